"""Descriptions of a robot from a URDF file, as text and as JSON: its tree, and its entry in a deployment."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from json import dumps
from math import ceil, inf
from typing import Any

from foosim.common.names import is_robot_name
from foosim.world.bodies.urdf import MJCF, Robot, free_base_problem
from foosim.world.bodies.urdf_base import base_of, height_of, wheels_of
from foosim.world.scene import MOVING, Box, Capsule, Cylinder, Hull, Link, Shape, Sphere

MOST_DIGITS = 6
ROUNDING_M = 1e-6
WIDTH = 100
"""The count of characters of an entry that is one line."""
ROW_WIDTH = 54
"""The count of characters of names in a line of a list of joints."""
NAMED_MAX = 8
"""The count of joints that are listed by names where a pattern selects them."""
FIXED_DEPTH_M = 1e-3
"""How deep in the floor the lowest point of a fixed robot may be."""


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
        "fixed": base_of(robot)[0],
        "deployment": snippet(robot),
    }


def _link_json(robot: Robot, number: int) -> dict[str, Any]:
    link = robot.links[number]
    joint: dict[str, Any] | None = None
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
            "follows": None,
        }
        if link.mimic is not None:
            leader, ratio, offset = link.mimic.leader, link.mimic.ratio, link.mimic.offset
            joint["follows"] = {"joint": robot.joints[leader], "ratio": ratio, "offset": offset}
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
        "visuals": len(link.visuals),
        "joint": joint,
    }


def _finite(value: float) -> float | None:
    return None if value == inf else value


def lines(robot: Robot) -> Iterator[str]:
    """Yield the lines of a robot's tree, its notes, and its entry in a deployment."""
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
            yield f"{indent}{robot.joints[number]}: {_joint_text(robot, link)}"
        yield f"{indent}{link.name}: {_mass_text(link)}"
        for shape in link.shapes:
            yield f"{indent}  {_shape_text(shape)}"
        if link.visuals:
            yield f"{indent}  {len(link.visuals)} visual{'' if len(link.visuals) == 1 else 's'}"
    yield ""
    yield from robot.notes
    problem = free_base_problem(robot)
    if problem:
        yield f"with `fixed: false`: {problem}"
    is_fixed, why = base_of(robot)
    yield f"in a deployment, `fixed: {'true' if is_fixed else 'false'}`: {why}"
    yield ""
    yield from snippet(robot).rstrip().split("\n")


def snippet(robot: Robot) -> str:
    """Return the entry of a robot in a deployment, as YAML: it stands on the floor, wheels by their speeds."""
    name = robot.name if is_robot_name(robot.name) else "robot"
    is_fixed, height = base_of(robot)[0], height_of(robot)
    is_level = height <= (FIXED_DEPTH_M if is_fixed else ROUNDING_M)
    at = "{x: 0 m, y: 0 m}" if is_level else f"{{x: 0 m, y: 0 m, z: {ceil(1000.0 * height)} mm}}"
    wheels = wheels_of(robot)
    led = [link.joint_name for link in robot.links if link.joint in MOVING and link.mimic is None]
    others = [joint for joint in led if joint not in wheels]
    parts = [("wheels", "joint_velocity", wheels), ("joints", "joint_position", others)]
    are_both = bool(wheels and others)
    shown = [
        f"{part}: {{kind: {kind}{f', joints: {_selection(joints, led)}' if are_both else ''}}}"
        for part, kind, joints in parts
        if joints
    ]
    settings = [
        f"model: {'mjcf' if robot.file.endswith(MJCF) else 'urdf'}",
        f"file: {robot.file}",
        f"at: {at}",
        f"fixed: {'true' if is_fixed else 'false'}",
    ]
    actuators = [f"actuators: {{{', '.join(shown)}}}"] if shown else []
    entry = f"  {name}: {{{', '.join([*settings, *actuators])}}}"
    if len(entry) <= WIDTH and "\n" not in entry:
        return f"robots:\n{entry}\n"
    rows = [*(f"    {setting}" for setting in settings), *(["    actuators:"] if shown else [])]
    return "\n".join(["robots:", f"  {name}:", *rows, *(f"      {actuator}" for actuator in shown), ""])


def _selection(joints: Sequence[str], led: Sequence[str]) -> str:
    """Return what selects some of the joints that have motors: their names, or of many one pattern if it does."""
    if len(joints) > NAMED_MAX:
        start, end = _common_start(joints), _common_start([name[::-1] for name in joints])[::-1]
        pattern = f"{start}*{end}"
        if not set("*?[") & {*start, *end} and [name for name in led if fnmatchcase(name, pattern)] == [*joints]:
            return dumps(pattern, ensure_ascii=False)
    *names, last = (dumps(name, ensure_ascii=False) for name in joints)
    rows = [""]
    for name in (*(f"{name}," for name in names), last):
        if len(rows[-1]) + len(name) > ROW_WIDTH:
            rows.append("")
        rows[-1] += f"{' ' if rows[-1] else ''}{name}"
    return f"[{rows[0]}]" if len(rows) == 1 else "[\n          " + "\n          ".join(rows) + "]"


def _common_start(names: Sequence[str]) -> str:
    first, last = min(names), max(names)
    length = next((at for at, (one, other) in enumerate(zip(first, last, strict=False)) if one != other), len(first))
    return first[:length]


def _joint_text(robot: Robot, link: Link) -> str:
    if link.joint not in MOVING:
        return "fixed"
    unit, force = ("m", "N") if link.joint == "prismatic" else ("rad", "N m")
    text = f"{link.joint} {'along' if link.joint == 'prismatic' else 'about'} {_vector(link.axis)}"
    if link.joint != "continuous":
        text += f", {_short(link.limits[0])} to {_short(link.limits[1])} {unit}"
    most = [(link.effort, force), (link.speed, f"{unit}/s")]
    bounds = [f"{_short(value)} {of}" for value, of in most if value != inf]
    if bounds:
        text += f", at most {' and '.join(bounds)}"
    if link.mimic is not None:
        text += f", follows {robot.joints[link.mimic.leader]} x {_short(link.mimic.ratio)}"
        text += f" + {_short(link.mimic.offset)} {unit}" if link.mimic.offset else ""
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
