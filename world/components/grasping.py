"""Objects for grippers: the free rigid objects of a layout, their sizes and masses, and their distances."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Annotated, NamedTuple

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.component_types.settings import ActuatorSettings, Tag
from foosim.world.components.entities import made_model
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity, Layout
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.rays.clearing import distance_to
from foosim.world.scene import Body, Quaternion, Vector, conjugate, moved, multiply, place, rotate, swept_box
from foosim.world.spec import WorldSpec

Reach = Annotated[float, Quantity(units.LENGTH, "1 mm", "2 m")]
Opening = Annotated[float, Quantity(units.LENGTH, "1 mm", "10 m")]
Load = Annotated[float, Quantity(units.MASS, "1 g", "100000 kg")]
Grasp = tuple[Vector, Quaternion]
"""The pose of the held entity, its centre of mass in its principal axes, in the frame of the link that holds it."""


class GripperSettings(ActuatorSettings):
    """Holds an object. `at` is the grip: a place on a link of the robot.

    It takes an object whose surface is at most `reach` from the grip, whose least side is at most `opening`, and whose
    mass is at most `mass`; with a `tag`, one that has it.
    """

    at: MountedAt = FIRST_LINK
    reach: Reach = default("5 cm")
    opening: Opening = default("50 cm")
    mass: Load = default("10 kg")
    tag: Tag | None = None


class Portable(NamedTuple):
    """A free rigid object: its size across, which is the least side of the box around it (m), its mass (kg), how far a
    part is from its centre of mass (m), and its tags."""

    entity: Entity
    body: Body
    across_m: float
    mass_kg: float
    radius_m: float
    tags: frozenset[str]


def portables_of(spec: WorldSpec, layout: Layout) -> tuple[Portable, ...]:
    """Return the free rigid objects of a layout, in name order."""
    return layout.shared("portables", spec, lambda: _portables_of(spec, layout))


def _portables_of(spec: WorldSpec, layout: Layout) -> tuple[Portable, ...]:
    found = []
    for entity in layout.free:
        if entity.is_robot or not entity.kind.couples:
            continue
        settings = spec.settings_of(entity.name)
        body: Body | None = made_model(spec, layout, entity).body()
        if body is None:
            continue
        low, high = swept_box(body)
        corner = [max(abs(a - c), abs(b - c)) for a, b, c in zip(low, high, body.links[0].centre_of_mass, strict=True)]
        x, y, z = corner
        tags = frozenset((*entity.kind.tags, *(() if settings is None else settings.tags)))
        across = min(b - a for a, b in zip(low, high, strict=True))
        mass = sum(link.mass for link in body.links)
        found.append(Portable(entity, body, across, mass, sqrt(x * x + y * y + z * z), tags))
    return tuple(found)


def distance_from(one: Portable, numbers: Sequence[float], point: Vector, reach_m: float) -> float | None:
    """Return how far a point is from the surface of an object (m), negative inside; None beyond a reach."""
    at = one.entity.offsets["position"]
    x, y, z = moved((numbers[at], numbers[at + 1], numbers[at + 2]), point, -1.0)
    far = reach_m + one.radius_m
    if x * x + y * y + z * z > far * far:
        return None
    least = None
    for link, (_, position, orientation) in zip(
        one.body.links, forward_kinematics(one.body, one.entity, numbers), strict=True
    ):
        for shape in link.shapes:
            middle, turned = place(shape, position, orientation)
            way = distance_to(shape.geometry, rotate(conjugate(turned), moved(point, middle, -1.0)))
            if way <= reach_m and (least is None or way < least):
                least = way
    return least


def grasp_of(entity: Entity, numbers: Sequence[float], position: Vector, orientation: Quaternion) -> Grasp:
    """Return the pose of a free body in the frame of a link that has this pose in the world."""
    at, turned = entity.offsets["position"], entity.offsets["orientation"]
    back = conjugate(orientation)
    x, y, z, w = numbers[turned : turned + 4]
    way = moved((numbers[at], numbers[at + 1], numbers[at + 2]), position, -1.0)
    return rotate(back, way), multiply(back, (x, y, z, w))
