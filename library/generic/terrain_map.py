"""The terrain around a robot: the heights of a grid of places, by rays cast straight down."""

from __future__ import annotations

from typing import Annotated, Final, Self

import numpy as np
from msgspec import Meta, Struct
from pydantic import model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.exact_math import hypot
from foosim.common.spec_base import default
from foosim.common.units import Quantity, custom_error
from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.mounted import MountedSensor
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import Mounting, View
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.scene import rotate

CELLS_MAX: Final = 4096
Side = Annotated[float, Quantity(units.LENGTH, "0 m", "1 km")]
Resolution = Annotated[float, Quantity(units.LENGTH, "1 mm", "100 m")]
Reach = Annotated[float, Quantity(units.LENGTH, "0 m", "1 km")]
Below = Annotated[float, Quantity(units.LENGTH, "1 cm", "1 km")]


class TerrainMapSettings(SensorSettings):
    """The heights of the ground and of things over it, above the height of `at`, in a grid of places around it.

    The grid has the `length` ahead and the `width` aside, with a place at each `resolution`, at most 4,096 of them; it
    is level and turns with the mount, or with `turns: false` keeps to the axes of the world. Rays start `above` the
    mount and end `below` it.
    """

    length: Side
    width: Side
    resolution: Resolution = default("10 cm")
    above: Reach = default("1 m")
    below: Below = default("2 m")
    turns: bool = True
    at: MountedAt = FIRST_LINK

    @model_validator(mode="after")
    def _is_small(self) -> Self:
        if self.cells > CELLS_MAX:
            what = f"{self.rows} by {self.columns} places of the grid; a reading has at most {CELLS_MAX} heights"
            raise custom_error(BadValue(what, self.resolution))
        return self

    @property
    def rows(self) -> int:
        """The count of places ahead."""
        return round(self.length / self.resolution) + 1

    @property
    def columns(self) -> int:
        """The count of places aside."""
        return round(self.width / self.resolution) + 1

    @property
    def cells(self) -> int:
        """The count of heights in a reading."""
        return self.rows * self.columns


class Terrain(Struct, frozen=True):
    """Heights above the mount: row by row from behind to ahead, each from right to left; -`below` where nothing is."""

    heights: Annotated[tuple[Metres, ...], Meta(min_length=1, max_length=CELLS_MAX)]


@sensor("terrain_map", TerrainMapSettings, Terrain, array_length=lambda settings, _: settings.cells)
class TerrainMap(MountedSensor):
    """The heights of a grid of places around the mount; rays pass the robot's own body."""

    def __init__(self, settings: TerrainMapSettings, at: Mounting) -> None:
        super().__init__(settings, at)
        self._around, self._own, self._turns = Surroundings(at.spec, at.layout), at.robot, settings.turns
        self._above, self._below = settings.above, settings.below
        ahead, aside = (
            (np.arange(count) - (count - 1) / 2.0) * settings.resolution for count in (settings.rows, settings.columns)
        )
        self._x, self._y = np.repeat(ahead, settings.columns), np.tile(aside, settings.rows)
        self._down = np.tile((0.0, 0.0, -1.0), (settings.cells, 1))

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and the greatest height (m); a ray that meets nothing has the least."""
        return {"heights": (-self._below, self._above)}

    def sample(self, view: View) -> Terrain:
        (px, py, pz), turned = self.mount.pose(view.start)
        ahead, aside, _ = rotate(turned, (1.0, 0.0, 0.0)) if self._turns else (1.0, 0.0, 0.0)
        size = hypot(ahead, aside)
        c, s = (ahead / size, aside / size) if size > 0.0 else (1.0, 0.0)
        x, y = px + (c * self._x - s * self._y), py + (s * self._x + c * self._y)
        starts = np.stack((x, y, np.full(len(x), pz + self._above)), axis=1)
        found = self._around.rays(view, starts, self._down, self._above + self._below, self._own).distances
        return Terrain(tuple((self._above - np.minimum(found, self._above + self._below)).tolist()))
