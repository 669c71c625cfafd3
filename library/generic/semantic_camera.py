"""A semantic camera: which tagged entities it sees, and where."""

from __future__ import annotations

from math import sqrt
from typing import Annotated, Final, Literal

import numpy as np
from msgspec import Meta, Struct

from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import Tag
from foosim.world.components.base import Sensor
from foosim.world.components.cameras import Eye, ViewSettings
from foosim.world.components.in_view import InView
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import Mounting, View
from foosim.world.layout import Entity
from foosim.world.scene import Quaternion, Vector, conjugate, dot, enclosing, moved, multiply, rotate, shape_box

OBJECTS_MAX: Final = 64
INWARDS: Final = 0.45
"""Of the sides of a box, from its middle to where rays go near its corners: what touches a wall is not hidden by it."""
CORNERS: Final = [(x, y, z) for x in (-INWARDS, INWARDS) for y in (-INWARDS, INWARDS) for z in (-INWARDS, INWARDS)]


class SemanticCameraSettings(ViewSettings):
    """Sees entities with the `tag`, by nine rays to the box around each of their links: to its middle and corners.

    It reports what a ray in its view reaches, with `hidden` also what is in its view behind other things. There are at
    most 64, the nearest first. Poses are in the `frame` of the camera itself or of the world.
    """

    tag: Tag
    hidden: bool = False
    frame: Literal["own", "world"] = "own"


class SeenEntity(Struct, frozen=True):
    """An entity in view: the pose of its first link in the frame of the camera, x ahead, y to the left, z up (m), or of
    the world; its distance, and whether a ray reaches it."""

    name: str
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    distance: Metres
    visible: bool


class SeenEntities(Struct, frozen=True):
    """The tagged entities in view, the nearest first."""

    objects: Annotated[tuple[SeenEntity, ...], Meta(max_length=OBJECTS_MAX)]


@sensor("semantic_camera", SemanticCameraSettings, SeenEntities)
class SemanticCamera(Sensor):
    """The tagged entities in view, with pose and distance; the robot itself aside."""

    def __init__(self, settings: SemanticCameraSettings, at: Mounting) -> None:
        self._eye, self._settings, self._own = Eye(at, settings), settings, at.robot
        self._in_view, self._around = InView(settings.optics, []), Surroundings(at.spec, at.layout)
        self._targets = [
            (entity, points_of(self._around, entity))
            for entity in self._around.tagged(settings.tag)
            if entity.name in self._around.bodies and entity is not at.robot
        ]

    @staticmethod
    def check(settings: SemanticCameraSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a pose that cannot be."""
        Eye(at, settings)

    def sample(self, view: View) -> SeenEntities:
        place, turned = self._eye.pose(view.start)
        back, near = conjugate(turned), self._settings.near
        seen: list[SeenEntity] = []
        ways: list[Vector] = []
        owners: list[tuple[int, int]] = []
        for entity, points in self._targets:
            if entity.is_absent(view.start):
                continue
            poses = self._around.poses(view, entity)
            arms = [moved(moved(poses[n][1], rotate(poses[n][2], point), 1.0), place, -1.0) for n, point in points]
            inside = [arm for arm in arms if self._in_view.away(its := rotate(back, arm)) <= 0.0 and its[0] >= near]
            if inside:
                where = rotate(back, moved(poses[0][1], place, -1.0))
                ways += inside
                owners += [(len(seen), entity.index)] * len(inside)
                orientation: Quaternion = multiply(back, poses[0][2])
                pose = poses[0][1:] if self._settings.frame == "world" else (where, orientation)
                seen.append(SeenEntity(entity.name, *pose, sqrt(dot(where, where)), False))
        reached = self._reached(view, place, ways, owners)
        found = [
            SeenEntity(one.name, one.position, one.orientation, one.distance, number in reached)
            for number, one in enumerate(seen)
            if number in reached or self._settings.hidden
        ]
        return SeenEntities(tuple(sorted(found, key=lambda one: (one.distance, one.name))[:OBJECTS_MAX]))

    def _reached(self, view: View, place: Vector, ways: list[Vector], owners: list[tuple[int, int]]) -> frozenset[int]:
        """Return the numbers of the owners of rays along some ways that meet them first; owners are number and index of
        an entity."""
        if not ways:
            return frozenset()
        directions = np.array(ways)
        x, y, z = directions.T
        lengths = np.sqrt(x * x + y * y + z * z)
        far = self._settings.far * self._in_view.beside * self._in_view.above
        hits = self._around.rays(view, np.array([place] * len(ways)), directions / lengths[:, None], far, self._own)
        return frozenset(
            [number for (number, index), thing in zip(owners, hits.things.tolist(), strict=True) if thing == index]
        )


def points_of(around: Surroundings, entity: Entity) -> list[tuple[int, Vector]]:
    """Return the index of the link and the place in its frame (m) of each point that rays go to."""
    found: list[tuple[int, Vector]] = []
    for index, link in enumerate(around.bodies[entity.name].links):
        if link.shapes:
            low, high = enclosing([shape_box(shape) for shape in link.shapes])
            sides = moved(high, low, -1.0)
            middle = moved(low, sides, 0.5)
            corners = [moved(middle, (x * sides[0], y * sides[1], z * sides[2]), 1.0) for x, y, z in CORNERS]
            found += [(index, point) for point in (middle, *corners)]
    return found
