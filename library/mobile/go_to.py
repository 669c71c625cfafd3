"""A robot on the ground by the place that it is to come to, on wheels or in any direction. A job is done when it is
there."""

from __future__ import annotations

from msgspec import Struct

from foosim.common.exact_math import atan2, cos, hypot, sin
from foosim.common.spec_base import Length, default
from foosim.library.mobile.holonomic import HolonomicRobot
from foosim.library.mobile.steering import AHEAD_RAD, NOTHING_FELT, Feelers, Steering, shorter, steered
from foosim.library.mobile.wheels import wheels_of
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.quantities import JobNumber, Metres
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import need, slot
from foosim.world.components.entities import Motors, made_model
from foosim.world.components.view import IncompatibleComponent, Mounting, View, WritableView
from foosim.world.moving.progress import Approach, Patience
from foosim.world.placing import FAR_M


class GoToSettings(ActuatorSettings):
    """Sends a robot to places on the ground; its speeds are those of its model.

    It is there within `tolerance`, and stays. With `feelers`, which is their length from the middle of its hull, it
    turns away from what these meet, left and right of where it looks. A job of one that has come no nearer for
    `patience` has failed: it stops.
    """

    tolerance: Length = default("10 cm")
    patience_ns: Patience = default("10 s", "patience")
    feelers: Length | None = None


class Place(Struct, frozen=True):
    """Where to come to in the world."""

    x: Metres
    y: Metres
    job: JobNumber = 0.0


@actuator("go_to", GoToSettings, Place, jobs=True)
class GoTo(Approach):
    """Keeps the place of the last command; without one the robot stands."""

    has_target, target = slot(), slot(2)
    position, heading = need(), need()

    def __init__(self, settings: GoToSettings, at: Mounting) -> None:
        """Raises BadValue for a model without wheels and without a way to move."""
        self._tolerance, self.patience_ticks = settings.tolerance, settings.patience_ns // at.spec.tick_ns
        self._feelers = None if settings.feelers is None else Feelers(at, settings.feelers)
        robot = at.spec.robots[at.robot.name]
        self._drive: _Base | _OnWheels = _Base(robot) if isinstance(robot, HolonomicRobot) else _OnWheels(at)

    @staticmethod
    def check(settings: GoToSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a robot that neither has wheels nor moves in any direction."""
        is_base = isinstance(at.spec.robots[at.robot.name], HolonomicRobot)
        if not is_base and made_model(at.spec, at.layout, at.robot).wheels() is None:
            raise IncompatibleComponent(
                ("kind",), "valid are robots on two wheels and of the model holonomic", settings.kind
            )

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest of each coordinate (m)."""
        return {"x": (-FAR_M, FAR_M), "y": (-FAR_M, FAR_M)}

    def accept(self, command: Place, view: WritableView) -> bool:
        """Take a place."""
        self._set(view, 1.0, command.x, command.y)
        return True

    def _set(self, view: WritableView, has_target: float, x: float, y: float) -> None:
        view.write(self.has_target, has_target)
        view.write(self.target, x, y)
        self.begin(view)

    def hold(self, view: WritableView) -> None:
        """Stop it."""
        self._set(view, 0.0, 0.0, 0.0)

    def excite(self, view: WritableView) -> None:
        """Go to a place ahead and aside, for the run that compares engines."""
        x, y, _ = view.read(self.position)
        self._set(view, 1.0, x + 1.0, y + 0.5)

    def demand(self, view: View) -> tuple[float, float]:
        """Return within which distance it is there (m), and the greatest speed on the way (m/s)."""
        return self._tolerance, self._drive.most.speed

    def progress(self, view: WritableView) -> JobState:
        """Return whether it is there."""
        left_m = hypot(*self._way(view))
        return self.judge(view, left_m, is_there=left_m <= self.demand(view)[0])

    def _way(self, view: View) -> tuple[float, float]:
        """Return the way that is left (m), in the world frame."""
        (x, y), (here_x, here_y, _) = view.read(self.target), view.read(self.position)
        return x - here_x, y - here_y

    def command(self, view: View) -> Motors:
        """Return the set-points of the drive's motors."""
        x, y = self._way(view)
        left_m, heading = hypot(x, y), view.numbers[self.heading.at]
        tolerance_m, fastest = self.demand(view)
        if view.numbers[self.has_target.at] == 0.0 or left_m <= tolerance_m or fastest == 0.0:
            return self._drive.set_points(Steering(0.0, 0.0, 0.0), view)
        felt = NOTHING_FELT if self._feelers is None else self._feelers.felt(view, heading, left_m)
        bearing, its = shorter(atan2(y, x) - heading), self._drive
        most = Steering(fastest, 0.0, its.most.turning)
        return its.set_points(steered(left_m, bearing, felt, most, its.acceleration, its.turning), view)


class _Base:
    """The drive of a base that moves in any direction, and turns to its course."""

    def __init__(self, robot: HolonomicRobot) -> None:
        self.most = Steering(robot.speed, 0.0, robot.turn_rate)
        self.acceleration, self.turning = robot.acceleration, robot.acceleration / robot.radius

    def set_points(self, steering: Steering, view: View) -> Motors:
        ahead, left = steering.speed * cos(steering.direction), steering.speed * sin(steering.direction)
        return (ahead, self.acceleration), (left, self.acceleration), (steering.turning, self.turning)


class _OnWheels:
    """The drive of a robot on two wheels: it turns on the spot until the place is ahead."""

    def __init__(self, at: Mounting) -> None:
        its = self._wheels = wheels_of(at.spec, at.layout, at.robot)
        self.most = Steering(its.speed, 0.0, its.turn_rate)
        self.acceleration, self.turning = its.acceleration, 2.0 * its.acceleration / its.track

    def set_points(self, steering: Steering, view: View) -> Motors:
        is_ahead = abs(steering.direction) < AHEAD_RAD
        speed = steering.speed * cos(steering.direction) if is_ahead else 0.0
        aside = steering.turning * self._wheels.track / 2.0
        left, right = speed - aside, speed + aside
        share = self.most.speed / max(abs(left), abs(right), self.most.speed)
        return self._wheels.set_points(left * share, right * share, view)
