"""Draws the pictures of one layout's world."""

from __future__ import annotations

from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.kernels.raster import NONE, Floats, Ints, raster
from foosim.rendering.lens import lens_of, sensed
from foosim.rendering.light import Floats32, Picture, coloured, facing_at, sky
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
LOOKED_UP_AT_ONCE: Final = 1 << 13
"""numpy makes indices of them, and would take new memory for more."""
KEPT_PIXELS: Final = 1 << 22
KEPT_VIEWS: Final = 32
"""Of what stands, whose pictures are kept for cameras that stand, from their second picture on."""


class Drawn(NamedTuple):
    """One picture: `colour` (height, width, 3) of red, green, blue from 0 to 255; `depth` (height, width), the distance
    along the camera's axis (m), 0 where nothing is seen; `segmentation` (height, width), 1 + the number of the thing in
    `Drawer.things`, 0 where nothing is seen. They are read-only."""

    colour: NDArray[np.uint8]
    depth: NDArray[np.float32]
    segmentation: NDArray[np.int32]


class _Buffers(NamedTuple):
    """The nearness, the triangle and the colour of each pixel: red, green, blue, and whether the colour is that of a
    curved triangle as if it were flat."""

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
        self._thing = model.thing + np.int32(1)
        self._kept: dict[View, _Buffers | None] = {}
        self._buffers: dict[bool, _Buffers] = {}
        """Those of the last view, and of the last one from the sun: new memory is half of the time of a picture."""

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
        n = optics.samples
        is_mean = n * count > 1
        shape = optics.height + 2 * margin[1], optics.width + 2 * margin[0], 3
        colour = np.zeros(shape, np.uint16 if is_mean else np.uint8)
        focal = focal_length(optics.fov, optics.width) * n
        view = view_of(position, orientation, focal, shape[1] * n, shape[0] * n, optics.near, optics.far)
        for earlier in range(1 - count, 1):
            moved = advanced(poses, speeds, earlier * optics.exposure / count)
            frame = self._frame(view, optics, numbers, moved)
            for i, channel in product(range(n * n), range(3)):  # all channels at once would take three times as long
                colour[:, :, channel] += frame.colour[i // n :: n, i % n :: n, channel]
        if is_mean:
            colour = ((colour + np.uint16(n * n * count // 2)) // np.uint16(n * n * count)).astype(np.uint8)
        nearness, triangles = frame.nearness[n // 2 :: n, n // 2 :: n], frame.numbers[n // 2 :: n, n // 2 :: n]
        if lens is not None:
            colour, nearness, triangles = (
                lens.mixed(colour),
                lens.nearest(nearness, view.start),
                lens.nearest(triangles, NONE),
            )
        depth, things = np.empty((2, *triangles.shape), np.float32)
        np.divide(np.float32(1.0), nearness, out=depth)
        np.copyto(depth, np.float32(0.0), where=triangles == NONE)
        things = _looked_up(self._thing, triangles, things.view(np.int32))
        drawn = Drawn(sensed(colour, optics.gain, optics.noise, key), depth, things)
        for picture in drawn:
            picture.setflags(write=False)  # readers of one process share it
        return drawn

    def _light(self, triangles: Ints) -> None:
        """Give triangles the facing and the colours that they have where they are flat."""
        self._facing[triangles] = self._model.facing[self._model.triangles[triangles, 0]]
        flat = coloured(self._model.colours.take(triangles, axis=0), self._facing[triangles])
        flat[:, 3] = self._model.curved[triangles]
        self._flat[triangles] = flat

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
        if still is None or optics.shadows:
            return buffers
        pixels = np.flatnonzero(buffers.numbers != still.numbers)
        triangles = buffers.numbers.reshape(-1)[pixels]
        _words(buffers.colour)[pixels] = _words(self._flat)[triangles]
        self._curve(view, pixels[self._model.curved[triangles]], buffers)
        return buffers

    def _drawn(self, view: View, parts: Ints) -> tuple[_Buffers | None, _Buffers]:
        """Return the picture of what stands, of a view that was drawn before, and a copy with moving parts, not yet
        coloured; of a new view the picture of all."""
        standing = np.arange(self._model.standing)
        is_new, still = view not in self._kept, self._kept.pop(view, None)
        if still is None and not is_new:
            still = self._picture(view, standing).copy()
        self._kept[view] = still
        pixels = [one.width * one.height if kept else 0 for one, kept in self._kept.items()]
        while len(self._kept) > KEPT_VIEWS or sum(pixels) > KEPT_PIXELS:
            del self._kept[next(iter(self._kept))], pixels[0]
        if still is None:
            return None, self._picture(view, np.append(standing, parts))
        buffers = self._taken(view)
        np.copyto(buffers.nearness, still.nearness)
        np.copyto(buffers.numbers, still.numbers)
        np.copyto(buffers.colour, still.colour)
        self._raster(view, parts, buffers)
        return still, buffers

    def _picture(self, view: View, parts: Ints) -> _Buffers:
        """Return the picture of these parts; one from the sun has no colours."""
        buffers = self._taken(view)
        buffers.nearness.fill(view.start)
        buffers.numbers.fill(NONE)
        self._raster(view, parts, buffers)
        if view.rays:
            words = _looked_up(
                _words(self._flat), buffers.numbers, _words(buffers.colour).reshape(buffers.numbers.shape)
            )
            empty = buffers.numbers == NONE
            if empty.any():
                np.copyto(words, sky(view), where=empty)
            self._curve(view, np.flatnonzero(buffers.colour[:, :, 3]), buffers)
        return buffers

    def _taken(self, view: View) -> _Buffers:
        """Return buffers for a view, with any content."""
        shape, has_colours = (view.height, view.width), bool(view.rays)
        found = self._buffers.get(has_colours)
        if found is None or found.numbers.shape != shape:
            colour = np.empty((*shape, 4) if has_colours else (0, 4), np.uint8)
            found = _Buffers(np.empty(shape, np.float32), np.empty(shape, np.int32), colour)
            self._buffers[has_colours] = found
        return found

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
        _words(buffers.colour)[pixels] = _words(coloured(self._model.colours.take(triangles, axis=0), facing))

    def _shadow(self, view: View, pixels: Ints, buffers: _Buffers, sun: View, shadows: NDArray[np.float32]) -> None:
        """Colour pixels with the shadows that a picture from the sun gives, its nearness."""
        triangles = buffers.numbers.reshape(-1)[pixels]
        facings, curved = self._facing[triangles], np.flatnonzero(self._model.curved[triangles])
        facings[curved] = self._facing_of(view, pixels[curved], triangles[curved])
        share, lit = np.zeros(len(pixels), np.float32), np.flatnonzero(facings > 0.0)
        depth = np.float32(1.0) / buffers.nearness.reshape(-1)[pixels[lit]]
        share[lit] = hidden(view, sun, shadows, facings[lit], depth, *_centres(view, pixels[lit]))
        _words(buffers.colour)[pixels] = _words(coloured(self._model.colours.take(triangles, axis=0), facings, share))

    def _facing_of(self, view: View, pixels: Ints, triangles: NDArray[np.int32]) -> Floats32:
        """Return how pixels face the sun at which these triangles are seen."""
        model = self._model
        present = np.zeros(len(model.triangles), np.bool_)
        present[triangles] = True
        used = np.flatnonzero(present)
        place = np.empty(len(present), np.intp)
        place[used] = np.arange(len(used))
        corners = model.triangles.take(used, axis=0)
        x, y, z = np.moveaxis(model.world.take(corners, axis=0), 2, 0)
        m = view.matrix
        clip = np.stack([m[i] * x + m[i + 1] * y + m[i + 2] * z + m[i + 3] for i in (0, 4, 8)], axis=2)
        return facing_at(clip, model.facing[corners], place[triangles], *_centres(view, pixels))


def _words(colours: Picture) -> NDArray[np.uint32]:
    """Return colours with one number for each, in a row."""
    return colours.view(np.uint32).reshape(-1)


def _looked_up(table: NDArray[Any], triangles: NDArray[np.int32], out: NDArray[Any]) -> NDArray[Any]:
    """Put the entries of a table (t + 1,) for triangles of pixels into an array, and return it."""
    numbers, flat = triangles.reshape(-1), out.reshape(-1)
    for start in range(0, len(flat), LOOKED_UP_AT_ONCE):
        part = slice(start, start + LOOKED_UP_AT_ONCE)
        table.take(numbers[part], mode="wrap", out=flat[part])
    return out


def _centres(view: View, pixels: Ints) -> tuple[Floats32, Floats32]:
    """Return the columns and rows of the centres of pixels."""
    places, width = pixels.astype(np.int32), np.int32(view.width)
    rows = places // width
    columns = places - rows * width
    return columns.astype(np.float32) + np.float32(0.5), rows.astype(np.float32) + np.float32(0.5)
