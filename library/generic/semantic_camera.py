"""A semantic camera: which tagged entities it sees, and where."""

from __future__ import annotations

from math import sqrt
from typing import Annotated, Final, Literal, NamedTuple

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
from foosim.world.scene import Pose, Quaternion, Vector, conjugate, dot, enclosing, moved, multiply, rotate, shape_box

OBJECTS_MAX: Final = 64
INWARDS: Final = 0.45
"""Of the sides of a box, from its middle to where rays go near its corners: what touches a wall is not hidden by it."""
CORNERS: Final = [(x, y, z) for x in (-INWARDS, INWARDS) for y in (-INWARDS, INWARDS) for z in (-INWARDS, INWARDS)]
PROJECTIONS_MAX: Final = 8
WITHIN: Final = 0.99
"""Of the view's width and height: rounding takes nothing out of it."""


class SemanticCameraSettings(ViewSettings):
    """Sees entities with the `tag`, by nine rays to the box around each of their links: to its middle and corners, and
    where these are out of view to points of the box in it.

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
            (entity, boxes_of(self._around, entity))
            for entity in self._around.tagged(settings.tag)
            if entity.name in self._around.bodies and entity is not at.robot
        ]

    @staticmethod
    def check(settings: SemanticCameraSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a pose that cannot be."""
        Eye(at, settings)

    def sample(self, view: View) -> SeenEntities:
        place, turned = self._eye.pose(view.start)
        back = conjugate(turned)
        seen: list[SeenEntity] = []
        ways: list[Vector] = []
        owners: list[tuple[int, int]] = []
        for entity, boxes in self._targets:
            if entity.is_absent(view.start):
                continue
            poses = self._around.poses(view, entity)
            inside = [arm for n, box in boxes for arm in self._in_view_of(box, poses[n], place, turned)]
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

    def _in_view_of(self, box: LinkBox, link: Pose, place: Vector, turned: Quaternion) -> list[Vector]:
        """Return the ways from the camera to the points of a link's box, drawn into view (m, world frame).

        A point out of view goes to the nearest of the view and of the box by turns, which leads to both where they meet
        (Cheney and Goldstein 1959).
        """
        its, near, far = self._in_view, self._settings.near, self._settings.far
        across = multiply(conjugate(link[2]), turned)
        origin, back = rotate(conjugate(link[2]), moved(place, link[1], -1.0)), conjugate(across)
        found: list[Vector] = []
        if its.away(rotate(back, moved(box.points[0], origin, -1.0))) > box.radius:
            return found
        for point in box.points:
            arm = rotate(back, moved(point, origin, -1.0))
            for _ in range(PROJECTIONS_MAX):
                if its.away(arm) <= 0.0 and arm[0] >= near:
                    found.append(rotate(turned, arm))
                    break
                x = min(max(arm[0], near), WITHIN * far)
                wide, high = WITHIN * its.wide * x, WITHIN * its.high * x
                arm = x, min(max(arm[1], -wide), wide), min(max(arm[2], -high), high)
                arm = rotate(back, moved(box.nearest(moved(rotate(across, arm), origin, 1.0)), origin, -1.0))
        return found

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


class LinkBox(NamedTuple):
    """The box around a link, in its frame (m), without its outermost part; the points that rays go to, the middle
    first; and how far the middle is from a corner."""

    low: Vector
    high: Vector
    points: list[Vector]
    radius: float

    def nearest(self, point: Vector) -> Vector:
        """Return the point of the box that is nearest to a point."""
        x, y, z = (min(max(at, low), high) for at, low, high in zip(point, self.low, self.high, strict=True))
        return x, y, z


def boxes_of(around: Surroundings, entity: Entity) -> list[tuple[int, LinkBox]]:
    """Return the index and the box of each link that has shapes."""
    found: list[tuple[int, LinkBox]] = []
    for index, link in enumerate(around.bodies[entity.name].links):
        if link.shapes:
            low, high = enclosing([shape_box(shape) for shape in link.shapes])
            sides = moved(high, low, -1.0)
            middle = moved(low, sides, 0.5)
            corners = [moved(middle, (x * sides[0], y * sides[1], z * sides[2]), 1.0) for x, y, z in CORNERS]
            radius = INWARDS * sqrt(dot(sides, sides))
            found.append((index, LinkBox(corners[0], corners[-1], [middle, *corners], radius)))
    return found
