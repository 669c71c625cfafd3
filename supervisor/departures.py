"""Players whose process was lost: the vHub waits for them or goes on without them, and the account says so.

The vHub tells in its heartbeats who is away, and what is over of it, numbered; one that is started again tells from its
journal what the one before did.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from foosim.supervisor.account import Recovered
from foosim.supervisor.roster import Process

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore


class Departures:
    """Takes what the vHub tells of players that were away."""

    def __init__(self, core: SupervisorCore) -> None:
        self._core = core
        self._boot = ""
        """The start of the vHub that has told last."""
        self._heard = 0
        """The number of what it told last."""
        self._known: Counter[tuple[str, str, str, int]] = Counter()
        """What the account had when this supervisor heard of this start of the vHub first: it tells that once more."""
        self._gaps_ns: dict[str, int] = {}
        """Of those that are away: the longest time between two commits since."""
        self._open: list[tuple[Recovered, int]] = []

    def hear(self, hub: Process) -> None:
        """Note what is new in a report of the vHub; what the journal of a supervisor before has is not."""
        core, told = self._core, hub.report.get("absences")
        if told is None or not core.is_open or core.end is not None:
            return
        if told["boot"] != hub.boot:
            return  # it comes late, of a vHub before this one
        if hub.boot != self._boot:
            self._boot, self._heard = hub.boot, 0
            entries = core.recovery.recovered
            self._known = Counter((entry.what, entry.name, entry.reason, entry.tick) for entry in entries)
        gaps_ns, self._gaps_ns = self._gaps_ns, {name: self._gaps_ns.get(name, 0) for name in told["away"]}
        for number, what, name, reason, tick in told["over"]:
            if number <= self._heard:
                continue
            self._heard = number
            if self._known[what, name, reason, tick] > 0:
                self._known[what, name, reason, tick] -= 1
                continue
            entry = core.recovery.note(what, name, reason, core.epoch, tick)
            self._open.append((entry, gaps_ns.get(name, 0)))

    def committed(self, before_ns: int, now_ns: int) -> None:
        """A frame is committed, the one before it was at `before_ns`."""
        for name, gap_ns in self._gaps_ns.items():
            self._gaps_ns[name] = max(gap_ns, now_ns - before_ns)
        for entry, gap_ns in self._open:
            entry.outage_ns = max(gap_ns, now_ns - before_ns)
        self._open.clear()
