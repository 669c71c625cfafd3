"""What a lens and its sensor make of a picture: distortion, gain, noise."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from foosim.common.batched.normal import inverse_of_lower_half
from foosim.kernels.raster import Floats
from foosim.rendering.view import focal_length
from foosim.world.components.optics import Optics

STEPS: Final = 20
"""Of the inverse of a distortion, each at least halves what is left of usual ones."""
CLOSE: Final = 0.01
"""Pixels within which the inverse must be, else nothing is seen there."""
SHARES: Final = 64
"""Pixels are mixed in steps of 1/64: three colours, times 64 x 64, fit one word of 64 bits."""
HALF: Final = np.uint64(SHARES * SHARES // 2 * (1 + (1 << 20) + (1 << 40)))

Number = TypeVar("Number", np.float32, np.int32)


class Lens:
    """The distortion of Brown's model with k1, k2, p1, p2, k3 (Brown, "Close-range camera calibration", 1971; in
    OpenCV's order, x to the right and y down), as a table: where in a picture without it each pixel comes from.

    That picture has `margin` more columns and rows at each side, since its corners may be seen further inside.
    """

    def __init__(self, optics: Optics) -> None:
        focal = focal_length(optics.fov, optics.width)
        v, u = np.divmod(np.arange(optics.width * optics.height), optics.width)
        seen_x, seen_y = (u + 0.5 - 0.5 * optics.width) / focal, (v + 0.5 - 0.5 * optics.height) / focal
        x, y = seen_x, seen_y
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                radial, aside, down = _distortion(x, y, optics)
                x, y = (seen_x - aside) / radial, (seen_y - down) / radial
            radial, aside, down = _distortion(x, y, optics)
            miss = np.abs(x * radial + aside - seen_x) + np.abs(y * radial + down - seen_y)
            out_x, out_y = (np.abs(a) * focal - 0.5 * size for a, size in ((x, optics.width), (y, optics.height)))
            is_seen = (miss * focal < CLOSE) & (out_x < optics.width // 2) & (out_y < optics.height // 2)
        x_most, y_most = (int(out[is_seen].max(initial=0.0)) for out in (out_x, out_y))
        self.margin = x_most + 2, y_most + 2
        self._width, height = optics.width + 2 * self.margin[0], optics.height + 2 * self.margin[1]
        place = [
            np.floor((np.where(is_seen, a, 0.0) * focal + 0.5 * size - 0.5) * SHARES + 0.5).astype(np.int64)
            for a, size in ((x, self._width), (y, height))
        ]
        (column, right), (row, below) = (np.divmod(a, SHARES) for a in place)
        self._first = (row * self._width + column).astype(np.int32)
        self._weights = [
            (is_seen * a * b).astype(np.uint16) for b in (SHARES - below, below) for a in (SHARES - right, right)
        ]
        self._nearest = np.where(
            is_seen, self._first + (right >= SHARES // 2) + (below >= SHARES // 2) * np.int32(self._width), 0
        )
        self._is_seen, self._shape = is_seen, (optics.height, optics.width)

    def nearest(self, values: NDArray[Number], nothing: float) -> NDArray[Number]:
        """Return the values of the nearest pixels, `nothing` where none is seen."""
        taken = np.where(self._is_seen, values.reshape(-1)[self._nearest], values.dtype.type(nothing))
        return taken.reshape(self._shape)

    def mixed(self, colour: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the picture, in which each pixel is mixed of the four next to its place."""
        red, green, blue = np.moveaxis(colour.astype(np.uint64).reshape(-1, 3), 1, 0)
        words = red | green << np.uint64(20) | blue << np.uint64(40)
        total = np.full(len(self._first), HALF)
        for weights, step in zip(self._weights, (0, 1, self._width, self._width + 1), strict=True):
            total += weights * words[self._first + step]
        made = np.empty((*self._shape, 3), np.uint8)
        for channel in range(3):
            made[:, :, channel] = (total >> np.uint64(20 * channel + 12) & np.uint64(255)).reshape(self._shape)
        return made


def _distortion(x: Floats, y: Floats, optics: Optics) -> tuple[Floats, Floats, Floats]:
    """Return the radial factor and the offsets of a place (x, y), per focal length."""
    k1, k2, p1, p2, k3 = optics.distortion
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    return radial, 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x), p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y


lens_of = lru_cache(8)(Lens)


_LOWER: Final = inverse_of_lower_half((np.arange(128, dtype=np.float64) + 0.5) / 256.0)
QUANTILES: Final = np.concatenate([_LOWER, -_LOWER[::-1]])
"""256 equally likely values of the standard normal distribution."""
KEY_BYTES: Final = 32


def sensed(colour: NDArray[np.uint8], gain: float, noise: float, key: int) -> NDArray[np.uint8]:
    """Return the values that a sensor gives: times `gain`, with normal noise of this standard deviation, by a key below
    2^256."""
    if gain != 1.0:
        colour = np.minimum(np.floor(np.arange(256) * gain + 0.5), 255.0).astype(np.uint8)[colour]
    if noise > 0.0:
        draws = hashlib.shake_128(key.to_bytes(KEY_BYTES, "little")).digest(colour.size)
        places = np.frombuffer(draws, np.uint8).reshape(colour.shape)
        offsets = np.floor(np.clip(QUANTILES * noise, -255.0, 255.0) + 0.5).astype(np.int16)
        colour = np.clip(colour + offsets[places], 0, 255).astype(np.uint8)
    return colour
