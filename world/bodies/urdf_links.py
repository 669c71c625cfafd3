"""Links of a URDF: their masses, their collision shapes, and a colour for these."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from foosim.common.errors import BadValue
from foosim.world.bodies.inertia import (
    NO_MASS,
    NO_TENSOR,
    MassOf,
    Principal,
    Tensor,
    check_mass,
    check_moments,
    placed,
    principal_of,
)
from foosim.world.bodies.urdf_values import (
    EXTENT_MAX_M,
    EXTENT_MIN_M,
    NUMBER_MAX,
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

GREY: Final[Colour] = (0.6, 0.6, 0.6, 1.0)
SCALE_MIN: Final = 1e-6
SCALE_MAX: Final = 1e6
PACKAGE: Final = "package://"


@dataclass(frozen=True, slots=True)
class LinkPart:
    """A link as its file describes it, without the joint that it hangs on. Its shapes have no surface.

    `mass` is in the link's frame; `moments` and `principal` are its principal moments and axes.
    """

    name: str
    line: int
    mass: MassOf
    moments: Vector
    principal: Quaternion
    shapes: tuple[Shape, ...]


def mesh_paths(robot: Element) -> dict[str, Element]:
    """Return the files that collision shapes name, in their order, by path, each with the line that names it first.

    Raises AssetError for a path outside of the asset folder.
    """
    found: dict[str, Element] = {}
    for link in robot.all_of("link"):
        for collision in link.all_of("collision"):
            for mesh in collision.below("mesh"):
                found.setdefault(mesh_path(mesh), mesh)
    return found


def mesh_path(mesh: Element) -> str:
    """Return the path, inside the asset folder, of a mesh: `package://a/b` is a/b there, any other is seen from the
    folder of the URDF file. Raises AssetError."""
    written = text_of(mesh, "filename")
    if written.startswith(PACKAGE):
        path = posixpath.normpath(written.removeprefix(PACKAGE))
    elif ":" in written:
        raise mesh.error(f"a mesh is a path, or {PACKAGE} and one inside the asset folder", written)
    else:
        path = posixpath.normpath(posixpath.join(posixpath.dirname(mesh.file), written))
    problem = path_problem(path)
    if problem:
        raise mesh.error(problem, written)
    if not mesh_format(path):
        raise mesh.error(f"no format of a mesh, there are {', '.join(MESH_SUFFIXES)}", written)
    return path


def read_link(link: Element, colours: Mapping[str, Colour], files: Mapping[str, bytes]) -> LinkPart:
    """Return a link; `files` are the contents of the meshes, by path. Raises AssetError."""
    name = name_of(link)
    mass, principal = _mass(link)
    colour = next((found for found in _colours_of(link, colours)), GREY)
    shapes = tuple(_shape(collision, colour, files) for collision in link.all_of("collision"))
    return LinkPart(name, link.line, mass, principal.moments, principal.axes, shapes)


def _mass(link: Element) -> tuple[MassOf, Principal]:
    """Return the mass of a link in its frame, with its principal moments and axes; one without inertial has none."""
    inertial = link.one_of("inertial")
    if inertial is None:
        return NO_MASS, Principal(ORIGIN, UPRIGHT)
    weight, inertia = inertial.one_of("mass"), inertial.one_of("inertia")
    if weight is None or inertia is None:
        raise inertial.error(f"an inertial without {'mass' if weight is None else 'inertia'}", link.attributes["name"])
    mass = number_of(weight, "value", -NUMBER_MAX, NUMBER_MAX)
    tensor = _tensor(inertia)
    if mass == 0.0 and tensor == NO_TENSOR:
        return NO_MASS, Principal(ORIGIN, UPRIGHT)
    try:
        check_mass(mass)
    except BadValue as bad:
        raise weight.error(bad.problem) from None
    moments, axes = principal_of(tensor)
    try:
        check_moments(mass, moments)
    except BadValue as bad:
        raise inertia.error(bad.problem) from None
    position, orientation = placed_by(inertial)
    whole = placed(MassOf(mass, ORIGIN, tensor), position, orientation)
    return whole, Principal(moments, multiply(orientation, axes) if orientation != UPRIGHT else axes)


def _tensor(inertia: Element) -> Tensor:
    def moment(key: str, default: float | None = None) -> float:
        return number_of(inertia, key, -NUMBER_MAX, NUMBER_MAX, default)

    xx, yy, zz = moment("ixx"), moment("iyy"), moment("izz")
    return xx, moment("ixy", 0.0), moment("ixz", 0.0), yy, moment("iyz", 0.0), zz


# --- shapes ----------------------------------------------------------------------------------------------------------


def _shape(collision: Element, colour: Colour, files: Mapping[str, bytes]) -> Shape:
    geometry = collision.one_of("geometry")
    if geometry is None:
        raise collision.error("a collision without geometry")
    if len(geometry.children) != 1:
        raise geometry.error(f"a geometry with {len(geometry.children)} shapes: it has one")
    (shape,) = geometry.children
    position, orientation = placed_by(collision)
    return Shape(_geometry(shape, files), "", colour, position, orientation)


def _geometry(shape: Element, files: Mapping[str, bytes]) -> Box | Sphere | Cylinder | Capsule | Hull:
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
        case "mesh":
            return _hull(shape, files)
    raise shape.error("an unknown shape, there are box, sphere, cylinder, capsule, mesh", shape.tag)


def _hull(mesh: Element, files: Mapping[str, bytes]) -> Hull:
    """Return the convex hull of a mesh's file: bodies are convex."""
    from foosim.world.bodies.hull import convex_hull  # brings numpy
    from foosim.world.mesh_files import read_mesh

    path = mesh_path(mesh)
    if path not in files:
        raise mesh.error("the file of a mesh is missing", path)
    scale = vector_of(mesh, "scale", SCALE_MAX, (1.0, 1.0, 1.0))
    most = max(abs(part) for part in scale)
    if min(abs(part) for part in scale) < SCALE_MIN:
        raise mesh.error(f"scale of mesh is below {SCALE_MIN:g}", mesh.attributes["scale"])
    try:
        points = read_mesh(path, files[path], most).vertices
        return Hull(convex_hull(points * [part / most for part in scale]))
    except AssetError as error:
        raise mesh.error(f"an invalid mesh: {error}") from None
    except BadValue as bad:
        raise mesh.error(f"a mesh without a convex hull: {bad.problem}", path) from None


# --- colours ---------------------------------------------------------------------------------------------------------


def materials_of(robot: Element) -> dict[str, Colour]:
    """Return the colours of a file's materials, by name: the first one of each."""
    found: dict[str, Colour] = {}
    for material in (
        *robot.all_of("material"),
        *(of for link in robot.all_of("link") for of in link.below("material")),
    ):
        colour = _colour(material)
        if colour is not None:
            found.setdefault(material.attributes.get("name", ""), colour)
    return found


def _colours_of(link: Element, colours: Mapping[str, Colour]) -> Iterator[Colour]:
    """Yield the colours of a link's visuals."""
    for visual in link.all_of("visual"):
        for material in visual.all_of("material"):
            colour = _colour(material) or colours.get(material.attributes.get("name", ""))
            if colour is not None:
                yield colour


def _colour(material: Element) -> Colour | None:
    colour = material.one_of("color")
    if colour is None:
        return None
    words = text_of(colour, "rgba").split()
    try:
        red, green, blue, alpha = map(float, words)
    except ValueError:
        raise colour.error("a colour has 4 numbers: red, green, blue, alpha", colour.attributes["rgba"]) from None
    if not all(0.0 <= share <= 1.0 for share in (red, green, blue, alpha)):
        raise colour.error("a share of a colour is not within 0 to 1", colour.attributes["rgba"])
    return red, green, blue, alpha
