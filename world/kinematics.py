"""Where the links of a body are, and how fast, from the numbers of a frame."""

from __future__ import annotations

from collections.abc import Sequence

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
    """Return the velocity (m/s, world frame) of the origin of the link that a body's antenna is on, from the numbers.

    A rover's is that of its wheels, which slip where it is kept from where it goes.
    """
    poses = forward_kinematics(body, entity, numbers)
    speeds = entity.offsets.get("joint_velocities", 0)
    of_joint: dict[int, float] = {}
    for index, link in enumerate(body.links):
        if link.joint in MOVING:
            of_joint[index] = numbers[speeds]
            speeds += 1
    index = body.antenna_link % len(body.links)
    place, sliding = poses[index][1], ORIGIN
    while index >= 0:
        link, (_, position, orientation) = body.links[index], poses[index]
        if link.joint == "free":
            sliding = moved(sliding, _free_velocity(entity, numbers, orientation, place), 1.0)
        elif link.joint in MOVING:
            axis, speed = rotate(orientation, link.axis), of_joint[index]
            way = axis if link.joint == "prismatic" else cross(axis, moved(place, position, -1.0))
            sliding = moved(sliding, way, speed)
        index = link.parent
    return sliding


def _free_velocity(entity: Entity, numbers: Sequence[float], orientation: Quaternion, place: Vector) -> Vector:
    """Return the velocity of a place that is fixed to a free link."""
    offsets = entity.offsets
    if "wheel_speeds" in offsets:
        wheels = offsets["wheel_speeds"]
        return rotate(orientation, (0.5 * (numbers[wheels] + numbers[wheels + 1]), 0.0, 0.0))
    start = offsets["linear_velocity"]
    sliding = numbers[start], numbers[start + 1], numbers[start + 2]
    if "angular_velocity" not in offsets:
        return sliding
    at, spin = offsets["position"], offsets["angular_velocity"]
    arm = place[0] - numbers[at], place[1] - numbers[at + 1], place[2] - numbers[at + 2]
    return moved(sliding, cross((numbers[spin], numbers[spin + 1], numbers[spin + 2]), arm), 1.0)
