"""Whether the base of a robot is fixed, as its file suggests: a proposal, for a URDF does not say it.

A base is free where nothing moves in it (an object), where two or more links at ends turn without limits about their
middles (wheels, rotors), and where it stands on two or more moving parts (legs): each reaches down to the lowest point
of the robot, and two legs have a knee. It is fixed in all other cases (arms, grippers, pendulums), where the first link
is called `world`, and where it has no mass.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from foosim.world.bodies.urdf import Robot, free_base_problem, poses_of
from foosim.world.scene import MOVING, Link, cross, dot, place, rotate, shape_box

WHEELS_MIN: Final = 2
"""One joint that turns without end may be the last one of an arm."""
UNBALANCE: Final = 0.05
"""The greatest share that the distance of its centre of mass from its axis has in the inertia of a wheel: a shin that
turns without end has more."""
LEGS_MIN: Final = 2
UPRIGHT_MIN: Final = 0.9
"""The least share of the vertical in the axis of a rotor or head, not of a wheel, with all joints at 0."""
LEVEL: Final = 0.05
"""The share of a robot's height by which the lowest points of its legs may differ."""


def base_of(robot: Robot) -> tuple[bool, str]:
    """Return whether the base should be fixed, and why."""
    if free_base_problem(robot):
        return True, "its first link has no mass"
    if robot.links[0].name == "world":
        return True, "its first link is the world"
    if not robot.moving:
        return False, "nothing in it moves, it is an object"
    wheels = wheels_of(robot)
    if wheels:
        return False, f"{len(wheels)} links turn without end, as wheels and rotors do"
    legs = _legs(robot)
    if legs >= LEGS_MIN and len(robot.moving) > LEGS_MIN:
        return False, f"it stands on {legs} moving links"
    return True, "it has no wheels and stands on no legs"


def wheels_of(robot: Robot) -> list[str]:
    """Return the joints of wheels, of which there are several: links that turn without end, balanced about their axes,
    and carry no moving ones. The axes of wheels are not vertical: vertical ones are those of rotors, where a robot has
    no wheels.
    """
    carriers: set[int] = set()
    for link in robot.links:
        parent = link.parent if link.joint in MOVING else -1
        while parent >= 0:
            carriers.add(parent)
            parent = robot.links[parent].parent
    turning = [
        number
        for number, link in enumerate(robot.links)
        if link.joint == "continuous" and link.mimic is None and number not in carriers and _is_balanced(link)
    ]
    poses = poses_of(robot.links)
    wheels = [number for number in turning if abs(rotate(poses[number][1], robot.links[number].axis)[2]) < UPRIGHT_MIN]
    for found in (wheels, turning):
        if len(found) >= WHEELS_MIN:
            return [robot.links[number].joint_name for number in found]
    return []


def _is_balanced(link: Link) -> bool:
    arm = cross(link.axis, link.centre_of_mass)
    return link.mass * dot(arm, arm) <= UNBALANCE * max(link.inertia)


def height_of(robot: Robot) -> float:
    """Return how far its lowest point is below its first link's frame (m)."""
    return -min(low for low, _, _ in _extents(robot))


def _legs(robot: Robot) -> int:
    """Return the count of branches, from the base on, that reach down to the lowest point, which no part of it does."""
    extents = _extents(robot)
    floor, top = min(low for low, _, _ in extents), max(high for _, high, _ in extents)
    standing = {branch for low, _, branch in extents if low <= floor + LEVEL * (top - floor)}
    return 0 if 0 in standing else len(standing)


def _extents(robot: Robot) -> list[tuple[float, float, int]]:
    """Return the lowest and highest point of each shape, and the moving link of its branch next to the base, or 0."""
    poses, branches = poses_of(robot.links), [0]
    for number, link in enumerate(robot.links[1:], 1):
        branch = branches[link.parent]
        branches.append(number if branch == 0 and link.joint in MOVING else branch)
    found = []
    for link, pose, branch in zip(robot.links, poses, branches, strict=True):
        for shape in link.shapes:
            position, orientation = place(shape, *pose)
            low, high = shape_box(replace(shape, position=position, orientation=orientation))
            found.append((low[2], high[2], branch))
    return found
