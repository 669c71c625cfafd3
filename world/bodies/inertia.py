"""Masses, centres of mass and inertia tensors of bodies, in + - * / and square roots alone: equal bits everywhere.

A tensor is xx, xy, xz, yy, yz, zz in kg m2, with the products of inertia as elements of the matrix (xy is -sum of
m x y). Eigenvectors come from cyclic Jacobi rotations, not from LAPACK, whose bits differ from one library to the next.
Sources: Golub and Van Loan, Matrix Computations, 4th edition, section 8.5 (rotations); Huygens and Steiner (parallel
axes); the moments of primitives and of tetrahedra are those of any handbook of mechanics.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import fsum, pi, sqrt
from typing import Final, NamedTuple

from foosim.common.errors import BadValue
from foosim.common.exact_math import exp, log
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import (
    ORIGIN,
    UPRIGHT,
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Hull,
    Quaternion,
    Shape,
    Sphere,
    Vector,
    rotate,
)

Tensor = tuple[float, float, float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]

MASS_MIN_KG: Final = 1e-6
MASS_MAX_KG: Final = 1e6
GYRATION_MIN_M: Final = 1e-4
GYRATION_MAX_M: Final = 1e3
"""Bounds of the radius of gyration, the root of moment over mass: the distance of a body's mass from an axis (m)."""
TRIANGLE_SHARE: Final = 0.01
"""The share by which a moment may exceed the sum of both others: files round their numbers."""
SWEEPS_MAX: Final = 32
"""Sweeps converge quadratically: six are enough for any tensor of float64."""
WATER_KG_M3: Final = 1000.0
NO_TENSOR: Final[Tensor] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class MassOf(NamedTuple):
    """A mass (kg), its centre (m) and its inertia about that centre, both in one frame."""

    mass: float
    centre: Vector
    tensor: Tensor


NO_MASS: Final = MassOf(0.0, ORIGIN, NO_TENSOR)


class Principal(NamedTuple):
    """Principal moments (kg m2), and the orientation of their axes in the frame of the tensor."""

    moments: Vector
    axes: Quaternion


def principal_of(tensor: Tensor) -> Principal:
    """Return the principal moments and axes of a tensor: a diagonal one has its own, unturned.

    The axes are right-handed, and each is the one that its coordinate axis was turned to by the least rotations.
    """
    a = [[tensor[0], tensor[1], tensor[2]], [tensor[1], tensor[3], tensor[4]], [tensor[2], tensor[4], tensor[5]]]
    v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    for _ in range(SWEEPS_MAX):
        if a[0][1] == 0.0 and a[0][2] == 0.0 and a[1][2] == 0.0:
            break
        for p, q in ((0, 1), (0, 2), (1, 2)):
            _rotate_away(a, v, p, q)
    columns = (v[0][0], v[1][0], v[2][0]), (v[0][1], v[1][1], v[2][1]), (v[0][2], v[1][2], v[2][2])
    return Principal((a[0][0], a[1][1], a[2][2]), quaternion_of(columns))


def _rotate_away(a: list[list[float]], v: list[list[float]], p: int, q: int) -> None:
    """Make the element p, q of a symmetric matrix 0 by a rotation, which the columns of `v` follow."""
    off = a[p][q]
    if abs(off) <= 1e-18 * (abs(a[p][p]) + abs(a[q][q])):  # less than the last bit of both
        a[p][q] = a[q][p] = 0.0
        return
    theta = (a[q][q] - a[p][p]) / (2.0 * off)
    t = 1.0 / (abs(theta) + sqrt(theta * theta + 1.0))
    if theta < 0.0:
        t = -t
    c = 1.0 / sqrt(t * t + 1.0)
    s = t * c
    a[p][p] -= t * off
    a[q][q] += t * off
    a[p][q] = a[q][p] = 0.0
    r = 3 - p - q
    one, other = a[r][p], a[r][q]
    a[r][p] = a[p][r] = c * one - s * other
    a[r][q] = a[q][r] = s * one + c * other
    for row in v:
        one, other = row[p], row[q]
        row[p], row[q] = c * one - s * other, s * one + c * other


def quaternion_of(columns: Matrix) -> Quaternion:
    """Return the unit quaternion, with w not negative, of a rotation that turns x, y, z to these columns.

    Shepperd's method: the largest of four roots is divided by.
    """
    (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = columns
    w4, x4, y4, z4 = 1.0 + xx + yy + zz, 1.0 + xx - yy - zz, 1.0 - xx + yy - zz, 1.0 - xx - yy + zz
    largest = max(w4, x4, y4, z4)
    if w4 == largest:
        found = zy - yz, xz - zx, yx - xy, w4
    elif x4 == largest:
        found = x4, yx + xy, xz + zx, zy - yz
    elif y4 == largest:
        found = yx + xy, y4, zy + yz, xz - zx
    else:
        found = xz + zx, zy + yz, z4, yx - xy
    return unit_quaternion(found)


def unit_quaternion(quaternion: Quaternion) -> Quaternion:
    """Return the quaternion of the same rotation with length 1 and w not negative."""
    x, y, z, w = quaternion
    length = sqrt(x * x + y * y + z * z + w * w)
    length = -length if w < 0.0 else length
    return x / length + 0.0, y / length + 0.0, z / length + 0.0, w / length  # a -0.0 becomes 0.0


def turned(tensor: Tensor, orientation: Quaternion) -> Tensor:
    """Return a tensor of a frame with this orientation in the frame around it: R I R^T."""
    if orientation == UPRIGHT:
        return tensor
    xx, xy, xz, yy, yz, zz = tensor
    ex, ey, ez = (rotate(orientation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))

    def element(i: int, j: int) -> float:
        return (
            ex[i] * (xx * ex[j] + xy * ey[j] + xz * ez[j])
            + ey[i] * (xy * ex[j] + yy * ey[j] + yz * ez[j])
            + ez[i] * (xz * ex[j] + yz * ey[j] + zz * ez[j])
        )

    return element(0, 0), element(0, 1), element(0, 2), element(1, 1), element(1, 2), element(2, 2)


def about(tensor: Tensor, mass: float, offset: Vector) -> Tensor:
    """Return the inertia about a point that is `offset` away from the centre of mass that the tensor is about."""
    x, y, z = offset
    xx, xy, xz, yy, yz, zz = tensor
    return (
        xx + mass * (y * y + z * z),
        xy - mass * x * y,
        xz - mass * x * z,
        yy + mass * (x * x + z * z),
        yz - mass * y * z,
        zz + mass * (x * x + y * y),
    )


def placed(part: MassOf, position: Vector, orientation: Quaternion) -> MassOf:
    """Return a mass whose frame has this pose in another frame, in that one."""
    x, y, z = rotate(orientation, part.centre)
    centre = position[0] + x, position[1] + y, position[2] + z
    return MassOf(part.mass, centre, turned(part.tensor, orientation))


def combined(parts: Iterable[MassOf]) -> MassOf:
    """Return the mass of parts that are fixed to one another, all in one frame, in their order."""
    heavy = [part for part in parts if part.mass > 0.0]
    if len(heavy) <= 1:
        return heavy[0] if heavy else NO_MASS
    mass = 0.0
    moment = [0.0, 0.0, 0.0]
    for part in heavy:
        mass += part.mass
        for axis in range(3):
            moment[axis] += part.mass * part.centre[axis]
    centre = moment[0] / mass, moment[1] / mass, moment[2] / mass
    total = NO_TENSOR
    for part in heavy:
        x, y, z = part.centre
        moved = about(part.tensor, part.mass, (x - centre[0], y - centre[1], z - centre[2]))
        total = (
            total[0] + moved[0],
            total[1] + moved[1],
            total[2] + moved[2],
            total[3] + moved[3],
            total[4] + moved[4],
            total[5] + moved[5],
        )
    return MassOf(mass, centre, total)


def check_mass(mass: float) -> float:
    """Return a valid mass of a robot's body. Raises BadValue."""
    if not MASS_MIN_KG <= mass <= MASS_MAX_KG:
        valid = f"valid are 0 to {MASS_MAX_KG:g} kg; below {MASS_MIN_KG:g} kg it counts as none"
        raise BadValue(f"a mass of {mass:g} kg, {valid}")
    return mass


def check_moments(mass: float, moments: Vector) -> None:
    """Raise BadValue for principal moments that are impossible for a body of this mass.

    All are above 0; none is more than the sum of both others, which a plate's are equal to; and the mass is neither
    at a point nor farther away than anything reaches.
    """
    low, middle, high = sorted(moments)
    shown = f"principal moments of {low:g}, {middle:g} and {high:g} kg m2"
    if low <= 0.0:
        raise BadValue(f"{shown}, valid are moments above 0")
    if high > (low + middle) * (1.0 + TRIANGLE_SHARE):
        raise BadValue(f"{shown}: no body has one above the sum of both others, {low + middle:g}")
    for moment in (low, high):
        radius = sqrt(moment / mass)
        if not GYRATION_MIN_M <= radius <= GYRATION_MAX_M:
            valid = f"valid are {GYRATION_MIN_M:g} to {GYRATION_MAX_M:g} m"
            raise BadValue(f"{shown} of {mass:g} kg: a radius of gyration of {radius:g} m, {valid}")


def without_rounding(moments: Vector) -> Vector:
    """Return moments of which the largest, rounded up in its file, is at most the sum of both others, as in MuJoCo."""
    x, y, z = moments
    return min(x, y + z), min(y, x + z), min(z, x + y)


# --- solid bodies ----------------------------------------------------------------------------------------------------


def solid(geometry: Geometry, mass: float) -> MassOf:
    """Return the mass of a solid body of even density, in the frame of its geometry."""
    if isinstance(geometry, Hull):
        return _solid_mesh(geometry.mesh, mass)
    assert not isinstance(geometry, Mesh), "a mesh need not have an inside"
    x, y, z = _solid_moments(geometry, mass)
    return MassOf(mass, ORIGIN, (x, 0.0, 0.0, y, 0.0, z))


def ball_moments(mass: float) -> Vector:
    """Return the moments of a solid ball of the density of water."""
    volume = mass / WATER_KG_M3
    radius = exp(log(volume * 3.0 / (4.0 * pi)) / 3.0)
    moment = 0.4 * mass * radius * radius
    return moment, moment, moment


def solid_of(shapes: Sequence[Shape], mass: float) -> MassOf:
    """Return the mass of a body whose shapes are all filled at one density, in the frame of its link."""
    volumes = [_volume(shape.geometry) for shape in shapes]
    whole = fsum(volumes)
    return combined(
        [
            placed(solid(shape.geometry, mass * volume / whole), shape.position, shape.orientation)
            for shape, volume in zip(shapes, volumes, strict=True)
        ]
    )


def _volume(geometry: Geometry) -> float:
    if isinstance(geometry, Box):
        x, y, z = geometry.half
        return 8.0 * x * y * z
    if isinstance(geometry, Hull):
        vertices, triangles = geometry.mesh.vertices.tolist(), geometry.mesh.triangles.tolist()
        return fsum([_six_volumes(vertices[a], vertices[b], vertices[c]) for a, b, c in triangles]) / 6.0
    assert not isinstance(geometry, Mesh), "a mesh need not have an inside"
    r2, ball = geometry.radius * geometry.radius, 0.0 if isinstance(geometry, Cylinder) else 4.0 / 3.0 * geometry.radius
    return pi * r2 * (ball if isinstance(geometry, Sphere) else ball + geometry.length)


def _six_volumes(a: Sequence[float], b: Sequence[float], c: Sequence[float]) -> float:
    """Return six times the signed volume of the tetrahedron of the origin and three points."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


def _solid_moments(geometry: Box | Sphere | Cylinder | Capsule, mass: float) -> Vector:
    if isinstance(geometry, Box):
        x, y, z = geometry.half
        third = mass / 3.0
        return third * (y * y + z * z), third * (x * x + z * z), third * (x * x + y * y)
    r2 = geometry.radius * geometry.radius
    if isinstance(geometry, Sphere):
        return 0.4 * mass * r2, 0.4 * mass * r2, 0.4 * mass * r2
    length2 = geometry.length * geometry.length
    if isinstance(geometry, Cylinder):
        across = mass * (r2 / 4.0 + length2 / 12.0)
        return across, across, 0.5 * mass * r2
    # Volumes over pi r^2: the cylinder's, and that of both half spheres, whose centres of mass are at 3/8 r.
    ends = geometry.radius * 4.0 / 3.0
    tube = mass * geometry.length / (geometry.length + ends)
    caps = mass - tube
    from_middle = length2 / 4.0 + 0.375 * geometry.length * geometry.radius
    across = tube * (r2 / 4.0 + length2 / 12.0) + caps * (0.4 * r2 + from_middle)
    return across, across, tube * 0.5 * r2 + caps * 0.4 * r2


def _solid_mesh(mesh: Mesh, mass: float) -> MassOf:
    """Return the mass within a closed mesh: tetrahedra from the origin to each triangle, with signed volumes."""
    volume = 0.0
    first = [0.0, 0.0, 0.0]
    second = [0.0] * 6
    pairs = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    vertices = mesh.vertices.tolist()
    for corners in mesh.triangles.tolist():
        a, b, c = (vertices[corner] for corner in corners)
        six = _six_volumes(a, b, c)
        total = [a[axis] + b[axis] + c[axis] for axis in range(3)]
        volume += six / 6.0
        for axis in range(3):
            first[axis] += six * total[axis] / 24.0
        for number, (i, j) in enumerate(pairs):
            second[number] += six * (total[i] * total[j] + a[i] * a[j] + b[i] * b[j] + c[i] * c[j]) / 120.0
    density = mass / volume
    centre = first[0] / volume, first[1] / volume, first[2] / volume
    xx, xy, xz, yy, yz, zz = (density * part for part in second)
    at_origin = (yy + zz, -xy, -xz, xx + zz, -yz, xx + yy)
    return MassOf(mass, centre, about(at_origin, -mass, centre))
