"""Descriptions of a robot from a URDF file, as text and as JSON: its tree, and its entry in a deployment."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf
from typing import Any

from foosim.common.names import is_robot_name
from foosim.world.bodies.urdf import Robot, free_base_problem
from foosim.world.scene import MOVING, Box, Capsule, Cylinder, Hull, Link, Shape, Sphere

MOST_DIGITS = 6
WHEELS_MIN = 2
"""One joint that turns without end may be the last one of an arm."""


def as_json(robot: Robot) -> dict[str, Any]:
    """Return the description of a robot as JSON, in SI units; a missing bound is null."""
    return {
        "file": robot.file,
        "name": robot.name,
        "mass": robot.mass,
        "moving": list(robot.moving),
        "links": [_link_json(robot, number) for number in range(len(robot.links))],
        "notes": list(robot.notes),
        "free_base": free_base_problem(robot) or None,
        "deployment": snippet(robot),
    }


def _link_json(robot: Robot, number: int) -> dict[str, Any]:
    link = robot.links[number]
    joint = None
    if link.parent >= 0:
        moves, limited = link.joint in MOVING, link.joint in ("revolute", "prismatic")
        joint = {
            "name": robot.joints[number],
            "kind": link.joint,
            "parent": robot.links[link.parent].name,
            "position": list(link.position),
            "orientation": list(link.orientation),
            "axis": list(link.axis) if moves else None,
            "limits": list(link.limits) if limited else None,
            "effort": _finite(link.effort) if moves else None,
            "speed": _finite(link.speed) if moves else None,
            "damping": link.damping if moves else None,
        }
    return {
        "name": link.name,
        "mass": link.mass,
        "centre_of_mass": list(link.centre_of_mass),
        "moments": list(link.inertia),
        "principal": list(link.principal),
        "shapes": [
            {"shape": _shape_text(shape), "position": list(shape.position), "orientation": list(shape.orientation)}
            for shape in link.shapes
        ],
        "joint": joint,
    }


def _finite(value: float) -> float | None:
    return None if value == inf else value


def lines(robot: Robot) -> Iterator[str]:
    """Yield the lines of a robot's tree, the elements passed over, and its entry in a deployment."""
    moving = len(robot.moving)
    joints = f"{moving} joint{'' if moving == 1 else 's'} that move{'s' if moving == 1 else ''}"
    links = f"{len(robot.links)} link{'' if len(robot.links) == 1 else 's'}"
    yield f"{robot.file}: {robot.name or 'a robot'}, {links}, {joints}, {_short(robot.mass)} kg"
    yield ""
    depths: list[int] = []
    for number, link in enumerate(robot.links):
        depths.append(0 if link.parent < 0 else depths[link.parent] + 1)
        indent = "  " * depths[number]
        if link.parent >= 0:
            yield f"{indent}{robot.joints[number]}: {_joint_text(link)}"
        yield f"{indent}{link.name}: {_mass_text(link)}"
        for shape in link.shapes:
            yield f"{indent}  {_shape_text(shape)}"
    yield ""
    for note in robot.notes:
        yield f"passed over: {note}"
    problem = free_base_problem(robot)
    if problem:
        yield f"with `fixed: false`: {problem}"
    yield "in a deployment:"
    yield ""
    yield from snippet(robot).rstrip().split("\n")


def snippet(robot: Robot) -> str:
    """Return the entry of a robot in a deployment, as YAML."""
    name = robot.name if is_robot_name(robot.name) else "robot"
    is_fixed = "true" if len(_wheels(robot)) < WHEELS_MIN or free_base_problem(robot) else "false"
    actuators = ", actuators: {joints: {kind: joint_position}}" if robot.moving else ""
    placed = f"at: {{x: 0 m, y: 0 m}}, fixed: {is_fixed}"
    return f"robots:\n  {name}: {{model: urdf, file: {robot.file}, {placed}{actuators}}}\n"


def _wheels(robot: Robot) -> list[str]:
    """Return the joints of possible wheels: links that turn without end, without moving links on them."""
    carriers = set()
    for link in robot.links:
        if link.joint in MOVING:
            parent = link.parent
            while parent >= 0:
                carriers.add(parent)
                parent = robot.links[parent].parent
    turning = [number for number, link in enumerate(robot.links) if link.joint == "continuous"]
    return [robot.joints[number] for number in turning if number not in carriers]


def _joint_text(link: Link) -> str:
    if link.joint not in MOVING:
        return "fixed"
    unit, force = ("m", "N") if link.joint == "prismatic" else ("rad", "N m")
    text = f"{link.joint} {'along' if link.joint == 'prismatic' else 'about'} {_vector(link.axis)}"
    if link.joint != "continuous":
        text += f", {_short(link.limits[0])} to {_short(link.limits[1])} {unit}"
    if link.effort != inf:
        text += f", at most {_short(link.effort)} {force} and {_short(link.speed)} {unit}/s"
    return text + (f", damping {_short(link.damping)} {force} s/{unit}" if link.damping else "")


def _mass_text(link: Link) -> str:
    if link.mass == 0.0:
        return "no mass"
    centre = _vector(link.centre_of_mass)
    return f"{_short(link.mass)} kg at {centre} m, principal moments {_vector(link.inertia)} kg m2"


def _shape_text(shape: Shape) -> str:
    match shape.geometry:
        case Box(half):
            return f"box of {_vector([2 * side for side in half])} m"
        case Sphere(radius):
            return f"sphere of radius {_short(radius)} m"
        case Cylinder(radius, length):
            return f"cylinder of radius {_short(radius)} m, length {_short(length)} m"
        case Capsule(radius, length):
            return f"capsule of radius {_short(radius)} m, length {_short(length)} m between its ends"
        case Hull(mesh):
            return f"convex hull of {len(mesh.vertices)} corners"
    raise AssertionError(shape)


def _vector(numbers: Sequence[float]) -> str:
    return ", ".join(map(_short, numbers))


def _short(number: float) -> str:
    return f"{number:.{MOST_DIGITS}g}"
