"""Shapes as rays meet them: a shape at a pose, the spans of a line inside of it, and the union of spans."""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt
from typing import Final

from foosim.world.matter.mesh import Mesh
from foosim.world.rays.spans import Span, box_span, capsule_span, cylinder_span, sphere_span
from foosim.world.rays.triangles import Triangles
from foosim.world.scene import (
    ORIGIN,
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Hull,
    Quaternion,
    Shape,
    Sphere,
    Vector,
    multiply,
    rotate,
)

TOUCH_M: Final = 1e-9
"""The longest way through a shape that is a touch (m); shapes of one thing this close are one."""
BOX: Final = 0
CYLINDER: Final = 1
SPHERE: Final = 2
MESH: Final = 3
CAPSULE: Final = 4
"""Forms of shapes."""

Line = tuple[Vector, Vector]
"""Two ends in the world frame (m)."""
Piece = list[Span]
"""The spans of a line inside of a thing, in order."""
Ray = tuple[Vector, Vector, float]
"""A line from its lesser end: start, unit direction, length."""


def ray_of(line: Line) -> Ray:
    """Return a line as a ray; one without a length has no direction."""
    (ax, ay, az), (bx, by, bz) = line
    x, y, z = bx - ax, by - ay, bz - az
    length = sqrt(x * x + y * y + z * z)
    if length > 0.0:
        return (ax, ay, az), (x / length, y / length, z / length), length
    return (ax, ay, az), (0.0, 0.0, 0.0), length


def form_of(geometry: Geometry) -> tuple[int, Vector]:
    """Return the form of a geometry, and half of the box around it about its own axes; of a mesh the latter is 0.

    Of a capsule it is that of its cylinder, without the half spheres.
    """
    if isinstance(geometry, Box):
        return BOX, geometry.half
    if isinstance(geometry, Cylinder):
        return CYLINDER, (geometry.radius, geometry.radius, geometry.length / 2)
    if isinstance(geometry, Sphere):
        return SPHERE, (geometry.radius, geometry.radius, geometry.radius)
    if isinstance(geometry, Capsule):
        return CAPSULE, (geometry.radius, geometry.radius, geometry.length / 2)
    return MESH, ORIGIN


class Meshes:
    """Meshes as rays meet them, equal ones once."""

    def __init__(self) -> None:
        self._known: dict[bytes, Triangles] = {}

    def triangles_of(self, geometry: Geometry) -> Triangles | None:
        """Return the triangles of a mesh or of a convex hull, None of other shapes."""
        mesh = geometry.mesh if isinstance(geometry, Hull) else geometry
        if not isinstance(mesh, Mesh):
            return None
        if mesh.digest not in self._known:
            self._known[mesh.digest] = Triangles(mesh)
        return self._known[mesh.digest]


class Solid:
    """A shape as rays meet it, in the world or in its link; `group` is the number of its name and material."""

    __slots__ = ("_back", "_form", "_half", "_is_turned", "_orientation", "_position", "group", "triangles")

    def __init__(
        self,
        form: int,
        half: Vector,
        triangles: Triangles | None,
        group: int,
        position: Vector,
        orientation: Quaternion,
    ) -> None:
        """`half` is that of the box around a shape of a `form`, about its own axes."""
        self._form, self._half, self.triangles, self.group = form, half, triangles, group
        self._position, self._orientation = position, orientation
        x, y, z, w = orientation
        self._back = (-x, -y, -z, w)
        self._is_turned = x != 0.0 or y != 0.0 or z != 0.0 or w != 1.0

    def placed(self, position: Vector, orientation: Quaternion) -> Solid:
        """Return it in the world, where its link has this pose."""
        x, y, z = rotate(orientation, self._position)
        place = position[0] + x, position[1] + y, position[2] + z
        turned = multiply(orientation, self._orientation)
        return Solid(self._form, self._half, self.triangles, self.group, place, turned)

    def pieces(self, ray: Ray) -> list[Piece]:
        """Return the spans of a ray inside of it; of an open mesh, each wall that the ray passes is a span."""
        (x, y, z), way, length = ray
        px, py, pz = self._position
        start = (x - px, y - py, z - pz)
        if self._is_turned:
            start, way = rotate(self._back, start), rotate(self._back, way)
        if self.triangles is not None:
            return _through_mesh(self.triangles, start, way, length)
        if self._form == BOX:
            span = box_span(start, way, self._half)
        elif self._form == CYLINDER:
            span = cylinder_span(start, way, self._half[0], self._half[2])
        elif self._form == CAPSULE:
            span = capsule_span(start, way, self._half[0], self._half[2])
        else:
            span = sphere_span(start, way, self._half[0])
        if span is None:
            return []
        inside = _within(span, length)
        return [] if inside is None else [[inside]]


def solid_of(shape: Shape, group: int, meshes: Meshes) -> Solid:
    """Return a shape as rays meet it."""
    form, half = form_of(shape.geometry)
    return Solid(form, half, meshes.triangles_of(shape.geometry), group, shape.position, shape.orientation)


def _through_mesh(triangles: Triangles, start: Vector, way: Vector, length: float) -> list[Piece]:
    hits = triangles.hits(start, way)
    if not triangles.is_closed:
        return [[(hit, hit)] for hit in hits if 0.0 < hit < length]
    spans = (_within(span, length) for span in zip(hits[::2], hits[1::2], strict=False))
    inside = [span for span in spans if span is not None]
    return [inside] if inside else []


def _within(span: Span, length: float) -> Span | None:
    """Return the part of a span that lies between the two ends."""
    enter, leave = span
    enter = enter if enter > 0.0 else 0.0  # three times as fast as max
    leave = leave if leave < length else length
    return (enter, leave) if leave - enter > TOUCH_M else None


def joined(pieces: Iterable[Piece]) -> list[Piece]:
    """Return separate pieces: overlapping or touching ones are united."""
    joined: list[Piece] = []
    end = 0.0
    for piece in sorted(pieces):
        if joined and piece[0][0] <= end + TOUCH_M:
            joined[-1] = _united([*joined[-1], *piece])
        else:
            joined.append(piece)
        end = joined[-1][-1][1]
    return joined


def _united(spans: Iterable[Span]) -> Piece:
    """Return separate spans that cover the same places."""
    united: list[Span] = []
    for enter, leave in sorted(spans):
        if united and enter <= united[-1][1]:
            united[-1] = (united[-1][0], max(united[-1][1], leave))
        else:
            united.append((enter, leave))
    return united


def chord_of(piece: Piece) -> float:
    chord = 0.0
    for enter, leave in piece:
        chord += leave - enter
    return chord
