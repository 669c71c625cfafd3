"""Draws the pictures of one layout's world."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.kernels.raster import NONE, Floats, Ints, raster
from foosim.rendering.lens import lens_of, sensed
from foosim.rendering.light import Floats32, coloured, facing_at, sky
from foosim.rendering.model import Model, advanced, check_poses
from foosim.rendering.shadow import hidden, sun_over
from foosim.rendering.view import View, focal_length, in_view, view_of
from foosim.world.components.optics import Optics
from foosim.world.layout import Layout
from foosim.world.scene import Quaternion, Scene, Vector

SUBFRAMES: Final = 9
"""Of an exposure: the last one, at the time of the poses, gives depth and segmentation."""
PIXELS_AT_ONCE: Final = 1 << 16
"""Shaded at once, so that their arrays stay in a cache."""
KEPT_PIXELS: Final = 1 << 22
KEPT_VIEWS: Final = 32
"""Of what stands, whose pictures are kept for cameras that stand."""


class Drawn(NamedTuple):
    """One picture: `colour` (height, width, 3) of red, green, blue from 0 to 255; `depth` (height, width), the distance
    along the camera's axis (m), 0 where nothing is seen; `segmentation` (height, width), 1 + the number of the thing in
    `Drawer.things`, 0 where nothing is seen. They are read-only."""

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
        self._facing = np.zeros(len(model.triangles) + 1, np.float32)
        self._flat = coloured(model.colours, self._facing)
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
        rad/s, world frame) blur them over an exposure before. `key` is that of the draws of noise, below 2^256.

        Raises Malformed for poses and velocities that no world has, as a changed packet may.
        """
        speeds = np.zeros((len(poses), 6)) if velocities is None else velocities
        check_poses(np.array([[*position, *orientation]]), np.zeros((0, 6)))
        check_poses(poses, speeds)
        count = SUBFRAMES if optics.exposure > 0.0 and speeds.any() else 1
        lens = lens_of(optics) if any(optics.distortion) else None
        margin = (0, 0) if lens is None else lens.margin
        total = np.zeros((optics.height + 2 * margin[1], optics.width + 2 * margin[0], 3), np.uint16)
        n = optics.samples
        focal = focal_length(optics.fov, optics.width) * n
        view = view_of(position, orientation, focal, total.shape[1] * n, total.shape[0] * n, optics.near, optics.far)
        for earlier in range(1 - count, 1):
            moved = advanced(poses, speeds, earlier * optics.exposure / count)
            frame = self._frame(view, optics, numbers, moved)
            for i in range(n * n if n * count > 1 else 0):
                total += frame.colour[i // n :: n, i % n :: n, :3]
        colour = np.ascontiguousarray(frame.colour[:, :, :3])
        if n * count > 1:
            colour = ((total + np.uint16(n * n * count // 2)) // np.uint16(n * n * count)).astype(np.uint8)
        nearness, triangles = frame.nearness[n // 2 :: n, n // 2 :: n], frame.numbers[n // 2 :: n, n // 2 :: n]
        if lens is not None:
            colour, nearness, triangles = lens.mixed(colour), lens.nearest(nearness, 0), lens.nearest(triangles, NONE)
        depth = np.divide(np.float32(1.0), nearness, out=np.zeros_like(nearness), where=triangles != NONE)
        things = self._model.thing.take(triangles, mode="wrap") + np.int32(1)
        drawn = Drawn(sensed(colour, optics.gain, optics.noise, key), depth, things)
        for picture in drawn:
            picture.setflags(write=False)  # readers of one process share it
        return drawn

    def _light(self, triangles: Ints) -> None:
        """Give triangles the facing and the colours that they have where they are flat."""
        self._facing[triangles] = self._model.facing[self._model.triangles[triangles, 0]]
        self._flat[triangles] = coloured(self._model.colours[triangles], self._facing[triangles])

    def _frame(self, view: View, optics: Optics, numbers: NDArray[np.intp], poses: Floats) -> _Buffers:
        """Return the picture of a view."""
        self._light(self._model.place(numbers, poses))
        parts = self._model.parts_of(numbers)
        still, buffers = self._drawn(view, parts)
        if optics.shadows:
            sun = sun_over(view, self._model.bounds, optics.far)
            shadows = self._drawn(sun, parts)[1].nearness
            seen = np.flatnonzero(buffers.numbers != NONE)
            for start in range(0, len(seen), PIXELS_AT_ONCE):
                self._shadow(view, seen[start : start + PIXELS_AT_ONCE], buffers, sun, shadows)
            return buffers
        pixels = np.flatnonzero(buffers.numbers != still.numbers)
        triangles = buffers.numbers.reshape(-1)[pixels]
        buffers.colour.reshape(-1, 4).view(np.uint32)[pixels] = self._flat.view(np.uint32)[triangles]
        self._curve(view, pixels[self._model.curved[triangles]], buffers)
        return buffers

    def _drawn(self, view: View, parts: Ints) -> tuple[_Buffers, _Buffers]:
        """Return the picture of what stands, which is kept, and a copy with moving parts, not yet coloured."""
        still = self._kept.pop(view, None) or self._standing(view)
        self._kept[view] = still
        while len(self._kept) > KEPT_VIEWS or sum([view.width * view.height for view in self._kept]) > KEPT_PIXELS:
            del self._kept[next(iter(self._kept))]
        buffers = still.copy()
        self._raster(view, parts, buffers)
        return still, buffers

    def _standing(self, view: View) -> _Buffers:
        """Return the picture of what stands; one from the sun has no colours."""
        shape = view.height, view.width
        nearness, numbers = np.full(shape, view.start, np.float32), np.full(shape, NONE, np.int32)
        buffers = _Buffers(nearness, numbers, np.zeros((0, 4), np.uint8))
        self._raster(view, np.arange(self._model.standing), buffers)
        if view.rays:
            words, empty = self._flat.view(np.uint32).reshape(-1).take(numbers, mode="wrap"), numbers == NONE
            if empty.any():
                words = np.where(empty, sky(view), words)
            buffers = buffers._replace(colour=words.view(np.uint8).reshape(*shape, 4))
            self._curve(view, np.flatnonzero(self._model.curved.take(numbers, mode="wrap")), buffers)
        return buffers

    def _raster(self, view: View, parts: Ints, buffers: _Buffers) -> None:
        model = self._model
        parts = parts[in_view(view, model.centres[parts], model.radii[parts])]
        matrix = np.array(view.matrix).reshape(4, 4)
        rows = 0, view.height
        raster(model.world, model.triangles, model.ranges[parts], matrix, view.near, rows, *buffers[:2])

    def _curve(self, view: View, pixels: Ints, buffers: _Buffers) -> None:
        """Colour pixels of curved triangles."""
        triangles = buffers.numbers.reshape(-1)[pixels]
        facing = self._facing_of(view, pixels, triangles)
        buffers.colour.reshape(-1, 4)[pixels] = coloured(self._model.colours[triangles], facing)

    def _shadow(self, view: View, pixels: Ints, buffers: _Buffers, sun: View, shadows: NDArray[np.float32]) -> None:
        """Colour pixels with the shadows that a picture from the sun gives, its nearness."""
        triangles = buffers.numbers.reshape(-1)[pixels]
        facings, curved = self._facing[triangles], np.flatnonzero(self._model.curved[triangles])
        facings[curved] = self._facing_of(view, pixels[curved], triangles[curved])
        share, lit = np.zeros(len(pixels), np.float32), np.flatnonzero(facings > 0.0)
        depth = np.float32(1.0) / buffers.nearness.reshape(-1)[pixels[lit]]
        share[lit] = hidden(view, sun, shadows, facings[lit], depth, *_centres(view, pixels[lit]))
        buffers.colour.reshape(-1, 4)[pixels] = coloured(self._model.colours[triangles], facings, share)

    def _facing_of(self, view: View, pixels: Ints, triangles: NDArray[np.int32]) -> Floats32:
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
