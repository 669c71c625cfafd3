"""Poses and velocities of a body's links from the numbers of a frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final, NamedTuple

from foosim.world.layout import Entity
from foosim.world.scene import (
    MOVING,
    ORIGIN,
    UPRIGHT,
    Body,
    Link,
    Pose,
    Quaternion,
    Vector,
    cross,
    moved,
    multiply,
    rotate,
    turn,
)

CENTRE_OF_SLOT: Final[Mapping[str, str]] = MappingProxyType(
    {
        "position": "centre_of_mass_position",
        "orientation": "centre_of_mass_orientation",
        "linear_velocity": "centre_of_mass_velocity",
    }
)
"""Displayed names of the slots of a free body with the pose (centre of mass, principal axes) and the velocity of its
first link's centre of mass: their own names are displayed for the link's origin and frame."""


def forward_kinematics(body: Body, entity: Entity, numbers: Sequence[float]) -> list[Pose]:
    """Return the pose of each link of a body, in their order, from the frame's numbers."""
    joint = entity.offsets.get("joint_positions", 0)
    poses: list[Pose] = []
    for link in body.links:
        if link.joint == "free":
            position, orientation = _free_pose(link, entity, numbers)
            poses.append((link.name, position, orientation))
            continue
        if link.parent < 0:
            position, orientation = body.position, body.orientation
        else:
            _, position, orientation = poses[link.parent]
        if link.position != ORIGIN:
            position = moved(position, rotate(orientation, link.position), 1.0)
        if link.orientation != UPRIGHT:
            orientation = multiply(orientation, link.orientation)
        if link.joint == "prismatic":
            way = numbers[joint]
            dx, dy, dz = rotate(orientation, (way * link.axis[0], way * link.axis[1], way * link.axis[2]))
            position = (position[0] + dx, position[1] + dy, position[2] + dz)
            joint += 1
        elif link.joint != "fixed":
            orientation = multiply(orientation, turn(link.axis, numbers[joint]))
            joint += 1
        poses.append((link.name, position, orientation))
    return poses


def _free_pose(link: Link, entity: Entity, numbers: Sequence[float]) -> tuple[Vector, Quaternion]:
    """Return the pose of a free link's frame: the frame has that of its centre of mass, in its principal axes."""
    start, turned = entity.offsets["position"], entity.offsets["orientation"]
    position = (numbers[start], numbers[start + 1], numbers[start + 2])
    orientation = (numbers[turned], numbers[turned + 1], numbers[turned + 2], numbers[turned + 3])
    if link.principal != UPRIGHT:
        x, y, z, w = link.principal
        orientation = multiply(orientation, (-x, -y, -z, w))
    if link.centre_of_mass != ORIGIN:
        position = moved(position, rotate(orientation, link.centre_of_mass), -1.0)
    return position, orientation


def velocity(body: Body, entity: Entity, numbers: Sequence[float]) -> Vector:
    """Return the velocity (m/s, world frame) of the origin of the link that a body's antenna is on."""
    return twist(body, entity, numbers, body.antenna_link % len(body.links)).linear


class Twist(NamedTuple):
    """The velocity of a place (m/s), and the angular velocity of its link (rad/s): in the world frame."""

    linear: Vector
    angular: Vector


def twist(body: Body, entity: Entity, numbers: Sequence[float], index: int, place: Vector | None = None) -> Twist:
    """Return the motion of a place (m, world frame) fixed to the link of this index: by default its origin."""
    poses = forward_kinematics(body, entity, numbers)
    speeds = entity.offsets.get("joint_velocities", 0)
    of_joint: dict[int, float] = {}
    for number, link in enumerate(body.links):
        if link.joint in MOVING:
            of_joint[number] = numbers[speeds]
            speeds += 1
    where = poses[index][1] if place is None else place
    linear, angular = ORIGIN, ORIGIN
    while index >= 0:
        link, (_, position, orientation) = body.links[index], poses[index]
        if link.joint == "free":
            of_base, spin = _free_twist(entity, numbers, where)
            linear, angular = moved(linear, of_base, 1.0), moved(angular, spin, 1.0)
        elif link.joint in MOVING:
            axis, speed = rotate(orientation, link.axis), of_joint[index]
            if link.joint == "prismatic":
                linear = moved(linear, axis, speed)
            else:
                linear = moved(linear, cross(axis, moved(where, position, -1.0)), speed)
                angular = moved(angular, axis, speed)
        index = link.parent
    return Twist(linear, angular)


def _free_twist(entity: Entity, numbers: Sequence[float], place: Vector) -> Twist:
    """Return the motion of a place that is fixed to a free link."""
    offsets = entity.offsets
    start = offsets["linear_velocity"]
    linear = numbers[start], numbers[start + 1], numbers[start + 2]
    if "angular_velocity" not in offsets:
        return Twist(linear, ORIGIN)
    at, turning = offsets["position"], offsets["angular_velocity"]
    arm = place[0] - numbers[at], place[1] - numbers[at + 1], place[2] - numbers[at + 2]
    spin = numbers[turning], numbers[turning + 1], numbers[turning + 2]
    return Twist(moved(linear, cross(spin, arm), 1.0), spin)
