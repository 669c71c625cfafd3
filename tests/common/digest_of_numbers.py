"""The digest of elementary functions and of noise over fixed arguments; as a script it prints it."""

from __future__ import annotations

from hashlib import blake2b
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.common import exact_math
from foosim.common.batched import exact_arrays
from foosim.common.batched.noise import NoiseKeys
from foosim.common.keyed_random import draw_key

FUNCTIONS: Final = ("exp", "log", "sin", "cos", "tan", "atan", "asin", "acos")


def arguments() -> NDArray[np.float64]:
    """Return numbers of any bits and of everyday sizes."""
    words = NoiseKeys([draw_key(1, "any")]).words(0, 3_000)[0]
    sizes = NoiseKeys([draw_key(1, "size")]).normal(0, 6_000)[0]
    return np.concatenate([words.view(np.float64), sizes * 1e3, sizes, sizes * 0.2])


def digest_of_numbers() -> str:
    """Return the digest, in hex."""
    x = arguments()
    y = x[::-1].copy()
    made = [np.array([getattr(exact_math, name)(one) for one in x.tolist()]) for name in FUNCTIONS]
    made += [np.array([*map(function, y.tolist(), x.tolist())]) for function in (exact_math.atan2, exact_math.hypot)]
    made += [exact_arrays.exp(x), exact_arrays.log(x), *exact_arrays.sincos(x)]
    keys = NoiseKeys(draw_key(2, str(n)) for n in range(101))
    made += [keys.normal(tick, width, slot=tick) for tick, width in enumerate((1, 2, 3, 8, 37))]
    made += [keys.words(1 << 40, 5)]
    return blake2b(b"".join(np.ascontiguousarray(part).tobytes() for part in made), digest_size=16).hexdigest()


if __name__ == "__main__":
    print(digest_of_numbers())
