"""The scene of a world: shapes, links and joints of every body, and the one forward kinematics.

Engines build their bodies from a `Scene`, viewers draw it, sensors and the vHub place links with it, so there is one
description of each. Frame of reference: the world's (x along the field, y across, z up), SI units, quaternions
x, y, z, w. Numbers of a frame or a fate are computed here with + - * / and `math.sqrt`, `math.sin`, `math.cos` only,
in one spelling.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import cos, inf, sin, sqrt
from typing import Final, Literal, TypeAlias

from foosim.common import limits
from foosim.world.matter.materials import UNKNOWN, RadioMaterial
from foosim.world.matter.mesh import Mesh

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Colour = tuple[float, float, float, float]
Pose = tuple[str, Vector, Quaternion]
"""Name of a link, position of its origin and orientation, in the world frame."""

# Not Final: compiled by mypyc 2.4, a Final tuple of this many floats counts as not set.
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
class Capsule:
    """A capsule, centred, whose axis is the local z: a cylinder of this length with a half sphere at each end."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Hull:
    """A convex body: the corners and outer triangles of a convex hull, counter-clockwise seen from outside."""

    mesh: Mesh


Geometry: TypeAlias = Box | Sphere | Cylinder | Capsule | Hull | Mesh


@dataclass(frozen=True, slots=True)
class Shape:
    """A geometry at a pose in its link (in the world for scenery), its surface (a key of the physics') and colour.

    `radio` is its loss of waves; `name` is that of the scenery it belongs to, empty in a body, which has its own.
    `visuals` is what a shape of scenery looks like, in its link's frame; without any it looks as it is (`drawn`).
    """

    geometry: Geometry
    surface: str
    colour: Colour
    position: Vector = ORIGIN
    orientation: Quaternion = UPRIGHT
    radio: RadioMaterial = UNKNOWN
    name: str = ""
    visuals: tuple[Shape, ...] = ()


JointKind: TypeAlias = Literal["free", "prismatic", "revolute", "continuous", "fixed"]


@dataclass(frozen=True, slots=True)
class Mimic:
    """A joint follows another one: its position is `ratio` times that of the joint of the link `leader` (an index among
    the links of the body), which follows none, and `offset` (m or rad)."""

    leader: int
    ratio: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Link:
    """A rigid part that hangs on its parent by one joint.

    `parent` is the index of the parent among the body's links, below its own; -1 is the body's base. A `free` joint has
    six degrees of freedom and is that of the first link only. Of any other, `position` and `orientation` are the pose
    of the joint in the frame of the parent: `prismatic` slides along `axis` within `limits` (m), `revolute` turns about
    it within `limits` (rad), `continuous` turns without limits, `fixed` does nothing. The link's frame is the joint's.

    `inertia` is the diagonal about the centre of mass, in the principal axes, whose orientation in the link's frame is
    `principal`. A motor of the joint has at most the force `effort` (N or N m) and the speed `speed` (m/s or rad/s);
    `damping` is the resistance to its speed (N s/m or N m s/rad). `joint_name` is what the joint is called; empty, it
    is called as the link (`Body.joint_names`). With a `mimic` the joint has no motor of its own.

    `visuals` is what the link looks like, with meshes of any form; where there are none it looks like its `shapes`.
    """

    name: str
    joint: JointKind
    shapes: tuple[Shape, ...]
    mass: float
    inertia: Vector
    centre_of_mass: Vector = ORIGIN
    axis: Vector = ORIGIN
    limits: tuple[float, float] = (0.0, 0.0)
    parent: int = -1
    position: Vector = ORIGIN
    orientation: Quaternion = UPRIGHT
    principal: Quaternion = UPRIGHT
    effort: float = inf
    speed: float = inf
    damping: float = 0.0
    joint_name: str = ""
    mimic: Mimic | None = None
    visuals: tuple[Shape, ...] = ()

    @property
    def is_centred(self) -> bool:
        """Whether its frame is that of its centre of mass and its principal axes."""
        return self.centre_of_mass == ORIGIN and self.principal == UPRIGHT


PRIMITIVES_MAX: Final = 16
"""Shapes of one link: those of a compound in Bullet."""
MOVING: Final = frozenset(("prismatic", "revolute", "continuous"))
"""The joints that have a position, a speed and a motor."""


@dataclass(frozen=True, slots=True)
class Body:
    """A tree of links on a base.

    A fixed base has the pose `position` and `orientation`. A free body is one whose first link is free: its slots
    `position` and `orientation` are the pose of that link's centre of mass, in the link's principal axes. The joints
    that move have a number each in `joint_positions`, in the order of their links.

    Radio waves leave from `antenna`, a place in the frame of the link `antenna_link` (an index). `speed_limit` (m/s) is
    the greatest speed of any part of a free body, a promise of its model. A body without `is_solid` is only drawn: rays
    and bodies pass it.
    """

    name: str
    model: str
    position: Vector
    links: tuple[Link, ...]
    antenna: Vector = ORIGIN
    speed_limit: float = 0.0
    orientation: Quaternion = UPRIGHT
    antenna_link: int = -1
    is_solid: bool = True

    @property
    def is_free(self) -> bool:
        """Whether its base moves; the base of any other is fixed."""
        return self.links[0].joint == "free"

    @property
    def joints(self) -> tuple[Link, ...]:
        """The links whose joints move, in their order."""
        return tuple([link for link in self.links if link.joint in MOVING])

    @property
    def link_names(self) -> tuple[str, ...]:
        """What the links are called: their names without that of the body, which may hold any characters."""
        return tuple([link.name.removeprefix(f"{self.name}/") for link in self.links])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """What the joints that move are called, in their order."""
        names = zip(self.links, self.link_names, strict=True)
        return tuple([link.joint_name or name for link, name in names if link.joint in MOVING])


@dataclass(frozen=True, slots=True)
class Scene:
    """All bodies of a layout by name, in name order, and the scenery that never moves."""

    bodies: Mapping[str, Body]
    scenery: tuple[Shape, ...]


def drawn(scenery: Iterable[Shape]) -> Iterator[Shape]:
    """Yield what scenery looks like: the visuals of a shape, without any the shape."""
    for shape in scenery:
        yield from shape.visuals or (shape,)


def looks_of(links: Iterable[Link]) -> list[tuple[Link, tuple[Shape, ...]]]:
    """Return links with what they look like: their visuals, without any their shapes. Those whose visuals would make
    the triangles of all more than `limits.LOOKS_TRIANGLES_MAX` look like their shapes, too."""
    looks = []
    left = limits.LOOKS_TRIANGLES_MAX
    for link in links:
        meshes = [shape.geometry for shape in link.visuals if isinstance(shape.geometry, Mesh)]
        count = sum([len(mesh.triangles) for mesh in meshes])
        fits = bool(link.visuals) and count <= left
        left -= count if fits else 0
        looks.append((link, link.visuals if fits else link.shapes))
    return looks


def inertia_about_axis(link: Link) -> float:
    """Return the moment of inertia of a turning link about its joint's axis, a coordinate axis (kg m2)."""
    (axis,) = [number for number in range(3) if link.axis[number] != 0.0]
    along = [link.centre_of_mass[number] for number in range(3) if number != axis]
    return link.inertia[axis] + link.mass * (along[0] * along[0] + along[1] * along[1])


def inertia_about(link: Link, axis: Vector, centre: Vector) -> float:
    """Return the inertia (kg m2) of a link about a unit axis, from which `centre` leads to its centre of mass (m).

    Both are in the frame of the link. By the parallel axis theorem."""
    x, y, z = rotate(conjugate(link.principal), axis)
    arm = cross(axis, centre)
    about_centre = link.inertia[0] * x * x + link.inertia[1] * y * y + link.inertia[2] * z * z
    return about_centre + link.mass * (arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2])


def load_of(body: Body, index: int) -> float:
    """Return the load of a motor on the joint of a link while all others rest: for one that slides the mass (kg) of its
    link and of all links that hang on that, for one that turns the moment of inertia (kg m2) of its link. Joints that
    follow it add theirs, times the square of their ratio."""
    link = body.links[index]
    if link.joint == "prismatic":
        carried = {index}
        for number, other in enumerate(body.links):
            if other.parent in carried:
                carried.add(number)
        load = sum([body.links[number].mass for number in sorted(carried)])
    else:
        load = inertia_about(link, link.axis, link.centre_of_mass)
    for number, other in enumerate(body.links):
        if other.mimic is not None and other.mimic.leader == index:
            load += other.mimic.ratio * other.mimic.ratio * load_of(body, number)
    return load


def cross(a: Vector, b: Vector) -> Vector:
    """Return the cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Vector, b: Vector) -> float:
    """Return the inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


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


def conjugate(orientation: Quaternion) -> Quaternion:
    """Return the rotation back."""
    x, y, z, w = orientation
    return -x, -y, -z, w


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


def from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation about fixed x by `roll`, then about y by `pitch`, then about z by `yaw` (rad)."""
    about_x, about_y = turn((1.0, 0.0, 0.0), roll), turn((0.0, 1.0, 0.0), pitch)
    return multiply(turn((0.0, 0.0, 1.0), yaw), multiply(about_y, about_x))


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
        elif isinstance(geometry, Capsule):
            half = (geometry.radius, geometry.radius, geometry.length / 2 + geometry.radius)
        elif isinstance(geometry, Box):
            half = geometry.half
        else:
            low, high = geometry.mesh.box if isinstance(geometry, Hull) else geometry.box
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
    """Yield shapes; a mesh with more triangles than `most` as several, in the order of its triangles."""
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

    A free body's box stands around the origin of its first link's frame, whose axes are the world's.
    """
    reached: list[list[tuple[Vector, Vector]]] = [[shape_box(shape) for shape in link.shapes] for link in body.links]
    of_base: list[tuple[Vector, Vector]] = []
    for link, boxes in zip(reversed(body.links), reversed(reached), strict=True):
        if not boxes:
            continue
        low, high = enclosing(boxes)
        if link.joint == "prismatic":
            low, high = enclosing([(moved(low, link.axis, way), moved(high, link.axis, way)) for way in link.limits])
        elif link.joint in MOVING:
            low, high = _revolved(low, high, link.axis)
        if link.joint != "free":
            low, high = _turned(low, high, link.orientation)
            low, high = moved(low, link.position, 1.0), moved(high, link.position, 1.0)
        (of_base if link.parent < 0 else reached[link.parent]).append((low, high))
    assert of_base, f"{body.name} has no shapes"
    low, high = _turned(*enclosing(of_base), body.orientation)
    return moved(low, body.position, 1.0), moved(high, body.position, 1.0)


def moved(point: Vector, direction: Vector, way: float) -> Vector:
    return point[0] + way * direction[0], point[1] + way * direction[1], point[2] + way * direction[2]


def _turned(low: Vector, high: Vector, orientation: Quaternion) -> tuple[Vector, Vector]:
    """Return the box around a box in a frame that is turned so."""
    if orientation == UPRIGHT:
        return low, high
    half = (high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2
    x, y, z = rotate(orientation, moved(low, half, 1.0))
    sides = [rotate(orientation, side) for side in ((half[0], 0.0, 0.0), (0.0, half[1], 0.0), (0.0, 0.0, half[2]))]
    dx, dy, dz = (sum(abs(side[axis]) for side in sides) for axis in range(3))
    return (x - dx, y - dy, z - dz), (x + dx, y + dy, z + dz)


def _revolved(low: Vector, high: Vector, axis: Vector) -> tuple[Vector, Vector]:
    """Return the box around all that a box sweeps when it turns fully about a unit axis through the origin."""
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    along = [x * axis[0] + y * axis[1] + z * axis[2] for x, y, z in corners]
    squares = [x * x + y * y + z * z - way * way for (x, y, z), way in zip(corners, along, strict=True)]
    radius, least, most = sqrt(max(0.0, *squares)), min(along), max(along)
    aside = [radius * sqrt(max(0.0, 1.0 - part * part)) for part in axis]
    lows = [min(part * least, part * most) - side for part, side in zip(axis, aside, strict=True)]
    highs = [max(part * least, part * most) + side for part, side in zip(axis, aside, strict=True)]
    return (lows[0], lows[1], lows[2]), (highs[0], highs[1], highs[2])
