"""What a place on a robot touches."""

from __future__ import annotations

from itertools import product
from math import sqrt
from typing import Annotated, Final

import numpy as np
from msgspec import Meta, Struct

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings, Tag
from foosim.world.components.mounted import MountedSensor
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import Mounting, View
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.scene import Vector, rotate

Reach = Annotated[float, Quantity(units.LENGTH, "1 mm", "10 m")]
WAYS: Final[list[Vector]] = [
    (x / sqrt(x * x + y * y + z * z), y / sqrt(x * x + y * y + z * z), z / sqrt(x * x + y * y + z * z))
    for x, y, z in product((-1, 0, 1), repeat=3)
    if (x, y, z) != (0, 0, 0)
]


class CollisionSettings(SensorSettings):
    """What is within `reach` of `at` on 26 rays, evenly around; with a `tag`, entities with that alone."""

    at: MountedAt = FIRST_LINK
    reach: Reach = default("4 cm")
    tag: Tag | None = None


class Touched(Struct, frozen=True):
    """The names of what is touched, entities and scenery, sorted."""

    objects: Annotated[tuple[str, ...], Meta(max_length=len(WAYS))]


@sensor("collision", CollisionSettings, Touched)
class Collision(MountedSensor):
    """What the rays around the mount meet, the robot itself aside."""

    def __init__(self, settings: CollisionSettings, at: Mounting) -> None:
        super().__init__(settings, at)
        self._around, self._own, self._reach_m = Surroundings(at.spec, at.layout), at.robot, settings.reach
        tagged = None if settings.tag is None else self._around.tagged(settings.tag)
        self._only = None if tagged is None else {entity.index for entity in tagged}

    def sample(self, view: View) -> Touched:
        place, turned = self.mount.pose(view.start)
        ways = np.array([rotate(turned, way) for way in WAYS])
        hits = self._around.rays(view, np.array([place] * len(ways)), ways, self._reach_m, self._own)
        met = {thing for thing in hits.things.tolist() if thing >= 0 and (self._only is None or thing in self._only)}
        return Touched(tuple(sorted({self._around.caster.things[thing] for thing in met})))
