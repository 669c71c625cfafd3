"""The account of who solved what: what a run's result says of its nodes and of the ball's way between them.

Neighbours: `core` counts every committed frame, `status` shows it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from foosim.protocol.barrier import Barrier
from foosim.protocol.frame import Frame
from foosim.protocol.layout import BALL


@dataclass(slots=True)
class Account:
    """Counts of a run. A hand-over is a change of the ball's solver, a move one of a robot's owner."""

    solved_ticks: dict[str, int] = field(default_factory=dict)
    """By node: the ticks in which it solved a body."""
    handovers: int = 0
    moves: int = 0
    ball_solver: str = ""

    def count(self, barrier: Barrier, frame: Frame) -> None:
        """Count what led to a committed frame."""
        entities = frame.layout.entities
        for name, part in barrier.parts.items():
            if any(entities[index].has_body for index in part.solved):
                self.solved_ticks[name] = self.solved_ticks.get(name, 0) + 1
        solver = barrier.solver_of(frame.layout[BALL].index)
        if self.ball_solver and solver != self.ball_solver:
            self.handovers += 1
        self.ball_solver = solver
