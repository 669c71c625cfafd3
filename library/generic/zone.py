"""A zone on the ground: which entities with a tag are in it, before each tick."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.exact_math import cos, sin
from foosim.common.units import Quantity, custom_error
from foosim.library.mobile.vehicles import UprightAt
from foosim.world.component_types.registry import rule
from foosim.world.component_types.settings import RuleSettings, Tag
from foosim.world.components.base import Rule, slot
from foosim.world.components.entities import Marked, MarkKind, RuleMounting
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import View, WritableView
from foosim.world.placing import ORIGIN_OF_WORLD

if TYPE_CHECKING:
    from foosim.world.frame import Frame

Side = Annotated[float, Quantity(units.LENGTH, "1 cm", "10 km")]
SIZES: Final = {"box": ("length", "width"), "circle": ("radius",)}
"""The sizes that each shape has."""
FULL: Final = "zone"


class ZoneSettings(RuleSettings):
    """Counts the entities with a `tag` whose place is in a zone, seen from above.

    A box has `length` along its x and `width` along y, a circle has `radius`; `at` is the middle, and of a box its yaw.
    The place of an entity is that of its first link.
    """

    shape: Literal["box", "circle"] = "box"
    at: UprightAt = ORIGIN_OF_WORLD
    length: Side | None = None
    width: Side | None = None
    radius: Side | None = None
    tag: Tag

    @model_validator(mode="after")
    def _has_its_sizes(self) -> Self:
        sizes = SIZES[self.shape]
        for key in ("length", "width", "radius"):
            if (getattr(self, key) is None) is (key in sizes):
                problem = "is missing" if key in sizes else "is not one of them"
                raise custom_error(BadValue(f"a {self.shape} has {' and '.join(sizes)}: {key} {problem}"))
        return self


@rule("zone", ZoneSettings)
class Zone(Rule):
    """How many are in a zone (`count`), and whether all of them are, which are at least one (`all_in`).

    `start_tick` is the tick from which on all were in it, for the last time.
    """

    mark_kinds: ClassVar = {FULL: MarkKind("score", "zones with all in them")}
    count, all_in, start_tick = slot(), slot(), slot()

    def __init__(self, settings: ZoneSettings, at: RuleMounting) -> None:
        self._name = at.name
        self._tick_s = at.spec.tick_ns / 1e9
        self._around = Surroundings(at.spec, at.layout)
        self._entities = self._around.tagged(settings.tag)
        self._x, self._y, _ = settings.at.position
        self._cos, self._sin = cos(settings.at.yaw), sin(settings.at.yaw)
        self._half = (settings.length or 0.0) / 2.0, (settings.width or 0.0) / 2.0
        self._radius = settings.radius

    def apply(self, view: WritableView) -> None:
        """Count."""
        places = list(self._places(view))
        inside = sum(self._has(place[0], place[1]) for place in places)
        view.write(self.count, float(inside))
        is_all = 0 < inside == len(places)
        if is_all and view.numbers[self.all_in.at] == 0.0:
            view.write(self.start_tick, float(view.tick))
        view.write(self.all_in, float(is_all))

    def _places(self, view: View) -> Iterator[tuple[float, float, float]]:
        """Yield where those are that are present."""
        for entity in self._entities:
            if entity.is_absent(view.numbers):
                continue
            place = self._around.position(view, entity)
            if place is not None:
                yield place

    def _has(self, x: float, y: float) -> bool:
        """Whether a place is in the zone, its edge with it."""
        east, north = x - self._x, y - self._y
        if self._radius is not None:
            return east * east + north * north <= self._radius * self._radius
        along, across = east * self._cos + north * self._sin, north * self._cos - east * self._sin
        return abs(along) <= self._half[0] and abs(across) <= self._half[1]

    def status(self, view: View) -> dict[str, Any]:
        """Return how many are in the zone and how many there are, whether all are, and since when (s, or None)."""
        (count,), (all_in,), (since,) = view.read(self.count), view.read(self.all_in), view.read(self.start_tick)
        since_s = round(since * self._tick_s, 9) if all_in else None
        found = {"in": int(count), "of": len(list(self._places(view))), "all_in": bool(all_in), "since_s": since_s}
        return {f"zone {self._name}": found}

    @staticmethod
    def text(status: dict[str, Any]) -> str:
        """Return `2 of 3 in the zone goal`, with the time since when it is all of them, for all zones of a world."""
        zones = {key.partition(" ")[2]: its for key, its in status.items() if key.startswith("zone ")}
        return ", ".join(
            f"{its['in']} of {its['of']} in the zone {name}" + (f" since {its['since_s']:g} s" if its["all_in"] else "")
            for name, its in zones.items()
        )

    def marks(self, before: Frame, after: Frame) -> Iterator[Marked]:
        """Yield that all are in it from then on."""
        field = f"{self._name}.all_in"
        if before.at("world", field) == 0.0 < after.at("world", field):
            yield after.tick, FULL, f"all are in the zone {self._name}"
