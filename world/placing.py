"""Poses in a deployment: `at: {x: 1 m, yaw: 90 deg}`."""

from __future__ import annotations

from typing import Annotated, Final

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import PartName, SpecBase, default
from foosim.common.units import Quantity
from foosim.world.scene import Quaternion, Vector, from_rpy

FAR_M: Final = 100_000.0
"""The greatest distance of a place from the origin, in each coordinate (m)."""
Coordinate = Annotated[float, Quantity(units.LENGTH, "-100 km", "100 km")]
Turn = Annotated[float, Quantity(units.ANGLE, "-360 deg", "360 deg")]


class At(SpecBase):
    """A pose in the world: a place, turned about the world's x (roll), then y (pitch), then z (yaw)."""

    x: Coordinate = default("0 m")
    y: Coordinate = default("0 m")
    z: Coordinate = default("0 m")
    roll: Turn = default("0 deg")
    pitch: Turn = default("0 deg")
    yaw: Turn = default("0 deg")

    @property
    def position(self) -> Vector:
        """The place (m)."""
        return self.x, self.y, self.z

    @property
    def orientation(self) -> Quaternion:
        """The rotation from its frame to the world's."""
        return from_rpy(self.roll, self.pitch, self.yaw)


class MountedAt(At):
    """A pose in the frame of a link of the robot: the one of this name, the first one without a name."""

    link: PartName | None = None


class MountedOrStanding(MountedAt):
    """A pose in the frame of a link of the robot, of a robot without a body in the world: its component checks it."""


def is_placed(settings: type[SpecBase]) -> bool:
    """Whether settings have the start of an entity: its pose, or its place on the ground and its heading."""
    return "at" in settings.model_fields or {"x", "y", "heading"}.issubset(settings.model_fields)


ORIGIN_OF_WORLD: Final = At()
FIRST_LINK: Final = MountedAt()
FIRST_LINK_OR_WORLD: Final = MountedOrStanding()


def leaning(at: At) -> BadValue | None:
    """Return what is wrong with a place for an upright body."""
    for key, angle in (("roll", at.roll), ("pitch", at.pitch)):
        if angle != 0.0:
            return BadValue(f"an upright body has no {key}", f"{angle:g} rad")
    return None
