"""A base station: an antenna at a place, and power for near rovers."""

from __future__ import annotations

from typing import Final

from foosim.library.mobile.hall_settings import Place, hall_of
from foosim.library.mobile.vehicles import mast
from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.base import Model
from foosim.world.matter.materials import METAL
from foosim.world.scene import ORIGIN, Body, Colour, Cylinder, Link, Shape

GREEN: Final[Colour] = (0.15, 0.60, 0.30, 1.0)


class StationRobot(RobotSettings):
    """A base station: an antenna at a place, and power for near rovers."""

    x: Place
    y: Place


@model("station", StationRobot, slots={"down": 1, "refused": 1}, kit="hall")
class Station(Model):
    """A base station: a round hull with an antenna, which stands at the place of its settings."""

    def body(self) -> Body:
        """Return the hull and the mast of its antenna."""
        station, name = hall_of(self.at.spec).station, self.at.robot.name
        middle = (0.0, 0.0, station.height / 2)
        hull = Shape(Cylinder(station.radius, station.height), "station", GREEN, middle, radio=METAL)
        shapes = (hull, *mast(station.height, station.antenna_height, "station"))
        link = Link(name, "fixed", shapes, 0.0, ORIGIN)
        place = (self.settings.x, self.settings.y, 0.0)
        return Body(name, "station", place, (link,), (0.0, 0.0, station.antenna_height))
