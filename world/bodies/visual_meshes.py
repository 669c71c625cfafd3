"""What a robot looks like: meshes of its visuals in drawn form, few triangles with the colours of their materials.

A visual mesh is a large file that only a viewer needs, so a deployment has it in this form only, under a name of its
own. One that is missing or unreadable is drawn by nothing, and its drawn form has the reason: it is never an error.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import msgspec

from foosim.common import limits
from foosim.world.matter.mesh import AssetError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from foosim.world.scene import Colour

    Part = tuple[NDArray[np.float64], NDArray[np.int32], Colour | None]

DRAWN_SUFFIX: Final = ".visual"
TRIANGLES_MAX: Final = 5_000
"""Of a mesh in drawn form."""
SPARED: Final = 16
"""Triangles that each colour of a mesh keeps, before the others are shared out."""
COLOURS_MAX: Final = 64
GRIDS: Final = (256, 128, 64, 32, 16)
"""Cells along the longest side of a mesh."""
FAR: Final = 1e9
"""No coordinate is that far out; the unit may be anything until it is scaled."""
BAD: Final = "no drawn form of a mesh"


class _DrawnPart(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Triangles of one colour: corners (float32, m) and their numbers (uint16), little-endian."""

    vertices: bytes
    triangles: bytes
    colour: tuple[float, float, float, float] | None


class _Drawn(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A mesh in drawn form: how many triangles its file has, its parts, and why there are none."""

    triangles: int
    parts: list[_DrawnPart]
    problem: str = ""


def drawn_path(path: str) -> str:
    """Return the name of the drawn form of the mesh in this file."""
    return path + DRAWN_SUFFIX


def undrawn_path(path: str) -> str:
    """Return the mesh's file of which this path names the drawn form; empty if it names none."""
    return path.removesuffix(DRAWN_SUFFIX) if path.endswith(DRAWN_SUFFIX) else ""


def drawn_content(name: str, content: bytes, triangles_max: int = TRIANGLES_MAX) -> bytes:
    """Return the drawn form of the mesh in a file's content; `name` is the file's. It has at most `triangles_max`."""
    from foosim.world.mesh_files import read_parts  # brings numpy

    try:
        parts = read_parts(name, content, limits.VISUAL_TRIANGLES_MAX)
    except AssetError as error:
        return undrawn_content(str(error))
    if not all(abs(vertices).max(initial=0.0) < FAR for vertices, _, _ in parts):  # nan is not, either
        return undrawn_content(f"{name}: a coordinate is too large or not finite")
    if not any(len(triangles) for _, triangles, _ in parts):
        return undrawn_content(f"{name}: no triangle")
    return _packed(parts, triangles_max)


def undrawn_content(problem: str) -> bytes:
    """Return the drawn form of a mesh that cannot be drawn."""
    return msgspec.msgpack.encode(_Drawn(0, [], problem))


def undrawn_meshes(files: Mapping[str, bytes]) -> list[str]:
    """Return a line for each drawn form among files without triangles, with the reason."""
    drawn = [msgspec.msgpack.decode(files[path], type=_Drawn) for path in sorted(files) if undrawn_path(path)]
    return [f"a visual is not drawn, {one.problem}" for one in drawn if one.problem]


def drawn_parts(content: bytes) -> tuple[list[Part], str]:
    """Return the parts of a mesh in drawn form, in m, each with its own colour if it has one; and a remark.

    The remark is why there are none, or how coarse they are; empty for a mesh that is whole.
    """
    import numpy as np

    try:
        drawn = msgspec.msgpack.decode(content, type=_Drawn)
        parts: list[Part] = []
        for part in drawn.parts:
            vertices = np.frombuffer(part.vertices, "<f4").reshape(-1, 3).astype(np.float64)
            triangles = np.frombuffer(part.triangles, "<u2").reshape(-1, 3).astype(np.int32)
            if not len(triangles) or triangles.max() >= len(vertices) or not np.isfinite(vertices).all():
                return [], BAD
            parts.append((vertices, triangles, part.colour))
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError, ValueError):
        return [], BAD
    count = sum(len(triangles) for _, triangles, _ in parts)
    coarse = f"{count:,} of {drawn.triangles:,} triangles are drawn" if count < drawn.triangles else ""
    return parts, drawn.problem or coarse


def _packed(parts: list[Part], triangles_max: int) -> bytes:
    whole = sum(len(triangles) for _, triangles, _ in parts)
    found = _by_colour(parts)
    share = max(0.0, triangles_max - SPARED * len(found)) / whole
    packed = []
    for colour, mesh in found.items():
        is_whole = whole <= triangles_max
        vertices, triangles = mesh if is_whole else _decimated(*mesh, SPARED + int(len(mesh[1]) * share))
        if len(triangles):
            packed.append(_DrawnPart(vertices.astype("<f4").tobytes(), triangles.astype("<u2").tobytes(), colour))
    return msgspec.msgpack.encode(_Drawn(whole, packed))


def _by_colour(parts: list[Part]) -> dict[Colour | None, tuple[NDArray[np.float64], NDArray[np.int32]]]:
    """Return the triangles of each colour, with corners at one place as one; of too many colours the first ones."""
    import numpy as np

    from foosim.world.mesh_files import merged

    corners: dict[Colour | None, list[NDArray[np.float64]]] = {}
    for vertices, triangles, colour in parts:
        known = colour if colour in corners or len(corners) < COLOURS_MAX else next(iter(corners))
        corners.setdefault(known, []).append(vertices[triangles].reshape(-1, 3))
    return {colour: merged(np.concatenate(found)) for colour, found in corners.items()}


def _decimated(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], most: int
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return a mesh with at most `most` triangles: corners are joined by a library, which keeps to the surface, and
    where its pieces are too small for that, those in one cell of a grid; at last triangles are left out."""
    if len(triangles) <= most:
        return vertices, triangles
    import fast_simplification
    import numpy as np

    from foosim.world.mesh_files import merged

    vertices, triangles = fast_simplification.simplify(vertices, triangles, target_count=most)
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    for cells in GRIDS:
        if len(triangles) <= most:
            break
        nodes = low + np.round((vertices - low) * (cells / size)) * (size / cells)
        vertices, triangles = merged(nodes[triangles].reshape(-1, 3))
        triangles = triangles[(np.diff(np.sort(triangles, axis=1), axis=1) > 0).all(axis=1)]
    every = -(-len(triangles) // most) or 1  # evenly, since a file has one side after the other
    used, renumbered = np.unique(triangles[::every], return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3).astype(np.int32)
