"""A laser scanner of several rows: the distances to the first thing on each beam, computed where they are read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Self

from pydantic import Field, model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.exact_math import cos, sin
from foosim.common.spec_base import default
from foosim.common.units import Quantity, custom_error
from foosim.library.generic.laser_scanner import Angle, Least, Range, directions
from foosim.world.component_types.registry import sensor
from foosim.world.components.cameras import PictureSensor, SightSettings
from foosim.world.components.optics import Optics
from foosim.world.components.sight import Seen
from foosim.world.scene import Vector

if TYPE_CHECKING:  # a client that reads no scan does without numpy
    import numpy as np
    from numpy.typing import NDArray

BYTES: Final = 3
"""Of a beam in the packets of usual scanners: two of a distance, one of an intensity."""
Elevation = Annotated[float, Quantity(units.ANGLE, "-90 deg", "90 deg")]


class LaserScanner3dSettings(SightSettings):
    """The distances from `at` to the first thing on each beam, from `least` to `range`, of `rows` of `columns` beams.

    Rows are at equal steps from `lowest` to `highest` above the plane of x and y of the mount, a single one half-way.
    Columns are over `angle`, as the beams of a `laser_scanner`: from right to left of x, a full turn begins behind.
    `latency` is added to the delay of the network; `size` is what the network carries, by default 3 bytes a beam.
    """

    rows: Annotated[int, Field(ge=1, le=64)]
    columns: Annotated[int, Field(ge=1, le=1024)]
    range: Range
    angle: Angle = default("360 deg")
    lowest: Elevation = default("-15 deg")
    highest: Elevation = default("15 deg")
    least: Least = default("0 m")

    @model_validator(mode="after")
    def _rises(self) -> Self:
        if self.lowest > self.highest:
            raise custom_error(BadValue("lowest is above highest", self.lowest))
        if self.least >= self.range:
            raise custom_error(BadValue(f"least is not below the range, {self.range:g} m", self.least))
        return self

    @property
    def directions(self) -> Sequence[Vector]:
        """Unit vectors of the beams in the frame of the mount, row by row."""
        step = (self.highest - self.lowest) / max(self.rows - 1, 1)
        first = self.lowest if self.rows > 1 else (self.lowest + self.highest) / 2.0
        level = list(directions(self.columns, self.angle))
        rises = [(cos(first + row * step), sin(first + row * step)) for row in range(self.rows)]
        return [(x * across, y * across, up) for across, up in rises for x, y, _ in level]

    @property
    def encoded_bytes(self) -> int:
        """The bytes of a scan as usual scanners send it."""
        return self.rows * self.columns * BYTES

    @property
    def optics(self) -> Optics:
        """Those of a camera with shadows: its readings have all links within the range, also those beside its view."""
        return Optics(1, 1, 1.0, self.least, self.range, shadows=True)


class Scan3d(Seen, frozen=True, dict=True):
    """What is around a laser scanner at a tick. Both methods raise as `Sight.picture`."""

    def ranges(self) -> NDArray[np.float64]:
        """Return the distances (m), (rows, columns), the lowest row first; the sensor's range where nothing is met."""
        found: NDArray[np.float64] = self._drawn_by.ranges(self)
        return found

    def points(self) -> NDArray[np.float64]:
        """Return the places where beams meet something, (n, 3), in the frame of the mount (m), row by row."""
        found: NDArray[np.float64] = self._drawn_by.points(self)
        return found


@sensor("laser_scanner_3d", LaserScanner3dSettings, Scan3d, drawn_by="foosim.rendering.scans:Scans")
class LaserScanner3d(PictureSensor):
    """The distance to the first thing on each beam other than the robot's own body; the range for none."""

    reading: ClassVar = Scan3d
