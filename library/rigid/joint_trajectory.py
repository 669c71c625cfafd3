"""Joints along positions at times, as from a planner of arms. A job is done when the last of them is reached."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from itertools import pairwise
from typing import Annotated, ClassVar, Final

from msgspec import Meta, Struct
from pydantic import Field

from foosim.common.spec_base import default
from foosim.library.rigid.joints import JointGroup, JointLoopSettings, Positions, loop_points
from foosim.library.rigid.spline import fastest, position_at
from foosim.world.component_types.descriptions import Carrier
from foosim.world.component_types.jobs import FAILURE, JobState
from foosim.world.component_types.quantities import JobNumber
from foosim.world.component_types.registry import actuator
from foosim.world.components.base import Actuator
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


def _slots(settings: JointTrajectorySettings, carrier: Carrier) -> Mapping[str, int]:
    found = loop_points(settings, carrier)
    joints = found["set_point"]
    return {
        **found,
        "begun": 1,
        "count": 1,
        FAILURE: 1,
        "times": settings.points,
        "positions": settings.points * joints,
    }


@actuator(
    "joint_trajectory",
    JointTrajectorySettings,
    Trajectory,
    slots=_slots,
    needs=("joint_positions",),
    joints="joints",
    jobs=True,
)
class JointTrajectory(Actuator):
    """Keeps the points of the last command, and the tick that it came in.

    `set_point` is where its way began; without points it is where the joints stay.
    """

    FAILURES: ClassVar = {
        TrajectoryFailure.POINTS: "it has no points, more than the actuator takes, or not as many positions as times",
        TrajectoryFailure.TIMES: "its times do not rise",
        TrajectoryFailure.JOINTS: "it has not one position for each joint",
        TrajectoryFailure.LIMITS: "a position is beyond the limits of its joint",
        TrajectoryFailure.SPEED: "a joint would have to be faster than its limit",
        TrajectoryFailure.LATE: "the joints are not where it ends after the patience of the actuator",
    }

    def __init__(self, settings: JointTrajectorySettings, at: Mounting) -> None:
        self._group, self._gain = JointGroup(settings, at), settings.gain
        self._begun, self._count = at.slot("begun"), at.slot("count")
        self._times, self._positions, self._failure = at.slot("times"), at.slot("positions"), at.slot(FAILURE)
        self._tolerance, self._tick_s = settings.tolerance, at.spec.tick_ns / 1e9
        self._patience_s = settings.patience_ns / 1e9

    @staticmethod
    def check(settings: JointTrajectorySettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a joint that the robot does not have."""
        JointGroup(settings, at)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return no bounds: points beyond the limits of a joint are refused."""
        return {}

    def problem(self, command: Trajectory) -> str:
        """Return why a command is refused for any state of the joints; empty for a valid one."""
        return self._refusal(command)[1]

    def _refusal(self, command: Trajectory) -> tuple[TrajectoryFailure, str]:
        group, times, rows = self._group, command.times, command.positions
        if not 1 <= len(times) <= self._times.size or len(rows) != len(times):
            what = f"{len(times)} times and positions at {len(rows)}: as many are valid, 1 to {self._times.size}"
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
        start, times = self._group.positions(view), (0.0, *command.times)
        if failure == TrajectoryFailure.NONE:
            ways = zip(start, *command.positions, strict=True)
            if not all(fastest(times, way) <= most for way, most in zip(ways, self._group.speeds, strict=True)):
                failure = TrajectoryFailure.SPEED
        view.write(self._failure, failure)
        if failure != TrajectoryFailure.NONE:
            return False
        numbers = [position for row in command.positions for position in row]
        view.write(self._group.set_point, *start)
        view.write(self._begun, view.tick)
        view.write(self._count, len(command.times))
        view.write(self._times, *command.times, *[0.0] * (self._times.size - len(command.times)))
        view.write(self._positions, *numbers, *[0.0] * (self._positions.size - len(numbers)))
        return True

    def hold(self, view: WritableView) -> None:
        """Stay at the present positions."""
        view.write(self._count, 0.0)
        view.write(self._group.set_point, *self._group.positions(view))

    def excite(self, view: WritableView) -> None:
        """Move each joint by a little, for the run that compares engines."""
        view.write(self._group.set_point, *[position + 0.2 for position in self._group.positions(view)])

    def progress(self, view: WritableView) -> JobState:
        """Return whether the joints are where the way ends, after its end."""
        times, ways = self._way(view)
        over_s = self._since_s(view, view.tick + 1) - times[-1]
        if over_s < 0.0:
            return JobState.RUNNING
        left = [abs(way[-1] - at) for way, at in zip(ways, self._group.positions(view), strict=True)]
        if max(left) <= self._tolerance:
            return JobState.DONE
        if over_s < self._patience_s:
            return JobState.RUNNING
        view.write(self._failure, TrajectoryFailure.LATE)
        return JobState.FAILED

    def _way(self, view: View) -> tuple[tuple[float, ...], list[tuple[float, ...]]]:
        """Return times (s), from 0 on, and for each joint its positions at these."""
        count, joints = int(view.numbers[self._count.at]), self._group.set_point.size
        numbers = (*view.read(self._group.set_point), *view.read(self._positions)[: count * joints])
        return (0.0, *view.read(self._times)[:count]), [numbers[joint::joints] for joint in range(joints)]

    def _since_s(self, view: View, tick: int) -> float:
        """Return how long ago the way began."""
        return (tick - view.numbers[self._begun.at]) * self._tick_s

    def command(self, view: View) -> Motors:
        """Return speed and greatest force of each motor.

        The loop's set-point leads the way so far that a joint on the way has its speed.
        """
        times, ways = self._way(view)
        since_s, lead = self._since_s(view, view.tick), 1.0 / (self._gain * self._tick_s)
        now = [position_at(times, way, since_s) for way in ways]
        soon = [position_at(times, way, since_s + self._tick_s) for way in ways]
        return self._group.towards([at + (to - at) * lead for at, to in zip(now, soon, strict=True)], view, self._gain)
