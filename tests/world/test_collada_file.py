"""COLLADA files: where their corners are by hand, with units, axes, poses and colours; and what is refused."""

from __future__ import annotations

import re
from itertools import product
from typing import Final

import numpy as np
import pytest

from foosim.common import limits
from foosim.world.bodies.visual_meshes import drawn_content, drawn_parts, undrawn_content
from foosim.world.matter.mesh import AssetError, Mesh
from foosim.world.mesh_files import read_mesh, read_parts

SCHEMA: Final = "http://www.collada.org/2005/11/COLLADASchema"
SIDES: Final = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
"""Of the cube with the corners +-1, by the numbers of the corners, seen from outside counter-clockwise."""
PLACES: Final = " ".join(f"{x} {y} {z}" for x, y, z in product((-1, 1), repeat=3))
QUADS: Final = (
    '<polylist material="paint" count="6"><input semantic="VERTEX" source="#corners" offset="0"/>'
    f"<vcount>{'4 ' * 6}</vcount><p>{' '.join(str(corner) for side in SIDES for corner in side)}</p></polylist>"
)
FANNED: Final = [(a, b, c) for a, *rest in SIDES for b, c in (rest[:2], rest[1:])]
TRIANGLES: Final = (
    '<triangles material="paint" count="12"><input semantic="VERTEX" source="#corners" offset="0"/>'
    f"<p>{' '.join(str(corner) for triangle in FANNED for corner in triangle)}</p></triangles>"
)
LOOK: Final = (
    '<library_effects><effect id="red"><profile_COMMON><technique sid="common"><lambert><diffuse>'
    "<color>0.8 0.1 0.2 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>"
    '<library_materials><material id="shiny"><instance_effect url="#red"/></material></library_materials>'
)
PLACED: Final = (
    '<instance_geometry url="#cube"><bind_material><technique_common>'
    '<instance_material symbol="paint" target="#shiny"/></technique_common></bind_material></instance_geometry>'
)
NODE: Final = f'<node id="node">{PLACED}</node>'


def collada(
    nodes: str = NODE, surface: str = QUADS, asset: str = "<up_axis>Z_UP</up_axis>", more: str = LOOK, rest: str = ""
) -> bytes:
    return (
        f'<?xml version="1.0" encoding="utf-8"?>\n<COLLADA xmlns="{SCHEMA}" version="1.4.1"><asset>{asset}</asset>'
        f"{more}"
        '<library_geometries><geometry id="cube"><mesh><source id="places"><float_array id="numbers" count="24">'
        f'{PLACES}</float_array><technique_common><accessor source="#numbers" count="8" stride="3"><param name="X" '
        'type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>'
        '</source><vertices id="corners"><input semantic="POSITION" source="#places"/></vertices>'
        f'{surface}</mesh></geometry></library_geometries>{rest}<library_visual_scenes><visual_scene id="scene">'
        f'{nodes}</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#scene"/></scene></COLLADA>'
    ).encode()


def volume(mesh: Mesh) -> float:
    """The volume inside, negative where corners are clockwise seen from outside."""
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


TOOL: Final = "<contributor><authoring_tool>VCGLib | MeshLab</authoring_tool></contributor>"
MOVE: Final = "<translate>10 20 30</translate>"
AT: Final[dict[str, tuple[bytes, tuple[float, ...], tuple[float, ...]]]] = {
    "m": (collada(), (-1, -1, -1), (1, 1, 1)),
    "triangles": (collada(surface=TRIANGLES), (-1, -1, -1), (1, 1, 1)),
    "mm": (
        collada(asset='<unit name="millimeter" meter="0.001"/><up_axis>Z_UP</up_axis>'),
        (-0.001, -0.001, -0.001),
        (0.001, 0.001, 0.001),
    ),
    "a place": (collada(f"<node>{MOVE}{PLACED}</node>"), (9, 19, 29), (11, 21, 31)),
    "a place within a scale and a turn": (
        collada(f"<node><rotate>0 0 1 90</rotate><scale>1 2 3</scale><node>{MOVE}{PLACED}</node></node>"),
        (-42, 9, 87),
        (-38, 11, 93),
    ),
    "a mirror": (collada(f"<node><scale>-1 1 1</scale>{MOVE}{PLACED}</node>"), (-11, 19, 29), (-9, 21, 31)),
    "two of a library": (
        collada(
            f'<node><node><translate>5 0 0</translate><instance_node url="#node"/></node>{PLACED}</node>',
            rest=f"<library_nodes>{NODE}</library_nodes>",
        ),
        (-1, -1, -1),
        (6, 1, 1),
    ),
    "y up, as without a word": (collada(f"<node>{MOVE}{PLACED}</node>", asset=""), (9, -31, 19), (11, -29, 21)),
    "x up": (
        collada(f"<node>{MOVE}{PLACED}</node>", asset="<up_axis>X_UP</up_axis>"),
        (-21, -31, 9),
        (-19, -29, 11),
    ),
    "y up, of MeshLab": (
        collada(f"<node>{MOVE}{PLACED}</node>", asset=f"{TOOL}<up_axis>Y_UP</up_axis>"),
        (9, 19, 29),
        (11, 21, 31),
    ),
}


@pytest.mark.parametrize("what", AT)
def test_a_cube_is_where_the_file_places_it_and_closed_from_outside(what: str) -> None:
    content, low, high = AT[what]
    mesh = read_mesh("meshes/CUBE.DAE", content)
    np.testing.assert_allclose(mesh.box, (low, high), rtol=1e-6)
    sides = np.subtract(high, low)
    cubes = 2.0 * 8.0 if what == "two of a library" else float(np.prod(sides))
    np.testing.assert_allclose(volume(mesh), cubes, rtol=1e-5)
    assert len(mesh.triangles) == (24 if what == "two of a library" else 12)


def test_colours_are_those_of_materials_and_a_broken_one_costs_the_colour_alone() -> None:
    ((_, triangles, colour),) = read_parts("cube.dae", collada(), 12)
    assert len(triangles) == 12 and colour == pytest.approx((0.8, 0.1, 0.2, 1.0))
    ((_, triangles, colour),) = read_parts("cube.dae", collada(more=""), 12)
    assert len(triangles) == 12 and colour is None


NESTED: Final = "".join(
    f'<node id="n{level}">' + f'<instance_node url="#n{level - 1}"/>' * 10 + "</node>" for level in range(1, 9)
)
BAD: Final[dict[str, tuple[bytes, str]]] = {
    "no XML": (b"solid", "no valid COLLADA file"),
    "nothing": (b"", "no valid COLLADA file"),
    "another root": (b"<svg/>", "0 scenes"),
    "a zero byte, as in an archive": (collada() + b"PK\5\6\0\0", "a zero byte in a text"),
    "bytes that are no text": (collada() + b"\xff", "not UTF-8, 255"),
    "a document type": (b'<!DOCTYPE a [<!ENTITY b "c">]>' + collada()[39:], "a document type"),
    "too many triangles": (collada(), "more than 11 triangles"),
    "a corner that is not there": (collada(surface=TRIANGLES.replace("<p>0 ", "<p>8 ")), "no valid COLLADA file"),
    "a corner before the first": (
        collada(surface=TRIANGLES.replace("<p>0 ", "<p>-1 ")),
        "a triangle with an unknown vertex",
    ),
    "counts that do not fit": (collada(surface=QUADS.replace("<vcount>4", "<vcount>5")), "counts of corners"),
    "a polygon of two": (collada(surface=QUADS.replace("<vcount>4 4", "<vcount>2 6")), "counts of corners"),
    "a geometry that is not there": (collada(NODE.replace("#cube", "#cub")), "no valid COLLADA file"),
    "lines alone": (
        collada(surface=re.sub("<vcount>.*</vcount>", "", QUADS.replace("polylist", "lines"))),
        "a scene without a surface",
    ),
    "a number that is not finite": (collada().replace(b"-1 -1 -1", b"1e39 -1 -1"), "a coordinate of nan m"),
    "a unit of 0": (collada(asset='<unit meter="0"/>'), "a unit of length is not within"),
    "nodes that multiply": (
        collada(
            '<node><instance_node url="#n8"/></node>', rest=f'<library_nodes><node id="n0"/>{NESTED}</library_nodes>'
        ),
        "more than 10000 nodes",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_what_is_no_surface_is_refused_with_the_reason(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    content, reason = BAD[what]
    monkeypatch.setattr(limits, "MESH_TRIANGLES_MAX", 11 if what.startswith("too many") else 24)
    with pytest.raises(AssetError) as refusal:
        read_mesh("a.dae", content)
    text = str(refusal.value)
    assert text.startswith("a.dae: ") and reason in text and text.isprintable() and len(text) < 300


def sphere(rings: int) -> bytes:
    """The OBJ of a unit sphere with 2 rings^2 triangles."""
    angles = [(np.pi * ring / rings, 2 * np.pi * step / rings) for ring in range(rings + 1) for step in range(rings)]
    lines = [f"v {np.sin(a) * np.cos(b)} {np.sin(a) * np.sin(b)} {np.cos(a)}" for a, b in angles]
    for ring, step in product(range(rings), range(rings)):
        a, b = ring * rings + step + 1, ring * rings + (step + 1) % rings + 1
        lines.append(f"f {a} {a + rings} {b + rings} {b}")
    return "\n".join(lines).encode()


def test_a_drawn_mesh_has_few_triangles_on_the_same_surface() -> None:
    whole = sphere(60)
    ((vertices, triangles, _),), remark = drawn_parts(drawn_content("s.obj", whole, 500))
    assert 250 < len(triangles) <= 500 and remark == f"{len(triangles)} of 7,200 triangles are drawn"
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1.0, atol=0.02)
    assert volume(Mesh(vertices, triangles, b"")) == pytest.approx(4 / 3 * np.pi, rel=0.05), "seen from outside"
    ((vertices, triangles, colour),), remark = drawn_parts(drawn_content("cube.dae", collada(), 500))
    assert (len(vertices), len(triangles), remark) == (8, 12, "") and colour == pytest.approx((0.8, 0.1, 0.2, 1.0))


def test_a_mesh_of_tangled_pieces_has_few_triangles_too() -> None:
    """They are in the file from the left to the right: to leave out the last ones would leave out a side."""
    rng = np.random.default_rng(5)
    lines = []
    for place in np.linspace(-1.0, 1.0, 60):
        lines += [f"v {x + place} {y} {z}" for x, y, z in rng.uniform(-0.2, 0.2, (10, 3)).tolist()]
        lines += [f"f {a - 10} {b - 10} {c - 10}" for a, b, c in (rng.permutation(10)[:3] for _ in range(50))]
    ((vertices, triangles, _),), _ = drawn_parts(drawn_content("tangle.obj", "\n".join(lines).encode(), 400))
    assert 0 < len(triangles) <= 400 and vertices[triangles, 0].max() > 0.9


def test_what_cannot_be_drawn_has_the_reason_and_nothing_else() -> None:
    assert drawn_parts(drawn_content("a.dae", b"x"))[0] == []
    assert drawn_parts(drawn_content("a.dae", b"x"))[1].startswith("a.dae: no valid COLLADA file")
    assert drawn_parts(drawn_content("a.dae", collada().replace(b"-1 -1 -1", b"1e39 -1 -1")))[1].endswith("not finite")
    assert drawn_parts(undrawn_content("not there")) == ([], "not there")
    whole = drawn_content("cube.dae", collada())
    for cut in range(len(whole)):
        assert drawn_parts(whole[:cut]) == ([], "no drawn form of a mesh")
