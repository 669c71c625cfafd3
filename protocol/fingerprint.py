"""The arithmetic fingerprint, which shows whether another machine computes the same bits.

The first part is a digest of values of the mathematical library and of numpy's elementwise functions, which differ
between CPU classes (glibc picks routines with or without fused multiply-add, numpy has loops for each vector unit).
The second part is a node's digest of a fixed short run of its engine (`node.solver`). Both are compared in the
handshake and kept in the capture.
"""

from __future__ import annotations

import math
import struct
from functools import cache
from hashlib import blake2b

from foosim.common import keyed_random


@cache
def library_fingerprint() -> bytes:
    """Return the BLAKE2b, 32 bytes, of sin, cos, exp, log, atan2 and hypot at 4,096 fixed points, by `math` and numpy.

    Of numpy also the world's arithmetic: square roots, quotients, products and sums.
    """
    import numpy as np  # only where the world is computed: commands that only read settings do without

    hasher = blake2b(digest_size=32)
    for number in range(1, 4097):
        x = number * 0.0123456789
        hasher.update(
            struct.pack(
                "<6d", math.sin(x), math.cos(x), math.exp(-x), math.log(x), math.atan2(x, 1.5), math.hypot(x, 0.7)
            )
        )
    points = np.arange(1, 4097) * 0.0123456789
    for values in (
        *(np.sin(points), np.cos(points), np.exp(-points), np.log(points), np.sqrt(points)),
        *(np.arctan2(points, 1.5), np.hypot(points, 0.7), np.frexp(points)[0], 1.0 / points),
        *(points * points + 0.1, points * 3.0 - points / 7.0),
    ):
        hasher.update(values.tobytes())
    return hasher.digest()


def is_compiled() -> bool:
    """Whether the hot path runs compiled (setup.py) on this machine: it computes the same bits, faster."""
    return not keyed_random.__file__.endswith(".py")
