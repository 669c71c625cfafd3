"""The state of an actuator's jobs, and the effect of each command on it: see `component_types/jobs.py`."""

from __future__ import annotations

from collections.abc import Callable
from math import copysign
from typing import Any, Final

import msgspec

from foosim.world.component_types.failures import ContractError
from foosim.world.component_types.jobs import CHANGED, JOB, NUMBER_MAX, NUMBERS, RUNNING, STATES, JobState
from foosim.world.components.base import Actuator
from foosim.world.components.view import Mounting, View, WritableView

NO_JOB: Final = 0.0
FRESH: Final = 2.0
"""In `jobs_changed` until the tick's end: something has changed in this tick."""
TOLD: Final = 1.0
"""In `jobs_changed` of the next frame, in which sensors report the change."""


class JobBook:
    """The jobs of one actuator. All state is in the actuator's slots."""

    def __init__(self, at: Mounting) -> None:
        self._rows = {name: row for row, name in enumerate(at.spec.senders_to(at.robot.name))}
        self._numbers, self._states = at.slot(NUMBERS), at.slot(STATES)
        self._running, self._changed = at.slot(RUNNING), at.slot(CHANGED)

    def addressed(self, command: Any, source: str) -> Any | None:
        """Return a command whose number includes the sender, so that modifiers may keep it for a later tick.

        None of a job of a sender that the deployment does not let command the robot, or whose number is none.
        """
        job = command.job
        if job == 0.0:
            return command
        row, number = self._rows.get(source), abs(job)
        if row is None or not number.is_integer() or number > NUMBER_MAX:
            return None
        return msgspec.structs.replace(command, **{JOB: copysign(number * len(self._rows) + row, job)})

    def take(self, command: Any, view: WritableView, made: Actuator, carry_out: Callable[[Any], bool]) -> bool:
        """Take a command that `addressed` has returned: a plain one, a job or a cancellation; False: it is refused.

        Each new one ends the job that runs. A job that the actuator refuses fails. A number up to the last one of its
        sender is a repeat, and does nothing.
        """
        plain = msgspec.structs.replace(command, **{JOB: 0.0})
        if command.job == 0.0:
            is_taken = carry_out(plain)
            if is_taken:
                self._end(view, JobState.PREEMPTED)
            return is_taken
        if not abs(command.job).is_integer():  # a modifier has changed it
            return False
        number, row = divmod(int(abs(command.job)), len(self._rows))
        if command.job < 0.0:
            self._cancel(view, row, float(number), made)
            return True
        if number <= view.numbers[self._numbers.at + row]:
            return True
        was_running = self._end(view, JobState.PREEMPTED)
        if carry_out(plain):
            self._note(view, row, float(number), JobState.RUNNING)
            view.write(self._running, row + 1.0)
            return True
        self._note(view, row, float(number), JobState.FAILED)
        if was_running:
            made.hold(view)
        return False

    def _cancel(self, view: WritableView, row: int, number: float, made: Actuator) -> None:
        """End the job of a sender; a job that arrives later never begins."""
        last = view.numbers[self._numbers.at + row]
        is_running = view.numbers[self._running.at] == row + 1.0
        if number < last or (number == last and not is_running):
            return
        if is_running:
            self._end(view, JobState.CANCELLED)
            made.hold(view)
        self._note(view, row, number, JobState.CANCELLED)

    def judge(self, view: WritableView, made: Any, *, has_power: bool) -> None:
        """After the actuator's robot was solved: let the job that runs end if it is done, or cannot be.

        Without power it fails. An actuator whose job has failed holds.
        """
        numbers = view.numbers
        if numbers[self._running.at] != NO_JOB:
            state = made.progress(view) if has_power else JobState.FAILED
            if state not in (JobState.RUNNING, JobState.DONE, JobState.FAILED):
                raise ContractError(made.progress, "JobState.RUNNING, DONE or FAILED", state)
            if state != JobState.RUNNING:
                self._end(view, state)
            if state == JobState.FAILED:
                made.hold(view)
        changed = numbers[self._changed.at]
        if changed:
            view.write(self._changed, TOLD if changed == FRESH else 0.0)

    def drop(self, view: WritableView) -> None:
        """Let the job that runs fail: the robot goes out of service."""
        self._end(view, JobState.FAILED)

    def is_idle(self, view: View) -> bool:
        """Whether `judge` has nothing to do."""
        return view.numbers[self._running.at] == NO_JOB and view.numbers[self._changed.at] == 0.0

    def _end(self, view: WritableView, state: JobState) -> bool:
        """Let the job that runs end so; return whether one ran."""
        running = int(view.numbers[self._running.at])
        if running:
            row = running - 1
            view.write(self._running, NO_JOB)
            self._note(view, row, view.numbers[self._numbers.at + row], state)
        return running > 0

    def _note(self, view: WritableView, row: int, number: float, state: JobState) -> None:
        for slot, value in ((self._numbers, number), (self._states, float(state))):
            values = [*view.read(slot)]
            values[row] = value
            view.write(slot, *values)
        view.write(self._changed, FRESH)
