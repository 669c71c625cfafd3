"""The account of a run: who solved what, and who was lost and came back.

What a run's result says of its nodes, of the ball's way between them and of its recoveries.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from foosim.common import limits
from foosim.protocol import messages


@dataclass(slots=True)
class Account:
    """Counts of a run. A hand-over is a change of the ball's solver, a move one of a robot's owner."""

    solved_ticks: dict[str, int] = field(default_factory=dict)
    """By node: the ticks in which it solved a body."""
    ball_ticks: dict[str, int] = field(default_factory=dict)
    """By node: the ticks in which it solved the ball."""
    handovers: int = 0
    moves: int = 0
    ball_solver: str = ""

    def count(self, solved: Iterable[str], ball_solver: str) -> None:
        """Count a committed frame: the nodes that solved a body for it, and who solved the ball."""
        for name in solved:
            self.solved_ticks[name] = self.solved_ticks.get(name, 0) + 1
        if self.ball_solver and ball_solver != self.ball_solver:
            self.handovers += 1
        self.ball_solver = ball_solver
        if ball_solver:
            self.ball_ticks[ball_solver] = self.ball_ticks.get(ball_solver, 0) + 1


@dataclass(slots=True)
class Recovered:
    """One loss or return. `outage_ns` is the wall time without a commit, -1 while there is none behind it, and `told`
    the tick of the commit that tells of it."""

    what: str
    name: str
    reason: str
    tick: int
    epoch: int
    outage_ns: int = -1
    told: int = -1

    def message(self) -> messages.Recovered:
        """Return it as a commit tells of it, when it is over."""
        return messages.Recovered(self.what, self.name, self.reason, self.tick, self.epoch, self.outage_ns)


def tell_again(recovered: Sequence[Recovered], tick: int) -> None:
    """Open what was told by commits behind a tick: they are void."""
    for entry in recovered:
        if entry.told > tick:
            entry.outage_ns = entry.told = -1


def close_outages(recovered: Sequence[Recovered], before_ns: int, now_ns: int, tick: int) -> list[Recovered]:
    """Frame `tick` is committed at `now_ns`, the one before it was at `before_ns`: what was out goes on.

    Return what is over by that, the oldest first; no more of it than a commit can tell of, the rest by the next one.
    """
    first = len(recovered)
    while first > 0 and recovered[first - 1].outage_ns < 0:
        first -= 1
    over = list(recovered[first : first + limits.RECOVERIES_PER_COMMIT_MAX])
    for entry in over:
        entry.outage_ns, entry.told = max(0, now_ns - before_ns), tick
    return over
