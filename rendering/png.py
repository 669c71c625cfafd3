"""Pictures as PNG files (W3C, Portable Network Graphics); depth and segmentation also in false colours."""

from __future__ import annotations

import struct
import zlib
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

HEAD: Final = b"\x89PNG\r\n\x1a\n"
NOTHING: Final = (24, 26, 30)
RAMP: Final = np.array([(255, 240, 120), (235, 120, 50), (150, 40, 110), (40, 20, 90)], np.float64)
"""Colours of depths, from the nearest to the farthest."""
TURN: Final = 0.6180339887498949
"""The golden section: hues of consecutive numbers differ."""


def encode_png(pixels: NDArray[Any]) -> bytes:
    """Return a file of colours (height, width, 3) of 8 bits, or of grey values (height, width) of 16 bits."""
    height, width = pixels.shape[:2]
    depth, kind, rows = (8, 2, pixels) if pixels.ndim == 3 else (16, 0, pixels.astype(">u2"))
    lines = np.ascontiguousarray(rows).view(np.uint8).reshape(height, -1)
    data = np.pad(lines, ((0, 0), (1, 0)))  # a 0 before each row: it is not filtered
    parts = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0)),
        (b"IDAT", zlib.compress(data.tobytes(), 3)),
        (b"IEND", b""),
    )
    return HEAD + b"".join(
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body)) for name, body in parts
    )


def visible(kind: str, picture: NDArray[Any]) -> NDArray[np.uint8]:
    """Return an `image`, `depth` or `segmentation` as colours (height, width, 3); black where nothing is seen."""
    if kind == "image":
        return picture
    found = np.full((*picture.shape, 3), NOTHING, np.uint8)
    seen = picture > 0
    values = picture[seen].astype(np.float64)
    if kind == "depth" and len(values):
        low, high = values.min(), values.max()
        share = (values - low) / max(high - low, 1e-9) * (len(RAMP) - 1)
        found[seen] = np.stack([np.interp(share, np.arange(len(RAMP)), colour) for colour in RAMP.T], axis=1)
    elif kind == "segmentation":
        hue = (values * TURN)[:, np.newaxis] % 1.0 * 6.0 + (0.0, 4.0, 2.0)
        found[seen] = 60.0 + 180.0 * np.clip(np.abs(hue % 6.0 - 3.0) - 1.0, 0.0, 1.0)
    return found
