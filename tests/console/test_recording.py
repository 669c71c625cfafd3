"""A capture at any tick: what is seen of it, found by its index, while it grows, in files, and where it is damaged."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from foosim.capture.foxglove import POSES
from foosim.capture.index import CaptureIndex
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.parts import files_from, part_path
from foosim.capture.reader import open_capture
from foosim.capture.rows import FRAME, ROW_TYPES
from foosim.console.recorded.recording import TOPICS, Recording
from foosim.simulation.verify import Between
from foosim.world.frame import Frame
from tests.simulation.conftest import TICKS, added_tick, damaged, messages_of, rewritten


@pytest.fixture(scope="module")
def frames(run: Path) -> dict[int, Frame]:
    """All captured frames of the run, by tick, as the reader of captures gives them."""
    return {frame.tick: frame for frame in open_capture(run).each_frame()}


def without(path: Path, out: Path, left: Any) -> Path:
    """A capture without some of its messages."""
    return rewritten(path, out, [message for message in messages_of(path) if not left(message)])


def test_each_tick_shows_what_was_captured_last_and_says_what_that_is(run: Path, frames: dict[int, Frame]) -> None:
    recording = Recording(run)
    assert recording.span == (0, TICKS) and recording.index.finished
    added, drawing = added_tick(run), recording.drawing
    for tick in range(TICKS + 1):
        look = recording.look(tick)
        assert look is not None and look.requested == tick
        if tick in frames:
            assert (look.kind, look.tick) == ("frame", tick)
            assert np.array_equal(look.values, drawing.poser.numbers(frames[tick].values), equal_nan=True)
            assert np.array_equal(look.poses, drawing.poser.poses(frames[tick].values), equal_nan=True)
        elif tick == added:
            assert look.kind == "poses", "poses stand where others are present, a frame does not"
        else:
            assert look.kind == "held" and look.tick == max(t for t in {*frames, added} if t < tick)
        assert len(look.poses) == len(drawing.links) and len(look.values) == drawing.layout.size
        (absent,) = np.nonzero(np.isnan(look.poses).any(axis=1))
        assert absent.tolist() == ([] if look.tick >= added else [drawing.entities["ball-2"]])


def test_poses_are_seen_where_frames_are_rare(run: Path, tmp_path: Path) -> None:
    rare = without(run, tmp_path / "rare.mcap", lambda m: m.topic == FRAME and m.log_ns % 200_000_000)
    recording, whole = Recording(rare), Recording(run)
    look, exact = recording.look(130), whole.look(130)
    assert look is not None and exact is not None
    assert (look.kind, look.tick) == ("poses", 130) and look.frame is not None and look.frame.tick == 100
    assert np.allclose(look.poses, exact.poses, atol=1e-6)
    assert recording.neighbour(130, later=True) == 140 and recording.neighbour(130, later=False) == 120
    assert recording.neighbour(TICKS, later=True) is None and recording.neighbour(0, later=False) is None


def test_ticks_between_frames_are_computed_again_to_the_last_bit(run: Path) -> None:
    recording = Recording(run)
    between = Between(recording.about)
    digests = open_capture(run).digests
    try:
        for tick in (67, 63, 299, 5, 60):  # across the addition of a ball, back, and with nothing to compute
            frame = recording.frame_up_to(tick)
            assert frame is not None
            found = between(frame, recording.inputs(frame.tick, tick))
            assert found is not None and found.tick == tick
            assert found.digest == digests[tick].tobytes()
            look = recording.seen(tick, found, "computed")
            assert np.array_equal(look.poses, recording.drawing.poser.poses(found.values), equal_nan=True)
        frame = recording.frame_up_to(0)
        assert frame is not None
        (wrong,) = recording.inputs(0, 1)
        object.__setattr__(wrong, "digest", bytes(32))
        assert between(frame, [wrong]) is None, "what differs from the capture is not shown"
    finally:
        between.close()


@pytest.mark.parametrize("topic", sorted({*TOPICS, *ROW_TYPES}))
def test_the_index_finds_each_message(run: Path, topic: str) -> None:
    index = CaptureIndex(run, [topic])
    there = [message for message in messages_of(run) if message.topic == topic]
    assert [index.read(topic, number) for number in range(len(index.places[topic]))] == there


def test_a_capture_that_grows_is_looked_at_from_where_the_last_look_ended(run: Path, tmp_path: Path) -> None:
    whole = run.read_bytes()
    growing = tmp_path / "growing.mcap"
    begun = whole.index(b"\x28\xb5\x2f\xfd")
    seen = []
    growing.write_bytes(whole[: begun + 20_000])
    recording = Recording(growing)
    generation = recording.index.generation
    for stop in [*range(begun + 20_000, len(whole), 7_001), len(whole)]:  # ends within chunks, indexes and the summary
        with growing.open("ab") as file:
            file.write(whole[growing.stat().st_size : stop])
        recording.refresh()
        seen.append(recording.span[1])
        assert not recording.index.finished or recording.span[1] == TICKS
    assert seen == sorted(seen) and len(set(seen)) > 5 and recording.span == (0, TICKS)
    assert recording.index.generation == generation and recording.index.finished
    other = Recording(run)
    assert [recording.index.places[topic] for topic in TOPICS] == [other.index.places[topic] for topic in TOPICS]


def test_a_chunk_without_indexes_is_looked_through(run: Path, tmp_path: Path) -> None:
    """Its writer was killed between the chunk and its indexes."""
    path = rewritten(run, tmp_path / "one.mcap", messages_of(run))
    content = path.read_bytes()
    cut = content.rindex(b"\x07", 0, content.index(b"\x0f\x04\x00\x00\x00\x00\x00\x00\x00"))
    path.write_bytes(content[:cut])
    index = CaptureIndex(path, [FRAME, POSES])
    assert not index.finished and len(index.places[FRAME]) == 31 and index.read(FRAME, 30).topic == FRAME


def test_a_damaged_chunk_hides_only_what_is_in_it(run: Path, tmp_path: Path) -> None:
    recording = Recording(damaged(run, tmp_path / "damaged.mcap"))
    refused, seen = [], []
    for tick in range(0, TICKS + 1, 10):
        try:
            look = recording.look(tick)
        except CaptureError as error:
            assert "damaged.mcap: byte" in str(error) and "a damaged chunk" in str(error)
            refused.append(tick)
        else:
            assert look is not None
            seen.append(tick)
    assert 0 < len(refused) < len(seen) // 2


def test_the_files_of_a_split_capture_are_one(split_run: Path, run: Path) -> None:
    recording, whole = Recording(split_run), Recording(run)
    assert len(files_from(split_run)) > 2
    assert recording.span == whole.span
    for tick in (0, 61, 130, 299, 300):
        one, other = recording.look(tick), whole.look(tick)
        assert one is not None and other is not None and one.kind == other.kind
        assert np.array_equal(one.poses, other.poses, equal_nan=True)
    later = Recording(part_path(split_run, 2))
    assert later.span[0] > 0 and later.span[1] == TICKS and later.look(TICKS) is not None
