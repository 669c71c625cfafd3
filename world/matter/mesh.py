"""A mesh: triangles of scenery or of a body, and the digests of the files that a deployment refers to.

Files become meshes in mesh_files.py, which brings numpy; a deployment without meshes is read without it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import blake2b
from typing import TYPE_CHECKING, Final

from foosim.common.errors import Refused, describe, show

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Part = tuple[NDArray[np.float64], NDArray[np.int32], tuple[float, float, float, float] | None]
    """Corners (n, 3) in m, triangles (m, 3) by their numbers, and the colour that a file gives them."""

MESH_SUFFIXES: Final = (".obj", ".stl", ".dae")
"""The formats of files with a mesh; a file's may be in capitals."""


class AssetError(Refused):
    """A file that a deployment refers to is invalid: `file:line: what, value`."""

    exit_code = 2


def mesh_format(path: str) -> str:
    """Return which of the formats the name of a file has, in small letters; empty for no such one."""
    suffix = path[path.rfind(".") :].lower()
    return suffix if suffix in MESH_SUFFIXES else ""


def too_many(place: str, most: int) -> AssetError:
    """Return the error for a file whose mesh has more triangles than `most`."""
    return AssetError(f"{place}: more than {most} triangles")


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles: corners as indices (m, 3) into vertices (n, 3), in m in the frame of the link or thing.

    Two meshes are equal when their digests, BLAKE2b of both arrays, are.
    """

    vertices: NDArray[np.float64] = field(compare=False, repr=False)
    triangles: NDArray[np.int32] = field(compare=False, repr=False)
    digest: bytes

    @property
    def box(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """The least and the greatest coordinates."""
        low, high = self.vertices.min(axis=0).tolist(), self.vertices.max(axis=0).tolist()
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def digest_of(content: bytes) -> str:
    """Return the digest of a file's content: 32 bytes of BLAKE2b in hex."""
    return blake2b(content, digest_size=32).hexdigest()


def check_digest(name: str, content: bytes, digest: str) -> None:
    """Refuse a file with another digest than the expected one."""
    found = digest_of(content)
    if found != digest:
        raise AssetError(f"{name}: {describe('another file than the digest names', found)}, expected {show(digest)}")
