"""What can be set of an entity while a run goes on: its pose, whether a robot is out of service, what its rules
declare; and the edits that set it.

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
from foosim.common.units import Quantity
from foosim.world.assembly.world import body_of, entity_rules_of
from foosim.world.components.entities import mounting_of
from foosim.world.components.view import WritableView, called
from foosim.world.edits import Set, written
from foosim.world.forms.failures import WrongResult
from foosim.world.forms.forms import DOWN
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity, Layout, find_entity_rule
from foosim.world.parameters.vehicles import leaning
from foosim.world.placing import At, is_placed
from foosim.world.scene import Quaternion, Vector
from foosim.world.setting.occupied import occupied_by
from foosim.world.spec import WorldSpec

AT: Final = "at"
PLACED: Final = ("position", "orientation", "heading")
STOPPED: Final = ("linear_velocity", "angular_velocity", "base_velocity", "wheel_speeds", "joint_velocities")
"""The fields of a state that are 0 in an entity that was put elsewhere."""
QUARANTINED: Final = "quarantined"
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
    for label, _, quantities in _declared(spec, layout, entity):
        found |= {f"{label}.{name}": f"{one.low} to {one.high}" for name, one in quantities.items()}
    return found


def _is_placed(spec: WorldSpec, entity: Entity) -> bool:
    settings = spec.settings_of(entity.name)
    return "position" in entity.fields and settings is not None and is_placed(type(settings))


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
            _check_place(spec, layout, numbers, entity, edits)
        return edits
    label, _, name = field.partition(".")
    found = [(made, its[name]) for one, made, its in _declared(spec, layout, entity) if one == label and name in its]
    if not found:
        fields = settable(spec, layout, entity)
        there = f"settable are {', '.join(fields)}" if fields else "nothing is"
        raise BadValue(f"not settable on {entity.name}: {there}", field, nearest_name(field, fields))
    made, quantity = found[0]
    try:
        number = float(quantity.read(value))
    except PydanticCustomError as error:
        raise BadValue(str(error), value) from None
    if not hasattr(made, "set"):
        return [Set(entity.name, field, [number])]
    return called(label, entity.name, 0, _of_component, entity, label, made.set, name, number)


def _of_component(
    entity: Entity, label: str, ask: Callable[[str, float], Mapping[str, Sequence[float]]], name: str, number: float
) -> list[Set]:
    """Return what a component says that its slots become: its own, else those that are fields of the entity."""
    found = []
    for slot, numbers in ask(name, number).items():
        field = f"{label}.{slot}" if f"{label}.{slot}" in entity.offsets else slot
        if entity.counts.get(field) != len(numbers) or not all(map(isfinite, numbers)):
            raise WrongResult(ask, "finite numbers by slot, as many as each has,", {slot: numbers})
        found.append(Set(entity.name, field, [*map(float, numbers)]))
    return found


def _declared(spec: WorldSpec, layout: Layout, entity: Entity) -> Iterator[tuple[str, Any, Mapping[str, Quantity]]]:
    """Yield the rules of a robot: name, rule, and what can be set of it."""
    if not entity.is_robot:
        return
    for label, rule in entity_rules_of(spec, layout, entity):
        yield label, rule, find_entity_rule(spec.robots[entity.name].rules[label]).settable


def _put(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity, value: object) -> list[Set]:
    """Return the edits that put an entity elsewhere, at rest and out of quarantine."""
    settings = _elsewhere(spec, entity, _completed(spec, layout, numbers, entity, value))
    placed = [0.0] * layout.size
    what = f"model {entity.model}"
    made: Any = called(what, entity.name, 0, entity.kind.made, settings, mounting_of(spec, layout, entity))
    called(what, entity.name, 0, made.place, WritableView(0, placed))
    edits = []
    for field, count in entity.fields.items():
        at = entity.offsets[field]
        if field in PLACED or field in STOPPED:
            edits.append(Set(entity.name, field, placed[at : at + count] if field in PLACED else [0.0] * count))
    if numbers[entity.offsets[QUARANTINED]] != 0.0:
        edits.append(Set(entity.name, QUARANTINED, [0.0]))
    return edits


def _check_place(
    spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity, edits: Sequence[Set]
) -> None:
    """Raise BadValue where edits put an entity into something."""
    after = written(layout, numbers, edits)
    what = occupied_by(spec, layout, after, entity)
    if what:
        at = entity.offsets["position"]
        x, y, z = after[at : at + 3]
        raise BadValue(f"a place that is occupied: {entity.name} would be in {what}", f"{x:g} m, {y:g} m, {z:g} m")


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
    keys = dict(zip("xyz", _lengths(value), strict=False)) if isinstance(value, str) else value
    if not isinstance(keys, dict) or not keys:
        raise BadValue("no place: valid are X,Y or X,Y,Z, or some of x, y, z, roll, pitch, yaw", value)
    try:
        asked = At.model_validate(keys)
    except ValidationError as error:
        first = error.errors()[0]
        raise BadValue(".".join(map(str, first["loc"])) + f": {first['msg']}", value) from None
    if entity.kind.motion and (problem := leaning(asked)) is not None:
        raise problem
    position, orientation = _frame_of(spec, layout, numbers, entity)
    x, y, z = (getattr(asked, key) if key in keys else was for key, was in zip("xyz", position, strict=True))
    if {"roll", "pitch", "yaw"}.isdisjoint(keys):
        yaw = numbers[entity.offsets["heading"]] if "heading" in entity.offsets else 0.0
        return Pose(x, y, z, yaw, orientation)
    return Pose(x, y, z, asked.yaw, asked.orientation)


def _lengths(text: str) -> list[str]:
    parts = [part.strip() for part in text.split(",")]
    if not 2 <= len(parts) <= 3:
        raise BadValue("no place: valid are X,Y or X,Y,Z", text)
    return [f"{part} m" if part[-1:].isdigit() or part[-1:] == "." else part for part in parts]


def _frame_of(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity) -> tuple[Vector, Quaternion]:
    """Return the pose of what the setting `at` of an entity is the pose of."""
    if entity.is_rigid:
        _, position, orientation = forward_kinematics(body_of(spec, layout, entity), entity, numbers)[0]
        return position, orientation
    at, turned = entity.offsets["position"], entity.offsets["orientation"]
    x, y, z = numbers[at : at + 3]
    a, b, c, d = numbers[turned : turned + 4]
    return (x, y, z), (a, b, c, d)
