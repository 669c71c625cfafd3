"""The vHub's journal: a fold of its records is the hub, at every record, wherever it is cut."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from itertools import chain, pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import pytest

from foosim.capture.file import Entry
from foosim.capture.left import Progress
from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import Deliveries, Down, Epoch
from foosim.runtime.journal import Journal, Records, journal_files, read_journal
from foosim.vhub.recording.rows_of_closing import packet_entry, world_rows
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import Closing, Fold, HeadRecord, HubRecord, InputsRecord, TickRecord
from foosim.vhub.state.resume import recall
from foosim.world.frame import CHAIN_START, Frame, chain_next
from tests.vhub.conftest import EPOCH_AT

if TYPE_CHECKING:
    from foosim.deployment.schema import Deployment
    from tests.vhub.conftest import HubRun


def head_of(run: HubRun, tick: int) -> bytes:
    """The head that a journal file would start with behind the record of `tick`."""
    record = decode_any(HubRecord, run.records[tick + 1])
    assert isinstance(record, TickRecord)
    epoch = encode([epoch for epoch in run.epochs if epoch.tick <= tick][-1])
    chain = CHAIN_START
    for closing in run.closings[1 : tick + 1]:
        chain = chain_next(chain, closing.digest)
    return encode(HeadRecord("run-1", run.snapshots[tick], record.commit, epoch, chain=chain))


def rows_of(closing: Closing, deployment: Deployment, known: Frame | None) -> list[Entry]:
    return [*world_rows(closing, deployment, known), *map(packet_entry, closing.fates)]


def without_wall(row: msgspec.Struct) -> dict[str, object]:
    content = msgspec.to_builtins(row, builtin_types=(bytes,))
    return {name: value for name, value in content.items() if not name.startswith("wall_")}


def test_the_run_has_everything_in_it(hub_run: HubRun) -> None:
    """Else the comparisons below would prove little."""
    causes = {flight.cause for closing in hub_run.closings for flight in closing.fates}
    assert causes == {"", "node_down", "random_loss", "rx_down", "in_flight"}
    state = HubState.restore(hub_run.deployment, hub_run.snapshots[-1])
    assert state.refusals.keys() == {"no_route", "malformed", "duplicate"}
    assert sum(len(closing.joins) for closing in hub_run.closings) == 4
    assert sum(len(closing.leaves) for closing in hub_run.closings) == 1
    there = [len(closing.frame.layout.present(closing.frame.numbers)) for closing in hub_run.closings]
    assert {*there} == {11, 12}
    assert all(HubState.restore(hub_run.deployment, snapshot).in_flight() for snapshot in hub_run.snapshots[1:])


def snapshots(hub_run: HubRun, records: Iterable[bytes]) -> list[bytes]:
    fold = Fold(hub_run.deployment, records)
    return [fold.state.snapshot() for _ in fold]


def test_a_fold_gives_the_hub_at_every_record(hub_run: HubRun) -> None:
    known = None
    count = 0
    fold = Fold(hub_run.deployment, hub_run.records)
    state = fold.state
    for tick, (closing, *_) in enumerate(fold):
        live = hub_run.closings[tick]
        assert state.snapshot() == hub_run.snapshots[tick], tick
        record = decode_any(HubRecord, hub_run.records[tick + 1])
        assert isinstance(record, TickRecord)
        assert decode(Deliveries, record.deliveries).packets == state.deliveries[tick + 1]
        assert hub_run.deliveries.get(tick + 1, []) == ([] if state.was_final else [record.deliveries])
        assert closing.frame.digest == closing.digest == live.digest
        folded, kept = (rows_of(one, hub_run.deployment, known) for one in (closing, live))
        assert [entry[:4] for entry in folded] == [entry[:4] for entry in kept]
        assert [without_wall(entry[4]) for entry in folded] == [without_wall(entry[4]) for entry in kept]
        known = closing.frame
        count += len(folded)
    assert known is not None and known.tick == len(hub_run.records) - 2 == 63
    assert count > 450


@pytest.mark.parametrize("first", range(0, 63, 7))
def test_a_fold_from_any_head_goes_on_equally(hub_run: HubRun, first: int) -> None:
    records = [head_of(hub_run, first), *hub_run.records[first + 2 :]]
    states = snapshots(hub_run, records)
    assert states == hub_run.snapshots[first + 1 :]


def test_the_head_of_the_hub_is_the_state_after_its_last_record(hub_run: HubRun) -> None:
    assert hub_run.head == head_of(hub_run, 63)


def test_files_that_turn_and_go_fold_to_the_same_hub(hub_run: HubRun, tmp_path: Path) -> None:
    with Journal(tmp_path, "vhub", bytes_max=30_000) as journal:
        journal.append(hub_run.records[0])
        for tick, record in enumerate(hub_run.records[1:]):
            journal.append(record)
            journal.rotate_if_full(partial(head_of, hub_run, tick), tick)
        files = journal_files(tmp_path, "vhub")
        assert len(files) > 4
        whole = snapshots(hub_run, read_journal(tmp_path, "vhub"))
        assert whole == hub_run.snapshots
        for path, following in pairwise(files):
            records = chain(Records(path), Records(following))
            states = snapshots(hub_run, records)
            at = hub_run.snapshots.index(states[0])
            assert states == hub_run.snapshots[at : at + len(states)]
        journal.forget_before(50)
        rest = snapshots(hub_run, read_journal(tmp_path, "vhub"))
        assert 14 <= len(rest) < 64 and rest == hub_run.snapshots[-len(rest) :]


def test_records_that_are_no_run_are_refused(hub_run: HubRun) -> None:
    def folded(records: list[bytes]) -> int:
        return sum(1 for _ in Fold(hub_run.deployment, records))

    assert folded(hub_run.records[:1]) == 0
    with pytest.raises(Malformed):
        folded([])
    with pytest.raises(Malformed, match="does not start with its head"):
        folded(hub_run.records[1:])
    with pytest.raises(Malformed, match="record 10 of the vHub's journal does not follow on tick 8"):
        folded([*hub_run.records[:10], *hub_run.records[11:]])
    record = decode_any(HubRecord, hub_run.records[6])
    assert isinstance(record, TickRecord) and record.admitted
    changed = msgspec.structs.replace(record, admitted=record.admitted[:1])
    with pytest.raises(Malformed, match="its inputs give other deliveries"):
        folded([*hub_run.records[:6], encode(changed), *hub_run.records[7:10]])


@pytest.mark.parametrize("captured", [None, -1, 3, 28, 40, 63])
def test_a_vhub_that_is_started_again_knows_what_the_one_before_knew(hub_run: HubRun, captured: int | None) -> None:
    told = None if captured is None else Progress(captured, epoch=1 if captured >= 0 else -1)
    past = recall(hub_run.deployment, "run-1", hub_run.journal, told, limits.DOWNLINK_KEPT_NS)
    assert past is not None and past.fold.state.snapshot() == hub_run.snapshots[-1]
    assert past.epoch == hub_run.epochs[-1] and past.committed is not None and past.committed[1].tick == 63
    for tick, payload in past.sent.items():
        assert hub_run.deliveries.get(tick, [payload]) == [payload], "byte for byte"
    assert past.published == [payloads for _, payloads in sorted(hub_run.deliveries.items())][-1][-1]
    live = {(name, down.number, encode(down)) for name, down in hub_run.downs if isinstance(down, Down)}
    again = {(name, number, payload) for name, downs in past.downlinks.items() for number, payload in downs}
    assert again and again <= live | {item for item in again if item[0] != "watcher"}
    kept = [item.frame.tick for item in past.kept if isinstance(item, Closing)]
    assert kept == ([] if captured is None else list(range(captured + 1, 64)))
    epochs = [item.epoch for item in past.kept if isinstance(item, Epoch)]
    assert epochs == ([] if captured is None else [2] if captured >= 0 else [1, 2])
    if captured is not None:
        begun = (at for at, item in enumerate(past.kept) if isinstance(item, Epoch) and item.epoch == 2)
        second = next(begun)
        before = sum(isinstance(item, Closing) for item in past.kept[:second])
        assert before == max(0, EPOCH_AT - captured - 1), "it holds from its tick on"
    if captured is not None and captured >= 0:
        assert past.known is not None and past.known.frame.tick == captured


def test_what_joins_and_leaves_is_written_before_its_go_is_said(hub_run: HubRun) -> None:
    cut = max(i for i, raw in enumerate(hub_run.journal) if isinstance(decode_any(HubRecord, raw), InputsRecord))
    past = recall(hub_run.deployment, "run-1", hub_run.journal[: cut + 1], None, 0)
    assert past is not None and past.fold.inputs is not None and past.fold.inputs.tick == past.fold.state.closed + 1
    assert [joining.name for joining in past.fold.inputs.joins] == ["watcher"]


def test_the_journal_of_another_run_is_refused_and_one_behind_its_capture_is_not(hub_run: HubRun) -> None:
    assert recall(hub_run.deployment, "run-1", [], None, 0) is None
    with pytest.raises(Malformed, match="the journal of the vHub is of run run-1, this is run run-2"):
        recall(hub_run.deployment, "run-2", hub_run.journal, None, 0)
    with pytest.raises(Malformed, match="one that does not start with its head, this is run run-1"):
        recall(hub_run.deployment, "run-1", hub_run.journal[1:], None, 0)
    past = recall(hub_run.deployment, "run-1", hub_run.journal, Progress(64, epoch=2), 0)
    assert past is not None and past.known is None and not past.kept, "a capture that is further lacks nothing"
