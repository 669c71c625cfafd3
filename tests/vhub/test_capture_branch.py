"""A capture that is further than its journal, whose end was lost with the machine: cut where the journal ends."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import open_capture
from foosim.protocol.codec import decode_any
from foosim.protocol.messages import Epoch
from foosim.vhub.recording.writer import CaptureWriter
from foosim.vhub.state.capture_queue import RecordClosing
from foosim.vhub.state.records import Closing, HubRecord, TickRecord
from foosim.vhub.state.resume import Captured, end_of, first_tick_of, recall
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
    writer = CaptureWriter(path, *described, None, first_tick_of(records), end_of(run.deployment, records))
    past = recall(run.deployment, "run-1", records, writer.begun_with, 0)
    assert past is not None
    if past.known is not None:
        writer.keep(Closing(past.known, past.known.digest, [], []))
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
    return writer.begun_with


@pytest.mark.parametrize("closed", [0, 1, 9, 26, EPOCH_AT - 1, EPOCH_AT, 44, 62, LAST])
def test_it_holds_each_tick_once(closed: int, chunked: bytes, path: Path, hub_run: HubRun, tmp_path: Path) -> None:
    """What comes behind the cut is written again, here as it was."""
    whole, records = rows(path), journal_until(hub_run, closed)
    newest = max(record.epoch for raw in records if isinstance(record := decode_any(HubRecord, raw), Epoch))
    starts: set[int] = set()
    for size in range(first_chunk(chunked), len(chunked) - 4000, 40_961):
        file = cut(tmp_path, chunked[:size])
        begun = go_on(file, hub_run, records)
        assert begun.tick <= closed and begun.epoch <= newest
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
    assert closed < 10 or len(starts) > 1, "cut at several places"


def test_a_journal_that_does_not_reach_back_so_far_gives_nothing_up(
    chunked: bytes, hub_run: HubRun, tmp_path: Path
) -> None:
    """Chunks are cut whole: the ticks of the one that is further have to be in the journal."""
    file = cut(tmp_path, chunked[: len(chunked) - 4000])
    records = journal_until(hub_run, 41)
    late = [raw for raw in records if not isinstance(r := decode_any(HubRecord, raw), TickRecord) or r.tick > 40]
    told = re.escape(f"{file}: byte") + r" \d+: further than its journal, whose end is lost; \d+ bytes .*no journal has"
    with pytest.raises(CaptureError, match=told):
        go_on(file, hub_run, late)
    assert file.read_bytes() == chunked[: len(chunked) - 4000]
