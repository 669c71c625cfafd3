"""Load balancing: robots move, one at a time, from the busiest node to the idlest.

A node's load is the share of its time in which its loop does not sleep, as its heartbeats report. A move is an epoch
like any other and does not change the world. The cost of a robot is estimated as an equal share of its node's load; it
moves only when that makes the two loads more equal, and then the loads settle before the next move. A request of an
operator makes all such moves at once.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final

from foosim.supervisor.state import RunState

EVERY_NS: Final = 1_000_000_000
"""How often loads are compared: a heartbeat has the load of the last second."""
SETTLE_NS: Final = 5_000_000_000
"""After a move, loads are new."""
STAY_NS: Final = 60_000_000_000
"""A robot that was moved stays for so long."""
SMOOTHING: Final = 0.5
"""Weight of the newest load in the running mean."""
WORTH: Final = 0.15
"""A smaller difference of loads is left alone."""


@dataclass(frozen=True, slots=True)
class Shift:
    """A robot that should move, and why: the loads of the two nodes."""

    robot: str
    source: str
    target: str
    source_load: float
    target_load: float

    def __str__(self) -> str:
        return (
            f"{self.robot} moves from {self.source} ({self.source_load:.0%}) to {self.target} ({self.target_load:.0%})"
        )


def best_shift(
    loads: Mapping[str, float], owners: Mapping[str, str], homes: Mapping[str, str], stay: Collection[str]
) -> Shift | None:
    """Return the robot that should move now, if any, but none in `stay`: from the busiest to the idlest
    node, preferably one whose home that is."""
    source = max(sorted(loads), key=lambda name: loads[name])
    target = min(sorted(loads), key=lambda name: loads[name])
    mine = sorted(robot for robot, owner in owners.items() if owner == source)
    difference = loads[source] - loads[target]
    if len(mine) < 2 or difference <= max(WORTH, loads[source] / len(mine)):
        return None
    free = [robot for robot in mine if robot not in stay]
    if not free:
        return None
    robot = min(free, key=lambda name: (homes.get(name) != target, name))
    return Shift(robot, source, target, loads[source], loads[target])


def shifts_at_once(loads: Mapping[str, float], owners: Mapping[str, str], homes: Mapping[str, str]) -> list[Shift]:
    """Return all moves that make loads more equal if each robot takes its share of the load with it; no node both
    gives and takes. The loads in a shift are the measured ones."""
    expected, placed = dict(loads), dict(owners)
    shifts: list[Shift] = []
    while (shift := best_shift(expected, placed, homes, {known.robot for known in shifts})) is not None:
        if any(shift.source == known.target or shift.target == known.source for known in shifts):
            break
        share = shift.source_load / sum(owner == shift.source for owner in placed.values())
        expected[shift.source] -= share
        expected[shift.target] += share
        placed[shift.robot] = shift.target
        shifts.append(Shift(shift.robot, shift.source, shift.target, loads[shift.source], loads[shift.target]))
    return shifts


def loads_of(state: RunState) -> dict[str, float]:
    """Return the load of each member that has reported one."""
    known = state.roster.by_name
    beats = {name: known[name].heartbeat for name in state.members if name in known}
    return {name: beat.busy for name, beat in beats.items() if beat is not None}


class Balancer:
    """Decides when which robot moves. Loads are shares of a core, from 0 to 1."""

    def __init__(self, homes: Mapping[str, str]) -> None:
        """`homes` is the node of each robot by the deployment: it moves there rather than elsewhere."""
        self._homes = dict(homes)
        self._means: dict[str, float] = {}
        self._moved_ns: dict[str, int] = {}
        self._next_ns = 0

    def look(self, loads: Mapping[str, float], owners: Mapping[str, str], now_ns: int) -> Shift | None:
        """Return the next move, given the load of every node of the run; None without one."""
        if now_ns < self._next_ns or len(loads) < 2:
            return None
        self._next_ns = now_ns + EVERY_NS
        before = self._means
        self._means = {
            name: load if name not in before else SMOOTHING * load + (1 - SMOOTHING) * before[name]
            for name, load in loads.items()
        }
        stay = {robot for robot, moved_ns in self._moved_ns.items() if now_ns < moved_ns + STAY_NS}
        shift = best_shift(self._means, owners, self._homes, stay)
        if shift is None:
            return None
        self._moved_ns[shift.robot] = now_ns
        self._next_ns = now_ns + SETTLE_NS
        self._means = {}
        return shift

    def wake(self, state: RunState, now_ns: int) -> Shift | None:
        """Return what should move now in a running world, by the loads that its members reported last."""
        if not state.is_open or state.end is not None or state.pacer.paused:
            return None
        loads = loads_of(state)
        return self.look(loads, state.present_owners(), now_ns) if len(loads) == len(state.members) else None
