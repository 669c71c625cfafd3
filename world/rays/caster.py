"""The ray caster of a scene: fixed shapes are prepared once, moving ones are placed for each frame.

Rays and distances are of the shapes of all bodies and of the scenery. A free body whose links do not move about one
another is placed with all others like it at once; the links of any other by the one forward kinematics. A caster keeps
data of scene and layout, and the places of the newest frame, found again by the bits of all moving poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity, Layout
from foosim.world.rays.boxes import MARGIN_M, Floats
from foosim.world.rays.casting import Bundles, Hits, cast, distances
from foosim.world.rays.clearing import clear_of
from foosim.world.rays.shapes import NOTHING, Forms, Part, Placed, Poses, multiplied, rotated
from foosim.world.rays.solids import Meshes
from foosim.world.rays.sorted_boxes import FEW, SortedBoxes
from foosim.world.scene import ORIGIN, UPRIGHT, Body, Link, Pose, Scene, Vector, moved, multiply, rotate, shape_box

Ignoring: TypeAlias = NDArray[np.int64] | int | None
"""The index of the entity that rays pass, one for all or one for each; -1 or None without one."""
PASSES_NONE: Final = -2
"""In place of the number of a passed thing; `NOTHING` would be that of a missing hit."""


class Caster:
    """Rays in the frames of one layout.

    `things` are the names of all that rays can meet: of entities by their index in the layout, then of scenery.
    """

    def __init__(self, scene: Scene, layout: Layout) -> None:
        scenery = list(dict.fromkeys(shape.name for shape in scene.scenery))
        self.things = (*layout.names, *scenery)
        number = {name: len(layout.entities) + place for place, name in enumerate(scenery)}
        fixed: list[Part] = []
        moving: list[Part] = []
        self._free: list[tuple[Entity, Link]] = []
        self._jointed: list[tuple[Entity, Body]] = []
        meshes = Meshes()
        bodies = [(layout[name], body) for name, body in sorted(scene.bodies.items()) if body.is_solid]
        for entity, body in bodies:
            if body.joints:
                continue
            poses = _poses_about_base(body, entity)
            if body.is_free:
                frame, parts = len(self._free), moving
                self._free.append((entity, body.links[0]))
            else:
                frame, parts = 0, fixed
            parts += _parts(body, entity, [frame] * len(poses), poses)
        frames = len(self._free)
        for entity, body in bodies:
            if body.joints:
                self._jointed.append((entity, body))
                numbers = list(range(frames, frames + len(body.links)))
                moving += _parts(body, entity, numbers, [("", ORIGIN, UPRIGHT)] * len(numbers))
                frames += len(body.links)
        fixed += [(shape, number[shape.name], 0, ORIGIN, UPRIGHT) for shape in scene.scenery]
        self._forms, self._moving = Forms([*fixed, *moving], meshes), slice(len(fixed), None)
        self._prepare_frames()
        still = np.array([ORIGIN]).T, np.array([UPRIGHT]).T
        self._fixed = Poses(self._forms, slice(len(fixed)), *still).columns
        boxes = np.array([_box_of(part) for part in fixed]).reshape(-1, 2, 3).transpose(1, 2, 0)
        self._boxes = boxes[0] - MARGIN_M, boxes[1] + MARGIN_M
        self._near = SortedBoxes(*self._boxes)
        self._is_small = len(fixed) + len(moving) <= FEW
        self._key: bytes | None = None
        self._placement = Placement(Placed(self._forms, self._fixed, [self._near]))

    def _prepare_frames(self) -> None:
        """Note the places of moving poses in a frame."""
        at = [entity.offsets for entity, _ in self._free]
        places = [offsets[name] for name in ("position", "orientation") for offsets in at]
        counts = [3] * len(at) + [4] * len(at)
        links = [link for _, link in self._free]
        back = [(-link.principal[0], -link.principal[1], -link.principal[2], link.principal[3]) for link in links]
        self._back = np.array(back).reshape(-1, 4).T
        self._centres = np.array([link.centre_of_mass for link in links]).reshape(-1, 3).T
        for entity, body in self._jointed:
            its = [("joint_positions", len(body.joints))]
            its += [("position", 3), ("orientation", 4)] if body.is_free else []
            places += [entity.offsets[name] for name, _ in its]
            counts += [count for _, count in its]
        self._places = np.array(
            [start + step for start, count in zip(places, counts, strict=True) for step in range(count)], np.intp
        )

    def at(self, numbers: Sequence[float], values: Floats | None = None) -> Placement:
        """Return the caster in a frame of its layout, of these numbers; `values` are the same as an array."""
        if len(self._places):
            state = (np.array(numbers) if values is None else values)[self._places]
            key = state.tobytes()
            if key != self._key:
                self._placement, self._key = Placement(self._place(state, numbers)), key
        return self._placement

    def _place(self, state: Floats, numbers: Sequence[float]) -> Placed:
        """Return all shapes placed in a frame, of whose numbers `state` are those of the poses."""
        free = len(self._free)
        positions = state[: 3 * free].reshape(-1, 3).T
        orientations = multiplied(state[3 * free : 7 * free].reshape(-1, 4).T, self._back)
        positions = positions - rotated(orientations, self._centres)
        poses = [pose for entity, body in self._jointed for pose in forward_kinematics(body, entity, numbers)]
        if poses:
            positions = np.concatenate((positions, np.array([position for _, position, _ in poses]).T), axis=1)
            orientations = np.concatenate((orientations, np.array([turned for _, _, turned in poses]).T), axis=1)
        moving = Poses(self._forms, self._moving, positions, orientations)
        return Placed(self._forms, np.concatenate((self._fixed, moving.columns), axis=1), self._boxes_with(moving))

    def _boxes_with(self, moving: Poses) -> list[SortedBoxes]:
        """Return the boxes around all shapes: those of fixed shapes are sorted once, where they are many."""
        boxes = moving.boxes()
        if not self._is_small:
            return [self._near, SortedBoxes(*boxes)]
        low, high = (np.concatenate(pair, axis=1) for pair in zip(self._boxes, boxes, strict=True))
        return [SortedBoxes(low, high)]


class Placement:
    """All things placed in one frame."""

    def __init__(self, placed: Placed) -> None:
        self._placed = placed

    def cast(self, origins: Floats, directions: Floats, ranges: Floats | float, ignoring: Ignoring = None) -> Hits:
        """Return the first hits of rays: distances (n,) and the numbers of things (n,), inf and -1 without a hit.

        `origins` and unit `directions` (n, 3) are in the world frame (m), `ranges` (n,) are their lengths (m); a ray
        passes the entity `ignoring`. One that begins inside of a thing meets it at 0, one that touches a thing does not
        meet it. Each has the same bits alone and among others in any order.
        """
        count = len(origins)
        starts, ways = (
            np.ascontiguousarray(np.asarray(rows, np.float64).reshape(-1, 3).T) for rows in (origins, directions)
        )
        far = np.ascontiguousarray(np.broadcast_to(np.asarray(ranges, np.float64), count))
        return cast(self._placed, Bundles.of_rays(starts, ways, far, _passed(ignoring, count)))

    def fans(self, origins: Floats, ways: Floats, ranges: Floats, passing: NDArray[np.int64]) -> Floats:
        """Return the distances (f, r) that `cast` gives of f fans of r rays that begin at one place.

        `origins` (3, f) and unit `ways` (3, f, r) are in the world frame (m), `ranges` (f,) are the lengths of a fan's
        rays (m), `passing` (f,) the index of the entity that they pass.
        """
        return distances(self._placed, Bundles.of_fans(origins, ways, ranges, passing)).reshape(ways.shape[1:])

    def clearance(self, points: Floats, reach: Floats | float, ignoring: Ignoring = None) -> Floats:
        """Return the distances of points (n, 3) from the nearest surface (m): negative inside, inf beyond `reach`.

        All is in the world frame; the entity `ignoring` does not count. An open mesh has no inside.
        Each has the same bits alone and among others in any order.
        """
        count = len(points)
        places = np.ascontiguousarray(np.asarray(points, np.float64).reshape(-1, 3).T)
        far = np.ascontiguousarray(np.broadcast_to(np.asarray(reach, np.float64), count))
        return clear_of(self._placed, places, far, _passed(ignoring, count))


def _passed(ignoring: Ignoring, count: int) -> NDArray[np.int64]:
    """Return the number of the thing that each passes; PASSES_NONE for none."""
    given = np.broadcast_to(np.asarray(NOTHING if ignoring is None else ignoring, np.int64), count)
    return np.where(given < 0, PASSES_NONE, given)


def _poses_about_base(body: Body, entity: Entity) -> list[Pose]:
    """Return the poses of a body's links, without moving joints: in the world, or of a free one about its first."""
    if body.is_free:
        first = replace(body.links[0], joint="fixed", position=ORIGIN, orientation=UPRIGHT)
        body = replace(body, position=ORIGIN, orientation=UPRIGHT, links=(first, *body.links[1:]))
    return forward_kinematics(body, entity, ())


def _box_of(part: Part) -> tuple[Vector, Vector]:
    """Return the least and the greatest coordinates of a fixed shape."""
    shape, _, _, position, orientation = part
    turned = multiply(orientation, shape.orientation)
    return shape_box(
        replace(shape, position=moved(position, rotate(orientation, shape.position), 1.0), orientation=turned)
    )


def _parts(body: Body, entity: Entity, frames: Sequence[int], poses: Sequence[Pose]) -> list[Part]:
    """Return the shapes of a body's links, which are fixed to these frames at these poses."""
    return [
        (shape, entity.index, frame, position, orientation)
        for link, frame, (_, position, orientation) in zip(body.links, frames, poses, strict=True)
        for shape in link.shapes
    ]
