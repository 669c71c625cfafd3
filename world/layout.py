"""The canonical layout of a frame: which entity, in name order, keeps which numbers where.

An entity's slots stand in one run of float64 numbers: first what its solver writes (body, flags, contact log, rules'
and actuators' memory), then what its owner writes (the memory of its sensors). A layout is a pure function of the
deployment and of what was added since, so every process builds the same one and its digest names it.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from typing import Final

from foosim.common.errors import Malformed
from foosim.world.forms import registry
from foosim.world.forms.models import MODELS
from foosim.world.forms.per_field import Numbers, numbers_of
from foosim.world.forms.registry import SAMPLES, Carrier, Component
from foosim.world.forms.settings import ComponentSettings, ModifierSettings
from foosim.world.spec import Robot, WorldSpec

WORLD: Final = "world"
"""Name of a table's entity that has no body: score and the rules' memory."""

ADDABLE: Final = tuple(name for name, model in MODELS.items() if model.is_addable)
"""Models of which a running world can have more."""
BALL: Final = "ball"
"""Name of the ball that every table has, and no hall; further ones have other names and can be removed again."""


@dataclass(frozen=True)
class Entity:
    """One entry of a layout. `start` to `split` are the solver's slots, `split` to `stop` the owner's."""

    index: int
    name: str
    model: str
    start: int
    split: int
    stop: int
    offsets: Mapping[str, int]
    counts: Mapping[str, int]
    """The place of the first number of each field, and how many it has."""

    @property
    def has_body(self) -> bool:
        return MODELS[self.model].has_body

    @property
    def is_robot(self) -> bool:
        return MODELS[self.model].is_robot


@dataclass(frozen=True, slots=True)
class Carried:
    """The slots of the components of a robot, by `NAME.FIELD`: those that the solver writes, and the owner's."""

    solver: Mapping[str, int]
    owner: Mapping[str, int]


NOTHING: Final = Carried({}, {})


class Layout:
    """Entities in name order and where their slots are. Two layouts are equal when their digests are."""

    def __init__(self, models: Mapping[str, str], carried: Mapping[str, Carried]) -> None:
        """Build from the model of every entity and what each robot carries."""
        entities = []
        position = 0
        for index, name in enumerate(sorted(models)):
            model = models[name]
            its = carried.get(name, NOTHING)
            start = position
            offsets: dict[str, int] = {}
            counts = {**MODELS[model].slots, **its.solver}
            for field, count in counts.items():
                offsets[field] = position
                position += count
            split = position
            for field, count in its.owner.items():
                offsets[field], counts[field] = position, count
                position += count
            entities.append(Entity(index, name, model, start, split, position, offsets, counts))
        self.entities: tuple[Entity, ...] = tuple(entities)
        self.size = position
        self.models = dict(models)
        self.carried = dict(carried)
        self._index = {entity.name: entity for entity in entities}
        self.robots = tuple([entity for entity in entities if entity.is_robot])
        """Entities that have an owner, in name order."""
        self.balls, self.rods, self.rovers = self._of("ball"), self._of("rod"), self._of("rover")
        self._digest = b""

    def _of(self, model: str) -> tuple[Entity, ...]:
        return tuple([entity for entity in self.entities if entity.model == model])

    def __getitem__(self, name: str) -> Entity:
        return self._index[name]

    def __contains__(self, name: object) -> bool:
        return name in self._index

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(entity.name for entity in self.entities)

    def components(self, robot: str) -> list[str]:
        """Return the components of a robot that have slots, in name order."""
        its = self.carried.get(robot, NOTHING)
        return sorted({slot.partition(".")[0] for slot in (*its.solver, *its.owner)})

    @property
    def digest(self) -> bytes:
        """BLAKE2b, 32 bytes, of every entity's name, model and slots."""
        if not self._digest:
            hasher = blake2b(digest_size=32)
            for entity in self.entities:
                for text in (entity.name, entity.model, *entity.offsets):
                    raw = text.encode()
                    hasher.update(struct.pack("<I", len(raw)) + raw)
                hasher.update(struct.pack(f"<{len(entity.counts)}Q", *entity.counts.values()))
                hasher.update(struct.pack("<3Q", entity.start, entity.split, entity.stop))
            self._digest = hasher.digest()
        return self._digest


def build_layout(spec: WorldSpec, added: Iterable[tuple[str, str]] = ()) -> Layout:
    """Return the layout of a deployment's world with `added` (name, model) entities, or raise `Malformed`."""
    models = {} if spec.is_hall else {BALL: "ball", WORLD: "world"}
    models |= {name: robot.model for name, robot in spec.robots.items()}
    carried = {name: _carried(spec, robot) for name, robot in spec.robots.items()}
    for name, model in added:
        if spec.is_hall:
            raise Malformed(f"{model} {name} cannot be added: nothing can be to a hall")
        if model not in ADDABLE or name in models:
            raise Malformed(f"{model} {name} cannot be added: {' or '.join(ADDABLE)} with a free name can be")
        models[name] = model
    return Layout(models, carried)


def _carried(spec: WorldSpec, robot: Robot) -> Carried:
    """Return the slots of a robot's components and of their modifiers, in name order."""
    solver: dict[str, int] = {}
    for name, actuator in sorted(robot.actuators.items()):
        component = registry.find("actuator", actuator.kind)
        solver |= _slots(name, component, actuator, Carrier(0, spec.tick_ns))
        solver |= _slots_of_modifiers(name, actuator.modifiers, numbers_of(component, actuator), spec.tick_ns)
    owner: dict[str, int] = {}
    for name, sensor in sorted(robot.sensors.items()):
        component = registry.find("sensor", sensor.kind)
        period_ns = spec.turns(sensor)[0] * spec.tick_ns
        owner |= _slots(name, component, sensor, Carrier(0, period_ns))
        owner |= _slots_of_modifiers(name, sensor.modifiers, numbers_of(component, sensor), period_ns)
        owner[f"{name}.{SAMPLES}"] = 1
    return Carried(solver, owner)


def _slots_of_modifiers(
    name: str, modifiers: Sequence[ModifierSettings], numbers: Numbers | None, period_ns: int
) -> dict[str, int]:
    found: dict[str, int] = {}
    for label, settings in zip(modifier_labels(modifiers), modifiers, strict=True):
        assert numbers is not None, "checked with the deployment"
        component = registry.find("modifier", settings.kind)
        found |= _slots(f"{name}.{label}", component, settings, Carrier(numbers.size, period_ns))
    return found


def _slots(name: str, component: Component, settings: ComponentSettings, carrier: Carrier) -> dict[str, int]:
    return {f"{name}.{field}": size for field, size in component.slots_on(settings, carrier).items()}


def modifier_labels(modifiers: Sequence[ModifierSettings]) -> list[str]:
    """Return the names of the modifiers of a component: their kinds, numbered where there are several of one."""
    kinds = [registry.find("modifier", settings.kind).name for settings in modifiers]
    return [
        kind if kinds.index(kind) == place else f"{kind}{kinds[:place].count(kind) + 1}"
        for place, kind in enumerate(kinds)
    ]
