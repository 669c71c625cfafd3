"""A trial tick of components of other packages when a deployment is loaded: an exception is a problem of the file.

Objects are built for the trial and dropped, and the numbers are copies. Returned values are checked where a run checks
them. Worlds of foosim's own components have no trial: tests do that.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np

from foosim.common.errors import ABSENT
from foosim.common.finding import Finding, Location
from foosim.common.json_text import encode_json
from foosim.world.assembly.world import (
    NO_TEXT,
    World,
    build_scene,
    initial_numbers,
    status_of,
    with_status,
    world_status,
    world_texts,
)
from foosim.world.component_types.failures import failure_of
from foosim.world.components.fitted import BoundActuator, BoundSensor, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import ComponentError, SensingView, View, WritableView, called
from foosim.world.components.watching import ReadOnly
from foosim.world.fixed_scenery import scene_shapes
from foosim.world.frame import Frame
from foosim.world.layout import WORLD, Layout, build_layout
from foosim.world.scenery import SceneryMesh
from foosim.world.spec import WorldSpec

TICK: Final = 1


def trial_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield the error of the first of a world's components that fails, at its place in the deployment."""
    try:
        _try_tick(spec, build_layout(spec))
    except KeyboardInterrupt:
        raise
    except ComponentError as error:
        place = _place_of(spec, error)
        yield Finding(place, str(error), place[-1] if place else ABSENT, at="key" if place else "value")
    except BaseException as error:  # noqa: BLE001  # user code may raise anything: SystemExit, too
        yield Finding((), f"the trial of the components fails: {failure_of(error)}", ABSENT)


def _place_of(spec: WorldSpec, error: ComponentError) -> Location:
    """Return the place of the component that failed in the deployment; empty where the deployment does not name it."""
    kind, _, name = error.component.partition(" ")
    if kind in ("kit", "scene"):
        return (name,) if kind == "kit" else ("scene",)
    if error.entity == WORLD and name in spec.rules:
        return "rules", name
    if error.entity not in spec.robots:
        return ("objects", error.entity) if error.entity in spec.objects else ()
    robot, channel = (
        spec.robots[error.entity],
        name.rpartition(" of ")[2].partition(".")[0],
    )  # of a modifier: its component's
    section = {"sensor": "sensors", "actuator": "actuators", "rule": "rules"}.get(kind, "")
    if kind == "modifier":
        section = "sensors" if channel in robot.sensors else "actuators"
    return ("robots", error.entity, section, channel) if section else ("robots", error.entity)


def _try_tick(spec: WorldSpec, layout: Layout) -> None:
    """Build all components and call the methods that a run calls in a tick, bodies first: motions need them."""
    if spec.scene is not None:
        called(f"scene {spec.scene.kind}", "", 0, scene_shapes, spec)
    for name, section in sorted(spec.kits.items()):
        called(f"kit {name}", "", 0, _try_kit, spec.kit_types[name].factory, section, spec)
    meshes = [name for name, thing in spec.scenery.items() if isinstance(thing, SceneryMesh)]
    if all(spec.mesh_of(name) is not None for name in meshes):  # their files come after the text
        build_scene(spec, layout)
    world = World(spec, layout, is_guarded=True)
    start = initial_numbers(spec, layout, world.models, is_guarded=True)
    sensors = [sensor for robot in layout.robots for sensor in sensors_of(spec, layout, robot)]
    for some in (*([sensor] for sensor in sensors), sensors):
        _sample(some, start)
    for one in (one for its in world.actuators.values() for one in its):
        called(f"actuator {one.channel}", one.robot, TICK, _command, one, list(start))
    before = start.copy()
    world.apply_rules(before, TICK)
    numbers = before.copy()
    moved = [entity for entity in layout.entities if entity.is_solved]
    drives = View(TICK, before)
    world.check_motors(moved, world.motors(moved, drives), TICK)
    world.move(moved, before, numbers, TICK)
    world.apply_entity_rules(moved, before, numbers, TICK)
    for entity in moved:
        world.problem(entity, numbers, before, TICK)
    frame = Frame(TICK, layout, np.array(numbers))
    for what, one, seen in with_status(spec, frame):
        called(what, WORLD, TICK, status_of, one, seen)
    status = world_status(spec, frame)
    called("status", "", TICK, encode_json, status)
    for text in world_texts(spec, status):
        assert not text.startswith(NO_TEXT), text


def _try_kit(factory: Any, section: Any, spec: WorldSpec) -> None:
    kit = factory(section, spec)
    kit.physics()
    for _ in (*kit.shapes(), *kit.findings()):
        pass


def _sample(sensors: Sequence[BoundSensor], numbers: Sequence[float]) -> None:
    view = SensingView(TICK, ReadOnly(numbers), np.array(numbers))
    view.values.setflags(write=False)
    Sensing().sample(sensors, view)


def _command(one: BoundActuator, numbers: list[float]) -> None:
    view = WritableView(TICK, numbers)
    one.actuator.hold(view)
    one.actuator.excite(view)
