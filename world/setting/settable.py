"""Fields of an entity that can be set during a run: its pose, whether a robot is out of service, its switched-off
components, the declared fields of its model and rules, and those of the world's rules; the edits that set them, and
that add an entity.

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
from foosim.world.component_types.descriptions import DOWN, INACTIVE, NO_ENTITY, overrides
from foosim.world.component_types.failures import ContractError
from foosim.world.components.entities import mounting_of
from foosim.world.components.view import WritableView, called
from foosim.world.edits import Add, Set, write, written
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
"""The texts of the shares 0 and 1."""
WITH_A_PLACE: Final = frozenset((*PLACED[1:], *STOPPED, QUARANTINED))
"""The fields that are set with a position."""


class Pose(NamedTuple):
    """A pose of an entity, as models read it in their setting `at`: lengths in m, angles in rad.

    Models with a heading are upright, and read `yaw`; all others read `orientation`.
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
    """Return the fields of an entity that can be set, and the valid values of each."""
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
    """Return in words the values of a quantity that can be set."""
    flag = ", or true or false" if quantity.dimension is PROBABILITY else ""
    return f"{quantity.low} to {quantity.high}{flag}"


def _field(label: str, name: str) -> str:
    """Return the full name of a field of a rule, or of a model, whose label is empty."""
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

    A pose is completed by that in the numbers of a frame. Raises BadValue for a field that cannot be set, a value
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
    entity: Entity, label: str, change: Callable[[str, float], Mapping[str, Sequence[float]]], name: str, number: float
) -> list[Set]:
    """Return the edits of a component's slots for a value: its own slots, else fields of the entity."""
    found = []
    for slot, numbers in change(name, number).items():
        field = _field(label, slot) if _field(label, slot) in entity.offsets else slot
        if entity.counts.get(field) != len(numbers) or not all(map(isfinite, numbers)):
            raise ContractError(change, "finite numbers by slot, as many as each has", {slot: numbers})
        found.append(Set(entity.name, field, [*map(float, numbers)]))
    return found


def _declared(spec: WorldSpec, layout: Layout, entity: Entity) -> Iterator[tuple[str, Any, Mapping[str, Quantity]]]:
    """Yield the model, without a name, and the rules with fields that can be set; each with these fields."""
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
    """Write the state of an entity that starts with a pose. Without settings the model's `place_at` puts it."""
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
    """Return the edit that adds an absent entity, as at tick 0, or at `place`.

    Slots of the world's rules for it begin anew. It raises as `set_edits`.
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
    """Raise BadValue where an entity overlaps a thing in a frame of these numbers, or is beyond its model's bounds."""
    at = entity.offsets["position"]
    where = ", ".join(f"{number:g} m" for number in numbers[at : at + 3])
    if not model_of(spec, layout, entity).is_plausible(numbers, numbers):
        raise BadValue(f"a place beyond the bounds of the world: {entity.name} would be quarantined there", where)
    if what := occupied_by(spec, layout, numbers, entity):
        raise BadValue(f"a place that is occupied: {entity.name} would be in {what}", where)


def _elsewhere(spec: WorldSpec, entity: Entity, pose: Pose) -> Any:
    """Return the settings of an entity with another place."""
    settings = spec.settings_of(entity.name)
    assert settings is not None, "an entity without settings has no place of its own"
    if AT in type(settings).model_fields:
        return settings.model_copy(update={AT: pose})
    return settings.model_copy(update={"x": pose.x, "y": pose.y, "heading": pose.yaw})


def _completed(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity, value: object) -> Pose:
    """Return the requested pose, with missing coordinates from the numbers of a frame.

    Without an angle the entity keeps its orientation, with one the missing angles are 0.
    """
    keys = read_place(value) if isinstance(value, str) else value
    if not isinstance(keys, dict) or not keys or not keys.keys() <= At.model_fields.keys():
        raise BadValue("no place: valid are X,Y or X,Y,Z, or some of x, y, z, roll, pitch, yaw", value)
    try:
        requested = At.model_validate(keys)
    except ValidationError as error:
        first = error.errors()[0]
        raise BadValue(".".join(map(str, first["loc"])) + f": {first['msg']}", first["input"]) from None
    if entity.kind.motion and (problem := leaning(requested)) is not None:
        raise problem
    position, orientation = _frame_of(spec, layout, numbers, entity)
    x, y, z = (getattr(requested, key) if key in keys else was for key, was in zip("xyz", position, strict=True))
    if {"roll", "pitch", "yaw"}.isdisjoint(keys):
        yaw = numbers[entity.offsets["heading"]] if "heading" in entity.offsets else 0.0
        return Pose(x, y, z, yaw, orientation)
    return Pose(x, y, z, requested.yaw, requested.orientation)


def read_place(text: str) -> dict[str, str]:
    """Return the x, y and maybe z of `X,Y` or `X,Y,Z`, in m where no unit is given. Raises BadValue."""
    parts = [part.strip() for part in text.split(",")]
    if not 2 <= len(parts) <= 3:
        raise BadValue("no place: valid are X,Y or X,Y,Z", text)
    lengths = [f"{part} m" if part[-1:].isdigit() or part[-1:] == "." else part for part in parts]
    return dict(zip("xyz", lengths, strict=False))


def _frame_of(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity) -> tuple[Vector, Quaternion]:
    """Return the pose in a frame of the part that the setting `at` of an entity places."""
    if entity.is_rigid:
        _, position, orientation = forward_kinematics(body_of(spec, layout, entity), entity, numbers)[0]
        return position, orientation
    at, turned = entity.offsets["position"], entity.offsets["orientation"]
    x, y, z = numbers[at : at + 3]
    a, b, c, d = numbers[turned : turned + 4]
    return (x, y, z), (a, b, c, d)
