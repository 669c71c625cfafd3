"""Obstacles of upright bodies: each shape as a footprint with a band of heights, as columns of numbers.

A footprint is a rectangle grown by a radius: `rays.outlines.Rectangle` has the radius 0, `Circle` has sides of 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import floor
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.fixed_scenery import fixed_shapes
from foosim.world.rays.outlines import Rectangle, outline
from foosim.world.scene import Shape, shape_box
from foosim.world.scenery import scenery_shape
from foosim.world.spec import WorldSpec

Floats: TypeAlias = NDArray[np.float64]
Places: TypeAlias = NDArray[np.int64]
CELL_M: Final = 1.0
CELLS_OF_ONE_MAX: Final = 4096
"""A solid in the reach of more cells is compared with each body."""
CELLS_MAX: Final = 2**20
"""Cells lie this far from the origin at most, in either direction; farther places are in the last one."""
STRIDE: Final = 2**22
PLACES_FEW: Final = 64
"""Up to this count of places cells are looked up one by one: it costs less than searching for all at once."""
PAIRS_FEW: Final = 4096
"""Up to this count all pairs are compared: it costs less than sorting."""


class Solids:
    """Footprints and heights (m): middle, unit vector along the first side, half of both sides, radius, band."""

    __slots__ = (
        "along_x",
        "along_y",
        "columns",
        "half_across",
        "half_along",
        "high",
        "low",
        "radius",
        "x",
        "y",
    )

    def __init__(self, columns: Floats) -> None:
        """`columns` (9, n) are in that order."""
        self.columns = columns
        self.x, self.y, self.along_x, self.along_y, self.half_along, self.half_across = columns[:6]
        self.radius, self.low, self.high = columns[6:]

    def at(self, chosen: Places | NDArray[np.bool_]) -> Solids:
        """Return the chosen ones."""
        return Solids(self.columns[:, chosen])

    def beside(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return how far a place is beyond the first and the second sides of each; negative between them."""
        east, north = x - self.x, y - self.y
        along = np.abs(east * self.along_x + north * self.along_y) - self.half_along
        across = np.abs(north * self.along_x - east * self.along_y) - self.half_across
        return along, across


def solid(shape: Shape) -> tuple[float, ...]:
    """Return a shape in the world as a row of `Solids`."""
    low, high = shape_box(shape)
    seen = outline(shape)
    if isinstance(seen, Rectangle):
        sides = seen.along_x, seen.along_y, seen.half_along, seen.half_across, 0.0
    else:
        sides = 1.0, 0.0, 0.0, 0.0, seen.radius
    return seen.x, seen.y, *sides, low[2], high[2]


def solids(rows: Iterable[tuple[float, ...]]) -> Solids:
    """Return rows as columns."""
    return Solids(np.array([*rows], float).reshape(-1, 9).T.copy())


def joined(parts: Iterable[Solids]) -> Solids:
    """Return the parts in one, in their order."""
    return Solids(np.concatenate([one.columns for one in parts], axis=1))


def distance(along: Floats, across: Floats) -> Floats:
    """Return the distances of places from rectangles, by the result of `Solids.beside`; negative inside."""
    outside_along, outside_across = np.maximum(along, 0.0), np.maximum(across, 0.0)
    outside = np.sqrt(outside_along * outside_along + outside_across * outside_across)
    return np.where((along <= 0.0) & (across <= 0.0), np.maximum(along, across), outside)


def scenery_of(spec: WorldSpec) -> Iterator[Shape]:
    """Yield the scenery of a world; meshes without their files are left out."""
    yield from fixed_shapes(spec)
    for name, thing in sorted(spec.scenery.items()):
        mesh = spec.mesh_of(name)
        if thing.shape != "mesh" or mesh is not None:
            yield scenery_shape(name, thing, mesh)


def cells_of(x: Floats, y: Floats, side: float) -> Places:
    """Return the numbers of the cells of a grid that places are in; the next cell in x has the next number."""
    column = np.minimum(np.maximum(np.floor(x / side), -CELLS_MAX), CELLS_MAX)
    row = np.minimum(np.maximum(np.floor(y / side), -CELLS_MAX), CELLS_MAX)
    return (row * STRIDE + column).astype(np.int64)


def ranges(starts: Places, ends: Places) -> tuple[Places, Places]:
    """Return the concatenated numbers of ranges, and for each number the index of its range."""
    counts = ends - starts
    which = np.repeat(np.arange(len(starts)), counts)
    first = np.cumsum(counts) - counts
    return np.arange(len(which)) - first[which] + starts[which], which


class Standing:
    """Fixed solids, by the cells of a grid in which a body with the reach `reach_m` may meet them."""

    def __init__(self, rows: Iterable[tuple[float, ...]], reach_m: float) -> None:
        self.solids = solids(rows)
        cells: dict[int, list[int]] = {}
        everywhere: list[int] = []
        for number, row in enumerate(self.solids.columns.T.tolist()):
            x, y, along_x, along_y, half_along, half_across, radius, _, _ = row
            half_x = abs(along_x) * half_along + abs(along_y) * half_across + radius + reach_m
            half_y = abs(along_y) * half_along + abs(along_x) * half_across + radius + reach_m
            columns = range(floor((x - half_x) / CELL_M), floor((x + half_x) / CELL_M) + 1)
            lines = range(floor((y - half_y) / CELL_M), floor((y + half_y) / CELL_M) + 1)
            is_beyond = max(abs(columns[0]), abs(columns[-1]), abs(lines[0]), abs(lines[-1])) >= CELLS_MAX
            if is_beyond or len(columns) * len(lines) > CELLS_OF_ONE_MAX:
                everywhere.append(number)
                continue
            for line in lines:
                for column in columns:
                    cells.setdefault(line * STRIDE + column, []).append(number)
        self._everywhere, self._cells = np.array(everywhere, np.int64), cells
        keys = sorted(cells)
        self._keys = np.array(keys, np.int64)
        self._members = np.array([number for key in keys for number in cells[key]], np.int64)
        self._ends = np.cumsum(np.array([len(cells[key]) for key in keys], np.int64))

    def near(self, x: Floats, y: Floats) -> tuple[Places, Places]:
        """Return pairs: the index of a place, and that of something that may be in its reach."""
        count = len(x)
        who, what = self._near_few(x, y) if count <= PLACES_FEW else self._near_many(x, y)
        if not len(self._everywhere):
            return who, what
        everywhere = np.tile(self._everywhere, count)
        return (
            np.concatenate((np.repeat(np.arange(count), len(self._everywhere)), who)),
            np.concatenate((everywhere, what)),
        )

    def _near_few(self, x: Floats, y: Floats) -> tuple[Places, Places]:
        who: list[int] = []
        what: list[int] = []
        cells = self._cells
        for index, cell in enumerate(cells_of(x, y, CELL_M).tolist()):
            members = cells.get(cell)
            if members is not None:
                who += [index] * len(members)
                what += members
        return np.array(who, np.int64), np.array(what, np.int64)

    def _near_many(self, x: Floats, y: Floats) -> tuple[Places, Places]:
        if not len(self._keys):
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        cells = cells_of(x, y, CELL_M)
        at = np.minimum(np.searchsorted(self._keys, cells), len(self._keys) - 1)
        there = np.flatnonzero(self._keys[at] == cells)
        ends = self._ends[at[there]]
        starts = np.where(at[there] == 0, 0, self._ends[at[there] - 1])
        members, which = ranges(starts, ends)
        return there[which], self._members[members]


def pairs_near(own: Floats, others: Floats, reach_m: float) -> tuple[Places, Places]:
    """Return pairs of places of two kinds, shape (n, 2 or more), within the reach of each other in x and y.

    Some pairs are farther apart: with many places the result is all pairs in neighbouring cells of a grid.
    """
    if len(own) * len(others) <= PAIRS_FEW:
        apart = np.abs(own[:, None, :2] - others[None, :, :2]) <= reach_m
        who, other = (apart[:, :, 0] & apart[:, :, 1]).nonzero()
        return who, other
    cells = cells_of(others[:, 0], others[:, 1], reach_m)
    order = np.argsort(cells, kind="stable")
    ordered, mine = cells[order], cells_of(own[:, 0], own[:, 1], reach_m)
    rows = np.concatenate((mine - STRIDE, mine, mine + STRIDE))
    found, which = ranges(np.searchsorted(ordered, rows - 1), np.searchsorted(ordered, rows + 1, "right"))
    return which % len(own), order[found]
