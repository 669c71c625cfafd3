"""A tick of the forms of other packages, tried when a deployment is loaded: what cannot work is a problem of the file.

Objects are made for the trial and thrown away, and the numbers are copies: a form without a memory of its own does not
notice. What a form returns is checked where a run checks it; here is what a run only reads later, or never. Worlds of
foosim's own forms are not tried: tests do that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import isfinite
from typing import Any, Final

import numpy as np

from foosim.common.errors import ABSENT
from foosim.common.finding import Finding, Location
from foosim.common.json_text import encode_json
from foosim.world.assembly.world import (
    NO_STATUS,
    NO_TEXT,
    World,
    are_motors,
    initial_numbers,
    models_of,
    world_status,
    world_texts,
)
from foosim.world.components.entities import Model
from foosim.world.components.fitted import FittedActuator, FittedSensor, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import ComponentError, SensingView, WritableView, called
from foosim.world.components.watching import ReadOnly
from foosim.world.forms.failures import WrongResult, failure_of
from foosim.world.frame import Frame
from foosim.world.layout import WORLD, Entity, Layout, build_layout
from foosim.world.scene import Body, Shape
from foosim.world.spec import WorldSpec

TICK: Final = 1


def trial_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield why the first of a world's forms that cannot work cannot, at its place in the deployment."""
    try:
        layout = build_layout(spec)
        _try_sections(spec)
        world, numbers = _try_entities(spec, layout)
        _try_tick(world, layout, numbers)
        _try_status(spec, layout, numbers)
    except KeyboardInterrupt:
        raise
    except ComponentError as error:
        place = _place_of(spec, error)
        yield Finding(place, str(error), place[-1] if place else ABSENT, at="key" if place else "value")
    except BaseException as error:  # noqa: BLE001  # other people's code may raise anything: SystemExit, too
        yield Finding((), f"the trial of the forms fails: {failure_of(error)}", ABSENT)


def _place_of(spec: WorldSpec, error: ComponentError) -> Location:
    """Return where a deployment has the form that failed; nothing where it does not name it."""
    kind, _, name = error.component.partition(" ")
    if kind in ("kit", "scene"):
        return (name,) if kind == "kit" else ("scene",)
    if error.entity == WORLD and name in spec.rules:
        return "rules", name
    if error.entity not in spec.robots:
        return ("objects", error.entity) if error.entity in spec.objects else ()
    robot, channel = spec.robots[error.entity], name.rpartition(" of ")[2]  # of a modifier, that of its component
    section = {"sensor": "sensors", "actuator": "actuators", "rule": "rules"}.get(kind, "")
    if kind == "modifier":
        section = "sensors" if channel in robot.sensors else "actuators"
    return ("robots", error.entity, section, channel) if section else ("robots", error.entity)


def _try_sections(spec: WorldSpec) -> None:
    """Make scene and kits, and ask for all that they have."""
    if spec.scene is not None:
        made = spec.scene.component_type.made
        called(f"scene {spec.scene.kind}", "", 0, lambda scene: _check_shapes(made, made(scene)), spec.scene)
    for name, section in sorted(spec.kits.items()):
        called(f"kit {name}", "", 0, _try_kit, spec.kit_types[name].made, section, spec)


def _try_kit(made: Any, section: Any, spec: WorldSpec) -> None:
    kit = made(section, spec)
    _check_shapes(kit.shapes, kit.shapes())
    kit.physics()
    for finding in kit.findings():
        _need(isinstance(finding, Finding), kit.findings, "a Finding", finding)


def _try_entities(spec: WorldSpec, layout: Layout) -> tuple[World, list[float]]:
    """Make all entities, place them, measure, alone and together, ask for limits and motors; return what was made.

    Motions are made of bodies, so these come first.
    """
    for index, model in models_of(spec, layout).items():
        entity = layout.entities[index]
        called(f"model {entity.model}", entity.name, 0, _check_body, model, entity)
    world = World(spec, layout, is_watched=True)
    numbers = initial_numbers(spec, layout, world.models, is_watched=True)
    sensors = [sensor for robot in layout.robots for sensor in sensors_of(spec, layout, robot)]
    for sensor in sensors:
        _check_readings([sensor], numbers)
    _check_readings(sensors, numbers)
    for index, actuators in world.actuators.items():
        for one in actuators:
            what = f"actuator {one.channel}"
            called(what, one.robot, TICK, _check_actuator, one, layout.entities[index], numbers)
    return world, numbers


def _try_tick(world: World, layout: Layout, start: list[float]) -> None:
    """Let rules and motions do what they do in a tick."""
    before = start.copy()
    world.apply_rules(before, TICK)
    numbers = before.copy()
    moved = [entity for entity in layout.entities if entity.is_solved]
    world.move(moved, before, numbers, TICK)
    world.apply_entity_rules(moved, before, numbers, TICK)
    for entity in moved:
        world.problem(entity, numbers, before, TICK)
    for entity in layout.entities:
        values = numbers[entity.start : entity.stop]
        assert all(map(isfinite, values)), f"{entity.name} is {values} after a tick"


def _try_status(spec: WorldSpec, layout: Layout, numbers: list[float]) -> None:
    """Show what rules and kits show."""
    status = world_status(spec, Frame(TICK, layout, np.array(numbers)))
    called("status", "", TICK, encode_json, status)
    for text in world_texts(spec, status):
        assert not text.startswith((NO_STATUS, NO_TEXT)), text


# --- what a run does not check ---------------------------------------------------------------------------------------


def _need(is_met: bool, method: Callable[..., Any], what: str, value: object) -> None:
    if not is_met:
        raise WrongResult(method, what, value)


def _check_shapes(method: Callable[..., Any], shapes: Any) -> None:
    _need(isinstance(shapes, tuple | list), method, "a tuple of shapes", shapes)
    for shape in shapes:
        _need(isinstance(shape, Shape), method, "a Shape", shape)
        for what, values, count in (
            ("colour", shape.colour, 4),
            ("position", shape.position, 3),
            ("orientation", shape.orientation, 4),
        ):
            is_met = isinstance(values, tuple | list) and len(values) == count
            is_met = is_met and all(isinstance(one, float | int) and isfinite(one) for one in values)
            _need(is_met, method, f"a {what} of {count} numbers", values)
        sizes = [getattr(shape.geometry, name, None) for name in ("radius", "length")]
        sizes += getattr(shape.geometry, "half", ())
        is_met = all(size is None or (isfinite(size) and size > 0) for size in sizes)
        _need(is_met, method, "a size above 0", shape.geometry)


def _check_body(model: Model, entity: Entity) -> None:
    method = model.body
    body = method()
    if body is None:
        return
    _need(isinstance(body, Body), method, "a Body, or None,", body)
    _need(bool(body.links), method, "a body with links", body)
    if body.is_free and not {"position", "orientation"} <= {*entity.offsets}:
        raise WrongResult(method, "a body that is not free, of a model without position or orientation", body)
    for link in body.links:
        _check_shapes(method, link.shapes)


def _check_readings(sensors: Sequence[FittedSensor], numbers: Sequence[float]) -> None:
    view = SensingView(TICK, ReadOnly(numbers), np.array(numbers))
    view.values.setflags(write=False)
    for one, payload in zip(sensors, Sensing().sample(sensors, view), strict=True):
        if payload is not None:
            called(f"sensor {one.channel}", one.robot, TICK, one.codec.decode, payload)


def _check_actuator(one: FittedActuator, entity: Entity, numbers: Sequence[float]) -> None:
    made, view = one.actuator, WritableView(TICK, list(numbers))
    made.limits()
    made.hold(view)
    motors = made.command(view)
    count = None
    if entity.is_rigid and one.moves:
        count = entity.counts.get("joint_positions") if one.joints is None else len(one.joints)
    _need(are_motors(motors, count), made.command, "a tuple of (target, greatest force)", motors)
    made.stir(view)
