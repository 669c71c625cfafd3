"""A rotorcraft by waypoints, each with its own tolerance. A job is done when it is within that."""

from __future__ import annotations

from math import sqrt

from msgspec import Struct

from foosim.library.mobile.waypoint import WaypointActuator, WaypointSettings
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.quantities import JobNumber, Metres, Radians
from foosim.world.component_types.registry import actuator
from foosim.world.components.base import slot
from foosim.world.components.view import WritableView
from foosim.world.placing import FAR_M


class FlyWithinSettings(WaypointSettings):
    """Sends a rotorcraft to waypoints, as `waypoint` does, with a tolerance in each command."""


class WaypointWithin(Struct, frozen=True):
    """Where to come to in the world, `yaw`, the heading there, from +x towards +y, and within which distance."""

    x: Metres
    y: Metres
    z: Metres
    yaw: Radians
    tolerance: Metres
    job: JobNumber = 0.0


@actuator("fly_within", FlyWithinSettings, WaypointWithin, jobs=True)
class FlyWithin(WaypointActuator):
    """Keeps the waypoint and the tolerance (m) of the last command; it flies on to the waypoint itself."""

    tolerance = slot()

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest of each coordinate and of the tolerance (m), and of the yaw (rad)."""
        return super().limits() | {"tolerance": (0.0, FAR_M)}

    def accept(self, command: WaypointWithin, view: WritableView) -> bool:  # type: ignore[override]
        """Take a waypoint."""
        view.write(self.tolerance, command.tolerance)
        self._set(view, command.x, command.y, command.z, command.yaw)
        return True

    def progress(self, view: WritableView) -> JobState:
        """Return whether it is within the tolerance, by the way that is left (m), or hovers at its waypoint."""
        x, y, z, _ = [there - now for there, now in zip(view.read(self.target), self._pose(view), strict=True)]
        way = sqrt(x * x + y * y + z * z)
        is_there = way <= view.numbers[self.tolerance.at] or view.numbers[self.arrived.at] != 0.0
        return self.judge(view, way, is_there=is_there)
