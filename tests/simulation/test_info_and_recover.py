"""What a capture holds in short, and the exit codes by which a recovery says what it could save."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from pathlib import Path

import msgspec
import pytest

from foosim.capture.info import capture_info
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import open_capture
from foosim.capture.start_frame import BadBranch, read_branch
from foosim.common.units import parse_ns
from foosim.console.recorded.recording import Recording
from foosim.console.report.collect import gather
from foosim.console.report.page import page
from foosim.deployment.loader import load_deployment
from foosim.simulation.play.main import read_span
from tests.simulation.conftest import TABLE, damaged, messages_of, replay


def test_info_counts_what_the_capture_has(run: Path) -> None:
    info, capture = capture_info(run), open_capture(run)
    packets = capture.packets
    assert info.packets["offered"] == len(packets)
    assert dict(info.channels) == Counter(packets.channel.tolist())
    assert dict(info.causes) == Counter(packets.cause[packets.fate == "dropped"].tolist()) != {}
    assert info.payload_bytes == int(packets.size.sum()) and info.clients == ("player-blue", "player-red")
    assert dict(info.topics) == Counter(message.topic for message in messages_of(run))
    shown = replay("info", run)
    assert shown.code == 0 and "\n  dropped by " in shown.out and "\n  clients player-blue, player-red\n" in shown.out
    content = msgspec.json.decode(replay("info", run, "--json").out)
    assert content["causes"] == dict(info.causes) and content["channels"] == dict(info.channels)


def test_no_command_takes_what_is_no_capture_and_none_leaves_a_file(
    run: Path, tmp_path: Path, bad_files: list[Path]
) -> None:
    deployment = load_deployment(TABLE.read_text(), TABLE.name)
    torn = damaged(run, tmp_path / "damaged.mcap")
    before = sorted(tmp_path.iterdir())

    def refused(bad: Path, *words: str | Path) -> None:
        done = replay(*words)
        assert done.code == 2 and done.out == "" and done.err.startswith(f"{bad}: "), (words, done)
        assert done.err.count("\n") == 1 and sorted(tmp_path.iterdir()) == before, words

    for bad in bad_files:
        for command in ("info", "verify", "what-if", "play"):
            refused(bad, command, bad)
        refused(bad, "diff", run, bad)
        refused(bad, "diff", bad, run)
        with pytest.raises(BadBranch, match=f"--from: {bad}: "):
            read_branch(f"{bad}@0.1s", deployment)
        with pytest.raises(CaptureError, match=str(bad)):
            Recording(bad)
    for bad in (*bad_files, torn):
        for command, out in (("cut", "o.mcap"), ("export", "o.csv"), ("report", "o.html")):
            refused(bad, command, bad, "-o", tmp_path / out)


def test_commands_take_what_a_killed_writer_left_up_to_its_last_chunk(run: Path, tmp_path: Path) -> None:
    left = tmp_path / "left.mcap"
    left.write_bytes(run.read_bytes()[: run.stat().st_size * 2 // 3])
    last = int(open_capture(left).ticks[-1])
    span, about = read_span(left)
    assert 100 < last < 300 and not about.finished and span.last_ns == last * 2_000_000
    shown = replay("info", left)
    assert shown.code == 0 and "not finished, " in shown.out
    assert replay("export", left, "--what", "tick", "-o", "-").out.count("\n") == last + 2
    assert replay("cut", left, "--from", "40 ms", "-o", tmp_path / "o.mcap").code == 0
    assert open_capture(tmp_path / "o.mcap").ticks.tolist() == list(range(20, last + 1))
    part = gather(open_capture(left), "left")
    assert part["end_ns"] == span.last_ns and part["fates"]["offered"] > 0 == part["fates"]["in_flight"]
    assert "not finished" in page(part)


def test_a_finished_capture_is_clean(run: Path) -> None:
    before = run.read_bytes()
    done = replay("recover", run)
    assert done.code == 0 and done.out == f"capture {run} is finished already\n" and run.read_bytes() == before


def spoiled(run: Path, out: Path, place: int, bit: int = 1) -> bytes:
    """Write a capture with one wrong bit; return what is written."""
    content = bytearray(run.read_bytes())
    content[place] ^= bit
    out.write_bytes(content)
    return bytes(content)


def chunk_starts(path: Path) -> list[int]:
    content = path.read_bytes()
    starts = [found.start() - 37 for found in re.finditer(rb"\x04\x00\x00\x00zstd", content)]
    return [start for start in starts if content[start] == 6]  # the summary names it, too


@pytest.mark.parametrize("within", [80, 5, 0, 12, 30])
def test_a_finished_capture_with_a_damaged_chunk_says_where_and_how_to_cut_out_what_precedes_it(
    run: Path, tmp_path: Path, within: int
) -> None:
    """A wrong bit in the rows of a chunk, in its length, its kind, its times, its checksum."""
    bad, part = tmp_path / "bad.mcap", tmp_path / "part.mcap"
    starts = chunk_starts(run)
    start, after = starts[len(starts) // 2 : len(starts) // 2 + 2]
    before = spoiled(run, bad, start + within)
    done = replay("recover", bad)
    assert done.code == 1 and bad.read_bytes() == before, done
    lines = done.err.splitlines()
    told = re.fullmatch(f"capture {bad} is finished and damaged; it is left as it is: {bad}: byte (\\d+): .+", lines[0])
    assert told is not None and start <= int(told[1]) < after, done.err
    words = shlex.split(lines[-1].partition("  what is before the damage: foosim capture ")[2])
    until_ns = parse_ns(words[3])
    assert words[:3] == ["cut", str(bad), "--to"] and replay(*words[:-1], part).code == 0
    cut, whole = open_capture(part), open_capture(run)
    assert cut.ticks.tolist() == list(range(until_ns // 2_000_000 + 1)) and len(cut.ticks) > 30
    assert (cut.digests == whole.digests[: len(cut.ticks)]).all()


@pytest.mark.parametrize("text", [b"loss: 0.5 %", b"fingerprint", b"/packets", b"before_crc32", b"foosim.end"])
def test_a_finished_capture_with_a_damaged_description_or_end_says_where(
    run: Path, tmp_path: Path, text: bytes
) -> None:
    bad = tmp_path / "bad.mcap"
    before = spoiled(run, bad, run.read_bytes().index(text) + len(text) - 1, 2)
    done = replay("recover", bad)
    assert done.code == 1 and bad.read_bytes() == before
    where = "a damaged summary, metadata 'foosim.enf'" if text == b"foosim.end" else "byte"
    assert f"{bad}: {where}" in done.err, done.err


def test_what_cannot_be_recovered_fails_and_stays_as_it_is(run: Path, tmp_path: Path, bad_files: list[Path]) -> None:
    for bad in bad_files:
        before = bad.read_bytes() if bad.is_file() else b""
        done = replay("recover", bad)
        assert done.code == (1 if bad.name.startswith("wrong") else 2) and str(bad) in done.err, done
        assert not bad.is_file() or bad.read_bytes() == before
    torn = damaged(run, tmp_path / "torn.mcap")
    torn.write_bytes(torn.read_bytes()[:-100])
    before = torn.read_bytes()
    done = replay("recover", torn)
    assert done.code == 3 and "a damaged record" in done.out and torn.read_bytes() == before
