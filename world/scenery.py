"""Fixed things that a deployment puts into its world beside table or hall: boxes, cylinders, and meshes from files.

This is their schema, and their conversion to shapes of the scene. A mesh's file is a path inside the deployment's
asset folder; its digest is written beside it when a run is planned, so that the deployment's text alone identifies
the world, on every machine.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, Field, StringConstraints

from foosim.common import limits, units
from foosim.common.errors import BadValue
from foosim.common.spec_base import SpecBase, default
from foosim.common.units import Quantity, custom_error
from foosim.world.matter.materials import UNKNOWN, Radio
from foosim.world.matter.mesh import MESH_SUFFIXES, AssetError, Mesh, check_digest, digest_of, mesh_format
from foosim.world.scene import Box, Colour, Cylinder, Quaternion, Shape, Vector, from_rpy

PATH_LENGTH_MAX: Final = 200
PATH_DEPTH_MAX: Final = 8
SCENERY_MAX: Final = 256

_COMPONENT: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
_LETTERS: Final = "letters, digits, _, - and . (not at the beginning)"


def path_problem(path: str, folder: str = "the asset folder") -> str:
    """Return the problem of a text as a path inside a folder, as messages name that; empty for a valid one.

    The file system is not read.
    """
    if len(path) > PATH_LENGTH_MAX:
        return f"a path of more than {PATH_LENGTH_MAX} characters"
    if ":" in path:
        return f"a path inside {folder} has no scheme and no drive"
    if path.startswith(("/", "\\", "~")):
        return f"a path inside {folder} is relative"
    components = path.split("/")
    if any(component in ("", ".", "..") for component in components):
        return f"a path inside {folder} has no empty component, no . and no .."
    if len(components) > PATH_DEPTH_MAX:
        return f"a path of more than {PATH_DEPTH_MAX} components"
    if not all(_COMPONENT.fullmatch(component) for component in components):
        return f"a path inside {folder} has {_LETTERS} between its slashes"
    return ""


def _asset_path(path: str) -> str:
    problem = path_problem(path)
    if problem:
        raise custom_error(BadValue(problem, path))
    return path


def _mesh_path(path: str) -> str:
    _asset_path(path)
    if not mesh_format(path):
        raise custom_error(BadValue(f"no format of a mesh, there are {', '.join(MESH_SUFFIXES)}", path))
    return path


def _folder(path: str) -> str:
    return path if path == "." else _asset_path(path)


def _digest(text: str) -> str:
    if not re.fullmatch("[0-9a-f]{64}", text):
        raise custom_error(BadValue("a digest is 64 hexadecimal digits", text))
    return text


AssetFolder = Annotated[str, AfterValidator(_folder)]
AssetPath = Annotated[str, AfterValidator(_asset_path)]
MeshPath = Annotated[str, AfterValidator(_mesh_path)]
Digest = Annotated[str, AfterValidator(_digest)]
Length = Annotated[float, Quantity(units.LENGTH, "0.1 mm", "1000 m")]
Position = Annotated[float, Quantity(units.LENGTH, "-1000 m", "1000 m")]
Turn = Annotated[float, Quantity(units.ANGLE, "-360 deg", "360 deg")]
Share = Annotated[float, Field(ge=0, le=1)]
SurfaceName = Annotated[str, StringConstraints(max_length=48)]


class Material(SpecBase):
    """The colour of a thing, as shares of red, green and blue."""

    red: Share = 0.6
    green: Share = 0.6
    blue: Share = 0.6

    @property
    def colour(self) -> Colour:
        return self.red, self.green, self.blue, 1.0


class Placed(SpecBase):
    """The pose of a thing: its origin; and turned about the world's x (roll), then y (pitch), then z (yaw).

    `surface` is its surface in contacts, '' for none; `radio` the loss of waves that cross it: 5 dB by default.
    """

    x: Position = default("0 m")
    y: Position = default("0 m")
    z: Position = default("0 m")
    roll: Turn = default("0 deg")
    pitch: Turn = default("0 deg")
    yaw: Turn = default("0 deg")
    surface: SurfaceName = "walls"
    material: Material = Field(default_factory=Material)
    radio: Radio | None = None

    @property
    def position(self) -> Vector:
        return self.x, self.y, self.z

    @property
    def orientation(self) -> Quaternion:
        return from_rpy(self.roll, self.pitch, self.yaw)


class SceneryBox(Placed):
    """A box, its origin in its middle."""

    shape: Literal["box"]
    length: Length
    width: Length
    height: Length


class SceneryCylinder(Placed):
    """A cylinder, its origin in its middle, its axis its own z: an upright column unless it is turned."""

    shape: Literal["cylinder"]
    radius: Length
    length: Length


class SceneryMesh(Placed):
    """The triangles of a file. `scale` is metres per unit of the file; `digest` (BLAKE2b) identifies the file."""

    shape: Literal["mesh"]
    file: MeshPath
    scale: Annotated[float, Field(ge=1e-6, le=1e6)] = 1.0
    digest: Digest | None = None


SceneryThing = SceneryBox | SceneryCylinder | SceneryMesh
Scenery = Annotated[SceneryThing, Field(discriminator="shape")]


@dataclass(frozen=True, slots=True)
class Contents:
    """The contents of the files of scenery: by path, by digest (hex), and as meshes by the thing's name."""

    files: Mapping[str, bytes] = field(default_factory=dict)
    by_digest: Mapping[str, bytes] = field(default_factory=dict)
    meshes: Mapping[str, Mesh] = field(default_factory=dict)


def read_contents(
    scenery: Mapping[str, SceneryThing], files: Mapping[str, bytes], others: Iterable[str] = ()
) -> Contents:
    """Read the files of all meshes, and keep `others`.

    Raises AssetError for a file that is missing, has another digest or is invalid.
    """
    meshes: dict[str, Mesh] = {}
    known: dict[tuple[str, float], Mesh] = {}
    triangles = 0
    things = {name: thing for name, thing in sorted(scenery.items()) if isinstance(thing, SceneryMesh)}
    if things:
        from foosim.world.mesh_files import read_mesh  # brings numpy
    for name, thing in things.items():
        if thing.file not in files:
            raise AssetError(f"{thing.file}: the file of scenery.{name} is missing")
        if thing.digest is not None:
            check_digest(thing.file, files[thing.file], thing.digest)
        key = thing.file, thing.scale
        if key not in known:
            known[key] = read_mesh(thing.file, files[thing.file], thing.scale)
        meshes[name] = known[key]
        triangles += len(known[key].triangles)
        if triangles > limits.SCENERY_TRIANGLES_MAX:
            what = f"{triangles} triangles in the meshes up to scenery.{name}"
            raise AssetError(f"{thing.file}: {what}, at most {limits.SCENERY_TRIANGLES_MAX} are allowed")
    used = {path: files[path] for path in (*mesh_files(scenery), *others) if path in files}
    return Contents(used, {digest_of(content): content for content in used.values()}, meshes)


def scenery_shape(name: str, thing: SceneryThing, mesh: Mesh | None) -> Shape:
    """Return a thing as a shape in the world; a mesh's triangles are given, scaled."""
    if isinstance(thing, SceneryBox):
        geometry: Box | Cylinder | Mesh = Box((thing.length / 2, thing.width / 2, thing.height / 2))
    elif isinstance(thing, SceneryCylinder):
        geometry = Cylinder(thing.radius, thing.length)
    else:
        assert mesh is not None, f"the deployment was not given the file of scenery.{name}"
        geometry = mesh
    colour, radio = thing.material.colour, thing.radio or UNKNOWN
    return Shape(geometry, thing.surface, colour, thing.position, thing.orientation, radio, name)


def open_meshes(scenery: Mapping[str, SceneryThing], meshes: Mapping[str, Mesh]) -> list[str]:
    """Return the things with an open mesh, whose material needs the way of waves through them."""
    if not meshes:
        return []
    from foosim.world.mesh_files import is_closed

    return [
        name
        for name, thing in scenery.items()
        if name in meshes and thing.radio is not None and thing.radio.needs_chord and not is_closed(meshes[name])
    ]


def mesh_files(scenery: Mapping[str, SceneryThing]) -> dict[str, str | None]:
    """Return the files of scenery, in name order, each with the digest that is written beside it."""
    meshes = [thing for thing in scenery.values() if isinstance(thing, SceneryMesh)]
    return {mesh.file: mesh.digest for mesh in sorted(meshes, key=lambda mesh: mesh.file)}
