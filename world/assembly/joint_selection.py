"""Settings of components with the names of the joints that they select: resolved once, when a world has its files.

Until then a setting may have patterns, or nothing, which stands for all joints.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

from foosim.common.errors import Refused
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.entities import mounting_of
from foosim.world.components.joint_names import joint_indices
from foosim.world.components.view import called
from foosim.world.layout import build_layout
from foosim.world.scene import Body
from foosim.world.spec import WorldSpec

Spec = TypeVar("Spec", bound=WorldSpec)
Selection = tuple[Sequence[str], Sequence[tuple[str, str]]]
SECTIONS = ("sensors", "actuators")


def with_joint_names(spec: Spec) -> Spec:
    """Return a world whose components name each joint that they select, in the order of their numbers.

    A setting that selects none, and those of a world or a model that is invalid, stay as they are: checks refuse them.
    """
    bare = {name: robot for name, robot in spec.robots.items() if _selecting(robot)}
    if not bare:
        return spec
    from foosim.world.components.mounted import body_at  # brings numpy

    # The slots of these components follow from the joints, so the bodies are those of a world without them.
    without = {name: robot.model_copy(update=_without(robot)) for name, robot in bare.items()}
    world = spec.model_copy(update={"robots": {**spec.robots, **without}})
    try:
        layout = build_layout(world)
        bodies = {
            name: called(f"model {robot.model}", name, 0, body_at, mounting_of(world, layout, layout[name]))
            for name, robot in bare.items()
        }
    except Refused:
        return spec
    known: dict[tuple[int, tuple[str, ...]], Any] = {}
    named = {name: _named(robot, bodies[name], known) for name, robot in bare.items()}
    return spec.model_copy(update={"robots": {**spec.robots, **named}})


def selections(spec: WorldSpec) -> list[Selection]:
    """Return the names that components of robots from files select, for a process without the files: names in their
    order, with the (robot, component) pairs that select these."""
    found: dict[tuple[str, ...], list[tuple[str, str]]] = {}
    for name, robot in spec.robots.items():
        for section in SECTIONS if robot.asset_paths({}) else ():
            for label, its in sorted(getattr(robot, section).items()):
                if its.component_type.joints and (named := its.component_type.joints_named(its)):
                    found.setdefault(tuple(named), []).append((name, label))
    return [*found.items()]


def with_selections(spec: Spec, chosen: Iterable[Selection]) -> Spec:
    """Return a world without files whose components select the joints of `selections`; unknown ones are ignored."""
    names = {pair: [*named] for named, pairs in chosen for pair in pairs}
    robots = dict(spec.robots)
    for name in dict.fromkeys(robot for robot, _ in names if robot in robots):
        sections = {section: dict(getattr(robots[name], section)) for section in SECTIONS}
        for its in sections.values():
            for label, settings in its.items():
                component = settings.component_type
                if component.joints and (name, label) in names:
                    its[label] = settings.model_copy(update={component.joints: names[name, label]})
        robots[name] = robots[name].model_copy(update=sections)
    return spec.model_copy(update={"robots": robots}) if names else spec


def _selecting(robot: RobotSettings) -> bool:
    return any(its.component_type.joints for section in SECTIONS for its in getattr(robot, section).values())


def _without(robot: RobotSettings) -> dict[str, Any]:
    """Return the sensors and actuators of a robot that select no joints."""
    return {
        section: {label: its for label, its in getattr(robot, section).items() if not its.component_type.joints}
        for section in SECTIONS
    }


def _named(robot: RobotSettings, body: Body, known: dict[tuple[int, tuple[str, ...]], Any]) -> RobotSettings:
    """Return a robot's settings with the names of joints; equal ones of several robots are one object."""
    sections: Mapping[str, dict[str, Any]] = {section: dict(getattr(robot, section)) for section in SECTIONS}
    for its in sections.values():
        for label, settings in its.items():
            component = settings.component_type
            if not component.joints:
                continue
            try:
                has_motors = component.type_name == "actuator"
                written = component.joints_named(settings)
                selected = joint_indices(body, written, component.joints, has_motors=has_motors)
            except Refused:
                continue
            names = tuple([body.joint_names[number] for number in selected])
            if written is None or tuple(written) != names:
                key = id(settings), names
                its[label] = known.setdefault(key, settings.model_copy(update={component.joints: [*names]}))
    return robot.model_copy(update=sections)
