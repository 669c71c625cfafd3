"""A rotorcraft by the place and the heading that it is to come to. A job is done when it hovers there."""

from __future__ import annotations

from math import sqrt
from typing import Final

from msgspec import Struct

from foosim.common.exact_math import PI
from foosim.common.spec_base import default
from foosim.library.mobile.rotorcraft import RotorcraftRobot
from foosim.library.mobile.steering import shorter
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.quantities import JobNumber, Metres, Radians
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import need, slot
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.moving.progress import Approach, Patience
from foosim.world.placing import FAR_M

YAW_RAD_MAX: Final = 2.0 * PI


class WaypointSettings(ActuatorSettings):
    """Sends a rotorcraft to waypoints; its speeds and its ceiling are those of its model.

    A job of one that has come no nearer for `patience` has failed: it hovers where it is.
    """

    patience_ns: Patience = default("10 s", "patience")


class Waypoint(Struct, frozen=True):
    """Where to come to in the world, and `yaw`, the heading there, from +x towards +y."""

    x: Metres
    y: Metres
    z: Metres
    yaw: Radians
    job: JobNumber = 0.0


@actuator("waypoint", WaypointSettings, Waypoint, jobs=True)
class WaypointActuator(Approach):
    """Keeps the waypoint of the last command; without one the rotorcraft brakes, and hovers where it is."""

    has_target, target = slot(), slot(4)
    arrived, position, heading = need(), need(), need()

    def __init__(self, settings: WaypointSettings, at: Mounting) -> None:
        robot = at.spec.robots[at.robot.name]
        assert isinstance(robot, RotorcraftRobot), f"{at.robot.name} is no rotorcraft"
        self._robot = robot
        self.patience_ticks = settings.patience_ns // at.spec.tick_ns

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest of each coordinate (m) and of the yaw (rad)."""
        level = (-FAR_M, FAR_M)
        return {"x": level, "y": level, "z": (0.0, self._robot.ceiling), "yaw": (-YAW_RAD_MAX, YAW_RAD_MAX)}

    def accept(self, command: Waypoint, view: WritableView) -> bool:
        """Take a waypoint."""
        self._set(view, command.x, command.y, command.z, command.yaw)
        return True

    def _set(self, view: WritableView, x: float, y: float, z: float, yaw: float) -> None:
        view.write(self.has_target, 1.0)
        view.write(self.target, x, y, z, yaw)
        self.begin(view)

    def hold(self, view: WritableView) -> None:
        """Make the present place the waypoint."""
        x, y, z = view.read(self.position)
        self._set(view, x, y, z, view.read(self.heading)[0])

    def excite(self, view: WritableView) -> None:
        """Fly askew and up, for the run that compares engines."""
        x, y, z = view.read(self.position)
        self._set(view, x + 1.0, y + 0.5, z + 1.0, view.read(self.heading)[0] + 1.0)

    def progress(self, view: WritableView) -> JobState:
        """Return whether it hovers at its waypoint, by the way that is left (m and rad together)."""
        left = [there - now for there, now in zip(view.read(self.target), self._pose(view), strict=True)]
        x, y, z, yaw = left
        way = sqrt(x * x + y * y + z * z) + abs(shorter(yaw))
        return self.judge(view, way, is_there=view.numbers[self.arrived.at] != 0.0)

    def _pose(self, view: View) -> list[float]:
        """Return place (m) and heading (rad)."""
        return [*view.read(self.position), *view.read(self.heading)]

    def unpowered(self) -> Motors:
        """Return that there is no waypoint."""
        return ()

    def command(self, view: View) -> Motors:
        """Return place (m) and heading (rad) to come to, each with the greatest speed there (m/s, rad/s), if any."""
        if view.numbers[self.has_target.at] == 0.0:
            return ()
        x, y, z, yaw = view.read(self.target)
        its = self._robot
        return (x, its.speed), (y, its.speed), (z, its.climb), (yaw, its.turn_rate)
