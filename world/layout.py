"""The canonical layout of a frame: the places of each entity's numbers, in name order.

An entity's slots are one run of float64 numbers: first those of its solver (the fields of its model, the slots of
rules, motion and actuators), then those of its owner (the slots of its sensors). A layout is a pure function of the
deployment, so every process builds the same one and its digest names it. Entities that can come and go are in it from
the start, with a slot for their absence.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from typing import Any, Final, TypeVar

from foosim.common.errors import BadValue, Malformed
from foosim.common.finding import Location
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import (
    ABSENT,
    INACTIVE,
    LINEAR_VELOCITY,
    POSE,
    ROBOTS,
    SAMPLES,
    STILL_POSE,
    STILL_TICKS,
    Carrier,
    Component,
    Kit,
    Model,
    References,
)
from foosim.world.component_types.jobs import job_slots
from foosim.world.component_types.per_field import Numbers, numbers_of
from foosim.world.component_types.settings import ComponentSettings, ModifierSettings, RobotSettings, SensorSettings
from foosim.world.spec import WorldSpec

T = TypeVar("T")
WORLD: Final = "world"
"""Name and model of the entity without a body that has the slots of the world's rules; it is missing in a world whose
rules have no slots."""
MOTION: Final = "motion"
"""Component name of the slots of a motion."""

WORLD_MODEL: Final = Model(
    type_name="model", name=WORLD, factory=object, settings=RobotSettings, slots={}, is_robot=False
)


@dataclass(frozen=True, eq=False)
class Entity:
    """One entry of a layout. `start` to `split` are the solver's slots, `split` to `stop` the owner's."""

    index: int
    name: str
    kind: Model
    start: int
    split: int
    stop: int
    offsets: Mapping[str, int]
    counts: Mapping[str, int]
    """The place of the first number of each field, and the count of its numbers."""
    fields: Mapping[str, int]
    """Those of its model, with their counts."""

    @property
    def model(self) -> str:
        """The name of its model."""
        return self.kind.name

    @property
    def is_robot(self) -> bool:
        """Whether it has an owner, sends and receives."""
        return self.kind.is_robot

    @property
    def is_solved(self) -> bool:
        """Whether a node computes its next state."""
        return self.kind.is_solved

    @property
    def is_rigid(self) -> bool:
        """Whether an engine solves it."""
        return self.kind.is_rigid

    @property
    def is_free(self) -> bool:
        """Whether it is a free rigid body: it can be pushed."""
        return self.kind.is_rigid and LINEAR_VELOCITY in self.offsets

    @property
    def can_leave(self) -> bool:
        """Whether it can be removed from the world and added to it: a solved entity with a place, except the
        lasting ones of a kit."""
        return ABSENT in self.offsets

    def is_absent(self, numbers: Sequence[float]) -> bool:
        """Whether it is absent from the world in a frame of these numbers."""
        at = self.offsets.get(ABSENT)
        return at is not None and numbers[at] != 0.0


@dataclass(frozen=True, slots=True)
class Carried:
    """The slots of an entity beside those of its model, by name, with the count of their numbers: the solver's and the
    owner's."""

    solver: Mapping[str, int]
    owner: Mapping[str, int]


NOTHING: Final = Carried({}, {})


@dataclass(frozen=True, slots=True)
class Declared:
    """The part of a deployment in a layout.

    `carried` are the slots that entities carry, by name; `rule_slots` those of the world's rules for each entity of a
    model; `spares` the entities that are absent at the start, `lasting` the entities that never leave; `switched` the
    robots with components, which can be switched off; `fields` the fields of entities whose model has no fixed ones, by
    name; `variants` the descriptions of entities with a variant of their model, by name; `demanded` the fields on
    demand of entities, by name.
    """

    carried: Mapping[str, Carried] = field(default_factory=dict)
    rule_slots: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    spares: frozenset[str] = frozenset()
    lasting: frozenset[str] = frozenset()
    switched: frozenset[str] = frozenset()
    fields: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    kinds: Mapping[str, Model] = field(default_factory=dict)
    demanded: Mapping[str, Mapping[str, int]] = field(default_factory=dict)

    def kind_of(self, name: str, model: str) -> Model:
        """Return the description of an entity, by its name and that of its model."""
        return self.kinds.get(name) or _model(model)

    def fields_of(self, name: str, kind: Model) -> Mapping[str, int]:
        """Return the fields of the state of an entity of a model."""
        fields = self.fields[name] if kind.declared is None else kind.declared
        more = self.demanded.get(name)
        return {**fields, **more} if more else fields

    def slots_of_rules(self, kind: Model) -> dict[str, int]:
        """Return the slots of the world's rules for each entity of a model."""
        of_robots = self.rule_slots.get(ROBOTS, {}) if kind.is_robot else {}
        return {**self.rule_slots.get(kind.name, {}), **of_robots}


class Layout:
    """Entities in name order and the places of their slots. Two layouts are equal when their digests are."""

    def __init__(self, models: Mapping[str, str], declared: Declared) -> None:
        """Build from the model of every entity, by name, and the part of the deployment."""
        entities = []
        position = 0
        for index, name in enumerate(sorted(models)):
            kind = declared.kind_of(name, models[name])
            its = declared.carried.get(name, NOTHING)
            start = position
            offsets: dict[str, int] = {}
            fields = declared.fields_of(name, kind)
            counts: dict[str, int] = {**fields, **declared.slots_of_rules(kind), **its.solver}
            if "position" in fields and kind.is_solved and name not in declared.lasting:
                counts[ABSENT] = 1
            if name in declared.switched:
                counts[INACTIVE] = 1
            if STILL_TICKS in fields:
                counts[STILL_POSE] = sum([fields.get(field, 0) for field in POSE])
            for slot, count in counts.items():
                offsets[slot] = position
                position += count
            split = position
            for slot, count in its.owner.items():
                offsets[slot] = position
                position += count
            counts.update(its.owner)
            entities.append(Entity(index, name, kind, start, split, position, offsets, counts, fields))
        self.entities: tuple[Entity, ...] = tuple(entities)
        self.size = position
        self.models = dict(models)
        self.declared = declared
        self._index = {entity.name: entity for entity in entities}
        self.robots = tuple([entity for entity in entities if entity.is_robot])
        """Entities that have an owner, in name order."""
        self.references = tuple(
            [
                entity.offsets[slot] + place
                for entity in entities
                for slot, count in _kept(entity.counts).items()
                if isinstance(count, References)
                for place in range(count)
            ]
        )
        """The numbers that refer to entities."""
        self.free = tuple([entity for entity in entities if entity.is_free])
        """Free rigid bodies, in name order."""
        self.couples = any(entity.is_rigid and entity.kind.couples for entity in entities)
        """Whether it has rigid bodies whose islands need a solve of their own."""
        self.resting = tuple([entity for entity in entities if STILL_TICKS in entity.offsets])
        """Bodies that may come to rest, in name order."""
        self._shared: dict[tuple[str, int], tuple[WorldSpec, Any]] = {}
        """By kind and the identity of the world, which is kept with the value."""
        self._digest = b""

    def shared(self, what: str, spec: WorldSpec, make: Callable[[], T]) -> T:
        """Return a value shared by all users of this layout in a world, built at its first use."""
        kept = self._shared.get((what, id(spec)))
        if kept is None:
            kept = self._shared[what, id(spec)] = spec, make()
        found: T = kept[1]
        return found

    def of(self, model: str) -> tuple[Entity, ...]:
        """Return the entities of a model, in name order."""
        return tuple([entity for entity in self.entities if entity.model == model])

    @staticmethod
    def kind_of(model: str) -> Model:
        """Return the description of a model."""
        return _model(model)

    @property
    def spares(self) -> frozenset[str]:
        """The entities that are absent at the start."""
        return self.declared.spares

    def present(self, numbers: Sequence[float]) -> list[Entity]:
        """Return the entities that are in the world in a frame of these numbers, in name order."""
        return [entity for entity in self.entities if not entity.is_absent(numbers)]

    def __getitem__(self, name: str) -> Entity:
        return self._index[name]

    def __contains__(self, name: object) -> bool:
        return name in self._index

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(entity.name for entity in self.entities)

    def components(self, robot: str) -> list[str]:
        """Return the components of a robot that have slots, in name order."""
        its = self.declared.carried.get(robot, NOTHING)
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
            if self.references:
                hasher.update(struct.pack(f"<{len(self.references)}Q", *self.references))
            self._digest = hasher.digest()
        return self._digest


def build_layout(spec: WorldSpec) -> Layout:
    """Return the layout of a deployment's world, or raise `Malformed`.

    Where models name files (`WorldSpec.robot_files`), their contents must have been given.
    """
    models: dict[str, str] = {}
    lasting: set[str] = set()
    spares = {name for section in (spec.objects, spec.robots) for name, one in section.items() if one.spare}
    for kit in spec.kit_types.values():
        its = spares_of(spec, kit)
        models |= {**kit.entities, **its}
        spares |= its.keys()
        lasting |= kit.entities.keys()
    rule_slots, of_world = _rule_slots(spec)
    if of_world:
        models[WORLD] = WORLD
    models |= {name: one.model for section in (spec.objects, spec.robots) for name, one in section.items()}
    kinds = {name: one.component_type for section in (spec.objects, spec.robots) for name, one in section.items()}
    fields = _fields(spec, {name: kinds.get(name) or _model(model) for name, model in models.items()})
    carried = {name: _carried(spec, name, robot) for name, robot in spec.robots.items()}
    carried |= {name: Carried(of_motion(_model(model)), {}) for name, model in models.items() if name not in carried}
    carried[WORLD] = Carried(of_world, {})
    demanded = {name: found for name, robot in spec.robots.items() if (found := _demanded(robot))}
    switched = frozenset([name for name, robot in spec.robots.items() if switches_of(robot)])
    coming = frozenset(spares), frozenset(lasting), switched
    return Layout(models, Declared(carried, rule_slots, *coming, fields, kinds, demanded))


def switches_of(robot: RobotSettings) -> dict[str, int]:
    """Return the bit of each sensor and actuator of a robot in its slot `inactive`, by name."""
    return {name: 1 << place for place, name in enumerate(sorted({*robot.sensors, *robot.actuators}))}


def spares_of(spec: WorldSpec, kit: Kit) -> Mapping[str, str]:
    """Return the entities of a world's kits that are absent at the start, their models by name."""
    return {} if kit.spares is None else kit.spares(spec.kits[kit.name])


def _fields(spec: WorldSpec, kinds: Mapping[str, Model]) -> dict[str, Mapping[str, int]]:
    """Return the fields of the state of entities whose model has no fixed ones."""
    found: dict[str, Mapping[str, int]] = {}
    for name, kind in kinds.items():
        if kind.declared is None:
            try:
                found[name] = kind.fields_of(spec.settings_of(name), spec)
            except BadValue as bad:
                raise Malformed(f"{name}, {kind.name}: {bad}") from None
    return found


def _model(kind: str) -> Model:
    return WORLD_MODEL if kind == WORLD else registry.find_model(kind)


def _rule_slots(spec: WorldSpec) -> tuple[dict[str, dict[str, int]], dict[str, int]]:
    """Return the slots of a world's rules: for each entity, by its model; and for the world."""
    each: dict[str, dict[str, int]] = {}
    of_world: dict[str, int] = {}
    for label, settings in spec.world_rules.items():
        rule = settings.component_type
        of_world |= _prefixed(label, rule.slots)
        for model, slots in rule.each.items():
            each.setdefault(model, {}).update(_prefixed(label, slots))
    return each, of_world


def of_motion(model: Model) -> dict[str, int]:
    """Return the slots of a model's motion."""
    return {} if model.motion is None else _prefixed(MOTION, model.motion.slots)


@dataclass(frozen=True, slots=True)
class Declaring:
    """A declaration of slots on an entity: its name in messages, its place in the deployment, and its slots by name.

    `is_owners`: the owner writes them instead of the solver.
    """

    what: str
    location: Location
    slots: Mapping[str, int]
    is_owners: bool = False


def declaring(spec: WorldSpec, name: str, robot: RobotSettings) -> Iterator[Declaring]:
    """Yield the declarations of slots on a robot: its motion, its components with their modifiers, and its rules."""
    place: Location = ("robots", name)
    model = robot.component_type
    fields = model.fields_of(robot, spec)
    joints = fields.get("joint_positions", 0)
    yield Declaring("motion", (*place, "model"), of_motion(model))
    for label, actuator in sorted(robot.actuators.items()):
        component = actuator.component_type
        slots = _slots(label, component, actuator, Carrier(0, spec.tick_ns, joints))
        if component.jobs:
            slots |= _prefixed(label, job_slots(spec.senders_to(name)))
        slots |= _slots_of_modifiers(label, actuator.modifiers, numbers_of(component, actuator, fields), spec.tick_ns)
        yield Declaring(f"actuator {label}", (*place, "actuators", label), slots)
    for label, rule in sorted(robot.rules.items()):
        slots = _prefixed(label, rule.component_type.slots_on(fields))
        yield Declaring(f"rule {label}", (*place, "rules", label), slots)
    for label, sensor in sorted(robot.sensors.items()):
        component = sensor.component_type
        period_ns = least_period_ns(spec, component, sensor)
        slots = _slots(label, component, sensor, Carrier(0, period_ns, joints))
        slots |= _slots_of_modifiers(label, sensor.modifiers, numbers_of(component, sensor, fields), period_ns)
        slots[f"{label}.{SAMPLES}"] = 1
        yield Declaring(f"sensor {label}", (*place, "sensors", label), slots, is_owners=True)


def least_period_ns(spec: WorldSpec, sensor: Component, settings: SensorSettings) -> int:
    """Return the least time between two readings: a sensor with a trigger may measure at each tick."""
    return spec.tick_ns if sensor.trigger else spec.schedule(settings).least_ticks * spec.tick_ns


def trigger_slot(robot: Entity, channel: str, field: str) -> str:
    """Return the slot of a robot that triggers a sensor of it: the sensor's own, else the robot's."""
    own = f"{channel}.{field}"
    return own if robot.offsets.get(own, -1) >= robot.split else field


def _demanded(robot: RobotSettings) -> dict[str, int]:
    """Return the fields of a robot that its model has on demand."""
    model: Model = robot.component_type
    if not model.on_demand:
        return {}
    needs = [need for its in (*robot.actuators.values(), *robot.rules.values()) for need in its.component_type.needs]
    for its in robot.sensors.values():
        needs += [*its.component_type.needs, its.component_type.trigger_by(its)]
    return model.demanded(needs)


def _carried(spec: WorldSpec, name: str, robot: RobotSettings) -> Carried:
    """Return the slots of a robot beside those of its model."""
    solver: dict[str, int] = {}
    owner: dict[str, int] = {}
    for one in declaring(spec, name, robot):
        (owner if one.is_owners else solver).update(one.slots)
    return Carried(solver, owner)


def _slots_of_modifiers(
    name: str, modifiers: Sequence[ModifierSettings], numbers: Numbers | None, period_ns: int
) -> dict[str, int]:
    found: dict[str, int] = {}
    for label, settings in zip(modifier_labels(modifiers), modifiers, strict=True):
        assert numbers is not None, "checked with the deployment"
        found |= _slots(f"{name}.{label}", settings.component_type, settings, Carrier(numbers.size, period_ns))
    return found


def _slots(name: str, component: Component, settings: ComponentSettings, carrier: Carrier) -> dict[str, int]:
    return _prefixed(name, component.slots_on(settings, carrier))


def _kept(slots: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return slots with the same objects as counts: in compiled code a count that is taken as an `int` becomes a plain
    number, without its reference."""
    return slots


def _prefixed(name: str, slots: Mapping[str, int]) -> dict[str, int]:
    """Return the slots of a component by their names on an entity."""
    return {f"{name}.{slot}": count for slot, count in _kept(slots).items()}


def modifier_labels(modifiers: Sequence[ModifierSettings]) -> list[str]:
    """Return the names of the modifiers of a component: their kinds, numbered where there are several of one."""
    labels: list[str] = []
    for settings in modifiers:
        kind = label = settings.component_type.name
        number = 1
        while label in labels:
            number += 1
            label = f"{kind}{number}"
        labels.append(label)
    return labels
