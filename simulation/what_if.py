"""What-if: the packets of a capture, judged again by another network.

The ticks of the capture are closed again by the vHub's own state, with the frames, clients and orders that the capture
has, and with the other network. It is an open loop: robots and clients send what they sent, whatever
reaches them. Without another network every fate is the captured one. Where fates depend on places and the capture does
not have the frame of every tick, the world is simulated again from its orders and deliveries. What is held of a packet
beyond its fates are two times on its link.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from foosim.analysis.age_tallies import AgeAtUse, AgeTallies
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import CaptureData
from foosim.capture.rows import ClientRow, PacketRow, edit_of
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Sent
from foosim.simulation.what_if_reader import Frames, Offers, frames_for, parts_lacking, world_of
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import IN_FLIGHT, Flight
from foosim.vhub.recording.rows_of_closing import packet_row
from foosim.vhub.state.hub_state import HubState

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
class AgeChange:
    """How old a channel is when its receiver acts, as captured and then."""

    source: str
    destination: str
    channel: str
    before: AgeAtUse
    after: AgeAtUse


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
    """The fates of a capture's packets under another network."""

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
    earlier: int = 0
    """How many were sent before the capture begins, and are not judged again."""
    caveats: tuple[str, ...] = ()
    """Why fates may not be the captured ones even without another network."""
    ages: tuple[AgeChange, ...] = ()
    """Ages at use by channel. A client that acts at arrival acts at other times then, and sends what it sent."""


@dataclass(slots=True)
class _Series:
    """The packets of one link that were delivered, as captured or judged again: sent and due times."""

    sent_ns: array[int] = field(default_factory=lambda: array("q"))
    due_ns: array[int] = field(default_factory=lambda: array("q"))

    def side(self) -> Side:
        if not self.due_ns:
            return Side(0, 0.0, 0.0, 0.0)
        sent, due = np.frombuffer(self.sent_ns, np.int64), np.frombuffer(self.due_ns, np.int64)
        delays_ms = (due - sent) / 1e6
        return Side(
            len(due),
            round(float(delays_ms.mean()), 4),
            round(float(np.quantile(delays_ms, 0.95)), 4),
            round(_age_ms(sent, due), 4),
        )


@dataclass(slots=True)
class _Link:
    """One link: how much was offered, what was delivered before and after."""

    offered: int = 0
    before: _Series = field(default_factory=_Series)
    after: _Series = field(default_factory=_Series)


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

    Raises CaptureError for a lack in the capture.
    """
    compared = _Compared(capture)
    deployment = deployment or capture.deployment
    frames = frames_for(capture, on_radio=deployment.profiles().on_radio)
    before, after = AgeTallies(deployment.tick_ns), AgeTallies(deployment.tick_ns)
    offers = Offers(capture, frames, compared.keep, before.take_row)
    for flight in _judged(capture, deployment, offers, frames, after):
        compared.take(flight)
    caveats = parts_lacking(capture)
    return replace(compared.result(), earlier=offers.earlier, caveats=caveats, ages=_age_changes(before, after))


def _age_changes(before: AgeTallies, after: AgeTallies) -> tuple[AgeChange, ...]:
    old, new = before.result(), after.result()
    return tuple(
        AgeChange(*channel, old.get(channel, AgeAtUse()), new.get(channel, AgeAtUse()))
        for channel in sorted({*old, *new})
    )


class _Compared:
    """Captured rows beside what becomes of the same packets."""

    def __init__(self, capture: CaptureData) -> None:
        self._path = capture.path
        self._is_part = bool(parts_lacking(capture))
        self._rows: dict[Key, PacketRow] = {}
        """Those whose packets have no other fate yet."""
        self._packets = self._changed = self._inputs_changed = 0
        self._changes: list[PacketChange] = []
        self._causes: Counter[str] = Counter()
        self._new_causes: Counter[str] = Counter()
        self._links: dict[tuple[str, str], _Link] = {}

    def keep(self, row: PacketRow) -> None:
        """Take a row of the capture, until its packet is judged again."""
        key = row.source, row.sequence, row.destination, row.copy
        if self._rows.setdefault(key, row) is not row:
            what = f"packet {row.sequence} of {row.source} to {row.destination}"
            raise CaptureError(f"{self._path}: {what} has two fates")
        self._packets += 1
        link = self._links.get((row.source, row.destination))
        if link is None:
            link = self._links[row.source, row.destination] = _Link()
        link.offered += row.copy == 0
        if row.fate == "delivered":
            link.before.sent_ns.append(row.sent_ns)
            link.before.due_ns.append(row.due_ns)
        elif row.fate == "dropped":
            self._causes[row.cause] += 1

    def take(self, flight: Flight) -> None:
        """Take a packet whose fate is final, or that is in flight at the end."""
        key = flight.source, flight.sequence, flight.destination, flight.copy
        before = self._rows.pop(key, None)
        if before is None and not flight.copy and self._is_part:
            return  # its row is after the end of a part: the row of another receiver shows that it was sent
        flight.released_wall_ns = 0 if before is None else before.wall_released_ns
        after = packet_row(flight)
        if after != before:
            if before is None or _verdict(after) != _verdict(before):
                self._note(key, before, after)
            else:
                self._inputs_changed += 1
        if after.fate == "delivered":
            delivered = self._links[after.source, after.destination].after
            delivered.sent_ns.append(after.sent_ns)
            delivered.due_ns.append(after.due_ns)
        elif after.fate == "dropped":
            self._new_causes[after.cause] += 1

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
        for key, row in self._rows.items():  # copies that the other network does not make
            self._note(key, row, None)
        links = tuple(
            LinkChange(*ends, link.offered, link.before.side(), link.after.side())
            for ends, link in sorted(self._links.items())
        )
        causes, new_causes = dict(sorted(self._causes.items())), dict(sorted(self._new_causes.items()))
        changes = tuple(sorted(self._changes, key=lambda change: (change.sent_ns, change.source, change.sequence)))
        return WhatIf(self._packets, self._changed, self._inputs_changed, links, causes, new_causes, changes)


def _verdict(row: PacketRow) -> tuple[str, str, int, int, bytes]:
    return row.fate, row.cause, row.due_ns, row.arrival_tick, row.payload


def _judged(
    capture: CaptureData, deployment: Deployment, offers: Offers, frames: Frames, ages: AgeTallies
) -> Iterator[Flight]:
    """Close the ticks of a capture again; yield the packets as their fates become final, the rest at the end. `ages`
    takes the ages at use."""
    state = HubState(deployment, offers.first)
    with world_of(capture, frames) as frame_of:
        for offered in offers.ticks():
            frame = frame_of(offered)
            owing = [row.client for row in offered.came if row.event == "leaves_owing"]
            for row in offered.came:
                _come_and_go(state, row)
            edits = [edit_of(edit) for edit in offered.edits]
            fates: list[Flight] = []
            numbers = sorted(offered.robots)
            counts = [offered.counts[key] for key in numbers]
            state.close_world(frame, [offered.robots[key] for key in numbers], fates, edits, counts)
            for name in owing:
                state.leave(name)
            admitted: dict[str, list[Sent]] = {}
            for (source, _), sent in sorted(offered.clients.items()):
                admitted.setdefault(source, []).append(sent)
            state.close_clients(frame, admitted, fates)
            state.final = state.closed + 1  # none ahead: clients at arrival acted by the captured network
            ages.take(state.aged)
            yield from fates
    ages.take(state.ages.unreported(state.closed))
    for flight in state.in_flight():
        flight.cause = IN_FLIGHT
        yield flight


def _come_and_go(state: HubState, row: ClientRow) -> None:
    if row.event == "leaves":
        state.leave(row.client)
    elif row.event == "joins":
        both = row.subscriptions, row.arrivals
        heard, calling = ([(item.source, item.channel) for item in items] for items in both)
        state.join(Joining(row.client, row.period, heard, row.offset, calling), row.tick)
