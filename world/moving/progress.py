"""Progress towards a place: a job fails after too long without any."""

from __future__ import annotations

from typing import Annotated, Final

from foosim.common import units
from foosim.common.units import Quantity
from foosim.world.component_types.jobs import JobState
from foosim.world.components.view import Mounting, WritableView

Patience = Annotated[int, Quantity(units.TIME, "0.1 s", "1 h")]
SLOTS: Final = {"nearest": 1, "waited": 1}
"""How near it has come (m), -1 before it has begun, and for how many ticks it has not come nearer."""
STEP_M: Final = 0.01
"""What comes nearer by less makes no progress."""


class Progress:
    """The progress of the actuator that is mounted there. Its slots are `SLOTS`."""

    def __init__(self, at: Mounting, patience_ns: int) -> None:
        self._nearest, self._waited = at.slot("nearest"), at.slot("waited")
        self._patience_ticks = patience_ns // at.spec.tick_ns

    def begin(self, view: WritableView) -> None:
        """Begin anew, with another place to go to."""
        view.write(self._nearest, -1.0)
        view.write(self._waited, 0.0)

    def judge(self, view: WritableView, left_m: float, *, is_there: bool) -> JobState:
        """Return the state of the job by the way that is left at the end of a tick, or DONE at the goal."""
        if is_there:
            return JobState.DONE
        nearest = view.numbers[self._nearest.at]
        if nearest < 0.0 or left_m < nearest - STEP_M:
            view.write(self._nearest, left_m)
            view.write(self._waited, 0.0)
            return JobState.RUNNING
        waited = view.numbers[self._waited.at] + 1.0
        view.write(self._waited, waited)
        return JobState.FAILED if waited >= self._patience_ticks else JobState.RUNNING
