"""A base station: an antenna at a place, and power for near rovers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.library.mobile.hall_settings import Place, hall_of
from foosim.library.mobile.vehicles import mast, standing
from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.base import Model
from foosim.world.components.view import Mounting, WritableView
from foosim.world.matter.materials import METAL
from foosim.world.scene import Body, Colour, Cylinder, Shape

GREEN: Final[Colour] = (0.15, 0.60, 0.30, 1.0)


class StationRobot(RobotSettings):
    """A base station: an antenna at a place, and power for near rovers."""

    x: Place
    y: Place


@model("station", StationRobot, slots={"down": 1, "refused": 1}, kit="hall")
class Station(Model):
    """A base station: a round hull with an antenna."""

    def __init__(self, settings: StationRobot, at: Mounting) -> None:
        self._settings, self._name = settings, at.robot.name
        self._station = hall_of(at.spec).station

    def body(self) -> Body:
        """Return the hull and the mast of its antenna."""
        station, settings = self._station, self._settings
        middle = (0.0, 0.0, station.height / 2)
        hull = Shape(Cylinder(station.radius, station.height), "station", GREEN, middle, radio=METAL)
        shapes = (hull, *mast(station.height, station.antenna_height, "station"))
        place = (settings.x, settings.y, 0.0)
        return standing(self._name, "station", place, "fixed", shapes, station.antenna_height)

    def place(self, view: WritableView) -> None:
        """It stands at the place of its settings."""

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Nothing moves it."""
        return True
