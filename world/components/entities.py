"""Mountings of models, motions and rules of the world, and the values that these return."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, TypeVar

from foosim.common.keyed_random import draw_key
from foosim.world.components.view import Mounting, Slot
from foosim.world.layout import MOTION, WORLD, Entity, Layout
from foosim.world.spec import WorldSpec

S = TypeVar("S")

Motors = tuple[tuple[float, ...], ...]
"""The set-point of each motor of an entity: target speed, and greatest force or acceleration (SI units).

Of a rigid body a third number may follow, `drives.Motor.slope`."""
Marked: TypeAlias = tuple[int, str, str]
"""An event: the tick, the kind of the mark, the text."""


@dataclass(frozen=True, slots=True)
class MarkKind:
    """The look of marks of a kind on a time line, and their name in the plural.

    `is_cut`: an entity is put elsewhere then, without a path between both places.
    """

    look: Literal["score", "start", "away", "rest", "lost"]
    text: str
    is_cut: bool = False


def mounting_of(spec: WorldSpec, layout: Layout, entity: Entity) -> Mounting:
    """Return the mounting of an entity's model."""
    return Mounting(spec, layout, entity, "", draw_key(spec.seed, "model", entity.name), frozenset(entity.fields))


def made_model(spec: WorldSpec, layout: Layout, entity: Entity) -> Any:
    """Return an entity as its model."""
    return entity.kind.factory(spec.settings_of(entity.name), mounting_of(spec, layout, entity))


@dataclass(frozen=True, slots=True)
class MotionMounting:
    """The mounting of a motion: the entities of a layout whose models have it."""

    spec: WorldSpec
    layout: Layout
    motion: type[Any]
    entities: tuple[Entity, ...]

    def settings(self, kind: type[S]) -> dict[int, S]:
        """Return the settings of the moved entities, which are of this class, by index."""
        found: dict[int, S] = {}
        for entity in self.entities:
            settings = self.spec.settings_of(entity.name)
            assert isinstance(settings, kind), f"{entity.name} has no {kind.__name__}"
            found[entity.index] = settings
        return found

    def slot(self, entity: Entity, field: str) -> Slot:
        """Return a slot of the motion itself on an entity, else a field of the entity, which it may write, too."""
        own = f"{MOTION}.{field}"
        name = own if own in entity.offsets else field
        return Slot(
            entity.offsets[name], entity.counts[name], f"{entity.name} {name}", entity.kind.motion is self.motion
        )


@dataclass(frozen=True, slots=True)
class RuleMounting:
    """The mounting of a rule: its world, its name, and the key of its draws.

    `writes` are the models whose state it may change.
    """

    spec: WorldSpec
    layout: Layout
    name: str
    key: bytes
    writes: frozenset[str]

    def slot(self, field: str) -> Slot:
        """Return the rule's own slot of the world."""
        return self._slot(self.layout[WORLD], f"{self.name}.{field}", is_own=True)

    def of(self, entity: Entity, field: str) -> Slot:
        """Return the rule's own slot of an entity, else a field of the entity."""
        own = f"{self.name}.{field}"
        if own in entity.offsets:
            return self._slot(entity, own, is_own=True)
        return self._slot(entity, field, is_own=entity.model in self.writes)

    def _slot(self, entity: Entity, name: str, *, is_own: bool) -> Slot:
        return Slot(entity.offsets[name], entity.counts[name], f"{entity.name} {name}", is_own)
