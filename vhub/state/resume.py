"""Restores a restarted vHub from the journal of the process before it.

A fold of the journal gives the state after the last closed tick. On the way it gives what others may still request
(deliveries, numbered downlinks) and what the capture lacks. Pure: the shell reads the journal and knows how far the
capture is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from foosim.capture.left import Progress
from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.deployment.schema import Deployment
from foosim.protocol.actions import Action, Log
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import Commit, Deliveries, Down, Epoch
from foosim.vhub.network.packet import received
from foosim.vhub.state.commits import Committed
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import (
    Closing,
    Fold,
    Folded,
    HeadRecord,
    HubRecord,
    TickRecord,
)
from foosim.world.frame import Frame, frame_from_bytes


@dataclass(slots=True)
class Past:
    """The vHub after its last record, as the fold of its journal ended, and the messages that it had sent."""

    fold: Fold
    committed: Committed | None = None
    """The commit of the last closed tick; None before the first."""
    epoch: Epoch | None = None
    sent: dict[int, bytes] = field(default_factory=dict)
    """Deliveries by tick, as they were published or as others take them to be."""
    published: bytes = b""
    """The last deliveries that were published."""
    downlinks: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)
    """Numbered downlinks outside of lockstep, by client."""
    owing: list[str] = field(default_factory=list)
    """Clients that left at the last tick, owing its Done."""
    known: Closing | None = None
    """The last frame in the capture, with digest and chain."""
    kept: list[Closing | Epoch] = field(default_factory=list)
    """Closings and epochs that the capture lacks, in order."""

    def actions(self) -> list[Action | Closing | Epoch]:
        """Return the first actions: complete the capture, log the position."""
        actions: list[Action | Closing | Epoch] = [*self.kept]
        if self.epoch is not None:
            actions.append(Log("info", f"resumes after tick {self.fold.state.closed} in epoch {self.epoch.epoch}"))
        return actions


def recall(
    deployment: Deployment, run: str, records: Sequence[bytes], captured: Progress | None, kept_ns: int
) -> Past | None:
    """Return the past that a journal records; None without any tick.

    `captured` is how far the capture is, None when there is none; downlinks of the last `kept_ns` of simulated time
    are kept to be sent again. Raises Malformed for the journal of another run, and for one that contradicts itself.
    """
    if not records:
        return None
    found = [decode_any(HubRecord, raw) for raw in records]
    first = found[0]
    if not isinstance(first, HeadRecord) or first.run != run:
        whose = f"of run {first.run}" if isinstance(first, HeadRecord) else "one that does not start with its head"
        raise Malformed(f"the journal of the vHub is {whose}, this is run {run}")
    start = _start(found, captured, max(limits.KEPT_TICKS, kept_ns // deployment.tick_ns))
    fold = Fold(deployment, records[start:])
    past = Past(fold)
    next_tick = fold.state.closed + 1
    following = 0 if fold.state.was_final else fold.state.final - next_tick
    _remember(past, next_tick, encode(Deliveries(next_tick, fold.state.deliveries[next_tick], following)))
    if captured is not None and captured.tick == fold.state.closed:
        known = _frame(fold)
        past.known = None if known is None else Closing(known, known.digest, [], [], chain=fold.chain)
    closings: dict[int, Closing] = {}
    for folded in fold:
        _remember(past, folded.record.tick + 1, folded.record.deliveries)
        _number(past, folded)
        past.owing = folded.record.owing
        if captured is not None and folded.record.tick > captured.tick:
            closings[folded.record.tick] = folded.closing
        elif captured is not None and folded.record.tick == captured.tick:
            past.known = folded.closing
    if captured is not None:
        past.kept = list(_not_captured(found, closings, captured.epoch))
    past.epoch = decode(Epoch, fold.epoch) if fold.epoch else None
    frame = _frame(fold)
    if frame is not None:
        past.committed = fold.commit, decode(Commit, fold.commit), frame
    return past


def _not_captured(found: Iterable[object], closings: Mapping[int, Closing], epoch: int) -> Iterator[Closing | Epoch]:
    """Yield closings by tick, each followed by the epochs that begin after it, in the order of the journal."""
    for record in found:
        if isinstance(record, Epoch) and record.epoch > epoch:
            yield record
        elif isinstance(record, TickRecord) and record.tick in closings:
            yield closings[record.tick]


def _start(found: Sequence[object], captured: Progress | None, kept_ticks: int) -> int:
    """Return the index of the last head before all wanted ticks; that of the first head where there is none."""
    closed = max((record.tick for record in found if isinstance(record, TickRecord)), default=-1)
    wanted = closed - kept_ticks if captured is None else min(closed - kept_ticks, captured.tick)
    start, tick = 0, -1
    for index, record in enumerate(found):
        if isinstance(record, TickRecord):
            tick = record.tick
        elif isinstance(record, HeadRecord) and 0 <= tick <= wanted:
            start = index
    return start


def _frame(fold: Fold) -> Frame | None:
    """Return the frame of the last closed tick; None before the first."""
    if not fold.commit:
        return None
    commit = decode(Commit, fold.commit)
    return frame_from_bytes(commit.tick, fold.layout, commit.values, commit.outboxes)


def _remember(past: Past, tick: int, payload: bytes) -> None:
    """Add the deliveries of a tick, and those after it where they are final."""
    past.sent[tick] = past.sent.get(tick, payload)
    for following in range(tick + 1, past.fold.state.final + 1):
        past.sent.setdefault(following, encode(Deliveries(following, [])))
    past.sent.pop(tick - limits.KEPT_TICKS, None)
    if not past.fold.state.was_final:
        past.published = payload


def _number(past: Past, folded: Folded) -> None:
    """Add the downlinks of a tick outside of lockstep, with their numbers; an unanswered Go is a Down as well."""
    tick, members, owing = folded.record.tick, past.fold.state.members, folded.record.owing
    for name in sorted({*folded.released, *owing}):
        member = members[name]
        if name in owing or not member.is_due(tick):
            packets = received(folded.released.get(name, []))
            down = Down(member.downlink, tick, member.sequence, packets, False, member.since, [*member.absent])
            past.downlinks.setdefault(name, []).append((member.downlink, encode(down)))


def first_tick_of(deployment: Deployment, records: Sequence[bytes]) -> int | None:
    """Return the first tick of which a journal has a record, or would have; None when there is no journal."""
    head = decode_any(HubRecord, records[0]) if records else None
    return HubState.restore(deployment, head.state).closed + 1 if isinstance(head, HeadRecord) else None


def last_tick_of(records: Sequence[bytes]) -> int:
    """Return the last tick of which a journal has a record, -1 when it has none."""
    ticks = (record.tick for raw in reversed(records) if isinstance(record := decode_any(HubRecord, raw), TickRecord))
    return next(ticks, -1)


def was_captured(records: Sequence[bytes]) -> str | None:
    """Return the capture's path by the journal, empty without a capture; None when there is no journal."""
    heads = (record for raw in records[:1] if isinstance(record := decode_any(HubRecord, raw), HeadRecord))
    return next((head.capture for head in heads), None)
