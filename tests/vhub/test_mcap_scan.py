"""Looking at the heads of old chunks alone finds what looking at all of them finds."""

from __future__ import annotations

from mmap import ACCESS_READ, mmap
from pathlib import Path
from random import Random

from foosim.capture.mcap.scan import Scanned, scan

SEED = 23


def scanned(path: Path, trusted: int) -> Scanned:
    """`trusted`: chunks before that byte are found by their heads alone."""
    with path.open("rb") as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as content:
        return scan(content, path.name, trusted)


def test_what_is_trusted_is_found_as_what_is_looked_through(chunked: bytes, tmp_path: Path) -> None:
    rng = Random(SEED)
    path = tmp_path / "cut.mcap"
    chunks = set()
    for size in (5, 1000, *(rng.randrange(len(chunked)) for _ in range(12)), len(chunked)):
        path.write_bytes(chunked[:size])
        found = scanned(path, 0)
        chunks.add(len(found.book.chunks))
        for trusted in (1, size, *(rng.randrange(size + 1) for _ in range(4))):
            assert scanned(path, trusted) == found, f"seed {SEED}: {size} bytes, {trusted} trusted"
    assert len(chunks) > 4 and found.finished


def test_damage_is_found_where_records_do_not_follow_each_other(chunked: bytes, tmp_path: Path) -> None:
    """Also in what is trusted; and behind that each chunk's content is looked at."""
    path = tmp_path / "spoiled.mcap"
    path.write_bytes(chunked)
    chunk = scanned(path, 0).book.chunks[3]
    start, stop = chunk.chunk_start_offset, chunk.chunk_start_offset + chunk.chunk_length
    for place, trusted in ((start + 1, len(chunked)), (stop + 2, len(chunked)), (stop - 1, start)):
        path.write_bytes(chunked[:place] + bytes([chunked[place] ^ 0x55]) + chunked[place + 1 :])
        found = scanned(path, trusted)
        assert found == scanned(path, 0) and not found.finished
        assert len(found.book.chunks) in (3, 4), "what stands before it is kept"
