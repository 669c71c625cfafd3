"""Draws the pictures of one layout's world."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.kernels.raster import NONE, Floats, Ints, raster
from foosim.rendering.light import Floats32, coloured, facing_at, sky
from foosim.rendering.model import Model
from foosim.rendering.view import View, focal_length, in_view, view_of
from foosim.world.components.optics import Optics
from foosim.world.layout import Layout
from foosim.world.scene import Quaternion, Scene, Vector

KEPT_PIXELS: Final = 1 << 22
"""Of the pictures of what stands, which are kept for cameras that stand."""


class Drawn(NamedTuple):
    """One picture: `colour` (height, width, 3) of red, green, blue from 0 to 255; `depth` (height, width), the distance
    along the camera's axis (m), 0 where nothing is seen; `segmentation` (height, width), 1 + the number of the thing in
    `Drawer.things`, 0 where nothing is seen."""

    colour: NDArray[np.uint8]
    depth: NDArray[np.float32]
    segmentation: NDArray[np.int32]


class _Buffers(NamedTuple):
    """The nearness, the triangle and the colour (red, green, blue, one unused) of each pixel."""

    nearness: NDArray[np.float32]
    numbers: NDArray[np.int32]
    colour: NDArray[np.uint8]

    def copy(self) -> _Buffers:
        return _Buffers(self.nearness.copy(), self.numbers.copy(), self.colour.copy())


class Drawer:
    """Scenery and the fixed links of a scene are prepared once, moving links are placed for each picture.

    `things` are the names of what is seen: entities by their index in the layout, then scenery (as `Caster.things`).
    """

    def __init__(self, scene: Scene, layout: Layout) -> None:
        self._model = model = Model(scene, layout)
        self.things = model.things
        self._flat = coloured(model.colours, np.zeros(len(model.colours), np.float32))
        self._light(np.arange(len(model.triangles)))
        self._kept: dict[View, _Buffers] = {}

    def draw(
        self,
        optics: Optics,
        position: Vector,
        orientation: Quaternion,
        numbers: NDArray[np.intp],
        poses: NDArray[np.float64],
        velocities: NDArray[np.float64] | None = None,
        key: int = 0,
    ) -> Drawn:
        """Return what a camera at a pose (m, world frame) sees.

        Of the links that move (`optics.moving_links`), those in view are given by `numbers` (n,), with the `poses` of
        their frames (n, 7): position (m) and orientation (x, y, z, w) in the world frame. `velocities` (n, 6) (m/s,
        rad/s) blur them where the optics have an exposure. `key` is that of the draws of noise.
        """
        n = optics.samples
        focal, width, height = focal_length(optics.fov, optics.width), optics.width, optics.height
        view = view_of(position, orientation, focal * n, width * n, height * n, optics.near, optics.far)
        nearness, triangles, colour = self._frame(view, numbers, poses)
        return Drawn(
            _mean(colour, n), *self._measured(nearness[n // 2 :: n, n // 2 :: n], triangles[n // 2 :: n, n // 2 :: n])
        )

    def _measured(
        self, nearness: NDArray[np.float32], triangles: NDArray[np.int32]
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        seen = triangles != NONE
        depth = np.divide(np.float32(1.0), nearness, out=np.zeros(nearness.shape, np.float32), where=seen)
        return depth, self._model.thing[triangles] + np.int32(1)

    def _light(self, triangles: Ints) -> None:
        """Give triangles the colours that they have where they are flat."""
        facing = self._model.facing[self._model.triangles[triangles, 0]].astype(np.float32)
        self._flat[triangles] = coloured(self._model.colours[triangles], facing)

    def _frame(self, view: View, numbers: NDArray[np.intp], poses: Floats) -> _Buffers:
        """Return the picture of a view."""
        model = self._model
        self._light(model.place(numbers, poses))
        still = self._kept.pop(view, None) or self._standing(view)
        self._kept[view] = still
        while len(self._kept) > 1 and sum(view.width * view.height for view in self._kept) > KEPT_PIXELS:
            del self._kept[next(iter(self._kept))]
        buffers = still.copy()
        self._raster(view, model.parts_of(numbers), buffers)
        self._shade(view, np.flatnonzero(buffers.numbers != still.numbers), buffers)
        return buffers

    def _standing(self, view: View) -> _Buffers:
        """Return the picture of what stands."""
        shape = view.height, view.width
        colour = np.empty((*shape, 4), np.uint8)
        buffers = _Buffers(np.full(shape, view.start, np.float32), np.full(shape, NONE, np.int32), colour)
        self._raster(view, np.arange(self._model.standing), buffers)
        self._shade(view, np.arange(view.width * view.height), buffers)
        return buffers

    def _raster(self, view: View, parts: Ints, buffers: _Buffers) -> None:
        model = self._model
        parts = parts[in_view(view, model.centres[parts], model.radii[parts])]
        matrix = np.array(view.matrix).reshape(4, 4)
        rows = 0, view.height
        raster(model.world, model.triangles, model.ranges[parts], matrix, view.near, rows, *buffers[:2])

    def _shade(self, view: View, pixels: Ints, buffers: _Buffers) -> None:
        """Colour some pixels, by what is at them."""
        model, colour = self._model, buffers.colour.reshape(-1, 4)
        triangles = buffers.numbers.reshape(-1)[pixels]
        colour.view(np.uint32)[pixels] = self._flat.view(np.uint32)[triangles]
        curved = np.flatnonzero(model.curved[triangles])
        facing = self._facing(view, pixels[curved], triangles[curved])
        colour[pixels[curved]] = coloured(model.colours[triangles[curved]], facing)
        empty = pixels[triangles == NONE]
        if len(empty):
            columns, rows = _centres(view, empty)
            _, first, across, down = np.array(view.rays).reshape(4, 3).astype(np.float32)
            way = [first[i] + across[i] * columns + down[i] * rows for i in range(3)]
            colour[empty] = sky(way[2], np.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]))

    def _facing(self, view: View, pixels: Ints, triangles: NDArray[np.int32]) -> Floats32:
        """Return how pixels face the sun at which these triangles are seen."""
        model = self._model
        present = np.zeros(len(model.triangles), np.bool_)
        present[triangles] = True
        used = np.flatnonzero(present)
        place = np.empty(len(present), np.intp)
        place[used] = np.arange(len(used))
        corners = model.triangles[used]
        x, y, z = np.moveaxis(model.world[corners], 2, 0)
        m = view.matrix
        clip = np.stack([m[i] * x + m[i + 1] * y + m[i + 2] * z + m[i + 3] for i in (0, 4, 8)], axis=2)
        return facing_at(clip, model.facing[corners], place[triangles], *_centres(view, pixels))


def _centres(view: View, pixels: Ints) -> tuple[Floats32, Floats32]:
    """Return the columns and rows of the centres of pixels."""
    rows, columns = np.divmod(pixels.astype(np.int32), np.int32(view.width))
    return columns.astype(np.float32) + np.float32(0.5), rows.astype(np.float32) + np.float32(0.5)


def _mean(colour: NDArray[np.uint8], n: int) -> NDArray[np.uint8]:
    """Return the means of n x n samples, rounded."""
    if n == 1:
        return np.ascontiguousarray(colour[:, :, :3])
    total = np.full((len(colour) // n, colour.shape[1] // n, 3), n * n // 2, np.uint16)
    for i in range(n * n):
        total += colour[i // n :: n, i % n :: n, :3]
    return (total // (n * n)).astype(np.uint8)
