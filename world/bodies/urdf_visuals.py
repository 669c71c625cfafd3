"""Looks of a URDF: the visuals of its links with their colours. A visual that cannot be drawn is noted, not refused."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from hashlib import blake2b
from typing import Final

from foosim.world.bodies.findings import Findings
from foosim.world.bodies.urdf_links import MISSING, mesh_path, primitive, scale_of, shape_in
from foosim.world.bodies.urdf_values import placed_by, text_of
from foosim.world.bodies.xml_tree import BadElement, Element
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import Box, Capsule, Colour, Cylinder, Shape, Sphere

GREY: Final[Colour] = (0.6, 0.6, 0.6, 1.0)
UNDRAWN: Final = "a visual is not drawn"


def materials_of(robot: Element, findings: Findings) -> dict[str, Colour]:
    """Return the colours of a file's materials, by name: the first one of each."""
    found: dict[str, Colour] = {}
    for material in (
        *robot.all_of("material"),
        *(of for link in robot.all_of("link") for of in link.below("material")),
    ):
        try:
            colour = _colour(material)
        except BadElement as bad:
            findings.note(material, "a colour is not used", bad.problem)
            continue
        if colour is not None:
            found.setdefault(material.attributes.get("name", ""), colour)
    return found


def first_colour(link: Element, colours: Mapping[str, Colour]) -> Colour:
    """Return the colour of a link's collision shapes: that of the first visual that has one."""
    named = (_colour_of(visual, colours) for visual in link.all_of("visual"))
    return next((colour for colour in named if colour is not None), GREY)


def read_visuals(
    link: Element, colours: Mapping[str, Colour], files: Mapping[str, bytes], findings: Findings
) -> Iterator[Shape]:
    """Yield the shapes of a link's visuals; `files` are the contents of their meshes, by the path that is drawn."""
    for visual in link.all_of("visual"):
        try:
            position, orientation = placed_by(visual)
            shape, colour = shape_in(visual), _colour_of(visual, colours)
            parts = [(primitive(shape), None)] if shape.tag != "mesh" else [*_mesh_parts(shape, files, findings)]
        except BadElement as bad:
            findings.note(visual, UNDRAWN, bad.problem)
            continue
        for geometry, own in parts:
            yield Shape(geometry, "", own or colour or GREY, position, orientation)


def _mesh_parts(
    mesh: Element, files: Mapping[str, bytes], findings: Findings
) -> Iterator[tuple[Box | Sphere | Cylinder | Capsule | Mesh, Colour | None]]:
    """Yield the parts of a mesh, each with its own colour if the file has one."""
    import numpy as np

    from foosim.world.bodies.visual_meshes import TRIANGLES_MAX, drawn_parts, drawn_path

    path = mesh_path(mesh)
    drawn = drawn_path(path)
    if drawn not in files:
        raise mesh.error(MISSING, path)
    scale = scale_of(mesh)
    parts, remark = drawn_parts(files[drawn])
    if remark and parts:
        findings.note(mesh, f"visuals with more than {TRIANGLES_MAX:,} triangles", f"{TRIANGLES_MAX:,} are drawn")
    elif remark:
        findings.note(mesh, f"{UNDRAWN},", remark.removeprefix(f"{path}: "), path)
    for vertices, triangles, colour in parts:
        placed = np.ascontiguousarray(vertices * scale)
        corners = triangles if scale[0] * scale[1] * scale[2] > 0.0 else np.ascontiguousarray(triangles[:, ::-1])
        digest = blake2b(placed.tobytes() + corners.tobytes(), digest_size=32).digest()
        yield Mesh(placed, corners, digest), colour


def _colour_of(visual: Element, colours: Mapping[str, Colour]) -> Colour | None:
    """Return the colour of a visual's material, its own or by name."""
    for material in visual.all_of("material"):
        try:
            colour = _colour(material)
        except BadElement:  # noted with the materials
            colour = None
        colour = colour or colours.get(material.attributes.get("name", ""))
        if colour is not None:
            return colour
    return None


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
