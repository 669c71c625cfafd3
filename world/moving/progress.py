"""Progress towards a goal: a job fails after too long without any."""

from __future__ import annotations

from typing import Annotated, Final

from foosim.common import units
from foosim.common.units import Quantity
from foosim.world.component_types.jobs import JobState
from foosim.world.components.base import Actuator, slot
from foosim.world.components.view import WritableView

Patience = Annotated[int, Quantity(units.TIME, "0.1 s", "1 h")]
STEP: Final = 0.01
"""What comes nearer by less makes no progress (m or rad)."""


class Approach(Actuator):
    """An actuator whose jobs have a goal, a place (m) or angles of joints (rad), that it comes nearer to."""

    least_distance, stalled_ticks = slot(), slot()
    """How near it has come (m or rad), -1 before it has begun, and for how many ticks it has not come nearer."""
    patience_ticks: int

    def begin(self, view: WritableView) -> None:
        """Begin anew, with another goal."""
        view.write(self.least_distance, -1.0)
        view.write(self.stalled_ticks, 0.0)

    def judge(self, view: WritableView, left: float, *, is_there: bool) -> JobState:
        """Return the state of the job by what is left (m or rad) at the end of a tick, or DONE at the goal."""
        if is_there:
            return JobState.DONE
        nearest = view.numbers[self.least_distance.at]
        if nearest < 0.0 or left < nearest - STEP:
            view.write(self.least_distance, left)
            view.write(self.stalled_ticks, 0.0)
            return JobState.RUNNING
        stalled = view.numbers[self.stalled_ticks.at] + 1.0
        view.write(self.stalled_ticks, stalled)
        return JobState.FAILED if stalled >= self.patience_ticks else JobState.RUNNING
