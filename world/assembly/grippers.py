"""The grippers of a layout: the link that holds, its reach, and the place of the held entity in the frame.

A held entity is solved with its holder, and released where one of them is put elsewhere or comes into quarantine.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

from foosim.common.keyed_random import draw_key
from foosim.world.component_types.descriptions import NO_ENTITY
from foosim.world.components.grasping import GripperSettings
from foosim.world.components.mounted import Mounted
from foosim.world.components.view import Mounting
from foosim.world.layout import Entity, Layout
from foosim.world.scene import Body, Shape, Sphere, Vector
from foosim.world.spec import WorldSpec

UNSEEN = (0.0, 0.0, 0.0, 0.0)


class Gripper(NamedTuple):
    """The index of a robot, that of the link which holds, the grip in the frame of the link (m), its reach (m); and the
    places of the reference to the held entity, and of the first of the seven numbers of the grasp."""

    robot: int
    link: int
    grip: Vector
    reach_m: float
    held: int
    grasp: int


def grippers_of(spec: WorldSpec, layout: Layout) -> tuple[Gripper, ...]:
    """Return the grippers of a layout, in the order of robots and channels. Raises IncompatibleComponent."""
    return layout.shared("grippers", spec, lambda: tuple(_grippers_of(spec, layout)))


def _grippers_of(spec: WorldSpec, layout: Layout) -> Iterator[Gripper]:
    for robot in layout.robots:
        for channel, settings in sorted(spec.robots[robot.name].actuators.items()):
            if isinstance(settings, GripperSettings):
                key = draw_key(spec.seed, "actuator", robot.name, channel)
                on = Mounted(Mounting(spec, layout, robot, channel, key), settings.at)
                held, grasp = robot.offsets[f"{channel}.held"], robot.offsets[f"{channel}.grasp"]
                yield Gripper(robot.index, on.link, on.position, settings.reach, held, grasp)


def reaching(body: Body, grippers: Iterable[Gripper]) -> Body:
    """Return a body with a ball around each of its grips, of the grip's reach: for its volume."""
    links = list(body.links)
    for one in grippers:
        ball = Shape(Sphere(one.reach_m), "", UNSEEN, one.grip)
        links[one.link] = replace(links[one.link], shapes=(*links[one.link].shapes, ball))
    return replace(body, links=tuple(links))


def release(grippers: Iterable[Gripper], numbers: list[float], entity: Entity) -> list[int]:
    """Release the entity that an entity holds, and the entity where it is held; return the released indices."""
    found = []
    for one in grippers:
        held = int(numbers[one.held])
        if held >= 0 and entity.index in (one.robot, held):
            numbers[one.held] = NO_ENTITY
            found.append(held)
    return found
