"""The entities around a robot: which are within a range, how far and in which direction, through walls, too."""

from __future__ import annotations

from typing import Annotated, Final

from msgspec import Meta, Struct

from foosim.common import units
from foosim.common.exact_math import atan2, hypot
from foosim.common.units import Quantity
from foosim.world.component_types.quantities import Metres, Radians
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings, Tag
from foosim.world.components.mounted import MountedSensor
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import Mounting, View
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.scene import conjugate, moved, rotate

ENTITIES_MAX: Final = 128
Range = Annotated[float, Quantity(units.LENGTH, "1 cm", "1 km")]


class NearbySettings(SensorSettings):
    """The entities whose first link is within `range` of `at`, with a `tag` those alone that have it.

    The nearest is the first; there are at most 128.
    """

    range: Range
    tag: Tag | None = None
    at: MountedAt = FIRST_LINK


class NearEntity(Struct, frozen=True):
    """An entity, as seen from the mount: its distance, and its direction from x towards y, then up towards z."""

    name: str
    distance: Metres
    bearing: Radians
    elevation: Radians


class Nearby(Struct, frozen=True):
    """The entities within the range, the nearest first."""

    entities: Annotated[tuple[NearEntity, ...], Meta(max_length=ENTITIES_MAX)]


@sensor("nearby", NearbySettings, Nearby)
class NearbySensor(MountedSensor):
    """The entities around the mount, the robot itself aside."""

    def __init__(self, settings: NearbySettings, at: Mounting) -> None:
        super().__init__(settings, at)
        self._around, self._own = Surroundings(at.spec, at.layout), at.robot
        self._range_m, self._tag = settings.range, settings.tag or ""

    def sample(self, view: View) -> Nearby:
        place, turned = self.mount.pose(view.start)
        back, found = conjugate(turned), []
        for entity in self._around.near(view, place, self._range_m, self._tag):
            position = self._around.position(view, entity)
            if position is None or entity is self._own:
                continue
            x, y, z = rotate(back, moved(position, place, -1.0))
            across = hypot(x, y)
            found.append(NearEntity(entity.name, hypot(across, z), atan2(y, x), atan2(z, across)))
        return Nearby(tuple(sorted(found, key=lambda one: (one.distance, one.name))[:ENTITIES_MAX]))
