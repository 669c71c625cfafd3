"""Joints of a URDF, and the tree of its links."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf, sqrt
from typing import Final

from foosim.common.errors import describe
from foosim.common.names import nearest_name
from foosim.world.bodies.urdf_links import LinkPart
from foosim.world.bodies.urdf_values import (
    ANGLE_MAX_RAD,
    EXTENT_MAX_M,
    NUMBER_MAX,
    Placed,
    name_of,
    number_of,
    placed_by,
    text_of,
    vector_of,
)
from foosim.world.bodies.xml_tree import Element
from foosim.world.matter.mesh import AssetError
from foosim.world.scene import MOVING, ORIGIN, JointKind, Vector

X_AXIS: Final[Vector] = (1.0, 0.0, 0.0)
AXIS_MIN: Final = 1e-6
KINDS: Final[dict[str, JointKind]] = {
    "fixed": "fixed",
    "revolute": "revolute",
    "continuous": "continuous",
    "prismatic": "prismatic",
}
REFUSED_KINDS: Final = {
    "floating": "a free joint is the base's alone, which the deployment frees (`fixed: false`)",
    "planar": "two prismatic joints and a revolute one do the same",
    "spherical": "three revolute joints do the same",
}


@dataclass(frozen=True, slots=True)
class JointPart:
    """A joint as its file describes it: its links, its pose in its parent, and its motion."""

    name: str
    line: int
    kind: JointKind
    parent: str
    child: str
    place: Placed
    axis: Vector = ORIGIN
    limits: tuple[float, float] = (0.0, 0.0)
    effort: float = inf
    speed: float = inf
    damping: float = 0.0


def read_joint(joint: Element, links: Iterable[str]) -> JointPart:
    """Return a joint between these links. Raises AssetError."""
    name, kind = name_of(joint), text_of(joint, "type")
    if kind not in KINDS:
        hint = f": {REFUSED_KINDS[kind]}" if kind in REFUSED_KINDS else ""
        raise joint.error(f"an unknown type of joint, valid are {', '.join(KINDS)}{hint}", kind)
    mimic = joint.one_of("mimic")
    if mimic is not None:
        raise mimic.error("a mimic joint: joints move independently of one another, a controller couples them", name)
    parent, child = (_end(joint, end, [*links]) for end in ("parent", "child"))
    if parent == child:
        raise joint.error("a joint from a link to itself", parent)
    place = placed_by(joint)
    if kind == "fixed":
        return JointPart(name, joint.line, "fixed", parent, child, place)
    limits, effort, speed = _limit(joint, KINDS[kind])
    dynamics = joint.one_of("dynamics")
    damping = 0.0 if dynamics is None else number_of(dynamics, "damping", 0.0, NUMBER_MAX, 0.0)
    return JointPart(name, joint.line, KINDS[kind], parent, child, place, _axis(joint), limits, effort, speed, damping)


def _end(joint: Element, end: str, links: Sequence[str]) -> str:
    """Return the link that a joint begins or ends at."""
    found = joint.one_of(end)
    if found is None:
        raise joint.error(f"a joint without {end}", joint.attributes["name"])
    name = text_of(found, "link")
    if name not in links:
        raise found.error("no link of this name", name, nearest_name(name, links))
    return name


def _axis(joint: Element) -> Vector:
    """Return the unit axis of a joint, by default x."""
    axis = joint.one_of("axis")
    if axis is None:
        return X_AXIS
    x, y, z = vector_of(axis, "xyz", NUMBER_MAX)
    length = sqrt(x * x + y * y + z * z)
    if length < AXIS_MIN:
        raise axis.error("an axis without a direction", axis.attributes["xyz"])
    return x / length, y / length, z / length


def _limit(joint: Element, kind: JointKind) -> tuple[tuple[float, float], float, float]:
    """Return the limits, the greatest effort and the greatest speed of a joint that moves."""
    limit = joint.one_of("limit")
    if limit is None:
        if kind == "continuous":
            return (0.0, 0.0), inf, inf
        raise joint.error(f"a {kind} joint without limit", joint.attributes["name"])
    effort, speed = number_of(limit, "effort", 0.0, NUMBER_MAX), number_of(limit, "velocity", 0.0, NUMBER_MAX)
    if speed == 0.0:
        raise limit.error("velocity of limit is 0: the greatest speed of a joint that moves is above it")
    if kind == "continuous":
        return (0.0, 0.0), effort, speed
    most = EXTENT_MAX_M if kind == "prismatic" else ANGLE_MAX_RAD
    low, high = (number_of(limit, key, -most, most, 0.0) for key in ("lower", "upper"))
    if low > high:
        raise limit.error(f"reversed limits: lower is {low:g}, upper {high:g}")
    if low == high:
        also = "" if kind == "prismatic" else ", or continuous"
        raise limit.error(f"limits {low:g} to {high:g}, between which nothing moves: the type is fixed{also}")
    return (low, high), effort, speed


# --- the tree --------------------------------------------------------------------------------------------------------


def in_tree(
    file: str, links: Sequence[LinkPart], joints: Sequence[JointPart]
) -> list[tuple[LinkPart, JointPart | None]]:
    """Return links from the root on, each with the joint that it hangs on: parents first, in the joints' order.

    Raises AssetError where they are no tree: a link with two parents, several roots, a loop, a part without a mover.
    """
    above: dict[str, JointPart] = {}
    for joint in joints:
        other = above.setdefault(joint.child, joint)
        if other is not joint:
            by = f"by the joints {other.name} (line {other.line}) and {joint.name}"
            raise AssetError(f"{file}:{joint.line}: a loop: {joint.child} has two parents, {by}; links are a tree")
    roots = [link for link in links if link.name not in above]
    if not roots:
        raise AssetError(f"{file}:{joints[0].line}: a loop: each link hangs on another one; links are a tree")
    if len(roots) > 1:
        named = ", ".join(f"{link.name} (line {link.line})" for link in roots[:8])
        raise AssetError(f"{file}:{roots[1].line}: {len(roots)} links that hang on none, there is one root: {named}")
    below: dict[str, list[JointPart]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    by_name = {link.name: link for link in links}
    found: list[tuple[LinkPart, JointPart | None]] = []
    waiting: list[tuple[LinkPart, JointPart | None]] = [(roots[0], None)]
    while waiting:
        found.append(waiting.pop())
        following = below.get(found[-1][0].name, [])
        waiting += [(by_name[joint.child], joint) for joint in reversed(following)]
    if len(found) < len(links):
        reached = {link.name for link, _ in found}
        lost = next(link for link in links if link.name not in reached)
        what = describe("a loop: a link that does not hang on the root", lost.name)
        raise AssetError(f"{file}:{lost.line}: {what}; links are a tree")
    _check_masses(file, found)
    return found


def _check_masses(file: str, tree: Sequence[tuple[LinkPart, JointPart | None]]) -> None:
    """Refuse joints without a load: their links, with all that is fixed to them, have no mass."""
    mover: dict[str, JointPart | None] = {}
    moved: dict[str, float] = {}
    for link, joint in tree:
        if joint is None or joint.kind in MOVING:
            mover[link.name] = joint
        else:
            mover[link.name] = mover[joint.parent]
        its = mover[link.name]
        if its is not None:
            moved[its.name] = moved.get(its.name, 0.0) + link.mass.mass
    for link, joint in tree:
        if joint is not None and joint.kind in MOVING and moved[joint.name] == 0.0:
            what = f"the joint {joint.name} moves nothing: {link.name}, with all that is fixed to it, has no mass"
            raise AssetError(f"{file}:{link.line}: {what}; it needs an inertial")
