"""Parts of captures: captures of their own that all reads, with whose frames runs begin, and that verify refuses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from foosim.capture.cut import cut_capture
from foosim.capture.export import export_capture
from foosim.capture.foxglove import POSES, SCENE
from foosim.capture.info import capture_info
from foosim.capture.reader import open_capture
from foosim.capture.rows import CLIENTS, EPOCHS, LAYOUT, PACKETS, TICK
from foosim.capture.start_frame import read_branch
from foosim.common.errors import BadValue
from foosim.deployment.loader import load_deployment
from tests.simulation.conftest import TICK_NS, added_tick, messages_of, replay

MS = 1_000_000


@pytest.fixture
def part(run: Path, tmp_path: Path) -> Path:
    """Ticks 120 to 200, behind the frame in which a ball was added; asked for a little later."""
    cut_capture(run, tmp_path / "part.mcap", 245 * MS, 400 * MS)
    return tmp_path / "part.mcap"


def test_a_part_has_all_that_was_recorded_of_its_ticks(run: Path, part: Path) -> None:
    whole, capture = open_capture(run), open_capture(part)
    assert capture.finished and capture.ticks.tolist() == list(range(120, 201))
    assert capture.digests.tolist() == whole.digests[120:201].tolist()
    assert capture.about.deployment_text == whole.about.deployment_text and capture.about.files == whole.about.files
    assert capture.about.versions == whole.about.versions
    assert capture.frames.ticks.tolist() == list(range(120, 201, 10))
    assert capture.frames.layout.digest == whole.frames.layout.digest
    assert capture.frames.frame(0).digest == whole.frames.frame(whole.frames.ticks.tolist().index(120)).digest
    assert list(capture.captured_ticks()) == list(whole.captured_ticks())[120:201]
    assert capture.clients == whole.clients and capture.epochs == whole.epochs, "who takes part is repeated"
    assert {message.topic for message in messages_of(part)} >= {TICK, LAYOUT, EPOCHS, CLIENTS, SCENE, POSES, PACKETS}
    mine = [message for message in messages_of(part) if message.topic == PACKETS]
    theirs = [message for message in messages_of(run) if message.topic == PACKETS]
    start = theirs.index(mine[0])
    assert theirs[start : start + len(mine)] == mine and len(mine) > 100
    assert (capture.poses("ball-2").positions == whole.poses("ball-2").positions[-19:-10]).all()


def test_digest_and_chain_are_those_of_the_whole_at_that_tick(run: Path, part: Path, tmp_path: Path) -> None:
    cut_capture(run, tmp_path / "first.mcap", None, 400 * MS)
    first, info = capture_info(tmp_path / "first.mcap"), capture_info(part)
    assert (first.first_tick, info.first_tick, first.ticks, info.ticks) == (0, 120, 200, 200)
    assert first.chain == info.chain and first.digest == info.digest
    cut_capture(run, tmp_path / "rest.mcap", 245 * MS)
    assert capture_info(tmp_path / "rest.mcap").chain == capture_info(run).chain
    assert info.duration_ns == 80 * TICK_NS
    assert (info.metadata["cut_from"], info.metadata["cut_tick"]) == ("run.mcap", "120")
    assert info.end == {"reason": "cut", "last_tick": "200"}


def test_the_layout_is_at_its_start_and_a_ball_that_is_added_within_comes_at_its_tick(
    run: Path, tmp_path: Path
) -> None:
    cut_capture(run, tmp_path / "o.mcap", 100 * MS, 200 * MS)
    frames, added = open_capture(tmp_path / "o.mcap").frames, added_tick(run)
    ticks = [*range(50, 101, 10)]
    assert frames.ticks.tolist() == ticks
    assert frames.column("ball-2", "absent").tolist() == [float(tick < added) for tick in ticks]
    (layout,) = [message for message in messages_of(tmp_path / "o.mcap") if message.topic == LAYOUT]
    assert layout.log_ns == 100 * MS and msgspec.json.decode(layout.data)["tick"] == 0


def test_verify_refuses_it_and_a_run_begins_with_its_frames(run: Path, part: Path, tmp_path: Path) -> None:
    done = replay("verify", part)
    assert done.code == 2 and "a cut of run.mcap from tick 120 on" in done.err and "verify run.mcap" in done.err
    found = replay("verify", part, "--from-first-frame", "--nodes", "3")
    assert found.out.startswith("equal: 80 ticks after frame 120 simulated again on 3 nodes, digest of all ticks ")
    assert found.out.rstrip().endswith(capture_info(part).chain)
    deployment = load_deployment(open_capture(run).about.deployment_text, "table.yaml")
    for at in ("240 ms", "0.33 s", "400 ms"):
        mine, theirs = (read_branch(f"{path}@{at}", deployment).start for path in (part, run))
        assert (mine.origin.tick, mine.origin.digest, mine.origin.chain, mine.values) == (
            theirs.origin.tick, theirs.origin.digest, theirs.origin.chain, theirs.values
        )  # fmt: skip
    with pytest.raises(BadValue, match=r"no frame of .* at that time"):
        read_branch(f"{part}@100ms", deployment)
    assert export_capture(part, "poses", tmp_path / "poses.csv").rows > 100


def refusals(run: Path, tmp_path: Path) -> Iterator[tuple[tuple[str | Path, ...], str]]:
    out = tmp_path / "o.mcap"
    yield (run, "--from", "10 s", "-o", out), "--from: the capture ends at 0.6 s, '10 s'"
    yield (run, "--from", "0.2", "-o", out), "--from: not a time"
    yield (run, "--to", "-1 s", "-o", out), "--to: negative; a time is at least 0"
    yield (run, "--from", "300 ms", "--to", "200 ms", "-o", out), "--to: before --from, which is 300 ms, '200 ms'"
    yield (run, "-o", run), "exists already; a capture is never overwritten"
    yield (run, "-o", run / "o.mcap"), "cannot be written, Not a directory"


def test_bad_input_is_named_and_leaves_no_file(run: Path, tmp_path: Path) -> None:
    before = sorted(tmp_path.iterdir())
    for arguments, text in refusals(run, tmp_path):
        done = replay("cut", *arguments)
        assert done.code == (1 if "cannot be written" in text else 2) and text in done.err, done
    assert sorted(tmp_path.iterdir()) == before


def test_a_part_before_the_first_frame_of_a_cut_is_refused(part: Path, tmp_path: Path) -> None:
    with pytest.raises(BadValue, match=r"--to: the capture begins at 0.24 s, '100 ms'"):
        cut_capture(part, tmp_path / "o.mcap", None, 100 * MS)
    done = replay("cut", part, "--from", "0 s", "--to", "250 ms", "-o", tmp_path / "o.mcap", "--json")
    assert done.code == 0
    content = msgspec.json.decode(done.out)
    assert (content["first_tick"], content["last_tick"]) == (120, 125)
    assert "0.24 s to 0.25 s" in replay("cut", part, "--to", "250 ms", "-o", tmp_path / "p.mcap").out
