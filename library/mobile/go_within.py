"""A robot on the ground by places, each with its own tolerance and speed. A job is done when it is there."""

from __future__ import annotations

from msgspec import Struct

from foosim.library.mobile.go_to import GoTo, GoToSettings
from foosim.world.component_types.quantities import JobNumber, Metres, MetresPerSecond
from foosim.world.component_types.registry import actuator
from foosim.world.components.base import slot
from foosim.world.components.view import View, WritableView
from foosim.world.placing import FAR_M


class GoWithinSettings(GoToSettings):
    """Sends a robot to places on the ground, as `go_to` does, with a tolerance and a speed in each command.

    The least of all tolerances is the setting `tolerance`. A speed is at most that of the model; 0 stops it.
    """


class PlaceWithin(Struct, frozen=True):
    """Where to come to in the world, within which distance, and how fast at most."""

    x: Metres
    y: Metres
    tolerance: Metres
    speed: MetresPerSecond
    job: JobNumber = 0.0


@actuator("go_within", GoWithinSettings, PlaceWithin, jobs=True)
class GoWithin(GoTo):
    """Keeps the place, the tolerance and the speed of the last command; without one the robot stands."""

    wanted = slot(2)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest of each coordinate, of the tolerance (m) and of the speed (m/s)."""
        its = {"tolerance": (self._tolerance, FAR_M), "speed": (0.0, self._drive.most.speed)}
        return super().limits() | its

    def accept(self, command: PlaceWithin, view: WritableView) -> bool:  # type: ignore[override]
        """Take a place, a tolerance and a speed."""
        view.write(self.wanted, command.tolerance, command.speed)
        self._set(view, 1.0, command.x, command.y)
        return True

    def excite(self, view: WritableView) -> None:
        """Go to a place ahead and aside, for the run that compares engines."""
        view.write(self.wanted, *super().demand(view))
        super().excite(view)

    def demand(self, view: View) -> tuple[float, float]:
        """Return tolerance (m) and speed (m/s) of the last command."""
        tolerance_m, speed = view.read(self.wanted)
        return tolerance_m, speed
