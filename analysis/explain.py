"""What became of one captured packet, and why: the stages that it went through, each with its numbers.

The numbers are those of its row; what a row does not have is made again from the deployment that is in the capture,
the events that were asked for until then, and the packet's draws, whose address is in the row (`draw_address`): so
they have to agree with the row's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final

from foosim.analysis.explain_stages import STAGE_NAMES, Evidence, Stages
from foosim.capture.reader import CaptureData, TickMark
from foosim.capture.rows import CLIENTS, PACKETS, TICK, ClientRow, PacketRow, TickRow
from foosim.common.errors import BadValue
from foosim.common.format import EXACT, time_text
from foosim.common.names import nearest_name
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
    outcome: str
    text: str
    facts: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Explained:
    """A packet, the stages in their order, and its fate. `agrees`: draws that are made again are those of its row."""

    head: str
    steps: tuple[Step, ...]
    verdict: str
    fate: str
    cause: str
    agrees: bool


PASSED, DROPPED, ABSENT, UNREACHED = "passed", "dropped", "not on this link", "not reached"


def find_packet(capture: CaptureData, which: PacketName) -> PacketRow:
    """Return the row of a packet; raises BadValue, with those that there are, when there is no such one."""
    found: dict[tuple[str, int], PacketRow] = {}
    sources: set[str] = set()
    for row in capture.rows(PACKETS):
        assert isinstance(row, PacketRow)
        sources.add(row.source)
        if (row.source, row.sequence) == (which.source, which.sequence):
            found[row.destination, row.copy] = row
    if which.source not in sources:
        nearest = nearest_name(which.source, sources)
        hint = None if nearest is None else repr(nearest)
        raise BadValue(f"{capture.path}: no packet from this source", which.source, hint)
    if not found:
        raise BadValue(f"{capture.path}: {which.source} sent no packet of this number", which.sequence)
    chosen = {key: row for key, row in found.items() if key[0] == which.destination or not which.destination}
    exact = [row for (_, copy), row in chosen.items() if copy == which.copy]
    if len(exact) == 1:
        return exact[0]
    names = [str(PacketName(which.source, which.sequence, *key)) for key in sorted(chosen if exact else found)]
    more = f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ""
    shown = ", ".join(names[:NAMES_SHOWN]) + more
    raise BadValue(f"{capture.path}: say which one of {shown}", str(which))


def explain_packet(capture: CaptureData, which: PacketName) -> Explained:
    """Return what became of a captured packet. Raises BadValue for one that is not there, CaptureError."""
    return explain_row(_Captured(capture), find_packet(capture, which))


def explain_row(evidence: Evidence, row: PacketRow) -> Explained:
    """Return the explanation of a packet's fate, by its row and its run. Raises CaptureError."""
    return _told(Stages(evidence, row))


class _Captured:
    """What a capture has beside the row of a packet."""

    def __init__(self, capture: CaptureData) -> None:
        self.deployment = capture.deployment
        self.versions = capture.about.versions
        self._capture = capture

    def asked(self, until: int) -> Iterator[tuple[int, str]]:
        for row in self._capture.rows(TICK):
            assert isinstance(row, TickRow)
            if row.tick <= until:
                yield from network_events(row)

    def frame(self, tick: int) -> Frame | None:
        found = None
        for frame in self._capture.each_frame():
            if frame.tick > tick:
                break
            found = frame
        return found

    def clients(self) -> Iterator[ClientRow]:
        for row in self._capture.rows(CLIENTS):
            assert isinstance(row, ClientRow)
            yield row


def network_events(row: TickMark | TickRow) -> list[tuple[int, str]]:
    """Return what was asked of the network in a tick: the tick, and each event as JSON."""
    return [(row.tick, edit.event) for edit in row.edits if edit.kind == "network"]


def _told(stages: Stages) -> Explained:
    row, ended = stages.row, False
    steps = []
    at_sending = row.arrival_tick < 0
    for name in STAGE_NAMES:
        if not stages.has(name):
            steps.append(Step(name, ABSENT, "nothing to do on this link"))
            continue
        if ended:
            steps.append(Step(name, UNREACHED, "not reached"))
            continue
        text, facts = stages.tell(name)
        is_drop = name == stages.dropped_by
        text += f": {row.cause}" if is_drop else ""
        steps.append(Step(name, DROPPED if is_drop else PASSED, text, facts))
        ended = is_drop and at_sending
    return Explained(_head(stages), tuple(steps), _verdict(stages), row.fate, row.cause, stages.agrees)


def _head(stages: Stages) -> str:
    row = stages.row
    is_robot = row.source in stages.evidence.deployment.robots
    number = f"tick {row.sequence >> OUTBOX_SHIFT}, place {row.sequence & 0xFFFF}" if is_robot else "its own count"
    number += f", count {row.count} on its channel" if is_robot else ""
    via = f" via {row.radio}" if row.radio and row.radio != row.rule else ""
    copy = f", copy {row.copy}" if row.copy else ""
    how = "published" if row.published else "sent"
    return (
        f"{row.source} to {row.destination} on {row.channel}: number {row.sequence} ({number}){copy}, "
        f"{row.size} B, {how} at {_time(row.sent_ns)} (tick {stages.tick}); rule {row.rule}{via}, "
        f"medium {stages.settings.medium}"
    )


def _verdict(stages: Stages) -> str:
    row = stages.row
    if row.fate == "dropped":
        when = "at sending" if row.arrival_tick < 0 else f"at arrival, tick {row.arrival_tick}"
        text = f"dropped {when}: {row.cause} ({stages.dropped_by})"
    elif row.fate == "in_flight":
        text = f"in flight when the run ended: due {_time(row.due_ns)}, tick {row.arrival_tick}"
    else:
        later_ns = row.due_ns - row.sent_ns
        text = f"delivered at tick {row.arrival_tick}: due {_time(later_ns)} after it was sent"
    return text if stages.agrees else f"{text}; its draws are NOT those of the address in its row"


def _time(ns: int) -> str:
    return time_text(ns, EXACT)
