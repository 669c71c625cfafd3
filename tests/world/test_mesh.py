"""Meshes from outside: what is read, and a corpus of bad files, each refused with its file, its line and the reason."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Final

import numpy as np
import pytest

from foosim.common import limits
from foosim.world.matter.mesh import AssetError, Mesh
from foosim.world.mesh_files import pieces, read_mesh

Point = tuple[float, float, float]
Triangle = tuple[Point, Point, Point]

CORNERS: Final = [(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
SIDES: Final = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
CUBE: Final = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "".join(
    "f " + " ".join(str(corner + 1) for corner in side) + "\n" for side in SIDES
)
TRIANGLES: Final = [(CORNERS[a], CORNERS[b], CORNERS[c]) for a, *rest in SIDES for b, c in (rest[:2], rest[1:])]


def binary_stl(triangles: Sequence[Triangle], count: int | None = None, head: bytes = b"made") -> bytes:
    body = b"".join(struct.pack("<12fH", *(0.0,) * 3, *a, *b, *c, 0) for a, b, c in triangles)
    return head.ljust(80, b" ") + struct.pack("<I", len(triangles) if count is None else count) + body


def text_stl(triangles: Sequence[Triangle]) -> str:
    facets = "".join(
        "facet normal 0 0 0\n outer loop\n"
        + "".join("  vertex " + " ".join(map(str, corner)) + "\n" for corner in triangle)
        + " endloop\nendfacet\n"
        for triangle in triangles
    )
    return f"solid cube\n{facets}endsolid cube\n"


def surface(mesh: Mesh) -> set[frozenset[tuple[float, ...]]]:
    """The triangles as sets of corners."""
    corners = mesh.vertices[mesh.triangles].tolist()
    return {frozenset(tuple(corner) for corner in triangle) for triangle in corners}


# --- what is read ----------------------------------------------------------------------------------------------------


def test_a_cube_is_the_same_from_every_format() -> None:
    obj = read_mesh("cube.obj", CUBE.encode())
    assert (len(obj.vertices), len(obj.triangles)) == (8, 12)
    assert obj.box == ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
    assert surface(obj) == {frozenset(triangle) for triangle in TRIANGLES}
    binary, text = (read_mesh("cube.stl", content) for content in (binary_stl(TRIANGLES), text_stl(TRIANGLES).encode()))
    assert binary == text and surface(binary) == surface(obj) and len(binary.vertices) == 8
    assert read_mesh("cube.stl", binary_stl(TRIANGLES, head=b"solid as they say")) == binary


def test_what_an_obj_may_have_beside_its_surface_changes_nothing() -> None:
    lines = CUBE.splitlines()
    more = [
        "# a cube",
        "mtllib /etc/passwd",
        "o cube",
        "g side",
        "usemtl ../../x",
        "s off",
        "vn 0 0 1",
        "vt 0 0",
        "l 1 2",
    ]
    full = [line.replace("f ", "f\t") if line.startswith("f") else f"{line} 1.0  # a vertex" for line in lines]
    relative = [
        "f " + " ".join(f"{int(word) - 9}/1/1" for word in line.split()[1:]) if line.startswith("f") else line
        for line in lines
    ]
    plain = read_mesh("cube.obj", CUBE.encode())
    assert read_mesh("cube.obj", "\r\n".join([*more, *full]).encode()) == plain
    assert read_mesh("cube.obj", "\n".join(relative).encode()) == plain
    assert read_mesh("cube.obj", "\n".join(lines[8:] + lines[:8]).encode()) == plain, "faces before their vertices"


def test_a_scale_is_part_of_the_mesh() -> None:
    small = read_mesh("cube.obj", CUBE.encode(), 0.015)
    assert small.box == ((-0.015, -0.015, -0.015), (0.015, 0.015, 0.015)) and small != read_mesh("c.obj", CUBE.encode())


def test_triangles_without_area_and_vertices_without_triangle_are_left_out() -> None:
    lines = ["v 9 9 9", *CUBE.splitlines()[:8], "v 2 2 2", "f 2 2 3", "f 2 5 2", "f 2 3 4"]
    mesh = read_mesh("cube.obj", "\n".join(lines).encode())
    assert len(mesh.triangles) == 1 and len(mesh.vertices) == 3


def test_a_zero_has_no_sign_in_a_mesh() -> None:
    flat = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    assert read_mesh("f.obj", flat.encode()) == read_mesh("f.obj", flat.replace(" 0", " -0").encode())


def test_pieces_are_the_mesh_together() -> None:
    mesh = read_mesh("cube.obj", CUBE.encode())
    parts = list(pieces(mesh, 5))
    assert [len(piece.triangles) for piece in parts] == [5, 5, 2]
    assert set().union(*map(surface, parts)) == surface(mesh)
    assert list(pieces(mesh, 12)) == [mesh]


# --- what is refused -------------------------------------------------------------------------------------------------


def grid(triangles: int) -> str:
    """A strip of so many triangles."""
    vertices = "".join(f"v {number // 2} {number % 2} 0\n" for number in range(triangles + 2))
    return vertices + "".join(f"f {number} {number + 1} {number + 2}\n" for number in range(1, triangles + 1))


FLAT: Final = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
ONE: Final[list[Triangle]] = [((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))]
STL: Final = text_stl(ONE)
FEW: Final = 40
"""How many triangles a mesh may have in these tests."""
BAD: Final[dict[str, tuple[str, str | bytes, str]]] = {
    "a vertex that is not there": ("a.obj", FLAT + "f 1 2 9\n", "a.obj:4: a face with vertex 9, there are 3"),
    "a vertex far away": ("a.obj", FLAT + "f 1 2 999999999\n", "a.obj:4: a face with vertex 999999999, there are 3"),
    "a number beyond 32 bits": ("a.obj", FLAT + "f 1 2 4294967297\n", "a.obj:4: no corner of a face, '4294967297'"),
    "vertex 0": ("a.obj", FLAT + "f 0 1 2\n", "a.obj:4: no corner of a face, '0', valid are 1 to, or -1 to -3"),
    "a relative vertex before the first": ("a.obj", FLAT + "f -1 -2 -4\n", "a.obj:4: no corner of a face, '-4'"),
    "a corner that is no number": ("a.obj", FLAT + "f 1 2 x\n", "a.obj:4: no corner of a face, 'x'"),
    "a corner with a fraction": ("a.obj", FLAT + "f 1 2 3.5\n", "a.obj:4: no corner of a face, '3.5'"),
    "a corner with too many slashes": ("a.obj", FLAT + "f 1 2 3/1/1/1\n", "a.obj:4: no corner of a face"),
    "a face of two corners": ("a.obj", FLAT + "f 1 2\n", "a.obj:4: a face of 2 corners, it has 3 to 1024"),
    "a face of too many": ("a.obj", FLAT + "f" + " 1" * 1025 + "\n", "a.obj:4: a face of 1025 corners"),
    "a vertex of two coordinates": ("a.obj", "v 0 0\n", "a.obj:1: 2 numbers, a vertex has 3"),
    "a coordinate that is nan": ("a.obj", "v 0 nan 0\n", "a.obj:1: not a finite number, 'nan'"),
    "a coordinate that is infinite": ("a.obj", "v 0 0 -inf\n", "a.obj:1: not a finite number, '-inf'"),
    "a coordinate beyond float64": ("a.obj", FLAT.replace("1", "1e999") + "f 1 2 3", "a.obj: a coordinate of inf m"),
    "a number with an underscore": ("a.obj", "v 0 1_0 0\n", "a.obj:1: not a finite number, '1_0'"),
    "a number in other digits": ("a.obj", "v 0 \u0661 0\n", "a.obj:1: not a finite number"),
    "a number of a million digits": ("a.obj", "v 0 0 " + "1" * 10**6, "a.obj:1: not a finite number, '1111"),
    "a statement of other things": ("a.obj", FLAT + "curv 0 1 1 2\n", "a.obj:4: an unknown statement, 'curv'"),
    "a call of another file": ("a.obj", "call /etc/passwd\n", "a.obj:1: an unknown statement, 'call'"),
    "nothing at all": ("a.obj", "", "a.obj: no triangle with an area"),
    "vertices alone": ("a.obj", FLAT, "a.obj: no triangle with an area"),
    "a line": ("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "a.obj: no triangle with an area"),
    "too small": ("a.obj", FLAT.replace("1", "1e-5") + "f 1 2 3\n", "a.obj: the longest side is 1e-05 m"),
    "too large": (
        "a.obj",
        "v -600 0 0\nv 600 0 0\nv 0 1 0\nf 1 2 3\n",
        "a.obj: the longest side is 1200 m, valid are 0.0001 to 1000 m",
    ),
    "too far out": (
        "a.obj",
        FLAT.replace(" 0\n", " 2e3\n") + "f 1 2 3\n",
        "a.obj: a coordinate of 2000 m, the farthest that is valid is 1000 m",
    ),
    "too many triangles": ("a.obj", grid(FEW + 1), f"a.obj:{2 * FEW + 4}: more than {FEW} triangles"),
    "too many in one face": ("a.obj", FLAT + "f " + "1 2 3 " * FEW, f"a.obj:4: more than {FEW} triangles"),
    "a zero byte": ("a.obj", FLAT + "f 1 2\0 3\n", "a.obj:4: a zero byte in a text"),
    "bytes that are no text": ("a.obj", b"v 0 0 0\n\xff\xfe\n", "a.obj:2: not UTF-8, 255"),
    "an STL that is called OBJ": ("a.obj", STL, "a.obj:1: an unknown statement, 'solid'"),
    "a binary STL that is called OBJ": ("a.obj", binary_stl(ONE), "a.obj:1: a zero byte in a text"),
    "an OBJ that is called STL": ("a.stl", CUBE, "a.stl: no STL file"),
    "an empty STL": ("a.stl", b"", "a.stl: no STL file: it has 0 bytes and a binary one has at least 84 bytes"),
    "a binary STL that is cut": ("a.stl", binary_stl(ONE)[:-1], "it has 133 bytes and 1 triangles would take 134"),
    "a binary STL with a tail": ("a.stl", binary_stl(ONE) + b"x", "it has 135 bytes and 1 triangles would take 134"),
    "a count that lies": ("a.stl", binary_stl(ONE, 2**32 - 1), "4294967295 triangles would take 214748364834 bytes"),
    "a binary STL without triangles": ("a.stl", binary_stl([]), "a.stl: no triangle with an area"),
    "a binary STL of too many": ("a.stl", binary_stl(ONE * (FEW + 1)), f"a.stl: more than {FEW} triangles"),
    "a binary STL with nan": (
        "a.stl",
        binary_stl([*ONE, ((float("nan"), 0.0, 0.0), ONE[0][1], ONE[0][2])]),
        "a.stl: triangle 2 has a non-finite coordinate",
    ),
    "a text STL with nan": ("a.stl", STL.replace("1.0 0.0 0.0", "nan 0 0"), "a.stl:5: not a finite number, 'nan'"),
    "a text STL with two coordinates": ("a.stl", STL.replace("1.0 0.0 0.0", "1 0"), "a.stl:5: 2 coordinates"),
    "a facet of two corners": (
        "a.stl",
        STL.replace("  vertex 1.0 0.0 0.0\n", ""),
        "a.stl:6: a line that does not belong here, 'endloop', not vertex",
    ),
    "a facet of four corners": (
        "a.stl",
        STL.replace(" endloop", "  vertex 1 1 1\n endloop"),
        "a.stl:7: a line that does not belong here, 'vertex', not endloop",
    ),
    "a text STL that ends early": ("a.stl", STL[: STL.index("endfacet")], "the file ends within a facet"),
    "a text STL that does not end": ("a.stl", STL[: STL.index("endsolid")], "the file ends within the solid"),
    "a text STL of too many": (
        "a.stl",
        text_stl(ONE * (FEW + 1)),
        f"a.stl:{2 + 7 * FEW + 6}: more than {FEW} triangles",
    ),
    "words behind the end": ("a.stl", STL + "more\n", "a.stl:10: a line that does not belong here, 'more', not solid"),
    "an archive": ("a.zip", b"PK\3\4", "a.zip: no format of a mesh, there are"),
    "a name without a format": ("obj", CUBE, "obj: no format of a mesh, there are .obj, .stl, .dae"),
}


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files with a triangle too many are large; here they are not."""
    monkeypatch.setattr(limits, "MESH_TRIANGLES_MAX", FEW)


@pytest.mark.parametrize("what", BAD)
def test_a_bad_file_is_refused_with_its_place_and_the_reason(few: None, what: str) -> None:
    name, content, reason = BAD[what]
    with pytest.raises(AssetError) as refusal:
        read_mesh(name, content.encode() if isinstance(content, str) else content)
    text = str(refusal.value)
    assert reason in text and text.startswith(name) and "\n" not in text and len(text) < 300


def test_a_file_beyond_the_limit_is_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "ASSET_BYTES_MAX", 10)
    with pytest.raises(AssetError, match=r"^cube\.obj: \d+ bytes, at most 10 are allowed$"):
        read_mesh("cube.obj", CUBE.encode())


def test_as_many_triangles_as_the_limit_says_are_read() -> None:
    mesh = read_mesh("strip.stl", binary_stl(ONE * 5 + [((0.0, 0.0, 1.0), ONE[0][1], ONE[0][2])]))
    assert len(mesh.triangles) == 6 and len(mesh.vertices) == 4
    rng = np.random.default_rng(4)
    corners = rng.uniform(-1, 1, (limits.MESH_TRIANGLES_MAX, 3, 3)).astype("<f4")
    record = np.zeros(len(corners), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]))
    record["corners"] = corners
    large = read_mesh("noise.stl", bytes(80) + struct.pack("<I", len(corners)) + record.tobytes())
    assert len(large.triangles) == limits.MESH_TRIANGLES_MAX
