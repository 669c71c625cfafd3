"""A sonar: the distance to the nearest surface in a cone that reflects sound back to it.

A smooth surface reflects sound as a mirror does light, so the echo of one that is turned away does not return (Kuc and
Siegel, "Physically based simulation model for acoustic sensor robot navigation", IEEE PAMI 9(6), 1987).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Final, Self

import numpy as np
from pydantic import model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.exact_math import cos, hypot
from foosim.common.spec_base import default
from foosim.common.units import Quantity, custom_error
from foosim.library.generic.range import Distance, directions
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.beams import Beams, BeamSensor, BeamsTogether
from foosim.world.components.rows import Rows
from foosim.world.components.view import Mounting, View
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.rays.boxes import Floats
from foosim.world.scene import Vector

CIRCLES: Final = ((0.25, 6), (0.5, 12), (0.75, 18), (1.0, 24))
BESIDE: Final = 1e-4
"""The angle (rad) between a beam and the two beside it, whose hits have the inclination of the surface."""
Cone = Annotated[float, Quantity(units.ANGLE, "1 deg", "120 deg")]
Incidence = Annotated[float, Quantity(units.ANGLE, "1 deg", "90 deg")]
DeadZone = Annotated[float, Quantity(units.LENGTH, "1 mm", "10 m")]
Range = Annotated[float, Quantity(units.LENGTH, "1 cm", "1 km")]


class SonarSettings(SensorSettings):
    """The distance from `at` to the nearest echo, of 61 beams in a `cone` about the x axis of the mount.

    The angle of the cone is that from side to side; beams are an eighth of it apart. A surface has an echo where a beam
    meets it at no more than `incidence` from its normal. Echoes from nearer than the `dead_zone` are not heard.
    """

    range: Range
    cone: Cone = default("30 deg")
    incidence: Incidence = default("25 deg")
    dead_zone: DeadZone = default("2 cm")
    at: MountedAt = FIRST_LINK

    @model_validator(mode="after")
    def _reaches(self) -> Self:
        if self.dead_zone >= self.range:
            raise custom_error(BadValue(f"the dead zone reaches as far as the range, {self.range:g} m", self.dead_zone))
        return self


@sensor("sonar", SonarSettings, Distance)
class Sonar(BeamSensor):
    """The distance to the nearest echo other than that of the robot's own body; the range without one."""

    field = "distance"

    def __init__(self, settings: SonarSettings, at: Mounting) -> None:
        self.least_m, self.range_m, self.least_cosine = settings.dead_zone, settings.range, cos(settings.incidence)
        beams = list(directions(settings.cone, CIRCLES))
        self.beams = Beams(at, settings.at, beams, settings.range)
        self.with_beside = Beams(
            at, settings.at, [one for way in beams for one in _with_two_beside(way)], settings.range
        )

    def reading(self, distances: list[float]) -> Distance:
        return Distance(*distances)

    @staticmethod
    def together(sensors: Sequence[Sonar]) -> Sonars:
        """Return these as one."""
        return Sonars(sensors)


class Sonars(Rows):
    """Several of them."""

    def __init__(self, sensors: Sequence[Sonar]) -> None:
        self._beams = BeamsTogether([one.with_beside for one in sensors])
        self._ways = np.array([one.with_beside.directions for one in sensors])
        self._dead_zones, self._ranges, self._cosines = np.array(
            [(one.least_m, one.range_m, one.least_cosine) for one in sensors]
        ).T.copy()

    def sample(self, view: View) -> Floats:
        """Return the distances (m), of shape (sensors, 1)."""
        distances = self._beams.distances(view)
        is_met = np.isfinite(distances)
        threes = (*distances.shape[:1], -1, 3)
        x, y, z = (np.where(is_met, distances, 0.0) * self._ways.transpose(2, 0, 1)).reshape(3, *threes)
        (ax, bx), (ay, by), (az, bz) = ((one[..., 1] - one[..., 0], one[..., 2] - one[..., 0]) for one in (x, y, z))
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        wx, wy, wz = self._ways[:, ::3].transpose(2, 0, 1)
        size = np.sqrt(nx * nx + ny * ny + nz * nz)
        is_heard = np.abs(nx * wx + ny * wy + nz * wz) >= self._cosines[:, None] * size
        is_heard &= is_met.reshape(threes).all(axis=2) & (distances[:, ::3] >= self._dead_zones[:, None])
        found: Floats = np.where(is_heard, distances[:, ::3], self._ranges[:, None]).min(axis=1, keepdims=True)
        return found


def _with_two_beside(way: Vector) -> Iterator[Vector]:
    """Yield a unit vector and two that are turned from it a little, at right angles to each other."""
    x, y, z = way
    flat = hypot(x, y)
    yield way
    for u, v, w in ((-y / flat, x / flat, 0.0), (-x * z / flat, -y * z / flat, flat)):
        size = hypot(1.0, BESIDE)
        yield (x + BESIDE * u) / size, (y + BESIDE * v) / size, (z + BESIDE * w) / size
