"""Jobs: commands with a number, of which an actuator reports the end.

A command that may be a job has a last field `job`. Its number grows with each job of a sender; the negative number
cancels that job; without it, or with 0, it is a plain command. An actuator's state of its jobs is slots, a row for
each endpoint that the deployment lets command the robot, in name order.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import Final

JOB: Final = "job"
"""The field of a command that has the number of its job."""
NUMBER_MAX: Final = 1 << 40
"""The greatest number of a job: with the row of its sender it is still a whole number as a float64."""

NUMBERS: Final = "jobs_numbers"
STATES: Final = "jobs_states"
RUNNING: Final = "jobs_running"
CHANGED: Final = "jobs_changed"
SLOTS: Final = (NUMBERS, STATES, RUNNING, CHANGED)
"""The slots of an actuator with jobs: of each sender the number of its last job, and its state; the row of the sender
whose job runs, counted from 1, 0 without one; whether any of these changed in the last tick."""

FAILURE: Final = "failure"
"""The slot of an actuator with the reason why its last command failed, 0 where it did not. Its class has the sentences
by these numbers, `FAILURES`."""


class JobState(IntEnum):
    """The state of the last job of a sender; values above `RUNNING` are ends."""

    NONE = 0
    RUNNING = 1
    DONE = 2
    FAILED = 3
    PREEMPTED = 4
    CANCELLED = 5

    @property
    def has_ended(self) -> bool:
        """Whether the job has ended."""
        return self > JobState.RUNNING


def job_slots(senders: Sequence[str]) -> dict[str, int]:
    """Return the slots of an actuator to which these endpoints may give jobs; without any there is one row."""
    rows = max(len(senders), 1)
    return {NUMBERS: rows, STATES: rows, RUNNING: 1, CHANGED: 1}
