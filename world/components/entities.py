"""What models, motions and rules of the world are made from, and what they return."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, TypeVar

from foosim.common.keyed_random import draw_key
from foosim.world.components.view import Mounting, Slot
from foosim.world.layout import MOTION, WORLD, Entity, Layout
from foosim.world.spec import WorldSpec

S = TypeVar("S")

Motors = tuple[tuple[float, ...], ...]
"""What actuators ask of each motor of an entity: target speed, and greatest force or acceleration (SI units).

Of a rigid body a third number may follow, `drives.Motor.slope`."""
Marked: TypeAlias = tuple[int, str, str]
"""What happened: the tick, the kind of the mark, the text."""


@dataclass(frozen=True, slots=True)
class MarkKind:
    """How marks of a kind look on a time line, and what several of them are called.

    `is_cut` says that something is put elsewhere then: no way leads there.
    """

    look: Literal["score", "start", "away", "rest", "lost"]
    text: str
    is_cut: bool = False


def mounting_of(spec: WorldSpec, layout: Layout, entity: Entity) -> Mounting:
    """Return what the model of an entity is made with."""
    return Mounting(spec, layout, entity, "", draw_key(spec.seed, "model", entity.name), frozenset(entity.fields))


@dataclass(frozen=True, slots=True)
class MotionMounting:
    """What a motion moves: the entities of a layout whose models have it."""

    spec: WorldSpec
    layout: Layout
    motion: type[Any]
    entities: tuple[Entity, ...]

    def settings(self, kind: type[S]) -> dict[int, S]:
        """Return the settings of what is moved, which are of this class, by index."""
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
    """Where a rule of the world is: in which world, under which name, and the key of its draws.

    `writes` are the models whose state it may change.
    """

    spec: WorldSpec
    layout: Layout
    name: str
    key: bytes
    writes: frozenset[str]

    def slot(self, field: str) -> Slot:
        """Return what the rule itself remembers of the world."""
        return self._slot(self.layout[WORLD], f"{self.name}.{field}", is_own=True)

    def of(self, entity: Entity, field: str) -> Slot:
        """Return what the rule remembers of an entity, else a field of the entity."""
        own = f"{self.name}.{field}"
        if own in entity.offsets:
            return self._slot(entity, own, is_own=True)
        return self._slot(entity, field, is_own=entity.model in self.writes)

    def _slot(self, entity: Entity, name: str, *, is_own: bool) -> Slot:
        return Slot(entity.offsets[name], entity.counts[name], f"{entity.name} {name}", is_own)
