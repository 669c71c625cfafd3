"""Joints of a URDF, and the tree of its links."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, sqrt
from typing import Final

from foosim.common.errors import describe
from foosim.common.names import nearest_name
from foosim.world.bodies.findings import Findings
from foosim.world.bodies.urdf_links import LinkPart
from foosim.world.bodies.urdf_values import (
    ANGLE_MAX_RAD,
    EXTENT_MAX_M,
    NUMBER_MAX,
    UNMOVED,
    Placed,
    name_of,
    number_of,
    placed_by,
    text_of,
    vector_of,
)
from foosim.world.bodies.xml_tree import Element
from foosim.world.scene import MOVING, ORIGIN, JointKind, Vector, moved, multiply, rotate, turn

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
    """A joint as its file describes it: its links, its pose in its parent, and its motion.

    `follows` is the element that names another joint, which it follows. A joint that is `held` at a position (m or
    rad) is fixed; its pose has that position in it.
    """

    name: str
    element: Element
    kind: JointKind
    parent: str
    child: str
    place: Placed
    axis: Vector = ORIGIN
    limits: tuple[float, float] = (0.0, 0.0)
    effort: float = inf
    speed: float = inf
    damping: float = 0.0
    follows: Element | None = None
    held: float = 0.0


class _Limit:
    """The limit of a joint: its ends, the greatest effort and the greatest speed."""

    __slots__ = ("effort", "ends", "speed")

    def __init__(self) -> None:
        self.ends: tuple[float, float] | None = None
        self.effort = self.speed = inf


def read_joint(joint: Element, links: Iterable[str], findings: Findings) -> JointPart | None:
    """Return a joint between these links; None for one without a valid name or end."""
    name = findings.read("", name_of, joint)
    kind = findings.read(None, _kind, joint)
    parent, child = (findings.read("", _end, joint, end, [*links]) for end in ("parent", "child"))
    if parent and parent == child:
        findings.error(joint, "a joint from a link to itself", parent)
        return None
    place = findings.read(UNMOVED, placed_by, joint)
    follows = findings.read(None, joint.one_of, "mimic")
    if not (name and parent and child):
        return None
    if kind == "fixed":
        if follows is not None:
            findings.note(follows, "passed over: mimic of joint", "it is fixed", name)
        return JointPart(name, joint, kind, parent, child, place)
    limit = _limit(joint, name, kind, findings)
    is_known = kind is not None
    if kind is None or (kind == "revolute" and limit.ends is None):
        kind = "continuous"
    dynamics = findings.read(None, joint.one_of, "dynamics")
    damping = 0.0
    if dynamics is not None:
        damping = findings.read(0.0, number_of, dynamics, "damping", 0.0, NUMBER_MAX, 0.0)
    axis = findings.read(X_AXIS, _axis, joint)
    ends = limit.ends or (0.0, 0.0)
    found = JointPart(name, joint, kind, parent, child, place, axis, ends, limit.effort, limit.speed, damping, follows)
    if kind != "continuous" and ends[0] == ends[1]:
        findings.note(joint, f"limits {ends[0]:g} to {ends[1]:g} hold joint", "it is fixed there", name)
        return _held_at(found, ends[0])
    if is_known:
        _note_motor(found, findings)
    return found


def _note_motor(joint: JointPart, findings: Findings) -> None:
    """Note a motor that does nothing, and one without bounds where the joint has a limit, but not of mimic joints."""
    for limit in joint.element.all_of("limit") if joint.follows is None else ():
        if joint.effort == 0.0:
            findings.note(limit, "an effort of 0, of joint", "its motor applies no force", joint.name)
        if joint.speed == 0.0:
            findings.note(limit, "a velocity of 0, of joint", "its motor cannot move it", joint.name)
        for key in ("effort", "velocity"):
            if key not in limit.attributes:
                findings.note(limit, f"no {key} in the limit of joint", f"its motor has no greatest {key}", joint.name)


def _kind(joint: Element) -> JointKind:
    kind = text_of(joint, "type")
    if kind not in KINDS:
        hint = f": {REFUSED_KINDS[kind]}" if kind in REFUSED_KINDS else ""
        raise joint.error(f"an unknown type of joint, valid are {', '.join(KINDS)}{hint}", kind)
    return KINDS[kind]


def _held_at(joint: JointPart, position: float) -> JointPart:
    """Return a joint as one that is fixed at a position."""
    place, orientation = joint.place
    if joint.kind == "prismatic":
        place = moved(place, rotate(orientation, joint.axis), position)
    elif position != 0.0:
        orientation = multiply(orientation, turn(joint.axis, position))
    return JointPart(
        joint.name, joint.element, "fixed", joint.parent, joint.child, Placed(place, orientation), held=position
    )


def _end(joint: Element, end: str, links: Sequence[str]) -> str:
    """Return the link that a joint begins or ends at."""
    found = joint.one_of(end)
    if found is None:
        raise joint.error(f"a joint without {end}", joint.attributes.get("name", ""))
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


def _limit(joint: Element, name: str, kind: JointKind | None, findings: Findings) -> _Limit:
    """Return the limit of a joint that moves; `ends` are None for one that turns without end.

    Of a joint of an unknown kind, None, only what is wrong in any kind is an error.
    """
    found = _Limit()
    limit = findings.read(None, joint.one_of, "limit")
    if limit is None:
        if kind not in ("continuous", None):
            findings.error(joint, f"a {kind} joint without limit", name)
        return found
    found.effort, found.speed = (
        findings.read(inf, number_of, limit, key, 0.0, inf, inf) for key in ("effort", "velocity")
    )
    if kind == "continuous":
        return found
    if "lower" not in limit.attributes and "upper" not in limit.attributes:
        if kind == "prismatic":
            findings.error(limit, "limit of a prismatic joint without lower and upper", name)
        elif kind == "revolute":
            findings.note(limit, "neither lower nor upper in the limit of joint", "it turns without end", name)
        return found
    most = {"prismatic": EXTENT_MAX_M, "revolute": ANGLE_MAX_RAD}.get(kind or "", inf)
    low, high = (findings.read(0.0, number_of, limit, key, -inf, inf, 0.0) for key in ("lower", "upper"))
    if kind == "revolute" and low < -most and most < high:
        findings.note(limit, f"limits beyond {most:g} rad, of joint", "it turns without end", name)
        return found
    if max(abs(low), abs(high)) > most:
        findings.error(limit, f"limits {low:g} to {high:g} are not within -{most:g} to {most:g}", name)
    elif low > high:
        findings.error(limit, f"reversed limits: lower is {low:g}, upper {high:g}", name)
    else:
        found.ends = low, high
    return found


# --- the tree --------------------------------------------------------------------------------------------------------

Tree = list[tuple[LinkPart, JointPart | None]]
"""Links from the root on, each with the joint that it hangs on: parents first, in the order of the joints."""


def in_tree(links: Sequence[LinkPart], joints: Sequence[JointPart]) -> Tree:
    """Return links as a tree. Raises BadElement for a link with two parents, several roots, a loop."""
    above: dict[str, JointPart] = {}
    for joint in joints:
        other = above.setdefault(joint.child, joint)
        if other is not joint:
            by = f"by the joints {other.name} (line {other.element.line}) and {joint.name}"
            raise joint.element.error(f"a loop: {joint.child} has two parents, {by}; links are a tree")
    roots = [link for link in links if link.name not in above]
    if not roots:
        raise joints[0].element.error("a loop: each link hangs on another one; links are a tree")
    if len(roots) > 1:
        named = ", ".join(f"{link.name} (line {link.element.line})" for link in roots[:8])
        raise roots[1].element.error(f"{len(roots)} links that hang on none, there is one root: {named}")
    below: dict[str, list[JointPart]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    by_name = {link.name: link for link in links}
    found: Tree = []
    waiting: Tree = [(roots[0], None)]
    while waiting:
        found.append(waiting.pop())
        following = below.get(found[-1][0].name, [])
        waiting += [(by_name[joint.child], joint) for joint in reversed(following)]
    if len(found) < len(links):
        reached = {link.name for link, _ in found}
        lost = next(link for link in links if link.name not in reached)
        what = describe("a loop: a link that does not hang on the root", lost.name)
        raise lost.element.error(f"{what}; links are a tree")
    return found


# --- joints that follow others ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Following:
    """A joint is at `ratio` times the position of the joint `leader`, which follows none, and `offset` (m or rad)."""

    leader: str
    ratio: float
    offset: float


def followers_of(joints: Sequence[JointPart], findings: Findings) -> tuple[list[JointPart], dict[str, Following]]:
    """Return joints, and by name how a joint follows another; one whose leader is fixed is fixed, too."""
    by_name = {joint.name: joint for joint in joints}
    made: list[JointPart] = []
    following: dict[str, Following] = {}
    for joint in joints:
        its = None if joint.follows is None else findings.read(None, _followed, joint, by_name)
        if its is None:
            made.append(joint)
            continue
        leader = by_name[its.leader]
        if leader.kind in MOVING and its.ratio != 0.0:
            following[joint.name] = its
            made.append(joint)
            continue
        assert joint.follows is not None
        position = its.ratio * leader.held + its.offset
        findings.note(
            joint.follows, f"joint {joint.name} follows {leader.name}", f"that does not move it, it is at {position:g}"
        )
        made.append(_held_at(joint, position))
    return made, following


def _followed(joint: JointPart, joints: Mapping[str, JointPart]) -> Following:
    """Return how a joint follows the first joint of its chain. Raises BadElement."""
    ratio, offset, seen, own = 1.0, 0.0, [joint.name], joint.follows or joint.element
    while joint.follows is not None:
        mimic = joint.follows
        offset += ratio * number_of(mimic, "offset", -NUMBER_MAX, NUMBER_MAX, 0.0)
        ratio *= number_of(mimic, "multiplier", -NUMBER_MAX, NUMBER_MAX, 1.0)
        name = text_of(mimic, "joint")
        if name not in joints:
            raise mimic.error("no joint of this name to follow", name, nearest_name(name, joints))
        if name in seen:
            raise own.error("a joint that follows itself", " > ".join((*seen, name)))
        seen.append(name)
        joint = joints[name]
    return Following(joint.name, ratio, offset)
