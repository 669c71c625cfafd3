"""Spaces of Gymnasium from the columns of readings and commands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from gymnasium import spaces

from foosim.client.vectors import Column


def box_of(columns: Sequence[Column]) -> spaces.Box:
    """Return the space of vectors with these columns: float64, of the shape (columns,), within their limits.

    What no form limits is unbounded.
    """
    low = np.array([column.low for column in columns])
    high = np.array([column.high for column in columns])
    return spaces.Box(low, high, dtype=np.float64)
