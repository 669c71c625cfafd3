"""What if the network had been another one: the packets that a capture says were offered, judged again.

The ticks of the capture are closed again by the vHub's own state, with the frames, clients and orders that the capture
has, and with the network that is asked about. It is an open loop: robots and clients send what they sent, whatever
reaches them. Without another network every fate is the captured one. Where fates depend on places and the capture does
not have the frame of every tick, the world is simulated again from its orders and deliveries.
Neighbours: `verify` and `replica` (the world again), `whatif_picture` (draws it), `foosim.vhub.state` (judges).
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

import msgspec
import numpy as np

from foosim.protocol.deployment import Deployment
from foosim.protocol.frame import Frame
from foosim.protocol.messages import Edit, Freeze, RobotPacket, Sent
from foosim.rehearsal.replica import Replica
from foosim.rehearsal.verify import start_of
from foosim.vhub.capture_reader import CaptureData, Scan, captured_tick
from foosim.vhub.packet import IN_FLIGHT, Flight
from foosim.vhub.payload_hash import check_payloads
from foosim.vhub.profiles import Profiles
from foosim.vhub.rows import CLIENTS, PACKETS, TICK, CaptureError, ClientRow, PacketRow, TickRow, edit_of, packet_row
from foosim.vhub.state import OUTBOX_SHIFT, HubState, Joining

CHANGED_KEPT: Final = 10_000
"""How many changed packets a result names."""

Key = tuple[str, int, str, int]
"""Source, sequence number, destination, copy."""


@dataclass(frozen=True, slots=True)
class Side:
    """One link under one network. Delays are of what was delivered; the age of information is the mean over time of
    how old, at the receiver, the newest is that has come."""

    delivered: int
    delay_mean_ms: float
    delay_p95_ms: float
    age_ms: float


@dataclass(frozen=True, slots=True)
class LinkChange:
    """One link: what was offered on it, and what became of it before and after."""

    source: str
    destination: str
    offered: int
    before: Side
    after: Side


@dataclass(frozen=True, slots=True)
class PacketChange:
    """One packet with another fate, or another time."""

    source: str
    sequence: int
    destination: str
    copy: int
    channel: str
    sent_ns: int
    fate: str
    cause: str
    due_ns: int
    new_fate: str
    new_cause: str
    new_due_ns: int


@dataclass(frozen=True, slots=True)
class WhatIf:
    """What another network would have made of a capture's packets."""

    packets: int
    changed: int
    """How many have another fate, cause, time or content; or are copies that only one of the networks makes."""
    inputs_changed: int
    """How many have the same, for other reasons."""
    links: tuple[LinkChange, ...]
    causes: dict[str, int]
    """How many packets were dropped, by cause, as captured."""
    new_causes: dict[str, int]
    changes: tuple[PacketChange, ...]
    """The first of the packets that changed."""


@dataclass(slots=True)
class _Series:
    """The packets of one link that were delivered, as captured or judged again: sent and due times."""

    sent_ns: list[int] = field(default_factory=list)
    due_ns: list[int] = field(default_factory=list)

    def side(self) -> Side:
        if not self.due_ns:
            return Side(0, 0.0, 0.0, 0.0)
        sent, due = np.array(self.sent_ns), np.array(self.due_ns)
        delays_ms = (due - sent) / 1e6
        return Side(
            len(due),
            round(float(delays_ms.mean()), 4),
            round(float(np.quantile(delays_ms, 0.95)), 4),
            round(_age_ms(sent, due), 4),
        )


def _age_ms(sent: np.ndarray, due: np.ndarray) -> float:
    """Return the mean age of information between the first and the last arrival: the area under a saw.

    Source: Kaul, Yates and Gruteser, "Real-time status: How often should one update?" (2012).
    """
    order = np.argsort(due, kind="stable")
    due, newest = due[order], np.maximum.accumulate(sent[order])
    spans = np.diff(due) / 1e6
    if not spans.sum():
        return float(due[-1] - newest[-1]) / 1e6
    ages = (due[:-1] - newest[:-1]) / 1e6
    return float((spans * ages + spans * spans / 2.0).sum() / spans.sum())


def what_if(capture: CaptureData, deployment: Deployment | None = None) -> WhatIf:
    """Judge a capture's packets again, by its own network or that of another deployment of the same world.

    Raises CaptureError for what the capture lacks.
    """
    if deployment is None:
        deployment = capture.deployment
    rows, came, ticks = _read(capture)
    compared = _Compared(rows)
    for flight in _judged(capture, deployment, _by_tick(rows.values(), deployment), came, ticks):
        compared.take(flight)
    return compared.result()


def _read(capture: CaptureData) -> tuple[dict[Key, PacketRow], dict[int, list[ClientRow]], list[TickRow]]:
    """Return, in one pass over the file, its packets, who came and went by tick, and the ticks that were closed."""
    rows: dict[Key, PacketRow] = {}
    came: defaultdict[int, list[ClientRow]] = defaultdict(list)
    ticks: list[TickRow] = []
    for _, row in Scan(capture.path).rows(frozenset({PACKETS, CLIENTS, TICK})):
        if isinstance(row, PacketRow):
            rows[row.source, row.sequence, row.destination, row.copy] = row
        elif isinstance(row, ClientRow):
            came[row.tick].append(row)
        elif isinstance(row, TickRow):
            ticks.append(row)
    return rows, came, ticks[:-1] if capture.finished else ticks


class _Compared:
    """Captured rows beside what becomes of the same packets."""

    def __init__(self, rows: dict[Key, PacketRow]) -> None:
        self._rows = rows
        self._left = dict.fromkeys(rows)
        self._changed = self._inputs_changed = 0
        self._changes: list[PacketChange] = []
        self._new_causes: Counter[str] = Counter()
        self._after: defaultdict[tuple[str, str], _Series] = defaultdict(_Series)

    def take(self, flight: Flight) -> None:
        """Take a packet whose fate is final, or that is in flight at the end."""
        key = flight.source, flight.sequence, flight.destination, flight.copy
        before = self._rows.get(key)
        self._left.pop(key, None)
        flight.released_wall_ns = 0 if before is None else before.wall_released_ns
        after = packet_row(flight)
        if before is not None and before.payload_hash:
            after = msgspec.structs.replace(after, payload=before.payload, payload_hash=before.payload_hash)
        if before is None or _verdict(after) != _verdict(before):
            self._note(key, before, after)
        else:
            self._inputs_changed += after != before
        self._new_causes[after.cause] += after.fate == "dropped"
        if after.fate == "delivered":
            series = self._after[after.source, after.destination]
            series.sent_ns.append(after.sent_ns)
            series.due_ns.append(after.due_ns)

    def _note(self, key: Key, before: PacketRow | None, after: PacketRow | None) -> None:
        self._changed += 1
        if len(self._changes) >= CHANGED_KEPT:
            return
        known = before or after
        assert known is not None
        old = ("", "", -1) if before is None else (before.fate, before.cause, before.due_ns)
        new = ("", "", -1) if after is None else (after.fate, after.cause, after.due_ns)
        self._changes.append(PacketChange(*key, known.channel, known.sent_ns, *old, *new))

    def result(self) -> WhatIf:
        for key in self._left:  # copies that the other network does not make
            self._note(key, self._rows[key], None)
        before: defaultdict[tuple[str, str], _Series] = defaultdict(_Series)
        offered: Counter[tuple[str, str]] = Counter()
        causes: Counter[str] = Counter()
        for row in self._rows.values():
            link = row.source, row.destination
            offered[link] += row.copy == 0
            causes[row.cause] += row.fate == "dropped"
            if row.fate == "delivered":
                before[link].sent_ns.append(row.sent_ns)
                before[link].due_ns.append(row.due_ns)
        links = tuple(
            LinkChange(*link, count, before[link].side(), self._after[link].side())
            for link, count in sorted(offered.items())
        )
        counted = [
            {cause: count for cause, count in sorted(found.items()) if count} for found in (causes, self._new_causes)
        ]
        changes = tuple(sorted(self._changes, key=lambda change: (change.sent_ns, change.source, change.sequence)))
        return WhatIf(len(self._rows), self._changed, self._inputs_changed, links, counted[0], counted[1], changes)


def _verdict(row: PacketRow) -> tuple[str, str, int, int, bytes]:
    return row.fate, row.cause, row.due_ns, row.arrival_tick, row.payload


# --- what was offered -------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class _Offered:
    """What was offered at one tick: by robots, in (robot, index) order, and by clients."""

    robots: dict[tuple[str, int], RobotPacket] = field(default_factory=dict)
    clients: dict[tuple[str, int], Sent] = field(default_factory=dict)


_NOTHING: Final = _Offered()


def _by_tick(rows: Iterable[PacketRow], deployment: Deployment) -> dict[int, _Offered]:
    """Return what was offered at each tick: a published packet once, whatever number of receivers it had."""
    offered: defaultdict[int, _Offered] = defaultdict(_Offered)
    mask = (1 << OUTBOX_SHIFT) - 1
    for row in rows:
        if row.copy:
            continue
        at, key = offered[row.sent_ns // deployment.tick_ns], (row.source, row.sequence)
        payload = row.payload or bytes(row.size)  # of one that is hashed the size is all that a fate depends on
        to = "" if row.published else row.destination
        if row.source in deployment.robots:
            at.robots[key] = RobotPacket(row.source, row.sequence & mask, to, row.channel, payload)
        else:
            at.clients[key] = Sent(row.sequence, to, row.channel, row.stamp_ns, payload)
    return offered


def _judged(
    capture: CaptureData,
    deployment: Deployment,
    offered: dict[int, _Offered],
    came: dict[int, list[ClientRow]],
    ticks: Sequence[TickRow],
) -> Iterator[Flight]:
    """Close the ticks of a capture again; yield the packets as their fates become final, the rest at the end."""
    state = HubState(deployment, ticks[0].tick if ticks else 0)
    for frame, edits in _worlds(capture, ticks, Profiles(deployment, deployment.network).on_radio):
        for row in came.get(frame.tick, ()):
            _come_and_go(state, row)
        at = offered.get(frame.tick, _NOTHING)
        fates: list[Flight] = []
        state.close_world(frame, [at.robots[key] for key in sorted(at.robots)], fates, edits)
        admitted: dict[str, list[Sent]] = {}
        for (source, _), sent in sorted(at.clients.items()):
            admitted.setdefault(source, []).append(sent)
        state.close_clients(frame, admitted, fates)
        yield from fates
    for flight in state.in_flight():
        flight.cause = IN_FLIGHT
        yield flight


def _come_and_go(state: HubState, row: ClientRow) -> None:
    if row.event == "leaves":
        state.leave(row.client)
    else:
        heard = [(heard.source, heard.channel) for heard in row.subscriptions]
        state.join(Joining(row.client, row.period, heard), row.tick)


def _worlds(
    capture: CaptureData, ticks: Sequence[TickRow], depends_on_places: bool
) -> Iterator[tuple[Frame, Sequence[Edit]]]:
    """Yield the frame of each tick with the edits that led to it.

    Where fates do not depend on places and nobody is taken out of service the first frame stands for all. Else they
    are the captured ones, or, where some are not there, all are computed again.
    """
    edited = [[edit_of(edit) for edit in row.edits] for row in ticks]
    if not depends_on_places and not any(isinstance(edit, Freeze) for edits in edited for edit in edits):
        first = capture.first_frame()
        if first is None:
            raise CaptureError(f"{capture.path}: it does not have the frame with which it begins")
        for row, edits in zip(ticks, edited, strict=True):
            yield Frame(row.tick, first.layout, first.values), edits
        return
    captured = {int(tick): (block, index) for block in capture.frame_blocks for index, tick in enumerate(block.ticks)}
    if all(row.tick in captured for row in ticks):
        for row, edits in zip(ticks, edited, strict=True):
            block, index = captured[row.tick]
            yield block.frame(index), edits
        return
    check_payloads(str(capture.path), capture.deployment, "a world that is computed again")
    text, name = capture.about.deployment_text, capture.about.deployment_name
    replica = Replica(text, name, capture.deployment, start=start_of(capture))
    try:
        for number, row in enumerate(ticks):
            tick = captured_tick(row)
            frame = replica.frame if number == 0 else replica.step(tick.edits, tick.delivered)
            if frame.tick != tick.tick or frame.digest != tick.digest:
                what = f"frame {tick.tick} is not there, and comes out otherwise here: verify it"
                raise CaptureError(f"{capture.path}: {what}")
            yield frame, tick.edits
    finally:
        replica.close()
