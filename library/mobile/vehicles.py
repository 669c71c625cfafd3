"""Robots that move by kinematics in any world: their quantities, and parts of their settings and bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Final

from pydantic import AfterValidator

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity, custom_error
from foosim.library.mobile.hall_settings import Rover
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.base import Model, Motion
from foosim.world.components.entities import MotionMounting
from foosim.world.components.view import Mounting, WritableView
from foosim.world.layout import Entity
from foosim.world.matter.materials import METAL, PLASTIC
from foosim.world.matter.physics import DEFAULT
from foosim.world.moving.columns import EntityColumns
from foosim.world.moving.free_way import ROUNDING, FreeWay, Near
from foosim.world.moving.solids import Floats
from foosim.world.moving.upright import Upright
from foosim.world.placing import ORIGIN_OF_WORLD, At, leaning
from foosim.world.scene import ORIGIN, Body, Box, Colour, Cylinder, Link, Shape, Vector, turn

Radius = Annotated[float, Quantity(units.LENGTH, "1 cm", "10 m")]
Height = Annotated[float, Quantity(units.LENGTH, "1 cm", "10 m")]
Antenna = Annotated[float, Quantity(units.LENGTH, "0 m", "20 m")]
Speed = Annotated[float, Quantity(units.SPEED, "1 mm/s", "50 m/s")]
Acceleration = Annotated[float, Quantity(units.ACCELERATION, "1 mm/s2", "100 m/s2")]
TurnRate = Annotated[float, Quantity(units.SPIN, "1 deg/s", "1000 deg/s")]
Slip = Annotated[float, Quantity(units.PROBABILITY, "0 %", "50 %")]

DARK: Final[Colour] = (0.15, 0.15, 0.18, 1.0)
MAST_RADIUS_M: Final = 0.01
HULL: Final = DEFAULT
"""The surface of robots without rigid-body dynamics."""


def _is_upright(at: At) -> At:
    if problem := leaning(at):
        raise custom_error(problem)
    return at


UprightAt = Annotated[At, AfterValidator(_is_upright)]


class Vehicle(RobotSettings):
    """A round robot that moves upright: where the middle of its underside starts, and how big it is.

    It is a cylinder. The antenna is `antenna_height` above the underside, on a mast where that is above the hull.
    """

    at: UprightAt = ORIGIN_OF_WORLD
    radius: Radius = default("25 cm")
    height: Height = default("30 cm")
    antenna_height: Antenna = default("35 cm")


def body_of(
    vehicle: Vehicle | Rover, name: str, model: str, colour: Colour, speed_limit: float, surface: str = HULL
) -> Body:
    """Return a round hull, a mark ahead on it, and the antenna's mast; it has no mass, since no engine moves it."""
    radius, height = vehicle.radius, vehicle.height
    hull = Shape(Cylinder(radius, height), surface, colour, (0.0, 0.0, height / 2), radio=METAL)
    shapes = (hull, mark_of(vehicle, surface), *mast(height, vehicle.antenna_height, surface))
    link = Link(name, "free", shapes, 0.0, ORIGIN)
    return Body(name, model, ORIGIN, (link,), (0.0, 0.0, vehicle.antenna_height), speed_limit)


def mark_of(vehicle: Vehicle | Rover, surface: str) -> Shape:
    """Return the mark on a hull that is ahead of its middle."""
    radius, height = vehicle.radius, vehicle.height
    mark = Box((radius / 4, radius / 8, height / 16))
    return Shape(mark, surface, DARK, (radius / 2, 0.0, height + height / 16), radio=PLASTIC)


def mast(bottom: float, top: float, surface: str) -> tuple[Shape, ...]:
    """Return the mast of an antenna that is higher than the hull below it, if it is."""
    if top <= bottom:
        return ()
    pole = Cylinder(MAST_RADIUS_M, top - bottom)
    return (Shape(pole, surface, DARK, (0.0, 0.0, (top + bottom) / 2), radio=PLASTIC),)


class KinematicModel(Model):
    """A model of entities that move by kinematics and start at rest at `at`, no faster than `fastest`."""

    def __init__(self, settings: Any, at: Mounting) -> None:
        super().__init__(settings, at)
        self._position = at.slot("position").at
        self._reach_m = self.fastest * at.spec.tick_ns / 1e9 * ROUNDING

    @property
    def fastest(self) -> float:
        """The greatest speed of its place (m/s)."""
        speed: float = self.settings.speed
        return speed

    def place(self, view: WritableView) -> None:
        """Set it to its start, at rest."""
        self.set_down(view, self.settings.at.position, self.settings.at.yaw)

    def set_down(self, view: WritableView, position: Vector, yaw: float) -> None:
        """Write its place (m) and its heading (rad)."""
        view.write(self.at.slot("position"), *position)
        view.write(self.at.slot("orientation"), *turn((0.0, 0.0, 1.0), yaw))
        view.write(self.at.slot("heading"), yaw)

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether it is no farther away than its speed allows, but for rounding."""
        at, reach_m = self._position, self._reach_m
        dx, dy, dz = numbers[at] - before[at], numbers[at + 1] - before[at + 1], numbers[at + 2] - before[at + 2]
        return dx * dx + dy * dy + dz * dz <= reach_m * reach_m


class FreeMotion(Motion):
    """A motion as far as nothing is in the way (`moving.free_way`)."""

    fields: ClassVar[tuple[str, ...]]
    """The fields that it writes, those of its state."""
    is_level: ClassVar[bool] = False
    """Whether what it moves keeps its height."""

    def __init__(self, at: MotionMounting) -> None:
        self.at, self._way, self._columns = at, FreeWay(at), EntityColumns(at, self.fields)
        self.substeps, self.dt = at.spec.substeps, at.spec.tick_ns / 1e9 / at.spec.substeps
        self.take(at.entities)

    def take(self, entities: Sequence[Entity]) -> None:
        """Keep what holds of these entities, which one node moves in a tick."""
        self._entities = list(entities)
        self.state, self._movers = self._columns.of(entities), self._way.movers(entities, is_level=self.is_level)

    def start(self, entities: Sequence[Entity], view: WritableView) -> tuple[Floats, Near]:
        """Return the state of these entities at the start of a tick, and what they may meet within it."""
        if self._entities != entities:
            self.take(entities)
        return self.state.read_at_start(view), self._way.near(self._movers, view)


class VehicleModel(KinematicModel):
    """A model of round robots that move upright by kinematics."""

    colour: ClassVar[Colour]

    def body(self) -> Body:
        """Return the hull, a mark ahead, and the antenna's mast."""
        return body_of(self.settings, self.at.robot.name, self.at.robot.kind.name, self.colour, self.fastest)

    def upright(self) -> Upright:
        """Return its cylinder for obstacles: its hull, up to the top of its antenna."""
        return Upright(self.settings.radius, 0.0, max(self.settings.height, self.settings.antenna_height))
