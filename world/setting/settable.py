"""What can be set of an entity while a run goes on: its pose, whether a robot is out of service, which of its
components are switched off, what its model and its rules declare; of the world what the rules of the world declare; and
the edits that set it, and that add an entity.

A pose is set as the deployment would place it: the model places it at tick 0, elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import isfinite
from typing import Any, Final, NamedTuple

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from foosim.common.errors import BadValue
from foosim.common.names import nearest_name
from foosim.common.units import PROBABILITY, Quantity
from foosim.world.assembly.world import body_of, entity_rules_of, model_of, rules_of
from foosim.world.components.entities import mounting_of
from foosim.world.components.view import WritableView, called
from foosim.world.edits import Add, Set, write, written
from foosim.world.forms.failures import ContractError
from foosim.world.forms.forms import DOWN, INACTIVE, NO_ENTITY, overrides
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import (
    WORLD,
    Entity,
    Layout,
    switches_of,
)
from foosim.world.placing import At, is_placed, leaning
from foosim.world.scene import Quaternion, Vector
from foosim.world.setting.occupied import occupied_by
from foosim.world.spec import WorldSpec

AT: Final = "at"
ACTIVE: Final = "active"
PLACED: Final = ("position", "orientation", "heading")
STOPPED: Final = ("linear_velocity", "angular_velocity", "base_velocity", "wheel_speeds", "joint_velocities")
"""The fields of a state that are 0 in an entity that was put elsewhere."""
QUARANTINED: Final = "quarantined"
FLAGS: Final = ("0", "1")
"""Shares that need no unit: nothing and all."""
WITH_A_PLACE: Final = frozenset((*PLACED[1:], *STOPPED, QUARANTINED))
"""What is set with a position."""


class Pose(NamedTuple):
    """Where something is put, as models read it in their setting `at`: lengths in m, angles in rad.

    What has a heading stands upright, and reads `yaw`; all others read `orientation`.
    """

    x: float
    y: float
    z: float
    yaw: float
    orientation: Quaternion

    @property
    def position(self) -> Vector:
        """The place (m)."""
        return self.x, self.y, self.z


def settable(spec: WorldSpec, layout: Layout, entity: Entity) -> dict[str, str]:
    """Return the fields of an entity that can be set, and what is valid for each."""
    found: dict[str, str] = {}
    if entity.is_robot:
        found[DOWN] = "true or false"
    if _is_placed(spec, entity):
        found[AT] = "X,Y or X,Y,Z in m, or keys of x, y, z, roll, pitch, yaw"
    if INACTIVE in entity.offsets:
        found |= dict.fromkeys([f"{name}.{ACTIVE}" for name in switches_of(spec.robots[entity.name])], "true or false")
    for label, _, quantities in _declared(spec, layout, entity):
        found |= {_field(label, name): valid(one) for name, one in quantities.items()}
    return found


def valid(quantity: Quantity) -> str:
    """Return in words which values of a quantity can be set."""
    flag = ", or true or false" if quantity.dimension is PROBABILITY else ""
    return f"{quantity.low} to {quantity.high}{flag}"


def _field(label: str, name: str) -> str:
    """Return what the field of a rule of this name is called; that of a model, which has no name, is called so."""
    return f"{label}.{name}" if label else name


def _is_placed(spec: WorldSpec, entity: Entity) -> bool:
    if "position" not in entity.fields:
        return False
    settings = spec.settings_of(entity.name)
    return overrides(entity.kind.factory, "place_at") if settings is None else is_placed(type(settings))


def set_edits(
    spec: WorldSpec,
    layout: Layout,
    numbers: Sequence[float],
    entity: Entity,
    field: str,
    value: object,
    *,
    is_checked: bool = True,
) -> list[Set]:
    """Return the edits that set a field of an entity.

    A pose is completed by that in the numbers of a frame. Raises BadValue for a field that is not settable, a value
    beyond its limits, and, if it `is_checked`, a place that is occupied in that frame; ComponentError for a component
    that raises.
    """
    if field == DOWN and entity.is_robot:
        if not isinstance(value, bool):
            raise BadValue("neither true nor false", value)
        return [Set(entity.name, DOWN, [float(value)])]
    if field == AT and _is_placed(spec, entity):
        edits = _put(spec, layout, numbers, entity, value)
        if is_checked:
            check_place(spec, layout, written(layout, numbers, edits), entity)
        return edits
    label, _, name = field.rpartition(".")
    if name == ACTIVE and INACTIVE in entity.offsets and label in (bits := switches_of(spec.robots[entity.name])):
        if not isinstance(value, bool):
            raise BadValue("neither true nor false", value)
        others = int(numbers[entity.offsets[INACTIVE]]) & ~bits[label]
        return [Set(entity.name, INACTIVE, [float(others if value else others | bits[label])])]
    found = [(made, its[name]) for one, made, its in _declared(spec, layout, entity) if one == label and name in its]
    if not found:
        fields = settable(spec, layout, entity)
        there = f"there are: {', '.join(fields) or 'none'}"
        raise BadValue(f"no field of {entity.name} that can be set ({there})", field, nearest_name(field, fields))
    made, quantity = found[0]
    number = _number(quantity, value)
    what = label or f"model {entity.model}"
    return called(what, entity.name, 0, _of_component, entity, label, made.set, name, number)


def _number(quantity: Quantity, value: object) -> float:
    """Return the number of a value, of a share 1 for true and 0 for false. Raises BadValue."""
    if quantity.dimension is PROBABILITY and (isinstance(value, bool) or value in FLAGS):
        return float(value)
    try:
        return float(quantity.read(value))
    except PydanticCustomError as error:
        raise BadValue(str(error), value) from None


def _of_component(
    entity: Entity, label: str, ask: Callable[[str, float], Mapping[str, Sequence[float]]], name: str, number: float
) -> list[Set]:
    """Return what a component says that its slots become: its own, else those that are fields of the entity."""
    found = []
    for slot, numbers in ask(name, number).items():
        field = _field(label, slot) if _field(label, slot) in entity.offsets else slot
        if entity.counts.get(field) != len(numbers) or not all(map(isfinite, numbers)):
            raise ContractError(ask, "finite numbers by slot, as many as each has", {slot: numbers})
        found.append(Set(entity.name, field, [*map(float, numbers)]))
    return found


def _declared(spec: WorldSpec, layout: Layout, entity: Entity) -> Iterator[tuple[str, Any, Mapping[str, Quantity]]]:
    """Yield what has something that can be set: the model, without a name, and the rules; each with what that is."""
    if entity.name == WORLD:
        settings = spec.world_rules
        yield from (
            (label, made, settings[label].component_type.settable) for label, made in rules_of(spec, layout).items()
        )
        return
    if entity.kind.settable:
        yield "", model_of(spec, layout, entity), entity.kind.settable
    for label, rule in () if not entity.is_robot else entity_rules_of(spec, layout, entity):
        yield label, rule, spec.robots[entity.name].rules[label].component_type.settable


def _put(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity, value: object) -> list[Set]:
    """Return the edits that put an entity elsewhere, at rest and out of quarantine."""
    placed = [0.0] * layout.size
    _place(spec, layout, entity, _completed(spec, layout, numbers, entity, value), WritableView(0, placed))
    edits = []
    for field, count in entity.fields.items():
        at = entity.offsets[field]
        if field in PLACED or field in STOPPED:
            edits.append(Set(entity.name, field, placed[at : at + count] if field in PLACED else [0.0] * count))
    if numbers[entity.offsets[QUARANTINED]] != 0.0:
        edits.append(Set(entity.name, QUARANTINED, [0.0]))
    return edits


def _place(spec: WorldSpec, layout: Layout, entity: Entity, pose: Pose, view: WritableView) -> None:
    """Write the state of an entity that starts with a pose. What has no settings is put by its model's `place_at`."""
    what, at = f"model {entity.model}", mounting_of(spec, layout, entity)
    if spec.settings_of(entity.name) is not None:
        made: Any = called(what, entity.name, 0, entity.kind.factory, _elsewhere(spec, entity, pose), at)
        called(what, entity.name, 0, made.place, view)
        return
    made = called(what, entity.name, 0, entity.kind.factory, None, at)
    made.check_place(pose.position)
    called(what, entity.name, 0, made.place_at, view, pose.position)


def add_edit(
    spec: WorldSpec,
    layout: Layout,
    numbers: Sequence[float],
    entity: Entity,
    place: object = None,
    *,
    is_checked: bool = True,
) -> Add:
    """Return the edit that adds an absent entity, as it would be at tick 0; `place` is where, if not there.

    Rules of the world remember nothing of it. It raises as `set_edits` does.
    """
    after, start = [*numbers], entity.start
    after[start : entity.stop] = [0.0] * (entity.stop - start)
    for at in layout.references:
        if start <= at < entity.stop:
            after[at] = NO_ENTITY
    view = WritableView(0, after)
    called(f"model {entity.model}", entity.name, 0, model_of(spec, layout, entity).place, view)
    if place is not None:
        if not _is_placed(spec, entity):
            raise BadValue(f"{entity.name} has no place that can be chosen: it starts where its {entity.model} does")
        for edit in _put(spec, layout, after, entity, place):
            write(layout, after, edit)
    for label, rule in entity_rules_of(spec, layout, entity) if entity.is_robot else ():
        called(f"rule {label}", entity.name, 0, rule.place, view)
    if is_checked:
        check_place(spec, layout, after, entity)
    return Add(entity.name, after[start : entity.stop])


def check_place(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity) -> None:
    """Raise BadValue where an entity is in something in a frame of these numbers, or beyond the bounds of its model."""
    at = entity.offsets["position"]
    where = ", ".join(f"{number:g} m" for number in numbers[at : at + 3])
    if not model_of(spec, layout, entity).is_plausible(numbers, numbers):
        raise BadValue(f"a place beyond the bounds of the world: {entity.name} would be quarantined there", where)
    if what := occupied_by(spec, layout, numbers, entity):
        raise BadValue(f"a place that is occupied: {entity.name} would be in {what}", where)


def _elsewhere(spec: WorldSpec, entity: Entity, pose: Pose) -> Any:
    """Return the settings of an entity with another place."""
    settings = spec.settings_of(entity.name)
    assert settings is not None, "what has no settings has no place of its own"
    if AT in type(settings).model_fields:
        return settings.model_copy(update={AT: pose})
    return settings.model_copy(update={"x": pose.x, "y": pose.y, "heading": pose.yaw})


def _completed(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity, value: object) -> Pose:
    """Return the pose that is asked for: what it does not say is as in the numbers of a frame.

    Without an angle the entity keeps its orientation, with one the angles that are not said are 0.
    """
    keys = read_place(value) if isinstance(value, str) else value
    if not isinstance(keys, dict) or not keys or not keys.keys() <= At.model_fields.keys():
        raise BadValue("no place: valid are X,Y or X,Y,Z, or some of x, y, z, roll, pitch, yaw", value)
    try:
        asked = At.model_validate(keys)
    except ValidationError as error:
        first = error.errors()[0]
        raise BadValue(".".join(map(str, first["loc"])) + f": {first['msg']}", first["input"]) from None
    if entity.kind.motion and (problem := leaning(asked)) is not None:
        raise problem
    position, orientation = _frame_of(spec, layout, numbers, entity)
    x, y, z = (getattr(asked, key) if key in keys else was for key, was in zip("xyz", position, strict=True))
    if {"roll", "pitch", "yaw"}.isdisjoint(keys):
        yaw = numbers[entity.offsets["heading"]] if "heading" in entity.offsets else 0.0
        return Pose(x, y, z, yaw, orientation)
    return Pose(x, y, z, asked.yaw, asked.orientation)


def read_place(text: str) -> dict[str, str]:
    """Return the x, y and maybe z of `X,Y` or `X,Y,Z`, in m where no unit is given. Raises BadValue."""
    parts = [part.strip() for part in text.split(",")]
    if not 2 <= len(parts) <= 3:
        raise BadValue("no place: valid are X,Y or X,Y,Z", text)
    lengths = [f"{part} m" if part[-1:].isdigit() or part[-1:] == "." else part for part in parts]
    return dict(zip("xyz", lengths, strict=False))


def _frame_of(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity) -> tuple[Vector, Quaternion]:
    """Return the pose of what the setting `at` of an entity is the pose of."""
    if entity.is_rigid:
        _, position, orientation = forward_kinematics(body_of(spec, layout, entity), entity, numbers)[0]
        return position, orientation
    at, turned = entity.offsets["position"], entity.offsets["orientation"]
    x, y, z = numbers[at : at + 3]
    a, b, c, d = numbers[turned : turned + 4]
    return (x, y, z), (a, b, c, d)
