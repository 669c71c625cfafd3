"""Meshes from outside: the content of an OBJ, an STL or a COLLADA file, checked, as vertices and triangles.

Everything that a physics engine takes for granted is checked here, in Python, before one sees it: a face with an
unknown vertex ends the process that hands it to Bullet. An invalid mesh raises `AssetError` with file, line and
reason. Of materials the colours of COLLADA alone are read, and no textures, so no file names another one. Pure: the
content is given.

OBJ and STL are read here, where each fault has its line: trimesh 5.2 takes a corner that counts back from its face as
one that counts back from the end of the file, passes over lines with a tab, and takes a time that grows with the square
of the number of solids in a text. COLLADA is read by pycollada (matter/collada_file.py).

OBJ: Wavefront's Advanced Visualizer manual, appendix B1. STL: 3D Systems' interface specification of 1989.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from hashlib import blake2b
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from foosim.common import limits
from foosim.common.errors import describe
from foosim.world.matter.mesh import MESH_SUFFIXES, AssetError, Mesh, mesh_format, too_many

if TYPE_CHECKING:
    from foosim.world.matter.mesh import Part

EXTENT_MIN_M: Final = 1e-4
EXTENT_MAX_M: Final = 1e3
"""The least and greatest longest side of a mesh after scaling (m); no coordinate is farther out."""
FACE_CORNERS_MAX: Final = 1024
CLOSED_KEPT: Final = 16
"""The count of meshes with a kept result of the test whether they are closed: it takes 0.2 s for the largest."""
_STL_HEAD: Final = 84
_STL_TRIANGLE: Final = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
_FLOAT: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_CORNER: Final = re.compile(r"(-?[0-9]{1,9})(?:/-?[0-9]{0,9}){0,2}")
_PASSED_OVER: Final = frozenset({"vn", "vt", "vp", "o", "g", "s", "l", "p", "usemtl", "mtllib"})
"""Statements of an OBJ file that do not concern its surface; their arguments are ignored."""


def read_mesh(name: str, content: bytes, scale: float = 1.0) -> Mesh:
    """Return the mesh in a file's content, its coordinates times `scale` in m; `name` is the file's in messages."""
    if len(content) > limits.ASSET_BYTES_MAX:
        raise AssetError(f"{name}: {len(content)} bytes, at most {limits.ASSET_BYTES_MAX} are allowed")
    (vertices, triangles, _), *more = read_parts(name, content, limits.MESH_TRIANGLES_MAX)
    for others, other_triangles, _ in more:
        triangles = np.concatenate((triangles, other_triangles + np.int32(len(vertices))))
        vertices = np.concatenate((vertices, others))
    with np.errstate(over="ignore"):  # an overflow is refused
        vertices = vertices * scale
    return _checked(name, vertices, triangles)


def read_parts(name: str, content: bytes, triangles_max: int) -> list[Part]:
    """Return the mesh in a file's content, not yet checked: a part for each use of a material, and at least one.

    A unit of length that the file has is applied; another scale is not.
    """
    match mesh_format(name):
        case ".obj":
            return [(*_read_obj(name, content, triangles_max), None)]
        case ".stl":
            return [(*_read_stl(name, content, triangles_max), None)]
        case ".dae":
            from foosim.world.matter.collada_file import read_collada  # brings pycollada

            return read_collada(name, content, triangles_max)
    raise AssetError(f"{name}: no format of a mesh, there are {', '.join(MESH_SUFFIXES)}")


def pieces(mesh: Mesh, triangles_max: int) -> Iterator[Mesh]:
    """Yield a mesh, or, if it has more triangles, its parts."""
    if len(mesh.triangles) <= triangles_max:
        yield mesh
        return
    for start in range(0, len(mesh.triangles), triangles_max):
        yield _compact(mesh.vertices, mesh.triangles[start : start + triangles_max])


@lru_cache(maxsize=CLOSED_KEPT)
def is_closed(mesh: Mesh) -> bool:
    """True if it has an inside: each edge is one of an even number of triangles, by the places of its ends."""
    corners = merged(mesh.vertices[mesh.triangles].reshape(-1, 3))[1].astype(np.int64)
    edges = np.sort(np.concatenate((corners[:, :2], corners[:, 1:], corners[:, ::2])), axis=1)
    _, counts = np.unique(edges[:, 0] << 32 | edges[:, 1], return_counts=True)
    return bool((counts % 2 == 0).all())


def _checked(name: str, vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> Mesh:
    """Leave out triangles without an area and unused vertices; refuse a mesh too big, too small or not finite."""
    far = float(np.abs(vertices).max(initial=0.0))
    if not far <= EXTENT_MAX_M:  # nan is not, either
        raise AssetError(f"{name}: a coordinate of {far:g} m, the farthest that is valid is {EXTENT_MAX_M:g} m")
    corners = vertices[triangles]
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    triangles = triangles[np.abs(np.cross(one, other)).max(axis=1, initial=0.0) > 0.0]
    if len(triangles) == 0:
        raise AssetError(f"{name}: no triangle with an area")
    mesh = _compact(vertices, triangles)
    low, high = mesh.box
    extent = max(high[axis] - low[axis] for axis in range(3))
    if not EXTENT_MIN_M <= extent <= EXTENT_MAX_M:
        valid = f"valid are {EXTENT_MIN_M:g} to {EXTENT_MAX_M:g} m"
        raise AssetError(f"{name}: the longest side is {extent:g} m, {valid}")
    return mesh


def _compact(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> Mesh:
    """Return triangles with those vertices that they use."""
    used, renumbered = np.unique(triangles, return_inverse=True)
    vertices = np.ascontiguousarray(vertices[used]) + 0.0  # a coordinate of -0.0 is 0.0
    triangles = np.ascontiguousarray(renumbered.reshape(-1, 3), dtype=np.int32)
    digest = blake2b(vertices.tobytes() + triangles.tobytes(), digest_size=32).digest()
    return Mesh(vertices, triangles, digest)


def _text(name: str, content: bytes) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the words of each line that has some."""
    if b"\0" in content:
        line = content.count(b"\n", 0, content.index(b"\0")) + 1
        raise AssetError(f"{name}:{line}: a zero byte in a text")
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise AssetError(f"{name}:{line}: {describe('not UTF-8', content[error.start])}") from None
    for number, line_text in enumerate(text.split("\n"), 1):
        words = line_text.partition("#")[0].split()
        if words:
            yield number, words


def _numbers(place: str, words: list[str]) -> tuple[float, float, float]:
    """Return three coordinates; the texts `nan`, `inf` and `1_0`, which Python reads, are refused."""
    if len(words) != 3:
        raise AssetError(f"{place}: {len(words)} coordinates, a vertex has 3")
    for word in words:
        if len(word) > 40 or not _FLOAT.fullmatch(word):
            raise AssetError(f"{place}: {describe('not a finite number', word)}")
    return float(words[0]), float(words[1]), float(words[2])


def _vertices(rows: list[tuple[float, float, float]]) -> NDArray[np.float64]:
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


# --- OBJ -------------------------------------------------------------------------------------------------------------


def _read_obj(name: str, content: bytes, triangles_max: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    vertices: list[tuple[float, float, float]] = []
    triangles: list[tuple[int, int, int]] = []
    faces: list[tuple[int, list[int]]] = []
    for line, (key, *words) in _text(name, content):
        if key == "v":
            # Values after the coordinates are a weight or a colour.
            if len(words) not in (3, 4, 6, 7):
                raise AssetError(f"{name}:{line}: {len(words)} numbers, a vertex has 3, and then a weight or a colour")
            vertices.append(_numbers(f"{name}:{line}", words[:3]))
        elif key == "f":
            corners = _corners(f"{name}:{line}", words, len(vertices))
            triangles += [(corners[0], b, c) for b, c in pairwise(corners[1:])]
            faces.append((line, corners))
            if len(triangles) > triangles_max:
                raise too_many(f"{name}:{line}", triangles_max)
        elif key not in _PASSED_OVER:
            choices = ", ".join(["v", "f", *sorted(_PASSED_OVER)])
            raise AssetError(f"{name}:{line}: {describe('an unknown statement', key)}, there are {choices}")
    for line, corners in faces:  # a face may come before its vertices
        if max(corners) >= len(vertices):
            raise AssetError(f"{name}:{line}: a face with vertex {max(corners) + 1}, there are {len(vertices)}")
    return _vertices(vertices), np.array(triangles, dtype=np.int32).reshape(-1, 3)


def _corners(place: str, words: list[str], count: int) -> list[int]:
    """Return a face's vertices, counted from 0; `count` is their count so far."""
    if not 3 <= len(words) <= FACE_CORNERS_MAX:
        raise AssetError(f"{place}: a face of {len(words)} corners, it has 3 to {FACE_CORNERS_MAX}")
    corners = []
    for word in words:
        match = _CORNER.fullmatch(word)
        number = int(match[1]) if match else 0
        if number == 0 or number < -count:
            raise AssetError(f"{place}: {describe('no corner of a face', word)}, valid are 1 to, or -1 to -{count}")
        corners.append(number - 1 if number > 0 else count + number)
    return corners


# --- STL -------------------------------------------------------------------------------------------------------------


def _read_stl(name: str, content: bytes, triangles_max: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Read either form: a binary file is one whose length fits its count, since its header may be `solid`, too."""
    if len(content) >= _STL_HEAD:
        count = int.from_bytes(content[_STL_HEAD - 4 : _STL_HEAD], "little")
        if len(content) == _STL_HEAD + count * _STL_TRIANGLE.itemsize:
            return _read_binary(name, content, count, triangles_max)
        size = f"{count} triangles would take {_STL_HEAD + count * _STL_TRIANGLE.itemsize} bytes"
    else:
        size = f"a binary one has at least {_STL_HEAD} bytes"
    if content.lstrip()[:5] != b"solid" or b"\0" in content:
        raise AssetError(f"{name}: no STL file: it has {len(content)} bytes and {size}, a text one begins with solid")
    return merged(_vertices(list(_read_facets(name, content, triangles_max))))


def _read_binary(
    name: str, content: bytes, count: int, triangles_max: int
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    if count > triangles_max:
        raise too_many(name, triangles_max)
    corners = np.frombuffer(content, _STL_TRIANGLE, offset=_STL_HEAD)["corners"].astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(corners).all(axis=(1, 2)))
    if len(bad):
        raise AssetError(f"{name}: triangle {bad[0] + 1} has a non-finite coordinate")
    return merged(corners.reshape(-1, 3))


_FACET: Final = (
    ("facet", "normal"),
    ("outer", "loop"),
    ("vertex",),
    ("vertex",),
    ("vertex",),
    ("endloop",),
    ("endfacet",),
)
"""The first words of the lines of a facet."""


def _read_facets(name: str, content: bytes, triangles_max: int) -> Iterator[tuple[float, float, float]]:
    """Yield the corners of each facet of a text."""
    step, count, line = -1, 0, 1
    for line, words in _text(name, content):
        if step == -1 and words[0] == "solid":
            step = 0
            continue
        if step == 0 and words[0] == "endsolid":
            step = -1
            continue
        expected = _FACET[step] if step >= 0 else ("solid",)
        if tuple(words[: len(expected)]) != expected:
            wanted = " ".join(expected) + (" or endsolid" if step == 0 else "")
            raise AssetError(f"{name}:{line}: {describe('a line that does not belong here', words[0])}, not {wanted}")
        if words[0] == "vertex":
            yield _numbers(f"{name}:{line}", words[1:])
        step = (step + 1) % len(_FACET)
        count += step == 0
        if count > triangles_max:
            raise too_many(f"{name}:{line}", triangles_max)
    if step != -1:
        raise AssetError(f"{name}:{line}: the file ends within {'a facet' if step else 'the solid'}")


def merged(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return vertices and triangles of three corners each: corners equal to the last bit are one vertex."""
    rows = np.ascontiguousarray(corners + 0.0).view("V24").ravel()  # compared as bytes: five times as fast as by axis
    vertices, index = np.unique(rows, return_inverse=True)
    return vertices.view(np.float64).reshape(-1, 3), index.reshape(-1, 3).astype(np.int32)
