"""The fate of one captured packet, and its causes: the stages of its link, each with its numbers.

The numbers are in its row; missing ones are computed again from the captured deployment,
the events requested until then, and the packet's draws, whose address is in the row (`draw_address`): so
they have to agree with the row's.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from functools import partial
from itertools import takewhile
from typing import Any, Final, Literal

from foosim.capture.reader import CaptureData, TickMark
from foosim.capture.rows import CLIENTS, PACKETS, TICK, PacketRow, TickRow
from foosim.common.errors import BadValue, no_such
from foosim.common.keyed_random import Slot
from foosim.deployment.channel_kinds import PLAIN, carried_by
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.packet import Flight
from foosim.vhub.stages import STAGES
from foosim.vhub.stages.admission import Admission
from foosim.vhub.stages.explanation import Evidence, Explanation, Seen, exact
from foosim.vhub.stages.policy import EXPIRED
from foosim.vhub.state.hub_state import OUTBOX_SHIFT
from foosim.world.frame import Frame

NAMES_SHOWN: Final = 8


@dataclass(frozen=True, slots=True)
class PacketName:
    """Which packet is meant; without a destination the one that has this number."""

    source: str
    sequence: int
    destination: str = ""
    copy: int = 0

    def __str__(self) -> str:
        parts = [self.source, str(self.sequence), *([self.destination] if self.destination else [])]
        return ":".join([*parts, *([str(self.copy)] if self.copy else [])])


def parse_packet(text: str) -> PacketName:
    """Return the packet that `SOURCE:SEQUENCE[:DESTINATION[:COPY]]` names; raises BadValue."""
    parts = text.split(":")
    numbers = [parts[at] for at in (1, 3) if at < len(parts)]
    if not 2 <= len(parts) <= 4 or not all(part.isascii() and part.isdigit() and len(part) < 20 for part in numbers):
        raise BadValue("not a packet, SOURCE:SEQUENCE[:DESTINATION[:COPY]]", text)
    destination = parts[2] if len(parts) > 2 else ""
    return PacketName(parts[0], int(parts[1]), destination, int(parts[3]) if len(parts) > 3 else 0)


@dataclass(frozen=True, slots=True)
class Step:
    """One stage: whether it is on the link, let the packet pass, dropped it, or was not reached; what it looked at."""

    stage: str
    outcome: Literal["passed", "dropped", "not on this link", "not reached"]
    text: str
    facts: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Explained:
    """A packet, the stages in their order, and its fate. `agrees`: draws that are made again equal the row's."""

    head: str
    steps: tuple[Step, ...]
    verdict: str
    fate: str
    cause: str
    agrees: bool


def find_packet(capture: CaptureData, which: PacketName) -> PacketRow:
    """Return the row of a packet; raises BadValue, with the existing ones, when there is no such one."""
    found: dict[tuple[str, int], PacketRow] = {}
    sources: set[str] = set()
    for row in capture.rows(PACKETS):
        assert isinstance(row, PacketRow)
        sources.add(row.source)
        if (row.source, row.sequence) == (which.source, which.sequence):
            found[row.destination, row.copy] = row
    if which.source not in sources:
        raise no_such(f"{capture.path}: no packet from this source", which.source, sources)
    if not found:
        raise BadValue(f"{capture.path}: {which.source} sent no packet of this number", which.sequence)
    chosen = {key: row for key, row in found.items() if key[0] == which.destination or not which.destination}
    exact = [row for (_, copy), row in chosen.items() if copy == which.copy]
    if len(exact) == 1:
        return exact[0]
    names = [str(PacketName(which.source, which.sequence, *key)) for key in sorted(chosen if exact else found)]
    more = f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ""
    shown = ", ".join(names[:NAMES_SHOWN]) + more
    raise BadValue(f"{capture.path}: name one of {shown}", str(which))


def explain_packet(capture: CaptureData, which: PacketName) -> Explained:
    """Return the explanation of a captured packet's fate. Raises BadValue for an unknown one, CaptureError."""
    return explain_row(evidence_of(capture), find_packet(capture, which))


def evidence_of(capture: CaptureData) -> Evidence:
    """Return the context of a capture's rows."""

    def frame(tick: int) -> Frame | None:
        frames = takewhile(lambda frame: frame.tick <= tick, capture.each_frame())
        return next(iter(deque(frames, maxlen=1)), None)

    events = [event for row in capture.rows(TICK) if isinstance(row, TickRow) for event in network_events(row)]
    clients = partial(capture.rows, CLIENTS)
    return Evidence(capture.deployment, capture.about.versions, events, frame, clients)


def explain_row(evidence: Evidence, row: PacketRow) -> Explained:
    """Return the explanation of a packet's fate, by its row and its run. Raises CaptureError."""
    seen, dropped_by, ended = _seen(evidence, row), _dropped_by(row), False
    steps = []
    for name, make, _ in STAGES:
        # A body's link is made anew when it goes out of service; here it is the one that it had in service.
        stage = make(seen.setup) or (Admission(seen.setup) if name == dropped_by == "admission" else None)
        if stage is None:
            steps.append(Step(name, "not on this link", "nothing to do on this link"))
        elif ended:
            steps.append(Step(name, "not reached", "not reached"))
        else:
            note = Explanation()
            stage.explain(seen, note)
            is_drop = name == dropped_by
            text = f"{note.text}: {row.cause}" if is_drop else note.text
            steps.append(Step(name, "dropped" if is_drop else "passed", text, note.facts))
            ended = is_drop and row.arrival_tick < 0
    words = seen.flight.words
    drawn = ((Slot.LOSS, row.loss_word), (Slot.JITTER, row.jitter_word), (Slot.ERROR, row.error_word))
    agrees = all(not word or word == f"{words[slot]:016x}" for slot, word in drawn)
    verdict = _verdict(row, dropped_by) + ("" if agrees else "; its draws differ from the address in its row")
    return Explained(_head(seen), tuple(steps), verdict, row.fate, row.cause, agrees)


def _dropped_by(row: PacketRow) -> str:
    """Return the stage that has dropped a packet; empty for none."""
    if row.fate != "dropped":
        return ""
    names = [name for name, _, causes in STAGES if row.cause in causes] or ["receiver"]
    is_first = row.arrival_tick >= 0 if row.cause == EXPIRED else row.decided_by.collision == "contention"
    return names[0 if is_first else -1]


def _seen(evidence: Evidence, row: PacketRow) -> Seen:
    """Return a packet with its link at its time of sending, and all events known when it arrived."""
    tick_ns = evidence.deployment.tick_ns
    fabric, tick = Fabric(evidence.deployment), row.sent_ns // tick_ns
    for at, event in evidence.requested:
        if at <= max(tick, row.arrival_tick):
            fabric.take(at, at * tick_ns, event)
    setup = fabric.link(row.source, row.destination, row.channel).setup_at(row.sent_ns)
    what = row.sequence, row.sent_ns, row.stamp_ns, row.payload, row.published, row.copy
    flight = Flight(row.source, row.destination, row.channel, *what)
    carried = carried_by(evidence.deployment).get((row.source, row.channel), PLAIN)
    flight.size, flight.latency_ns = row.size, carried.latency_ns
    flight.draw = setup.draws.number(row.sequence, tick, row.count)
    flight.words = setup.words(flight, 0)
    return Seen(row, flight, setup, fabric.timeline, evidence)


def network_events(row: TickMark | TickRow) -> list[tuple[int, str]]:
    """Return the requested events of the network in a tick: the tick, and each event as JSON."""
    return [(row.tick, edit.event) for edit in row.edits if edit.kind == "network"]


def _head(seen: Seen) -> str:
    row = seen.row
    is_robot = row.source in seen.evidence.deployment.robots
    number = f"tick {row.sequence >> OUTBOX_SHIFT}, place {row.sequence & 0xFFFF}" if is_robot else "its own count"
    number += f", count {row.count} on its channel" if is_robot else ""
    via = f" via {row.radio}" if row.radio and row.radio != row.rule else ""
    copy = f", copy {row.copy}" if row.copy else ""
    how = "published" if row.published else "sent"
    return (
        f"{row.source} to {row.destination} on {row.channel}: number {row.sequence} ({number}){copy}, "
        f"{row.size} B, {how} at {exact(row.sent_ns)} (tick {seen.tick}); rule {row.rule}{via}, "
        f"medium {seen.settings.medium}"
    )


def _verdict(row: PacketRow, dropped_by: str) -> str:
    if row.fate == "dropped":
        when = "at sending" if row.arrival_tick < 0 else f"at arrival, tick {row.arrival_tick}"
        return f"dropped {when}: {row.cause} ({dropped_by})"
    if row.fate == "in_flight":
        return f"in flight when the run ended: due {exact(row.due_ns)}, tick {row.arrival_tick}"
    return f"delivered at tick {row.arrival_tick}: due {exact(row.due_ns - row.sent_ns)} after it was sent"
