"""A COLLADA file (.dae) as triangles: in m, at the poses of its scene, with the colours of its materials.

pycollada reads it. It would unpack an archive and follow a node as often as others place it; both are bounded here.
It reads strictly first; where that fails, without images and colours, of which files often name some that are missing.
To it a coordinate of nan is 0.
A document type is refused, and with it every entity.

The axis that points up is turned to z, as the format has it, but for files of MeshLab, which writes Y_UP whatever the
axis is: TIAGo's 14 collision meshes of it fit the STL files of the same links as they are. The 56 meshes of iCub, which
say Y_UP and come from another tool, have their links' centres of mass and joints inside when they are turned alone.
Viewers of ROS turn no file.

Source of the format: COLLADA 1.4.1, digital asset schema, Khronos 2008.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree

import collada
import numpy as np
from collada.polylist import Polylist
from collada.scene import ControllerNode, GeometryNode, Node, NodeNode
from collada.triangleset import TriangleSet

from foosim.common.errors import describe
from foosim.world.matter.mesh import AssetError, too_many

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from foosim.world.matter.mesh import Part

UNIT_MIN_M: Final = 1e-6
UNIT_MAX_M: Final = 1e6
_TO_Z_UP: Final = {
    "X_UP": np.array([[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0]]),
    "Y_UP": np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0]]),
    "Z_UP": np.eye(3, 4),
}
"""Turns by the axis that points up: right, up and towards the viewer become x, z and -y."""
_ANY_AXIS: Final = "MeshLab"
"""The tool that writes the same axis into every file."""
PLACED_MAX: Final = 10_000
"""Nodes and surfaces in a scene: one that is placed twice counts twice."""
_DECLARATION: Final = re.compile(r"\s*<\?xml.*?\?>", re.DOTALL)
_NO_SURFACE: Final = frozenset(
    (
        *("library_images", "library_effects", "library_materials", "bind_material", "extra"),
        *("library_animations", "library_cameras", "library_lights", "instance_camera", "instance_light"),
    )
)
"""Elements that do not concern the surface."""


class _TooMany(Exception):
    """There are more triangles than are allowed."""


def read_collada(name: str, content: bytes, triangles_max: int) -> list[Part]:
    """Return the surface in a file's content, a part for each use of a material. Raises AssetError."""
    text = _text(name, content)
    try:
        document = _document(text)
        whole = _turn(document) * _unit(name, document)
        parts: list[Part] = []
        left = triangles_max
        for primitive, matrix, colour in _placed(name, document, whole):
            vertices, triangles = _surface(primitive, left)
            left -= len(triangles)
            if len(triangles) == 0:
                continue
            if _is_mirror(matrix):  # corners stay counter-clockwise, seen from outside
                triangles = triangles[:, ::-1]
            with np.errstate(over="ignore", invalid="ignore"):  # infinities are refused
                parts.append((_moved(vertices, matrix), triangles, colour))
    except AssetError:
        raise
    except _TooMany:
        raise too_many(name, triangles_max) from None
    except Exception as error:  # noqa: BLE001  # pycollada and numpy raise many types for a malformed document
        reason = f"{type(error).__name__} {' '.join(str(error).split())}"[:100]
        raise AssetError(f"{name}: {describe('no valid COLLADA file', reason)}") from None
    if not parts:
        raise AssetError(f"{name}: a scene without a surface")
    return parts


def _text(name: str, content: bytes) -> bytes:
    """Return the content without the declaration of its encoding, which is UTF-8."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise AssetError(f"{name}: {describe('not UTF-8', content[error.start])}") from None
    if "\0" in text:  # as in any archive
        raise AssetError(f"{name}: a zero byte in a text")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise AssetError(f"{name}: a document type: it may define entities, and a mesh needs none")
    declared = _DECLARATION.match(text)
    return text[declared.end() if declared else 0 :].encode()


def _document(text: bytes) -> Any:
    try:
        return collada.Collada(BytesIO(text))
    except collada.DaeError:
        root = ElementTree.fromstring(text)
        for element in root.iter():
            for child in [child for child in element if str(child.tag).rpartition("}")[2] in _NO_SURFACE]:
                element.remove(child)
        return collada.Collada(BytesIO(ElementTree.tostring(root)))


def _unit(name: str, document: Any) -> float:
    """Return the m in a unit of length."""
    unit = document.assetInfo.unitmeter
    if unit is None:
        return 1.0
    if not UNIT_MIN_M <= unit <= UNIT_MAX_M:
        what = f"a unit of length is not within {UNIT_MIN_M:g} to {UNIT_MAX_M:g} m"
        raise AssetError(f"{name}: {describe(what, unit)}")
    return float(unit)


def _turn(document: Any) -> NDArray[np.float64]:
    """Return the rotation that brings the axis that points up to z, as three rows of four."""
    asset = document.assetInfo
    tools = [contributor.authoring_tool or "" for contributor in asset.contributors]
    return _TO_Z_UP["Z_UP" if any(_ANY_AXIS in tool for tool in tools) else asset.upaxis]


# The results of BLAS differ from machine to machine: products are written out.


def _moved(points: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (n, 3) after a transform of three rows of four."""
    x, y, z = points[:, 0:1], points[:, 1:2], points[:, 2:3]
    return x * matrix[:, 0] + y * matrix[:, 1] + z * matrix[:, 2] + matrix[:, 3]


def _within(matrix: NDArray[np.float64], inner: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the transform, of three rows of four, that is `matrix` after `inner`."""
    axes = _moved(inner[:3, :3].T, np.column_stack((matrix[:, :3], np.zeros(3))))
    return np.column_stack((axes.T, _moved(inner[np.newaxis, :3, 3], matrix)[0]))


def _is_mirror(matrix: NDArray[np.float64]) -> bool:
    (a, b, c), (d, e, f), (g, h, i) = matrix[:, :3].tolist()
    return bool(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0)


def _placed(
    name: str, document: Any, whole: NDArray[np.float64]
) -> Iterator[tuple[Any, NDArray[np.float64], tuple[float, float, float, float] | None]]:
    """Yield the surfaces in the scene, in its order, each with its pose in `whole` and its colour."""
    scenes = [document.scene] if document.scene is not None else [*document.scenes]
    if len(scenes) != 1:
        raise AssetError(f"{name}: {len(scenes)} scenes, and none is named as the one to show")
    found = 0
    nodes = [(node, whole) for node in reversed(scenes[0].nodes)]
    while nodes:
        node, matrix = nodes.pop()
        inner = node.geometry.primitives if isinstance(node, GeometryNode) else getattr(node, "children", [])
        found += 1 + len(inner)
        if found > PLACED_MAX:
            raise AssetError(f"{name}: more than {PLACED_MAX} nodes and surfaces in its scene")
        if isinstance(node, GeometryNode):
            colours = {bound.symbol: _colour(bound.target.effect) for bound in node.materials}
            yield from [(primitive, matrix, colours.get(primitive.material)) for primitive in inner]
        elif isinstance(node, ControllerNode):
            raise AssetError(f"{name}: a skin, which moves with bones; a mesh is rigid")
        elif isinstance(node, Node):
            transforms = (node.node if isinstance(node, NodeNode) else node).transforms
            for transform in transforms:
                matrix = _within(matrix, np.asarray(transform.matrix, np.float64))
            nodes += [(child, matrix) for child in reversed(inner)]


def _colour(effect: Any) -> tuple[float, float, float, float] | None:
    """Return the diffuse colour of a material, None of one that has an image in its place."""
    if not isinstance(effect.diffuse, tuple):
        return None
    red, green, blue, *alpha = [min(max(float(share), 0.0), 1.0) for share in effect.diffuse]
    return red, green, blue, alpha[0] if alpha and alpha[0] > 0.0 else 1.0


def _surface(primitive: Any, left: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return corners and triangles; lines have none. Raises _TooMany for more triangles than `left`."""
    if isinstance(primitive, Polylist):
        corners = np.asarray(primitive.vcounts, np.int64)
        if corners.min(initial=3) < 3 or corners.sum() != len(primitive.index):
            raise ValueError("polygons whose counts of corners do not fit their corners")
        if (corners - 2).sum() > left:
            raise _TooMany
        primitive = primitive.triangleset()
    if not isinstance(primitive, TriangleSet) or len(primitive) == 0:
        return np.empty((0, 3)), np.empty((0, 3), np.int32)
    if len(primitive) > left:
        raise _TooMany
    index = primitive.vertex_index
    if index.min() < 0 or index.max() >= len(primitive.vertex):
        raise ValueError("a triangle with an unknown vertex")
    used, renumbered = np.unique(index, return_inverse=True)
    return primitive.vertex[used].astype(np.float64), renumbered.reshape(-1, 3).astype(np.int32)
