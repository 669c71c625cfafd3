"""The settings of a robot on two driven wheels, and its rigid body."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import pi
from typing import Annotated, Final, Literal, Self

from pydantic import model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.finding import Location
from foosim.common.spec_base import Name, default
from foosim.common.units import Quantity, custom_error
from foosim.library.mobile.vehicles import DARK, Acceleration, Slip, Speed, TurnRate, Vehicle, mark_of, mast
from foosim.world.bodies.inertia import solid
from foosim.world.matter.materials import METAL, PLASTIC
from foosim.world.matter.physics import DEFAULT, FRICTIONLESS
from foosim.world.placing import ORIGIN_OF_WORLD, At, leaning
from foosim.world.scene import ORIGIN, Body, Box, Colour, Cylinder, Link, Shape, Sphere, Vector, turn

Track = Annotated[float, Quantity(units.LENGTH, "1 cm", "20 m")]
Mass = Annotated[float, Quantity(units.MASS, "10 g", "100000 kg")]
Size = Annotated[float, Quantity(units.LENGTH, "1 mm", "10 m")]
Torque = Annotated[float, Quantity(units.TORQUE, "1 mN m", "100000 N m")]
SpeedLimit = Annotated[float, Quantity(units.SPEED, "1 mm/s", "500 m/s")]

OF_KINEMATICS: Final = ("slip",)
OF_DYNAMICS: Final = (
    "mass",
    "wheel_mass",
    "wheel_radius",
    "wheel_width",
    "clearance",
    "torque",
    "bumper",
    "surface",
    "tyres",
    "speed_limit",
)
"""The settings that one kind of dynamics has alone."""
CASTER_GAP: Final = 0.01
"""How far both casters are above the floor while the wheels stand on it, as a share of the radius of a wheel."""
BUMPER_HALF_M: Final = 0.01
"""Half of how thick the plate of a bumper is."""
ALONG_Y: Final = turn((1.0, 0.0, 0.0), pi / 2.0)


class DifferentialDriveRobot(Vehicle):
    """A round robot on two driven wheels, `track` apart. Its usual actuator is `motion`, of the kind `v_w`.

    `speed` and `acceleration` are those of the wheels' rims, and so of the robot straight on; it turns at most as fast
    as `turn_rate`. With `dynamics: kinematic` each wheel rolls less far on the ground than it turns, by a share of its
    own between none and `slip`.

    With `dynamics: rigid` it is a rigid body: a hull, `clearance` above the floor, of `mass` less twice `wheel_mass`;
    two wheels, whose motors have at most `torque` each; and two balls without friction in casters, ahead and behind. A
    `bumper` is a plate of that width ahead, without a mass of its own. `surface` is that of hull and bumper, `tyres`
    that of the wheels. `speed_limit` is how fast any part of it usually is; it may start with a pitch and a roll.

    The sizes are those of usual research robots; they slip on clean floors by less than can be seen.
    """

    dynamics: Literal["kinematic", "rigid"] = "kinematic"
    at: At = ORIGIN_OF_WORLD
    track: Track = default("40 cm")
    speed: Speed = default("1 m/s")
    acceleration: Acceleration = default("1 m/s2")
    turn_rate: TurnRate = default("180 deg/s")
    slip: Slip = default("0 %")
    mass: Mass = default("20 kg")
    wheel_mass: Mass = default("1 kg")
    wheel_radius: Size = default("8 cm")
    wheel_width: Size = default("3 cm")
    clearance: Size = default("2 cm")
    torque: Torque = default("4 N m")
    bumper: Size | None = None
    surface: Name = DEFAULT
    tyres: Name = DEFAULT
    speed_limit: SpeedLimit = default("5 m/s")

    @model_validator(mode="after")
    def _can_be(self) -> Self:
        if self.dynamics != "rigid" and (leans := leaning(self.at)):
            raise custom_error(leans)
        problem = next(self._problems(), "")
        if problem:
            raise custom_error(BadValue(problem))
        return self

    def _problems(self) -> Iterator[str]:
        if self.track > 2.0 * self.radius:
            yield "the wheels would be outside of the robot: its track is more than twice its radius"
        others = OF_KINEMATICS if self.dynamics == "rigid" else OF_DYNAMICS
        for key in others:
            if key in self.model_fields_set:
                other = "kinematic" if self.dynamics == "rigid" else "rigid"
                yield f"{key} needs dynamics: {other}"
        if self.dynamics != "rigid":
            return
        if self.mass <= 2.0 * self.wheel_mass:
            yield "no mass is left for the hull: mass includes both wheels, each of wheel_mass"
        if self.clearance >= min(self.height, self.radius / 2.0, 2.0 * self.wheel_radius):
            yield "clearance must be below height, half of radius and twice wheel_radius"
        if self.wheel_radius > self.radius:
            yield "the wheels would be outside of the robot: wheel_radius is more than radius"
        if self.bumper is not None and self.bumper > 4.0 * self.radius:
            yield "a bumper is at most twice as wide as the robot"
        if self.speed_limit < 2.0 * self.speed:
            yield "speed_limit must be at least twice speed, the speed of the top of a wheel"

    @property
    def felt_surfaces(self) -> Mapping[Location, str]:
        """The surfaces that rigid bodies feel of it, by the setting that names them."""
        if self.dynamics != "rigid":
            return {}
        return {("surface",): self.surface, ("tyres",): self.tyres, ("dynamics",): FRICTIONLESS}

    @property
    def centre_height(self) -> float:
        """How high the centre of mass of the hull is above the underside of the wheels (m)."""
        return (self.height + self.clearance) / 2.0


def rigid_body(its: DifferentialDriveRobot, name: str, colour: Colour) -> Body:
    """Return a hull on two wheels and two casters: the origin is on the floor, x ahead, z up.

    Hull and wheels are solid cylinders. The casters clear the floor by a hundredth of a wheel's radius, as those of
    usual bases do, so that it is the wheels that carry: a robot leans on one of them. With c from the axle to a caster
    and a force F against the robot at the height z, the wheels carry m g - F z / c.
    """
    height, clearance = its.height, its.clearance
    geometry = Cylinder(its.radius, height - clearance)
    middle = (0.0, 0.0, its.centre_height)
    shapes = [Shape(geometry, its.surface, colour, middle, radio=METAL), mark_of(its, its.surface)]
    if its.bumper is not None:
        plate = Box((BUMPER_HALF_M, its.bumper / 2.0, (height - clearance) / 2.0))
        ahead = (its.radius + BUMPER_HALF_M, 0.0, its.centre_height)
        shapes.append(Shape(plate, its.surface, DARK, ahead, radio=METAL))
    shapes += mast(height, its.antenna_height, its.surface)
    mass = its.mass - 2.0 * its.wheel_mass
    hull = Link(name, "free", tuple(shapes), mass, _moments(geometry, mass), centre_of_mass=middle)
    wheels = [_wheel(its, f"{name}/{side}_wheel", sign) for side, sign in (("left", 1.0), ("right", -1.0))]
    ball, gap = Sphere(clearance), CASTER_GAP * its.wheel_radius
    casters = [
        Link(
            f"{name}/{end}_caster",
            "fixed",
            (Shape(ball, FRICTIONLESS, DARK, radio=PLASTIC),),
            0.0,
            ORIGIN,
            parent=0,
            position=(sign * (its.radius - clearance), 0.0, clearance + gap),
        )
        for end, sign in (("front", 1.0), ("rear", -1.0))
    ]
    links = (hull, *wheels, *casters)
    antenna = (0.0, 0.0, its.antenna_height)
    return Body(name, its.model, ORIGIN, links, antenna, its.speed_limit, antenna_link=0)


def _wheel(its: DifferentialDriveRobot, name: str, side: float) -> Link:
    """Return a wheel that turns about y: forwards with a positive speed."""
    geometry = Cylinder(its.wheel_radius, its.wheel_width)
    x, y, z = _moments(geometry, its.wheel_mass)
    return Link(
        name,
        "continuous",
        (Shape(geometry, its.tyres, DARK, orientation=ALONG_Y, radio=PLASTIC),),
        its.wheel_mass,
        (x, z, y),
        axis=(0.0, 1.0, 0.0),
        parent=0,
        position=(0.0, side * its.track / 2.0, its.wheel_radius),
        effort=its.torque,
        speed=its.speed_limit / its.wheel_radius,
    )


def _moments(geometry: Cylinder, mass: float) -> Vector:
    """Return the principal moments of a solid cylinder along z (kg m2)."""
    tensor = solid(geometry, mass).tensor
    return tensor[0], tensor[3], tensor[5]
