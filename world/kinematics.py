"""Where the links of a body are, and how fast, from the numbers of a frame."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.world.layout import Entity
from foosim.world.scene import ORIGIN, UPRIGHT, Body, Pose, Vector, moved, multiply, rotate, turn


def forward_kinematics(body: Body, entity: Entity, numbers: Sequence[float]) -> list[Pose]:
    """Return the pose of each link of a body, in their order, from the frame's numbers."""
    position, orientation = body.position, UPRIGHT
    joint = entity.offsets.get("joint_positions", 0)
    poses: list[Pose] = []
    for link in body.links:
        if link.joint == "free":
            start, turned = entity.offsets["position"], entity.offsets["orientation"]
            position = (numbers[start], numbers[start + 1], numbers[start + 2])
            orientation = (numbers[turned], numbers[turned + 1], numbers[turned + 2], numbers[turned + 3])
        elif link.joint == "prismatic":
            way = numbers[joint]
            dx, dy, dz = rotate(orientation, (way * link.axis[0], way * link.axis[1], way * link.axis[2]))
            position = (position[0] + dx, position[1] + dy, position[2] + dz)
            joint += 1
        elif link.joint == "revolute":
            orientation = multiply(orientation, turn(link.axis, numbers[joint]))
            joint += 1
        poses.append((link.name, position, orientation))
    return poses


def velocity(body: Body, entity: Entity, numbers: Sequence[float]) -> Vector:
    """Return the velocity (m/s, world frame) of the origin of a body's last link, from the frame's numbers.

    A rover's is that of its wheels, which slip where it is kept from where it goes.
    """
    orientation, sliding = UPRIGHT, ORIGIN
    joint = entity.offsets.get("joint_positions", 0)
    for link in body.links:
        if link.joint == "free":
            turned = entity.offsets["orientation"]
            orientation = (numbers[turned], numbers[turned + 1], numbers[turned + 2], numbers[turned + 3])
            if "wheel_speeds" in entity.offsets:
                wheels = entity.offsets["wheel_speeds"]
                sliding = rotate(orientation, (0.5 * (numbers[wheels] + numbers[wheels + 1]), 0.0, 0.0))
            else:
                start = entity.offsets["linear_velocity"]
                sliding = numbers[start], numbers[start + 1], numbers[start + 2]
        elif link.joint == "prismatic":
            speed = numbers[joint - entity.offsets["joint_positions"] + entity.offsets["joint_velocities"]]
            step = rotate(orientation, (speed * link.axis[0], speed * link.axis[1], speed * link.axis[2]))
            sliding = moved(sliding, step, 1.0)
            joint += 1
        elif link.joint == "revolute":
            orientation = multiply(orientation, turn(link.axis, numbers[joint]))
            joint += 1
    return sliding
