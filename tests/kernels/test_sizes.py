"""Arrays that do not fit together are refused by the kernels, which would else read and write beside them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from foosim.kernels import C

SHAPES, BUNDLES, RAYS = 5, 3, 36
CALLS: dict[str, list[Any]] = {
    "raster": [
        *(np.zeros((12, 3)), np.zeros((20, 3), np.int32), np.array([[0, 12, 0, 20, 1]], np.int32), np.eye(4), 0.01),
        *(16, 9, 0, 9, np.zeros((9, 16), np.float32), np.zeros((9, 16), np.int32)),
    ],
    "first_hits": [
        *(np.ones((15, SHAPES)), np.ones(SHAPES), np.ones((3, SHAPES)), np.arange(SHAPES), np.arange(SHAPES)),
        *(np.array([-1, -1, -1, 0, -1]), ((np.ones((6, 2)), np.ones((3, 3, 2, 32)), True),), np.ones((3, BUNDLES))),
        *(np.ones(BUNDLES), np.zeros(BUNDLES, np.int64), np.arange(BUNDLES) * 12, np.full(BUNDLES, 12)),
        *(np.ones((3, RAYS)), np.zeros(RAYS), np.zeros(RAYS, np.int64)),
    ],
    "turned": [np.ones((4, 3)), np.ones((3, 5, 3)), np.zeros((3, 3, 5))],
}
INDICES = {("raster", 2), *[("first_hits", place) for place in (3, 5, 10, 11)]}
"""Runs, forms, meshes, and the rays of bundles."""


@pytest.mark.skipif(C is None, reason="no C compiler built the kernels")
@pytest.mark.parametrize("name", CALLS)
def test_arrays_that_do_not_fit_together_are_refused(name: str) -> None:
    function, given = getattr(C, name), CALLS[name]
    function(*given)
    for place, array in enumerate(given):
        wrong: list[Any] = []
        if isinstance(array, tuple):
            wrong = [(), ((array[0][0], array[0][1][:2], True),)]
        elif isinstance(array, np.ndarray):
            wrong = [array.reshape(-1)[:-1], array.astype(np.float16)]
            wrong += [array + 1000, array - 1000] if (name, place) in INDICES else []
        for one in wrong:
            with pytest.raises(ValueError, match="sizes of arrays do not fit together"):
                function(*given[:place], one, *given[place + 1 :])
