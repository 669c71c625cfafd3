"""Joints along positions at times, as from a planner of arms. A job is done when the last of them is reached."""

from __future__ import annotations

from enum import IntEnum
from itertools import pairwise
from typing import Annotated, ClassVar, Final

from msgspec import Meta, Struct
from pydantic import Field

from foosim.common.spec_base import default
from foosim.library.rigid.joints import JointActuator, JointLoopSettings, Positions, checked_joint_count
from foosim.library.rigid.spline import fastest, position_at
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.quantities import JobNumber
from foosim.world.component_types.registry import actuator
from foosim.world.components.base import slot
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.moving.progress import Patience

POINTS_MAX: Final = 256
Time = Annotated[float, Meta(gt=0.0, le=1e6, extra={"unit": "s"})]


class TrajectoryFailure(IntEnum):
    """Why joints do not follow, or have not followed, the trajectory of the last command."""

    NONE = 0
    POINTS = 1
    TIMES = 2
    JOINTS = 3
    LIMITS = 4
    SPEED = 5
    LATE = 6


class JointTrajectorySettings(JointLoopSettings):
    """Moves joints along points in time, at most `points` for each command.

    Each joint moves at the speed of its way, and by `gain` times its distance from that. A job is done when the last
    time is over and each joint is within `tolerance` (m or rad) of its last position. It has failed `patience` later.
    """

    points: Annotated[int, Field(ge=1, le=POINTS_MAX)] = 16
    tolerance: Annotated[float, Field(ge=1e-6, le=10.0)] = 0.01
    patience_ns: Patience = default("2 s", "patience")


class Trajectory(Struct, frozen=True):
    """Times from the command on (s), which rise from above 0, and the positions of all joints at each (m or rad).

    The way begins where the joints are. Between two points that of each joint is a monotone cubic, which
    `library/rigid/spline.py` describes.
    """

    times: Annotated[tuple[Time, ...], Meta(max_length=POINTS_MAX)]
    positions: Annotated[tuple[Positions, ...], Meta(max_length=POINTS_MAX)]
    job: JobNumber = 0.0


@actuator("joint_trajectory", JointTrajectorySettings, Trajectory, joints="joints", jobs=True)
class JointTrajectory(JointActuator):
    """Keeps the points of the last command, and the tick in which it came.

    `set_point` is where its way began; without points it is where the joints stay.
    """

    start_tick, count, failure = slot(), slot(), slot()
    times = slot(lambda settings, carrier: settings.points)
    positions = slot(lambda settings, carrier: settings.points * checked_joint_count(settings, carrier))
    FAILURES: ClassVar = {
        TrajectoryFailure.POINTS: "it has no points, more than the actuator takes, or not as many positions as times",
        TrajectoryFailure.TIMES: "its times do not rise",
        TrajectoryFailure.JOINTS: "it has not one position for each joint",
        TrajectoryFailure.LIMITS: "a position is beyond the limits of its joint",
        TrajectoryFailure.SPEED: "a joint would have to be faster than its limit",
        TrajectoryFailure.LATE: "the joints are not where it ends after the patience of the actuator",
    }

    def __init__(self, settings: JointTrajectorySettings, at: Mounting) -> None:
        super().__init__(settings, at)
        self._gain = settings.gain
        self._tolerance, self._tick_s = settings.tolerance, at.spec.tick_ns / 1e9
        self._patience_s = settings.patience_ns / 1e9

    def problem(self, command: Trajectory) -> str:
        """Return why a command is refused for any state of the joints; empty for a valid one."""
        return self._refusal(command)[1]

    def _refusal(self, command: Trajectory) -> tuple[TrajectoryFailure, str]:
        group, times, rows = self.group, command.times, command.positions
        if not 1 <= len(times) <= self.times.size or len(rows) != len(times):
            what = f"{len(times)} times and positions at {len(rows)}: as many are valid, 1 to {self.times.size}"
            return TrajectoryFailure.POINTS, what
        if not all(before < time for before, time in pairwise(times)):
            return TrajectoryFailure.TIMES, "its times do not rise"
        for row in rows:
            if len(row) != len(group.names):
                what = f"{len(row)} positions at a time: one for each of {len(group.names)} joints is valid"
                return TrajectoryFailure.JOINTS, what
            for name, low, position, high in zip(group.names, group.lows, row, group.highs, strict=True):
                if not low <= position <= high:
                    what = f"{name} to {position:g}, beyond its limits {low:g} to {high:g}"
                    return TrajectoryFailure.LIMITS, what
        return TrajectoryFailure.NONE, ""

    def accept(self, command: Trajectory, view: WritableView) -> bool:
        """Take points; False if they are invalid or too fast for a joint."""
        failure, _ = self._refusal(command)
        start, times = self.group.positions(view), (0.0, *command.times)
        if failure == TrajectoryFailure.NONE:
            ways = zip(start, *command.positions, strict=True)
            if not all(fastest(times, way) <= most for way, most in zip(ways, self.group.speeds, strict=True)):
                failure = TrajectoryFailure.SPEED
        view.write(self.failure, failure)
        if failure != TrajectoryFailure.NONE:
            return False
        numbers = [position for row in command.positions for position in row]
        view.write(self.set_point, *start)
        view.write(self.start_tick, view.tick)
        view.write(self.count, len(command.times))
        view.write(self.times, *command.times, *[0.0] * (self.times.size - len(command.times)))
        view.write(self.positions, *numbers, *[0.0] * (self.positions.size - len(numbers)))
        return True

    def hold(self, view: WritableView) -> None:
        """Stay at the present positions."""
        view.write(self.count, 0.0)
        super().hold(view)

    def progress(self, view: WritableView) -> JobState:
        """Return whether the joints are where the way ends, after its end."""
        times, ways = self._way(view)
        over_s = self._since_s(view, view.tick + 1) - times[-1]
        if over_s < 0.0:
            return JobState.RUNNING
        left = [abs(way[-1] - at) for way, at in zip(ways, self.group.positions(view), strict=True)]
        if max(left) <= self._tolerance:
            return JobState.DONE
        if over_s < self._patience_s:
            return JobState.RUNNING
        view.write(self.failure, TrajectoryFailure.LATE)
        return JobState.FAILED

    def _way(self, view: View) -> tuple[tuple[float, ...], list[tuple[float, ...]]]:
        """Return times (s), from 0 on, and for each joint its positions at these."""
        count, joints = int(view.numbers[self.count.at]), self.set_point.size
        numbers = (*view.read(self.set_point), *view.read(self.positions)[: count * joints])
        return (0.0, *view.read(self.times)[:count]), [numbers[joint::joints] for joint in range(joints)]

    def _since_s(self, view: View, tick: int) -> float:
        """Return how long ago the way began."""
        return (tick - view.numbers[self.start_tick.at]) * self._tick_s

    def command(self, view: View) -> Motors:
        """Return speed and greatest force of each motor.

        The loop's set-point leads the way so far that a joint on the way has its speed.
        """
        times, ways = self._way(view)
        since_s, lead = self._since_s(view, view.tick), 1.0 / (self._gain * self._tick_s)
        now = [position_at(times, way, since_s) for way in ways]
        soon = [position_at(times, way, since_s + self._tick_s) for way in ways]
        return self.group.towards([at + (to - at) * lead for at, to in zip(now, soon, strict=True)], view, self._gain)
