"""A bit that flips in a capture is noticed, wherever it stands, and the place is named."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from foosim.capture.info import capture_info
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import McapFile, Message
from foosim.capture.parts import end_of, head_of
from foosim.capture.reader import open_capture, read_about
from foosim.vhub.recording.recovery import recover_capture

FLIPS = 400


def flipped(content: bytes, bit: int) -> bytes:
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def sampled_bits(content: bytes) -> Iterator[int]:
    """Bits by a fixed seed: half of them in front of the messages, where the description of the run stands."""
    rng = random.Random(909)
    described = content.index(b"before_crc32") + 40
    for number in range(FLIPS):
        yield rng.randrange(8 * (described if number % 2 else len(content)))


def messages_of(path: Path, since_ns: int = 0) -> list[Message]:
    with path.open("rb") as stream:
        file = McapFile(stream, path.stat().st_size, str(path), since_ns)
        return [content for content in file.contents() if isinstance(content, Message)]


def test_every_bit_of_a_finished_capture_is_checked(chunked: bytes, tmp_path: Path) -> None:
    path = tmp_path / "flipped.mcap"
    for bit in sampled_bits(chunked):
        path.write_bytes(flipped(chunked, bit))
        for read in (open_capture, capture_info):
            with pytest.raises(CaptureError) as caught:
                read(path)
            assert str(caught.value).startswith(f"{path}: "), bit
            assert re.search(r"byte|\d+ ns|summary|MCAP file|end", str(caught.value)), str(caught.value)


def test_every_bit_of_an_unfinished_capture_is_checked_or_of_its_last_chunk(chunked: bytes, tmp_path: Path) -> None:
    """What is read is what was written; a last chunk whose head is damaged cannot be told from one that is cut.

    Nothing else is read: neither an index within the times of its chunk, nor the end of the file.
    """
    path = tmp_path / "flipped.mcap"
    whole = chunked[: len(chunked) * 2 // 3]
    path.write_bytes(whole)
    messages, about = messages_of(path), read_about(path)
    assert not open_capture(path).finished
    read, lengths = 0, {len(messages)}
    for bit in sampled_bits(whole):
        path.write_bytes(flipped(whole, bit))
        try:
            found = messages_of(path)
            assert read_about(path) == about, bit
        except CaptureError as error:
            assert str(error).startswith(f"{path}: ")
            continue
        read += 1
        assert found == messages[: len(found)], bit
        lengths.add(len(found))
    assert read < FLIPS / 10
    assert len(lengths) <= 2, "what is missing is always the same: the last chunk"


def test_who_passes_chunks_by_checks_their_times(chunked: bytes, tmp_path: Path) -> None:
    """What comes late enough is read, or the damage is named: nothing is passed by that is wanted."""
    path = tmp_path / "flipped.mcap"
    path.write_bytes(chunked)
    since_ns = 80_000_000
    wanted = [message for message in messages_of(path) if message.log_ns >= since_ns]
    rng = random.Random(910)
    heads = [found.start() - 28 for found in re.finditer(rb"\x04\x00\x00\x00zstd", chunked)]
    heads = [head for head in heads if chunked[head - 9] == 6]  # the summary names it, too
    refused = 0
    for _ in range(100):
        path.write_bytes(flipped(chunked, 8 * rng.choice(heads) + rng.randrange(128)))
        try:
            found = messages_of(path, since_ns)
        except CaptureError:
            refused += 1
        else:
            assert [message for message in found if message.log_ns >= since_ns] == wanted
    assert refused > 90


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (b"seed: 1", r"byte \d+: a damaged record, attachment 'deployment\.yaml': checksum \w{8}, written was \w{8}"),
        (b"python", r"byte \d+: a damaged record, attachment 'versions\.json': checksum \w{8}, written was \w{8}"),
        (b"fingerprint", r"byte \d+: a damaged record, metadata 'foosim' has digest \w{32}, written was '\w{32}'"),
        (b"before_crc32", r"byte \d+: a damaged record, metadata 'foosim.digests' has digest \w{32}, written was "),
        (b"/packets", r"the file up to here has digest \w{8}, written was '\w{8}'"),
        (b"enough", r"byte \d+: a damaged record, metadata 'foosim.end' has digest \w{32}, written was "),
    ],
)
def test_what_is_damaged_is_named(chunked: bytes, tmp_path: Path, text: bytes, told: str) -> None:
    path = tmp_path / "named.mcap"
    path.write_bytes(flipped(chunked, 8 * (chunked.index(text) + len(text) // 2)))
    with pytest.raises(CaptureError, match=told):
        open_capture(path)


def test_the_end_and_the_head_are_checked_where_they_are_read_alone(chunked: bytes, tmp_path: Path) -> None:
    path = tmp_path / "named.mcap"
    path.write_bytes(flipped(chunked, 8 * chunked.index(b"enough")))
    with pytest.raises(CaptureError, match=r"a damaged summary, metadata 'foosim.end' has digest"):
        end_of(path)
    path.write_bytes(flipped(chunked, 8 * (len(chunked) - 60)))
    with pytest.raises(CaptureError, match=r"a damaged summary, all of it: checksum"):
        end_of(path)
    path.write_bytes(flipped(chunked, 8 * chunked.index(b"fingerprint")))
    with pytest.raises(CaptureError, match=r"metadata 'foosim' has digest"):
        head_of(path)


def test_a_record_that_is_cut_is_damaged_where_a_whole_chunk_follows(chunked: bytes, tmp_path: Path) -> None:
    """A length that became too large in the middle of an unfinished file is no end of it."""
    path = tmp_path / "long.mcap"
    whole = chunked[: len(chunked) * 2 // 3]
    chunks = [found.start() - 37 for found in re.finditer(rb"\x04\x00\x00\x00zstd", whole)]
    middle = chunks[len(chunks) // 2]
    path.write_bytes(flipped(whole, 8 * (middle + 5)))
    following = chunks[len(chunks) // 2 + 1]
    told = rf"byte {middle}: a damaged record, it is longer .*, and a whole chunk follows at byte {following}"
    with pytest.raises(CaptureError, match=told):
        open_capture(path)
    found = recover_capture(path)
    assert found is not None and re.search(told, found.problem)
    assert path.read_bytes() == flipped(whole, 8 * (middle + 5))
