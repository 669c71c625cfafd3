"""The convex hull of points, with few corners, as engines need it: deterministic, around all of the points.

Quickhull (Barber, Dobkin, Huhdanpaa, The Quickhull Algorithm for Convex Hulls, 1996), always with the point that is
farthest outside. On which side of a plane a point lies is decided by whole numbers, of points on a grid of 2^20 steps,
whose determinants fit int64: many points in one plane, as meshes have them, cannot mislead it. Where points are left
outside of the greatest number of corners, the hull is scaled about its middle until it holds them, too. So it holds all
points, to a few millionths of its length, the resolution of the grid.
"""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import blake2b
from heapq import heappop, heappush
from math import sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import BadValue
from foosim.world.matter.mesh import Mesh

CORNERS_MAX: Final = 255
STEPS: Final = 1 << 20
"""Differences of coordinates have 20 bits, their cross products 41 and determinants 63: the sign included, an int64."""
FLAT: Final = 1e-4
"""The least share of its longest side that a hull is thick."""

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


def convex_hull(points: Floats, corners_max: int = CORNERS_MAX) -> Mesh:
    """Return the hull of points (n, 3), in m, as a closed mesh of triangles, counter-clockwise seen from outside.

    Raises BadValue for points that lie in a plane.
    """
    points = np.unique(np.asarray(points, dtype=np.float64) + 0.0, axis=0)
    low = points.min(axis=0)
    extent = float((points.max(axis=0) - low).max())
    if len(points) < 4 or not extent > 0.0:
        raise BadValue(f"{len(points)} different corners: a convex hull has at least 4")
    grid = np.rint((points - low) * (STEPS / extent)).astype(np.int64)
    building = _Building(grid, _first_four(grid))
    while building.count < corners_max and building.grow():
        pass
    triangles = np.array([building.faces[key].corners for key in sorted(building.faces)], dtype=np.int64)
    used, numbers = np.unique(triangles, return_inverse=True)
    found = np.ascontiguousarray(numbers.reshape(-1, 3), dtype=np.int32)
    vertices = _around(points, points[used], building)
    return Mesh(vertices, found, blake2b(vertices.tobytes() + found.tobytes(), digest_size=32).digest())


class _Face:
    """A triangle of the hull: corners, the neighbour beyond each edge (corner i to i + 1), and the points outside.

    `normal` points outwards and is as long as twice the area, `level` is its product with a corner, in steps.
    """

    __slots__ = ("corners", "far", "level", "neighbours", "normal", "outside")

    def __init__(self, corners: tuple[int, int, int], places: Mapping[int, tuple[int, int, int]]) -> None:
        self.corners = corners
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (places[corner] for corner in corners)
        ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
        nx, ny, nz = self.normal = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        self.level = nx * ax + ny * ay + nz * az
        self.neighbours = [-1, -1, -1]
        self.outside: Ints = np.zeros(0, dtype=np.int64)
        self.far = -1
        """The farthest of those points."""


class _Building:
    """A hull that grows by one corner at a time."""

    def __init__(self, grid: Ints, four: tuple[int, int, int, int]) -> None:
        self.grid = grid
        self._x, self._y, self._z = np.ascontiguousarray(grid.T)
        self.count = 4
        self.faces: dict[int, _Face] = {}
        self._next = 0
        self._places = {corner: self._place(corner) for corner in four}
        self._farthest: list[tuple[float, int]] = []
        """A heap of the faces with points outside, also of some that are gone: their distance, negative, and key."""
        a, b, c, d = four
        keys = [self._add(corners) for corners in ((a, b, c), (a, d, b), (b, d, c), (c, d, a))]
        self._join(keys)
        self._share_out(np.arange(len(grid), dtype=np.int64), keys)

    def grow(self) -> bool:
        """Add the point that is farthest outside as a corner; False when no point is outside."""
        while self._farthest and self._farthest[0][1] not in self.faces:
            heappop(self._farthest)
        if not self._farthest:
            return False
        start, self.count = self._farthest[0][1], self.count + 1
        corner = self.faces[start].far
        self._places[corner] = self._place(corner)
        seen, horizon = self._horizon(start, corner)
        orphans = np.concatenate([self.faces[key].outside for key in seen])
        for key in seen:
            del self.faces[key]
        keys = []
        for one, other, beyond in horizon:
            key = self._add((one, other, corner))
            face, neighbour = self.faces[key], self.faces[beyond]
            face.neighbours[0] = beyond
            edge = next(i for i in range(3) if neighbour.corners[i] == other and neighbour.corners[i - 2] == one)
            neighbour.neighbours[edge] = key
            keys.append(key)
        begins = {self.faces[key].corners[0]: key for key in keys}
        for key in keys:
            following = begins[self.faces[key].corners[1]]
            self.faces[key].neighbours[1] = following
            self.faces[following].neighbours[2] = key
        self._share_out(orphans, keys)
        return True

    def _place(self, point: int) -> tuple[int, int, int]:
        x, y, z = self.grid[point].tolist()
        return x, y, z

    def _add(self, corners: tuple[int, int, int]) -> int:
        self.faces[self._next] = _Face(corners, self._places)
        self._next += 1
        return self._next - 1

    def _join(self, keys: list[int]) -> None:
        """Make the faces of the first tetrahedron each other's neighbours."""
        edges = {(self.faces[key].corners[i], self.faces[key].corners[i - 2]): key for key in keys for i in range(3)}
        for key in keys:
            corners = self.faces[key].corners
            self.faces[key].neighbours = [edges[corners[i - 2], corners[i]] for i in range(3)]

    def _share_out(self, points: Ints, keys: list[int]) -> None:
        """Give each point to the first face that it is outside of; those within all are dropped."""
        for key in keys:
            face = self.faces[key]
            if len(points) == 0:
                return
            nx, ny, nz = face.normal
            volumes = nx * self._x[points] + ny * self._y[points] + nz * self._z[points] - face.level
            greatest = int(volumes.max())
            if greatest > 0:
                out = volumes > 0
                face.outside = points[out]
                face.far = int(points[volumes == greatest].min())
                x, y, z = map(float, face.normal)
                heappush(self._farthest, (-(greatest / sqrt(x * x + y * y + z * z)), key))
                points = points[~out]

    def _horizon(self, start: int, corner: int) -> tuple[list[int], list[tuple[int, int, int]]]:
        """Return the faces that a point sees, and the edges around them (from, to, the face beyond)."""
        x, y, z = self._places[corner]
        seen, order, horizon = {start}, [start], []
        for key in order:
            face = self.faces[key]
            for neighbour in face.neighbours:
                if neighbour in seen:
                    continue
                beyond = self.faces[neighbour]
                nx, ny, nz = beyond.normal
                if nx * x + ny * y + nz * z > beyond.level:
                    seen.add(neighbour)
                    order.append(neighbour)
        for key in order:
            face = self.faces[key]
            for edge, neighbour in enumerate(face.neighbours):
                if neighbour not in seen:
                    horizon.append((face.corners[edge], face.corners[edge - 2], neighbour))
        return order, horizon


def _first_four(grid: Ints) -> tuple[int, int, int, int]:
    """Return four corners of a tetrahedron with an inside, the fourth below the triangle of the others."""
    extents = grid.max(axis=0) - grid.min(axis=0)
    axis = int(np.argmax(extents))
    a, b = int(np.argmin(grid[:, axis])), int(np.argmax(grid[:, axis]))
    along, offset = grid[b] - grid[a], grid - grid[a]
    across = np.stack(
        (
            along[1] * offset[:, 2] - along[2] * offset[:, 1],
            along[2] * offset[:, 0] - along[0] * offset[:, 2],
            along[0] * offset[:, 1] - along[1] * offset[:, 0],
        ),
        axis=1,
    ).astype(np.float64)
    c = int(np.argmax(across[:, 0] * across[:, 0] + across[:, 1] * across[:, 1] + across[:, 2] * across[:, 2]))
    normal = [int(part) for part in across[c]]
    volumes = normal[0] * offset[:, 0] + normal[1] * offset[:, 1] + normal[2] * offset[:, 2]
    d = int(np.argmax(np.abs(volumes)))
    area = float(np.sqrt(sum(float(part) * float(part) for part in normal)))
    if not abs(float(volumes[d])) > FLAT * STEPS * area:
        raise BadValue(f"its corners lie in a plane, or nearly: a convex hull is at least {FLAT:g} of its length thick")
    return (a, b, c, d) if volumes[d] < 0 else (a, c, b, d)


def _around(points: Floats, vertices: Floats, building: _Building) -> Floats:
    """Return a hull's vertices, scaled about their middle by as little as it takes to hold all points."""
    middle = [sum(vertices[:, axis].tolist()) / len(vertices) for axis in range(3)]
    offset = [points[:, axis] - middle[axis] for axis in range(3)]
    scale = 1.0
    for key in sorted(building.faces):
        face = building.faces[key]
        x, y, z = map(float, face.normal)
        reach = x * offset[0] + y * offset[1] + z * offset[2]
        height, farthest = max(reach[[*face.corners]].tolist()), float(reach.max())
        if farthest > height * scale:
            scale = farthest / height
    return np.array([[middle[i] + scale * (vertex[i] - middle[i]) for i in range(3)] for vertex in vertices.tolist()])
