"""The triangles of a scene: what stands is placed once, what moves whenever its pose is another one."""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import Malformed
from foosim.kernels.raster import Floats, Ints, runs
from foosim.rendering.tessellation import corners_of
from foosim.world.components.optics import moving_links
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Layout
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import ORIGIN, UPRIGHT, Colour, Pose, Quaternion, Scene, Shape, Vector, drawn, looks_of

SUN: Final[Vector] = (0.384, 0.288, 0.8772684879784524)
"""The direction to the sun, of length 1."""
FAR: Final = 1e7
"""The greatest coordinate (m) and velocity (m/s or rad/s): entities that are absent are parked within it."""
UNIT: Final = 0.01
"""How far the square of a quaternion's length may be from 1."""


class Model:
    """All triangles: those of what stands first, then those of moving links by their numbers.

    `world` (v, 3) are the corners in the world (m), `facing` (v,) the cosine between a corner's normal and the sun,
    `triangles` (t, 3) corners of triangles; `thing` (t + 1,) the number in `things` and `colours` (t + 1, 3) of each,
    the last for none. `curved` are those whose corners face the sun unequally or that are seen from both sides. A row
    of `ranges` (n, 5) is a part for the kernel, within a sphere about `centres` (n, 3) of `radii` (n,); the first
    `standing` parts stand.
    """

    def __init__(self, scene: Scene, layout: Layout) -> None:
        scenery: dict[str, list[Shape]] = {}
        for shape in drawn(scene.scenery):
            scenery.setdefault(shape.name, []).append(shape)
        self.things = (*layout.names, *scenery)
        building = _Building()
        for number, one in enumerate(scenery.values(), len(layout.names)):
            building.add(number, one, ORIGIN, UPRIGHT)
        moving = {place: number for number, place in enumerate(moving_links(scene.bodies))}
        still = [0.0] * layout.size  # poses of what stands do not depend on them
        later: list[tuple[int, int, tuple[Shape, ...]]] = []
        bodies = sorted(scene.bodies.items())
        looks = iter(looks_of(link for _, body in bodies for link in body.links))
        for name, body in bodies:
            poses: list[Pose] = forward_kinematics(body, layout[name], still)
            for index, (_, position, orientation) in enumerate(poses):
                shapes = next(looks)[1]
                if (name, index) in moving:
                    later.append((moving[name, index], layout[name].index, shapes))
                else:
                    building.add(layout[name].index, shapes, position, orientation)
        self.standing = len(building.parts)
        self._begins: list[tuple[int, int, int]] = []
        for _, thing, shapes in sorted(later, key=lambda link: link[0]):
            self._begins.append((building.vertices, building.count, len(building.parts)))
            building.add(thing, shapes, ORIGIN, UPRIGHT)
        self._begins.append((building.vertices, building.count, len(building.parts)))
        self._take(building)

    def _take(self, building: _Building) -> None:
        self._links = np.array(self._begins, np.int64).reshape(-1, 3)
        """The first vertex, triangle and part of each moving link, and the ends."""
        self._local = np.concatenate([*[part.vertices for part in building.parts], np.zeros((0, 6))]).T.copy()
        self.world = np.ascontiguousarray(self._local[:3].T)
        self.facing = _dot(self._local[3:], SUN)
        self.triangles = np.concatenate(
            [*[part.triangles for part in building.parts], np.zeros((0, 3), np.int32)], dtype=np.int32
        )
        self.thing = np.array([*np.repeat([p.thing for p in building.parts], building.counts), -1], np.int32)
        self.colours = np.concatenate([*[part.colours for part in building.parts], np.zeros((1, 3), np.float32)])
        self.ranges = np.array([part.range for part in building.parts], np.int32).reshape(-1, 5)
        self._middles = np.array([part.middle for part in building.parts]).reshape(-1, 3)
        self.centres = self._middles.copy()
        self.radii = np.array([part.radius for part in building.parts])
        normals = self._local[3:].T[self.triangles]
        curved = (normals != normals[:, :1]).any(axis=(1, 2))
        both = np.repeat(self.ranges[:, 4] != 0, building.counts)
        self.curved = np.append(curved | both, False)
        self._poses = np.full((len(self._links) - 1, 7), np.nan)
        self.bounds = self._bounds()

    def _bounds(self) -> tuple[Vector, float]:
        """Return the middle and the radius of a sphere around what stands."""
        low, high = np.zeros(3), np.zeros(3)
        if self.standing:
            reach, centres = self.radii[: self.standing, np.newaxis], self.centres[: self.standing]
            low, high = (centres - reach).min(axis=0), (centres + reach).max(axis=0)
        (x, y, z), (a, b, c) = ((low + high) * 0.5).tolist(), ((high - low) * 0.5).tolist()
        return (x, y, z), sqrt(a * a + b * b + c * c)

    def place(self, numbers: NDArray[np.intp], poses: Floats) -> Ints:
        """Place moving links, by their numbers (n,) and poses (n, 7); return the triangles that moved since."""
        changed = (self._poses[numbers] != poses).any(axis=1)
        numbers, poses = numbers[changed], poses[changed]
        self._poses[numbers] = poses
        begins, ends = self._links[numbers], self._links[numbers + 1]
        matrix = rotations(poses[:, 3:].T)
        place = np.concatenate([matrix, poses[:, :3].T])
        parts = runs(begins[:, 2], ends[:, 2])
        self.centres[parts] = _moved(np.repeat(place, ends[:, 2] - begins[:, 2], axis=1), self._middles[parts].T)
        vertices = runs(begins[:, 0], ends[:, 0])
        each = np.repeat(place, ends[:, 0] - begins[:, 0], axis=1)
        local = self._local[:, vertices]
        self.world[vertices] = _moved(each, local[:3])
        sun = np.repeat([_dot(matrix[i::3], SUN) for i in range(3)], ends[:, 0] - begins[:, 0], axis=1)
        self.facing[vertices] = sun[0] * local[3] + sun[1] * local[4] + sun[2] * local[5]
        return runs(begins[:, 1], ends[:, 1])

    def parts_of(self, numbers: NDArray[np.intp]) -> Ints:
        """Return the parts of moving links, in the order of the numbers."""
        return runs(self._links[numbers, 2], self._links[numbers + 1, 2])


class _Part(NamedTuple):
    thing: int
    vertices: Floats
    triangles: NDArray[np.int64]
    colours: NDArray[np.float32]
    range: tuple[int, int, int, int, bool]
    middle: Floats
    radius: float


class _Building:
    """Parts one after the other."""

    def __init__(self) -> None:
        self.parts: list[_Part] = []
        self.counts: list[int] = []
        self.vertices = self.count = 0

    def add(self, thing: int, shapes: Iterable[Shape], position: Vector, orientation: Quaternion) -> None:
        """Add shapes of a link at this pose: a part for closed ones, one for what is seen from both sides."""
        visible = [shape for shape in shapes if shape.colour[3] > 0.0]
        for both in (False, True):
            some = [shape for shape in visible if isinstance(shape.geometry, Mesh) is both]
            if some:
                self._add(thing, some, both, np.array([*position, *orientation]))

    def _add(self, thing: int, shapes: list[Shape], both: bool, pose: Floats) -> None:
        rows: list[Floats] = []
        colours: list[tuple[Colour, int]] = []
        for shape in shapes:
            corners = np.concatenate(corners_of(shape.geometry), axis=2).reshape(-1, 6).T
            for at in (np.array([*shape.position, *shape.orientation]), pose):
                matrix = rotations(at[3:])
                corners = np.concatenate(
                    [_moved([*matrix, *at[:3]], corners[:3]).T, _moved([*matrix, 0.0, 0.0, 0.0], corners[3:]).T]
                )
            rows.append(corners.T + 0.0)
            colours.append((shape.colour, len(corners.T) // 3))
        vertices, triangles = np.unique(np.concatenate(rows), axis=0, return_inverse=True)
        low, high = vertices[:, :3].min(axis=0), vertices[:, :3].max(axis=0)
        middle = (low + high) * 0.5
        x, y, z = (vertices[:, :3] - middle).T
        count = len(triangles) // 3
        spans = (self.vertices, self.vertices + len(vertices), self.count, self.count + count, both)
        own = np.concatenate([np.full((n, 3), np.array(colour[:3]) * 255.0, np.float32) for colour, n in colours])
        triangles = triangles.reshape(-1, 3) + self.vertices
        radius = float(np.sqrt((x * x + y * y + z * z).max()))
        self.parts.append(_Part(thing, vertices, triangles, own, spans, middle, radius))
        self.counts.append(count)
        self.vertices, self.count = spans[1], spans[3]


def check_poses(poses: Floats, velocities: Floats) -> None:
    """Raise Malformed where these are no poses (n, 7) and velocities (n, 6)."""
    x, y, z, w = poses[:, 3:].T
    near = (np.abs(poses) <= FAR).all() and (np.abs(velocities) <= FAR).all()
    if not (near and (np.abs(x * x + y * y + z * z + w * w - 1.0) < UNIT).all()):
        raise Malformed(f"a pose or velocity of a picture has no finite numbers to {FAR:g} and a unit quaternion")


def advanced(poses: Floats, velocities: Floats, later_s: float) -> Floats:
    """Return poses (n, 7) after a short time (before, if negative) at velocities (n, 6), in the world frame."""
    if later_s == 0.0:
        return poses
    moved = poses.copy()
    moved[:, :3] += velocities[:, :3] * later_s
    (a, b, c), (x, y, z, w) = velocities[:, 3:].T * (0.5 * later_s), poses[:, 3:].T
    turned = [
        x + a * w + b * z - c * y,
        y + b * w + c * x - a * z,
        z + c * w + a * y - b * x,
        w - a * x - b * y - c * z,
    ]
    length = np.sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2] + turned[3] * turned[3])
    is_turning = velocities[:, 3:].any(axis=1)
    for i, part in enumerate(turned, 3):
        moved[is_turning, i] = (part / length)[is_turning]
    return moved


def rotations(orientations: Floats) -> Floats:
    """Return the nine numbers of rotation matrices, row by row, from quaternions (4, ...)."""
    x, y, z, w = orientations
    return np.stack(
        [
            *(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
            *(2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
            *(2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
        ]
    )


def _moved(place: Floats | list[float], points: Floats) -> Floats:
    """Return points (3, n) as (n, 3), turned and moved by the twelve numbers of `place`."""
    x, y, z = points
    return np.stack([place[i] * x + place[i + 1] * y + place[i + 2] * z + place[9 + i // 3] for i in (0, 3, 6)], axis=1)


def _dot(columns: Floats, vector: Vector) -> Floats:
    x, y, z = columns
    return np.asarray(x * vector[0] + y * vector[1] + z * vector[2])
