"""Links of a URDF: their masses, and their collision shapes. Sources of looks are in urdf_visuals.py."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from foosim.common.errors import BadValue
from foosim.world.bodies.findings import Findings
from foosim.world.bodies.inertia import (
    MASS_MIN_KG,
    NO_TENSOR,
    Principal,
    Tensor,
    ball_moments,
    check_mass,
    check_moments,
    principal_of,
    solid_of,
    without_rounding,
)
from foosim.world.bodies.urdf_values import (
    EXTENT_MAX_M,
    EXTENT_MIN_M,
    NUMBER_MAX,
    UNMOVED,
    name_of,
    number_of,
    placed_by,
    text_of,
    vector_of,
)
from foosim.world.bodies.xml_tree import Element
from foosim.world.matter.mesh import MESH_SUFFIXES, AssetError, mesh_format
from foosim.world.scene import (
    ORIGIN,
    UPRIGHT,
    Box,
    Capsule,
    Colour,
    Cylinder,
    Hull,
    Quaternion,
    Shape,
    Sphere,
    Vector,
    multiply,
)
from foosim.world.scenery import path_problem

SCALE_MIN: Final = 1e-6
SCALE_MAX: Final = 1e6
PACKAGE: Final = "package://"
MISSING: Final = "the file of a mesh is missing"
PRIMITIVES: Final = ("box", "sphere", "cylinder", "capsule")
SHAPES: Final = (*PRIMITIVES, "mesh")


@dataclass(frozen=True, slots=True)
class LinkPart:
    """A link as its file describes it, without the joint that it hangs on. Its shapes have no surface.

    `inertia` has the principal moments about the centre of mass, and their axes in the link's frame.
    """

    name: str
    element: Element
    mass: float
    centre_of_mass: Vector
    inertia: Principal
    shapes: tuple[Shape, ...]
    visuals: tuple[Shape, ...] = ()


def meshes_in(robot: Element, part: str) -> Iterator[Element]:
    """Yield the meshes of all collisions, or visuals, of a robot."""
    for link in robot.all_of("link"):
        for owner in link.all_of(part):
            yield from owner.below("mesh")


def mesh_path(mesh: Element) -> str:
    """Return the path of a mesh in the asset folder. Raises BadElement.

    `package://a/b` is a/b there, any other path is relative to the folder of the URDF file.
    """
    written = text_of(mesh, "filename")
    if written.startswith(PACKAGE):
        path = posixpath.normpath(written.removeprefix(PACKAGE).lstrip("/"))
    elif "://" in written:
        raise mesh.error(f"a mesh is a path relative to this file, or {PACKAGE}PACKAGE/PATH", written)
    else:
        path = posixpath.normpath(posixpath.join(posixpath.dirname(mesh.file), written))
    problem = path_problem(path)
    if problem:
        raise mesh.error(problem, written)
    if not mesh_format(path):
        raise mesh.error(f"no format of a mesh, there are {', '.join(MESH_SUFFIXES)}", written)
    return path


def read_link(link: Element, colour: Colour, files: Mapping[str, bytes], findings: Findings) -> LinkPart | None:
    """Return a link, whose shapes have this colour, without its looks; None for one without a valid name.

    `files` are the contents of the meshes, by path.
    """
    name = findings.read("", name_of, link)
    found = [findings.read(None, _shape, one, colour, files, findings) for one in link.all_of("collision")]
    shapes = tuple([shape for shape in found if shape is not None])
    mass, centre, inertia = _mass(link, name, shapes if len(shapes) == len(found) else (), findings)
    return LinkPart(name, link, mass, centre, inertia, shapes) if name else None


# --- masses ----------------------------------------------------------------------------------------------------------


def _mass(link: Element, name: str, shapes: Sequence[Shape], findings: Findings) -> tuple[float, Vector, Principal]:
    """Return the mass of a link, its centre, and its inertia."""
    nothing = 0.0, ORIGIN, Principal(ORIGIN, UPRIGHT)
    inertial = findings.read(None, link.one_of, "inertial")
    if inertial is None:
        return nothing
    mass = findings.read(None, _mass_value, inertial)
    tensor = findings.read(NO_TENSOR, _tensor, inertial)
    position, orientation = findings.read(UNMOVED, placed_by, inertial)
    if mass is None:
        return nothing
    if mass < MASS_MIN_KG:
        findings.note(inertial, f"a mass below {MASS_MIN_KG * 1e6:g} mg, of link", "it counts as none", name)
        return nothing
    moments, axes = principal_of(tensor)
    try:
        check_moments(mass, moments)
    except BadValue as bad:
        moments, axes, where = _moments_instead(mass, moments, shapes)
        used = f"{', '.join(f'{moment:.3g}' for moment in moments)} kg m2, {where}"
        findings.note(inertial, f"inertia of link {name}", f"{bad.problem}; instead it has {used}")
        return mass, position, Principal(moments, axes)
    axes = multiply(orientation, axes) if orientation != UPRIGHT else axes
    return mass, position, Principal(without_rounding(moments), axes)


def _mass_value(inertial: Element) -> float:
    weight = inertial.one_of("mass")
    if weight is None:
        return 0.0
    mass = number_of(weight, "value", -NUMBER_MAX, NUMBER_MAX)
    try:
        return 0.0 if 0.0 <= mass < MASS_MIN_KG else check_mass(mass)
    except BadValue as bad:
        raise weight.error(bad.problem) from None


def _tensor(inertial: Element) -> Tensor:
    """Return the inertia about the axes of the inertial's origin; without one it is 0."""
    inertia = inertial.one_of("inertia")
    if inertia is None:
        return NO_TENSOR

    def moment(key: str, default: float | None = None) -> float:
        return number_of(inertia, key, -NUMBER_MAX, NUMBER_MAX, default)

    xx, yy, zz = moment("ixx"), moment("iyy"), moment("izz")
    return xx, moment("ixy", 0.0), moment("ixz", 0.0), yy, moment("iyz", 0.0), zz


def _moments_instead(mass: float, moments: Vector, shapes: Sequence[Shape]) -> tuple[Vector, Quaternion, str]:
    """Return moments, axes and their source for a link whose file has impossible ones: those of its shapes at its mass;
    without shapes the file's, spread evenly over the axes; where these are 0, those of a ball."""
    mean = (moments[0] + moments[1] + moments[2]) / 3.0
    ball = ball_moments(mass)
    choices = [
        (Principal((mean, mean, mean), UPRIGHT), "its sum spread evenly"),
        (Principal(ball, UPRIGHT), "a ball of the density of water"),
    ]
    if shapes:
        choices.insert(0, (principal_of(solid_of(shapes, mass).tensor), "its collision shapes filled evenly"))
    for (found, axes), where in choices:
        try:
            check_moments(mass, found)
        except BadValue:
            continue
        return without_rounding(found), axes, where
    raise AssertionError(mass)


# --- shapes ----------------------------------------------------------------------------------------------------------


def _shape(collision: Element, colour: Colour, files: Mapping[str, bytes], findings: Findings) -> Shape:
    position, orientation = findings.read(UNMOVED, placed_by, collision)
    shape = shape_in(collision)
    geometry = _hull(shape, files) if shape.tag == "mesh" else primitive(shape)
    return Shape(geometry, "", colour, position, orientation)


def shape_in(owner: Element) -> Element:
    """Return the shape of a collision or visual. Raises BadElement."""
    geometry = owner.one_of("geometry")
    if geometry is None:
        raise owner.error(f"a {owner.tag} without geometry")
    shapes = [*geometry.all_of(*SHAPES)]
    if not shapes and geometry.children:
        raise geometry.children[0].error(f"an unknown shape, there are {', '.join(SHAPES)}", geometry.children[0].tag)
    if len(shapes) != 1:
        raise geometry.error(f"a geometry with {len(shapes)} shapes: it has one")
    return shapes[0]


def primitive(shape: Element) -> Box | Sphere | Cylinder | Capsule:
    """Return a primitive shape. Raises BadElement."""

    def extent(key: str) -> float:
        return number_of(shape, key, EXTENT_MIN_M, EXTENT_MAX_M)

    match shape.tag:
        case "box":
            x, y, z = size = vector_of(shape, "size", EXTENT_MAX_M)
            if min(size) < EXTENT_MIN_M:
                what = f"size of box is not within {EXTENT_MIN_M:g} to {EXTENT_MAX_M:g}"
                raise shape.error(what, shape.attributes["size"])
            return Box((x / 2, y / 2, z / 2))
        case "sphere":
            return Sphere(extent("radius"))
        case "cylinder":
            return Cylinder(extent("radius"), extent("length"))
        case "capsule":
            return Capsule(extent("radius"), extent("length"))
    raise AssertionError(shape.tag)


def _hull(mesh: Element, files: Mapping[str, bytes]) -> Hull:
    """Return the convex hull of a mesh's file: bodies are convex."""
    from foosim.world.bodies.hull import convex_hull  # brings numpy
    from foosim.world.mesh_files import read_mesh

    path = mesh_path(mesh)
    if path not in files:
        raise mesh.error(MISSING, path)
    scale = scale_of(mesh)
    most = max(abs(part) for part in scale)
    try:
        points = read_mesh(path, files[path], most).vertices
        return Hull(convex_hull(points * [part / most for part in scale]))
    except AssetError as error:
        raise mesh.error(f"an invalid mesh: {error}") from None
    except BadValue as bad:
        raise mesh.error(f"a mesh without a convex hull: {bad.problem}", path) from None


def scale_of(mesh: Element) -> Vector:
    """Return the factors along the axes of a mesh. Raises BadElement."""
    scale = vector_of(mesh, "scale", SCALE_MAX, (1.0, 1.0, 1.0))
    if min(abs(part) for part in scale) < SCALE_MIN:
        raise mesh.error(f"scale of mesh is below {SCALE_MIN:g}", mesh.attributes["scale"])
    return scale
