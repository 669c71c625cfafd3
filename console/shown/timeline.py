"""Events of a run as marks on its time line: effects of the world's rules, requests, losses.

The rules keep their memory in frames, so marks are exact to the tick also with every tenth frame only. Pure, and
bounded for any length of the run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from pydantic import ValidationError

from foosim.capture.rows import EditRow, EpochRow, RecoveryRow
from foosim.common.errors import Refused
from foosim.deployment.network.rules import event_of
from foosim.deployment.network.settings_text import event_words
from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import WorldMarks
from foosim.world.component_types.descriptions import DOWN
from foosim.world.frame import Frame
from foosim.world.setting.settable import WITH_A_PLACE

MARKS_MAX: Final = 400
"""Marks of one kind; later ones are left out."""
DROP_BINS: Final = 120
"""Marks of drops: each is of a span of time."""
FINE_BINS: Final = 8192
"""Spans in which drops are counted; where they are not enough, they get twice as long."""
FINE_NS: Final = 50_000_000
CAUSES_SHOWN: Final = 3
QUARANTINE = "quarantine"
EPOCH, RECOVERY, MOVE, NETWORK, DROPS = "epoch", "recovery", "move", "network", "drops"

FLAGS: Final = {"quarantined": (QUARANTINE, "is in quarantine"), "down": (DOWN, "is out of service")}
"""Slots of a present entity that are 1 while something holds: the kind of the mark, and its text."""


@dataclass(frozen=True, slots=True)
class Mark:
    """Something that happened at a tick."""

    tick: int
    kind: str
    text: str


class WorldEvents:
    """Finds the effects of rules between frames, taken in order. Later frames are compared with the first one."""

    def __init__(self, deployment: Deployment) -> None:
        self._deployment = deployment
        self._rules: WorldMarks | None = None
        self._before: Frame | None = None

    def take(self, frame: Frame) -> list[Mark]:
        """Return the marks since the frame before; an earlier or equal frame begins anew."""
        before, self._before = self._before, frame
        if before is None or frame.tick <= before.tick:
            return []
        marks = self._of_flags(before, frame)
        if self._rules is None:
            self._rules = WorldMarks(self._deployment, frame.layout)
        marks += [Mark(*mark) for mark in self._rules.between(before, frame)]
        return sorted(marks, key=lambda mark: mark.tick)

    @staticmethod
    def _of_flags(before: Frame, frame: Frame) -> list[Mark]:
        marks = []
        for entity in frame.layout.entities:
            for slot, (kind, text) in FLAGS.items():
                at = entity.offsets.get(slot)
                if at is None or (before.numbers[at] != 0.0) is (frame.numbers[at] != 0.0):
                    continue
                if entity.is_absent(before.numbers) or entity.is_absent(frame.numbers):
                    continue
                if frame.numbers[at] != 0.0:
                    marks.append(Mark(frame.tick, kind, f"{entity.name} {text}"))
                elif kind == DOWN:
                    marks.append(Mark(frame.tick, kind, f"{entity.name} is in service again"))
        return marks


class Timeline:
    """Gathers the marks of a run; `news` gives the new ones."""

    def __init__(self, deployment: Deployment) -> None:
        self._deployment = deployment
        self._tick_ns = deployment.tick_ns
        self._events = WorldEvents(deployment)
        self._epoch: EpochRow | None = None
        self._new: list[Mark] = []
        self._kinds: Counter[str] = Counter()
        self._fine_ns = max(FINE_NS, self._tick_ns)
        self._drops: dict[int, Counter[str]] = {}
        for event in deployment.network.events:
            self._add(Mark(event.at_ns // self._tick_ns, NETWORK, event_words(event)))

    def _add(self, mark: Mark) -> None:
        self._kinds[mark.kind] += 1
        if self._kinds[mark.kind] <= MARKS_MAX:
            self._new.append(mark)

    def take_frame(self, frame: Frame) -> None:
        """Take the next frame."""
        for mark in self._events.take(frame):
            self._add(mark)

    def take_edits(self, tick: int, edits: Iterable[EditRow]) -> None:
        """Take the requests of the tick that led to a frame."""
        for edit in edits:
            if edit.kind == "network":
                self._add(Mark(tick, NETWORK, self._network_text(edit.event, tick)))
            elif text := edit_text(edit):
                self._add(Mark(tick - 1, edit.kind, text))

    def _network_text(self, event: str, tick: int) -> str:
        try:
            return event_words(event_of(event, tick * self._tick_ns))
        except (ValidationError, ValueError, TypeError, Refused):
            return "an event of the network that cannot be read"

    def take_epoch(self, epoch: EpochRow) -> None:
        """Take the next epoch: the nodes that joined or left, and the moved robots."""
        before, self._epoch = self._epoch, epoch
        if before is None:
            return
        gone, come = sorted({*before.roster} - {*epoch.roster}), sorted({*epoch.roster} - {*before.roster})
        moved = [*moves([before, epoch])]
        for tick, text in moved:
            self._add(Mark(tick, MOVE, text))
        if gone or come or not moved:
            parts = [f"without {', '.join(gone)}"] if gone else []
            parts += [f"with {', '.join(come)}"] if come else []
            self._add(Mark(epoch.tick, EPOCH, " ".join([f"epoch {epoch.epoch}", *parts])))

    def take_recovery(self, row: RecoveryRow) -> None:
        """Take a loss or return of a process."""
        outage = f", {row.wall_outage_ns / 1e6:.0f} ms without a commit" if row.wall_outage_ns else ""
        self._add(Mark(row.tick, RECOVERY, f"{row.what} {row.name}: {row.reason}{outage}"))

    def take_drop(self, at_ns: int, cause: str) -> None:
        """Count a packet that was dropped."""
        self._drops.setdefault(at_ns // self._fine_ns, Counter())[cause] += 1
        if len(self._drops) > FINE_BINS:
            self._fine_ns *= 2
            coarse: dict[int, Counter[str]] = {}
            for number, causes in self._drops.items():
                coarse.setdefault(number // 2, Counter()).update(causes)
            self._drops = coarse

    def news(self) -> list[Mark]:
        """Return the marks since the last call, by tick; drops are summed up over spans, each at its first drop."""
        marks = sorted([*self._new, *self._of_drops()], key=lambda mark: (mark.tick, mark.kind))
        self._new, self._drops = [], {}
        return marks

    def _of_drops(self) -> list[Mark]:
        if not self._drops:
            return []
        first, last = min(self._drops), max(self._drops)
        together = -(-(last - first + 1) // DROP_BINS)
        binned: dict[int, tuple[int, Counter[str]]] = {}
        for number, causes in sorted(self._drops.items()):
            binned.setdefault((number - first) // together, (number, Counter()))[1].update(causes)
        return [
            Mark(start * self._fine_ns // self._tick_ns, DROPS, drops_text(causes)) for start, causes in binned.values()
        ]


def drops_text(causes: Counter[str]) -> str:
    """Return how many packets were dropped, and the most frequent causes."""
    most = sorted(causes.items(), key=lambda item: (-item[1], item[0]))
    shown = ", ".join(f"{cause} {count}" for cause, count in most[:CAUSES_SHOWN])
    more = f", {len(most) - CAUSES_SHOWN} more causes" if len(most) > CAUSES_SHOWN else ""
    return f"{causes.total()} dropped: {shown}{more}"


def edit_text(edit: EditRow) -> str:
    """Return a description of a requested edit; empty for other edits."""
    if edit.kind == "push":
        return f"push {edit.name} by {_vector(edit.impulse)} N s"
    if edit.kind == "set":
        return _set_text(edit)
    return {"add": f"{edit.name} was added", "remove": f"{edit.name} was removed"}.get(edit.kind, "")


def _set_text(edit: EditRow) -> str:
    """Return a description of a field that is set; empty for fields that follow from a place."""
    if edit.field == DOWN:
        return f"{edit.name} is {'in' if edit.numbers == [0.0] else 'out of'} service"
    if edit.field == "position":
        return f"put {edit.name} at {_vector(edit.numbers)} m"
    return "" if edit.field in WITH_A_PLACE else f"set {edit.name} {edit.field} to {_vector(edit.numbers)}"


def _vector(numbers: Sequence[float]) -> str:
    return ", ".join(f"{number:g}" for number in numbers)


def moves(epochs: Sequence[EpochRow]) -> Iterator[tuple[int, str]]:
    """Yield (tick, text) of each robot that was moved from one node to another while both took part.

    Recoveries report the robots that another node adopts at the loss of their own, and the ones that return.
    """
    for before, epoch in pairwise(epochs):
        owned = {owner.robot: owner.node for owner in before.owners}
        for owner in epoch.owners:
            node = owned.get(owner.robot, owner.node)
            if node != owner.node and node in epoch.roster and owner.node in before.roster:
                yield epoch.tick, f"move {owner.robot} from {node} to {owner.node}"
