"""What the world is made of: shapes, links and joints of every body, and the one forward kinematics.

Engines build their bodies from a `Scene`, viewers draw it, sensors and the vHub place links with it, so there is one
description of each. Frame of reference: the world's (x along the field, y across, z up), SI units, quaternions
x, y, z, w. What enters a frame or a fate is computed here with + - * / and `math.sqrt`, `math.sin`, `math.cos` only,
in one spelling.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import cos, sin, sqrt
from typing import Literal

from foosim.world.materials import UNKNOWN, RadioMaterial
from foosim.world.mesh import Mesh

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Colour = tuple[float, float, float, float]
Pose = tuple[str, Vector, Quaternion]
"""Name of a link, position of its origin and orientation, in the world frame."""

# Not Final: compiled by mypyc 2.4, a Final tuple of so many floats counts as not set.
ORIGIN: Vector = (0.0, 0.0, 0.0)
UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class Box:
    """A box, centred: half of its length along each local axis."""

    half: Vector


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere, centred."""

    radius: float


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder, centred, whose axis is the local z."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Shape:
    """A geometry at a pose in its link (in the world for scenery), its surface (a key of the physics') and colour.

    `radio` is what waves lose in it; `name` is that of the scenery it belongs to, empty in a body, which has its own.
    """

    geometry: Box | Sphere | Cylinder | Mesh
    surface: str
    colour: Colour
    position: Vector = ORIGIN
    orientation: Quaternion = UPRIGHT
    radio: RadioMaterial = UNKNOWN
    name: str = ""


@dataclass(frozen=True, slots=True)
class Link:
    """A rigid part that hangs on the link before it (the first on the body's base) by one joint.

    `free` has six degrees of freedom, `prismatic` slides along `axis` within `limits` (m), `revolute` turns about it
    (rad, without limits), `fixed` does nothing. The link's frame is the joint's; `inertia` is the diagonal about the
    centre of mass.
    """

    name: str
    joint: Literal["free", "prismatic", "revolute", "fixed"]
    shapes: tuple[Shape, ...]
    mass: float
    inertia: Vector
    centre_of_mass: Vector = ORIGIN
    axis: Vector = ORIGIN
    limits: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Body:
    """A chain of links on a base that stands at `position`, upright. A free body's position comes from its slots.

    Radio waves leave from `antenna`, a place in its last link. `speed_limit` (m/s) is how fast a free body can be, a
    promise of its model.
    """

    name: str
    model: str
    position: Vector
    links: tuple[Link, ...]
    antenna: Vector = ORIGIN
    speed_limit: float = 0.0

    @property
    def is_free(self) -> bool:
        """Whether its base moves; the base of any other is fixed."""
        return self.links[0].joint == "free"


@dataclass(frozen=True, slots=True)
class Scene:
    """All bodies of a layout by name, in name order, and the scenery that never moves."""

    bodies: Mapping[str, Body]
    scenery: tuple[Shape, ...]


def inertia_about_axis(link: Link) -> float:
    """Return the moment of inertia of a turning link about its joint's axis, a coordinate axis (kg m2)."""
    (axis,) = [number for number in range(3) if link.axis[number] != 0.0]
    along = [link.centre_of_mass[number] for number in range(3) if number != axis]
    return link.inertia[axis] + link.mass * (along[0] * along[0] + along[1] * along[1])


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation `b` followed by `a`."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(orientation: Quaternion, vector: Vector) -> Vector:
    """Return a vector of a rotated frame in the frame that the unit quaternion is given in."""
    qx, qy, qz, qw = orientation
    x, y, z = vector
    tx, ty, tz = 2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)
    return (
        x + qw * tx + (qy * tz - qz * ty),
        y + qw * ty + (qz * tx - qx * tz),
        z + qw * tz + (qx * ty - qy * tx),
    )


def turn(axis: Vector, angle: float) -> Quaternion:
    """Return the rotation by `angle` (rad) about a unit axis."""
    s = sin(0.5 * angle)
    return axis[0] * s, axis[1] * s, axis[2] * s, cos(0.5 * angle)


def place(shape: Shape, position: Vector, orientation: Quaternion) -> tuple[Vector, Quaternion]:
    """Return the world pose of a shape whose link has this pose."""
    dx, dy, dz = rotate(orientation, shape.position)
    return (position[0] + dx, position[1] + dy, position[2] + dz), multiply(orientation, shape.orientation)


def shape_box(shape: Shape) -> tuple[Vector, Vector]:
    """Return the least and greatest coordinates of a shape in its link's frame."""
    geometry = shape.geometry
    middle = ORIGIN
    if isinstance(geometry, Sphere):
        extent = [geometry.radius] * 3
    else:
        if isinstance(geometry, Cylinder):
            half: Vector = (geometry.radius, geometry.radius, geometry.length / 2)
        elif isinstance(geometry, Box):
            half = geometry.half
        else:
            low, high = geometry.box
            half = ((high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2)
            middle = rotate(shape.orientation, moved(low, half, 1.0))
        sides = [
            rotate(shape.orientation, side) for side in ((half[0], 0.0, 0.0), (0.0, half[1], 0.0), (0.0, 0.0, half[2]))
        ]
        extent = [sum(abs(side[axis]) for side in sides) for axis in range(3)]
    x, y, z = moved(shape.position, middle, 1.0)
    low = (x - extent[0], y - extent[1], z - extent[2])
    return low, (x + extent[0], y + extent[1], z + extent[2])


def in_pieces(shapes: Iterable[Shape], triangles_max: int) -> Iterator[Shape]:
    """Yield shapes; a mesh of more than so many triangles as several, in the order of its triangles."""
    for shape in shapes:
        mesh = shape.geometry
        if not isinstance(mesh, Mesh):
            yield shape
            continue
        from foosim.world.mesh_files import pieces  # brings numpy

        for piece in pieces(mesh, triangles_max):
            yield shape if piece is mesh else replace(shape, geometry=piece)


def enclosing(boxes: Iterable[tuple[Vector, Vector]]) -> tuple[Vector, Vector]:
    """Return the box around boxes, of which there is at least one."""
    lows, highs = zip(*boxes, strict=True)
    low = (min(p[0] for p in lows), min(p[1] for p in lows), min(p[2] for p in lows))
    return low, (max(p[0] for p in highs), max(p[1] for p in highs), max(p[2] for p in highs))


def swept_box(body: Body) -> tuple[Vector, Vector]:
    """Return the least and greatest world coordinates that a body's shapes reach over all its joint positions.

    A free body's box stands around its own origin. Joints turn about or slide along a coordinate axis.
    """
    swept: tuple[Vector, Vector] | None = None
    for link in reversed(body.links):
        boxes = [shape_box(shape) for shape in link.shapes] + ([swept] if swept else [])
        low, high = enclosing(boxes)
        if link.joint == "prismatic":
            low = moved(low, link.axis, min(link.limits))
            high = moved(high, link.axis, max(link.limits))
        elif link.joint == "revolute":
            low, high = _revolved(low, high, link.axis)
        swept = low, high
    assert swept is not None, f"{body.name} has no links"
    return moved(swept[0], body.position, 1.0), moved(swept[1], body.position, 1.0)


def moved(point: Vector, direction: Vector, way: float) -> Vector:
    return point[0] + way * direction[0], point[1] + way * direction[1], point[2] + way * direction[2]


def _revolved(low: Vector, high: Vector, axis: Vector) -> tuple[Vector, Vector]:
    """Return the box that a box sweeps when it turns fully about a coordinate axis through the origin."""
    along = [abs(part) == 1.0 for part in axis]
    assert sum(along) == 1, f"axis {axis} is no coordinate axis"
    far = [max(abs(low[i]), abs(high[i])) for i in range(3)]
    radius = sqrt(sum(far[i] * far[i] for i in range(3) if not along[i]))
    lows = [low[i] if along[i] else -radius for i in range(3)]
    highs = [high[i] if along[i] else radius for i in range(3)]
    return (lows[0], lows[1], lows[2]), (highs[0], highs[1], highs[2])
