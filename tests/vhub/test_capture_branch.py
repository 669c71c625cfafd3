"""A capture that is further than its journal, whose end was lost with the machine: it keeps what it has."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from foosim.capture.reader import open_capture
from foosim.protocol.codec import decode_any
from foosim.vhub.recording.recorder import Recorder
from foosim.vhub.state.capture_queue import RecordClosing
from foosim.vhub.state.records import Closing, HubRecord, TickRecord
from foosim.vhub.state.resume import Captured, first_tick_of, recall
from tests.vhub.conftest import EPOCH_AT, NAME
from tests.vhub.test_capture_recovery import LAST, cut, first_chunk, read_by_others, rows

if TYPE_CHECKING:
    from tests.vhub.conftest import HubRun


def journal_until(run: HubRun, tick: int) -> list[bytes]:
    """The run's journal as a machine leaves it that is lost behind the record of a tick."""
    for at, raw in enumerate(run.journal):
        record = decode_any(HubRecord, raw)
        if isinstance(record, TickRecord) and record.tick == tick:
            return run.journal[: at + 1]
    raise AssertionError(f"no record {tick}")


def go_on(path: Path, run: HubRun, records: Sequence[bytes]) -> Captured:
    """Go on with an unfinished capture as a vHub does whose journal has these records; return how far it was then."""
    described = run.deployment, NAME, run.text, {"run": "run-1", "fingerprint": "00"}
    writer = Recorder(path, *described, None, first_tick_of(run.deployment, records))
    past = recall(run.deployment, "run-1", records, writer.captured, 0)
    assert past is not None
    if past.known is not None:
        writer.keep(past.known)
    for item in past.kept:
        writer.keep(item.closing if isinstance(item, RecordClosing) else item.epoch)
    known = 0 if past.epoch is None else past.epoch.epoch
    for epoch in run.epochs:
        if epoch.epoch > known:
            writer.keep(epoch)
    for closing in run.closings:
        if closing.frame.tick > past.state.closed:
            writer.keep(closing)
    writer.finish({"reason": "enough"})
    return writer.captured


@pytest.mark.parametrize("closed", [0, 1, 9, 26, EPOCH_AT - 1, EPOCH_AT, 44, 62, LAST])
def test_it_holds_each_tick_once(closed: int, chunked: bytes, path: Path, hub_run: HubRun, tmp_path: Path) -> None:
    """Rows that it has are not written again, whatever the vHub closes once more."""
    whole, records = rows(path), journal_until(hub_run, closed)
    starts: set[int] = set()
    for size in range(first_chunk(chunked), len(chunked) - 4000, 40_961):
        file = cut(tmp_path, chunked[:size])
        had = open_capture(file)
        begun = go_on(file, hub_run, records)
        assert begun.tick == max(had.ticks.tolist(), default=-1) and begun.epoch == max(
            (row.epoch for row in had.epochs), default=0
        )
        starts.add(begun.tick)
        made = rows(file)
        made["/frame"] = [row for row in made["/frame"] if row["tick"] % 10 == 0]  # the last one stands in each capture
        for topic, expected in whole.items():
            found = made[topic]
            if topic == "/epochs":  # the tests' capture has them in another place among the rows of their tick
                assert sorted(row["epoch"] for row in found) == sorted(row["epoch"] for row in expected)
            else:
                assert found == [row for row in expected if topic != "/frame" or row["tick"] % 10 == 0], (topic, size)
        assert [int(tick) for tick in open_capture(file).ticks] == list(range(LAST + 2))
        read_by_others(file)
    assert len(starts) > 1 and max(starts) > closed - 9, "killed at several places"


def test_a_run_that_ends_where_its_journal_does_loses_nothing(chunked: bytes, hub_run: HubRun, tmp_path: Path) -> None:
    """The journal ends at tick 20: the run ends there, and what the capture has of later ticks stays, row for row."""
    file = cut(tmp_path, chunked[: len(chunked) * 2 // 3])
    before, records = rows(file), journal_until(hub_run, 20)
    described = hub_run.deployment, NAME, hub_run.text, {"run": "run-1", "fingerprint": "00"}
    writer = Recorder(file, *described, None, first_tick_of(hub_run.deployment, records))
    past = recall(hub_run.deployment, "run-1", records, writer.captured, 0)
    assert past is not None and not past.kept and past.state.closed == 20 < writer.begun_with.tick
    flights = past.state.in_flight()
    assert past.committed is not None
    for _ in range(2):
        writer.keep(Closing(past.committed[2], past.committed[2].digest, [], [], fates=flights))
    writer.finish({"reason": "lost vhub"})
    assert rows(file) == before and open_capture(file).finished
    read_by_others(file)
