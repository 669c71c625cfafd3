"""Progress of a rehearsal in wall time: a line each second, and detection of a player that does not return.

A rehearsal is one process on virtual time, so the process in turn blocks all others, and no deadline of a core can
expire meanwhile. Pure: the caller passes the time.
"""

from __future__ import annotations

from collections import Counter
from typing import Final

from foosim.simulation.settings import AtWork
from foosim.supervisor.state import RunState
from foosim.world.assembly.world import world_status, world_texts
from foosim.world.frame import Frame

LINE_S: Final = 1.0
LOOK_S: Final = 0.05
"""Sampling period."""
STOOD_S: Final = 4 * LOOK_S
"""A longer gap between two samples means that this process was not scheduled; it is not charged to a player."""


def reached(state: RunState) -> str:
    """Progress of a run: `3.20 s of 20.00 s`."""
    tick_s = state.deployment.tick_ns / 1e9
    last = state.settings.last_tick
    return f"{(state.frame.tick - state.first_tick) * tick_s:.2f} s of {(last - state.first_tick) * tick_s:.2f} s"


class Onlooker:
    """Samples one rehearsal."""

    def __init__(self, state: RunState, now_s: float) -> None:
        self._state = state
        self._line_s = self._looked_s = now_s
        self._line_tick = state.frame.tick
        self._turns: Counter[str] = Counter()
        """Number of samples per process in turn, since the last line."""
        self._turn = -1
        self._in_turn_s = 0.0

    def look(self, now_s: float, at_work: AtWork) -> str:
        """Sample the process in turn; return a line when one is due, else an empty string."""
        elapsed_s, self._looked_s = now_s - self._looked_s, now_s
        is_same = at_work.acts and at_work.turns == self._turn
        self._in_turn_s = self._in_turn_s + min(elapsed_s, STOOD_S) if is_same else 0.0
        self._turn = at_work.turns
        self._turns[at_work.name] += 1
        if now_s < self._line_s + LINE_S:
            return ""
        frame = self._state.frame
        line = self._line(now_s - self._line_s, frame)
        self._line_s, self._line_tick = now_s, frame.tick
        self._turns.clear()
        return line

    @property
    def allowed_s(self) -> float:
        """Deadline of a player's turn at this stage of the run: the first turns import its module."""
        state, deadlines = self._state, self._state.deployment.deadlines
        first_ns = deadlines.start_ns if state.frame.tick == state.first_tick else 0
        return max(first_ns, deadlines.lockstep_fast_ns) / 1e9

    def overdue(self, at_work: AtWork) -> str:
        """Return a message about a player that has not returned within its deadline; empty when none is overdue."""
        deadlines = self._state.deployment.deadlines
        is_first = at_work.tick < 0
        allowed_ns = deadlines.start_ns if is_first else deadlines.lockstep_fast_ns
        if not at_work.acts or at_work.turns != self._turn or self._in_turn_s < allowed_ns / 1e9:
            return ""
        what = "has not joined" if is_first else f"has not answered tick {at_work.tick}"
        which = "start" if is_first else "lockstep_fast"
        return f"{at_work.name} {what} for {allowed_ns / 1e9:g} s (deadlines.{which})"

    def _line(self, elapsed_s: float, frame: Frame) -> str:
        speed = (frame.tick - self._line_tick) * self._state.deployment.tick_ns / 1e9 / elapsed_s
        parts = [f"{reached(self._state)} simulated, {speed:.2f}x"]
        deployment = self._state.deployment
        parts += world_texts(deployment, world_status(deployment, frame))
        name, count = max(sorted(self._turns.items()), key=lambda item: item[1])
        parts.append(f"waits for {name or 'start'} ({100 * count / self._turns.total():.0f} %)")
        return ", ".join(parts)
