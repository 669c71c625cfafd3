"""The overlap of two convex bodies: the least displacement of one of them that separates both.

It is the depth of the origin in the Minkowski difference of both, of which only a polytope inside is built: it grows
where its surface is nearest to the origin (G. van den Bergen, "Proximity queries and penetration depth computation on
3D game objects", GDC 2001). It begins with any tetrahedron: as long as the origin is outside, the distance of a face is
negative, and a direction with the whole difference on the other side of the origin separates both. Pure Python, for few
pairs before a run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, sqrt
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.matter.mesh import Mesh
from foosim.world.scene import (
    Box,
    Capsule,
    Cylinder,
    Hull,
    Quaternion,
    Shape,
    Sphere,
    Vector,
    conjugate,
    cross,
    dot,
    moved,
    rotate,
)

GROWTH_MAX: Final = 200
"""The greatest count of a polytope's corners: bodies with edges need a few, round ones of any size less than this."""
EXACT_M: Final = 1e-6
EXACT_SHARE: Final = 0.005
"""Growing ends where the depth is exact to this (m), or to this share of itself."""
FLAT: Final = 1e-9
"""The sine of the angle between two edges of a face, below which it has no direction."""
AXES: Final[tuple[Vector, ...]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
Geometry: TypeAlias = Box | Sphere | Cylinder | Capsule


class Solid:
    """A box, sphere, cylinder or capsule at a pose in the world."""

    def __init__(self, geometry: Geometry, position: Vector, orientation: Quaternion) -> None:
        self.middle = position
        self.ball = geometry.radius if isinstance(geometry, Sphere) else 0.0
        """Its radius if it is round all over."""
        self._geometry, self._orientation, self._back = geometry, orientation, conjugate(orientation)

    def farthest(self, way: Vector) -> Vector:
        """Return a point that is farthest along a direction, which is a unit vector."""
        x, y, z = rotate(self._back, way)
        its = self._geometry
        if isinstance(its, Box):
            a, b, c = its.half
            there = a if x >= 0.0 else -a, b if y >= 0.0 else -b, c if z >= 0.0 else -c
        elif isinstance(its, Sphere):
            there = its.radius * x, its.radius * y, its.radius * z
        elif isinstance(its, Capsule):
            half = its.length / 2 if z >= 0.0 else -its.length / 2
            there = its.radius * x, its.radius * y, its.radius * z + half
        else:
            across = sqrt(x * x + y * y)
            reach = its.radius / across if across > 0.0 else 0.0
            there = reach * x, reach * y, its.length / 2 if z >= 0.0 else -its.length / 2
        return moved(self.middle, rotate(self._orientation, there), 1.0)

    def directions(self) -> Iterator[Vector]:
        """Yield directions across its flat sides."""
        if isinstance(self._geometry, Box):
            yield from (rotate(self._orientation, axis) for axis in AXES)
        elif isinstance(self._geometry, Cylinder):
            yield rotate(self._orientation, AXES[2])


class Corners:
    """The convex hull of points in the world, shape (n, 3); three of them are a triangle."""

    def __init__(self, points: NDArray[np.float64]) -> None:
        self._points: list[Vector] = [(x, y, z) for x, y, z in points.tolist()]
        self._x, self._y, self._z = (np.ascontiguousarray(points[:, axis]) for axis in range(3))
        x, y, z = (sum(point[axis] for point in self._points) / len(self._points) for axis in range(3))
        self.middle: Vector = (x, y, z)
        self.ball = 0.0

    def farthest(self, way: Vector) -> Vector:
        """Return a point that is farthest along a direction."""
        return self._points[int(np.argmax(self._x * way[0] + self._y * way[1] + self._z * way[2]))]

    def directions(self) -> Iterator[Vector]:
        """Yield the direction across a triangle."""
        if len(self._points) == 3:
            a, b, c = self._points
            way = _unit(cross(moved(b, a, -1.0), moved(c, a, -1.0)))
            if way is not None:
                yield way


Convex: TypeAlias = Solid | Corners


def convex_parts(
    shape: Shape, position: Vector, orientation: Quaternion, low: Vector, high: Vector
) -> Iterator[Convex]:
    """Yield a shape at a pose in the world as convex bodies: of a mesh the triangles whose boxes meet a box."""
    its = shape.geometry
    if isinstance(its, Mesh):
        corners = _placed(its, position, orientation)[its.triangles]
        is_met = (corners.min(axis=1) <= high).all(axis=1) & (corners.max(axis=1) >= low).all(axis=1)
        yield from map(Corners, corners[is_met])
    elif isinstance(its, Hull):
        yield Corners(_placed(its.mesh, position, orientation))
    else:
        yield Solid(its, position, orientation)


def _placed(mesh: Mesh, position: Vector, orientation: Quaternion) -> NDArray[np.float64]:
    """Return the corners of a mesh at a pose in the world, shape (n, 3)."""
    x, y, z = mesh.vertices.T
    ex, ey, ez = (rotate(orientation, axis) for axis in AXES)
    return np.stack([position[i] + x * ex[i] + y * ey[i] + z * ez[i] for i in range(3)], axis=1)


def overlap_of(one: Convex, other: Convex, tolerance_m: float) -> float:
    """Return the overlap of two bodies (m), to `EXACT_M` or `EXACT_SHARE`; 0 up to a tolerance.

    Not both are flat.
    """
    if one.ball > 0.0 and other.ball > 0.0:
        apart = moved(one.middle, other.middle, -1.0)
        depth = one.ball + other.ball - sqrt(dot(apart, apart))
        return depth if depth > tolerance_m else 0.0
    growing = _Growing(one, other)
    for way in (*one.directions(), *other.directions(), _unit(moved(one.middle, other.middle, -1.0))):
        if way is not None and min(growing.reach(way), growing.reach(_back(way))) <= tolerance_m:
            return 0.0
    growing.begin()
    for _ in range(GROWTH_MAX):
        if growing.most <= tolerance_m:
            return 0.0
        if not growing.grow():
            break
    return growing.most if growing.least > tolerance_m else 0.0


class _Face:
    """A triangle of a polytope: corners, unit normal outwards, the distance of its plane from the origin along it."""

    __slots__ = ("corners", "far", "normal")

    def __init__(self, points: Sequence[Vector], corners: tuple[int, int, int]) -> None:
        a, b, c = (points[corner] for corner in corners)
        one, other = moved(b, a, -1.0), moved(c, a, -1.0)
        across = cross(one, other)
        length = sqrt(dot(across, across))
        self.corners = corners
        if length > FLAT * sqrt(dot(one, one) * dot(other, other)):
            self.normal: Vector = (across[0] / length, across[1] / length, across[2] / length)
            self.far = dot(self.normal, a)
        else:  # it keeps the surface closed, and is never the nearest one
            self.normal, self.far = (0.0, 0.0, 0.0), inf


class _Growing:
    """A polytope within the Minkowski difference of two bodies.

    The origin is at most as deep in the difference as `most`, and at least as deep as `least`, both in m.
    """

    def __init__(self, one: Convex, other: Convex) -> None:
        self._one, self._other = one, other
        self.most = inf
        self.least = -inf
        self._points: list[Vector] = []
        self._faces: dict[int, _Face] = {}
        self._edges: dict[tuple[int, int], int] = {}
        self._next = 0

    def reach(self, way: Vector) -> float:
        """Return the extent of the difference from the origin along a direction: a bound of the origin's depth."""
        return dot(self._farthest(way), way)

    def _farthest(self, way: Vector) -> Vector:
        point = moved(self._one.farthest(way), self._other.farthest(_back(way)), -1.0)
        self.most = min(self.most, dot(point, way))
        return point

    def begin(self) -> None:
        """Begin with a tetrahedron: the ends along x, then the farthest points across them, and across all three."""
        a, b = self._farthest(AXES[0]), self._farthest(_back(AXES[0]))
        along = moved(a, b, -1.0)
        least = min(range(3), key=lambda axis: abs(along[axis]))
        c = self._away(a, cross(along, AXES[least]))
        d = self._away(a, cross(along, moved(c, a, -1.0)))
        self._points = [a, b, c, d]
        if dot(cross(moved(b, a, -1.0), moved(c, a, -1.0)), moved(d, a, -1.0)) > 0.0:
            self._points = [a, c, b, d]
        for corners in ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)):
            self._add(corners)

    def _away(self, point: Vector, across: Vector) -> Vector:
        """Return the point that is farthest from a point along a direction, or against it."""
        way = _unit(across)
        assert way is not None, "the ends along a direction are apart"
        one, other = self._farthest(way), self._farthest(_back(way))
        is_one = abs(dot(moved(one, point, -1.0), way)) >= abs(dot(moved(other, point, -1.0), way))
        return one if is_one else other

    def grow(self) -> bool:
        """Add a corner beyond the face that is nearest to the origin; False where the difference ends there."""
        key = min(self._faces, key=lambda key: (self._faces[key].far, key))
        face = self._faces[key]
        self.least = face.far
        point = self._farthest(face.normal)
        if dot(point, face.normal) - face.far <= max(EXACT_M, EXACT_SHARE * abs(face.far)):
            return False
        number = len(self._points)
        self._points.append(point)
        for one, other in self._opened(key, point):
            self._add((one, other, number))
        return True

    def _opened(self, start: int, point: Vector) -> list[tuple[int, int]]:
        """Remove the faces that a point sees, from one on; return the edges around them."""
        seen, order, around = {start}, [start], []
        for key in order:
            a, b, c = self._faces[key].corners
            for edge in ((a, b), (b, c), (c, a)):
                behind = self._edges[edge[1], edge[0]]
                if behind in seen:
                    continue
                face = self._faces[behind]
                if dot(face.normal, point) > face.far + EXACT_M * 1e-3:
                    seen.add(behind)
                    order.append(behind)
                else:
                    around.append((edge, behind))
        for key in order:
            a, b, c = self._faces.pop(key).corners
            for edge in ((a, b), (b, c), (c, a)):
                del self._edges[edge]
        return [edge for edge, behind in around if behind not in seen]

    def _add(self, corners: tuple[int, int, int]) -> None:
        self._faces[self._next] = _Face(self._points, corners)
        a, b, c = corners
        for edge in ((a, b), (b, c), (c, a)):
            self._edges[edge] = self._next
        self._next += 1


def _back(way: Vector) -> Vector:
    return -way[0], -way[1], -way[2]


def _unit(way: Vector) -> Vector | None:
    length = sqrt(dot(way, way))
    return (way[0] / length, way[1] / length, way[2] / length) if length > 0.0 else None
