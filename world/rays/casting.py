"""The first hits of rays on placed shapes. Each ray has the bits that it has alone.

Rays that begin at one place are a bundle, as those of a scanner. A box around a bundle selects shapes, the sphere
around each of these selects rays; only near pairs are computed exactly. Neither changes a distance, of which the least
is taken. Where kernels were compiled, kernels/rays.c does the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.kernels import C
from foosim.world.rays.boxes import Floats
from foosim.world.rays.kernels import box_spans, capsule_spans, cylinder_spans, sphere_spans
from foosim.world.rays.shapes import NOTHING, Placed
from foosim.world.rays.solids import BOX, CYLINDER, SPHERE, TOUCH_M
from foosim.world.rays.triangles import Triangles

Indices = NDArray[np.intp]
BUNDLE: Final = 32
"""The greatest count of rays of a bundle: a narrower bundle has fewer near shapes."""
ROUNDING: Final = 1.000001
"""A tolerance of rounding in comparisons of squares of distances."""
PAIRS_AT_ONCE: Final = 16_384
"""The count of pairs of a ray and a shape that are compared at once: their arrays stay in a cache."""


class Hits(NamedTuple):
    """The first hits of rays: distance (m) and number of the thing; inf and -1 without a hit."""

    distances: Floats
    things: NDArray[np.int64]


class Bundles(NamedTuple):
    """n rays in b bundles: those of a bundle have one start, one length and one passed thing, and are in a row."""

    origins: Floats
    """Of bundles (3, b)."""
    ranges: Floats
    """The lengths of rays (b,) (m)."""
    passing: NDArray[np.int64]
    """The numbers of the things that they pass (b,)."""
    starts: Indices
    """The first ray of each bundle (b,)."""
    lengths: Indices
    """The count of rays of each (b,)."""
    ways: Floats
    """Unit directions of rays (3, n)."""

    @classmethod
    def of_rays(cls, origins: Floats, ways: Floats, ranges: Floats, passing: NDArray[np.int64]) -> Bundles:
        """Return rays as bundles: origins and unit directions (3, n), ranges and numbers of things (n,)."""
        count = len(ranges)
        changed = np.ones(count, np.bool_)
        changed[1:] = (origins[:, 1:] != origins[:, :-1]).any(axis=0)
        changed[1:] |= (passing[1:] != passing[:-1]) | (ranges[1:] != ranges[:-1])
        runs = np.flatnonzero(changed)
        starts, lengths = _in_pieces(runs, np.diff(np.append(runs, count)))
        return cls(origins[:, starts], ranges[starts], passing[starts], starts, lengths, ways)

    @classmethod
    def of_fans(cls, origins: Floats, ways: Floats, ranges: Floats, passing: NDArray[np.int64]) -> Bundles:
        """Return f fans of r rays as bundles: origins (3, f), unit directions (3, f, r), ranges and things (f,)."""
        fans, rays = ways.shape[1:]
        starts, lengths = _in_pieces(np.arange(fans) * rays, np.full(fans, rays))
        fan = starts // rays
        return cls(origins[:, fan], ranges[fan], passing[fan], starts, lengths, ways.reshape(3, -1))

    def box(self) -> tuple[Floats, Floats]:
        """Return the least and the greatest coordinates of each bundle (3, b)."""
        if not len(self.starts):
            return self.origins, self.origins
        low, high = (extreme.reduceat(self.ways, self.starts, axis=1) for extreme in (np.minimum, np.maximum))
        return self.origins + np.minimum(low, 0.0) * self.ranges, self.origins + np.maximum(high, 0.0) * self.ranges


def _in_pieces(begins: Indices, lengths: Indices) -> tuple[Indices, Indices]:
    """Return the starts and lengths of pieces of at most BUNDLE rays, of runs of rays."""
    if not len(lengths) or int(lengths.max()) <= BUNDLE:
        return begins, lengths
    pieces = -(-lengths // BUNDLE)
    within = np.arange(int(pieces.sum())) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return (
        np.repeat(begins, pieces) + within * BUNDLE,
        np.minimum(np.repeat(lengths, pieces) - within * BUNDLE, BUNDLE),
    )


class Pairs(NamedTuple):
    """n pairs of a ray and a shape that come near each other."""

    rays: Indices
    shapes: Indices
    starts: Floats
    """Where the rays begin, in the frames of the shapes (3, n)."""
    ranges: Floats


def distances(placed: Placed, bundles: Bundles) -> Floats:
    """Return the distances of the first hits of rays (n,) (m); inf without a hit."""
    if C is not None:
        least = np.empty(bundles.ways.shape[1])
        _compiled(placed, bundles, least, None)
        return least
    least = np.full(bundles.ways.shape[1], np.inf)
    for pairs in _near(placed, bundles):
        np.minimum.at(least, pairs.rays, _entries(placed, bundles, pairs))
    return least


def cast(placed: Placed, bundles: Bundles) -> Hits:
    """Return the first hits of rays on placed shapes; of things at the same distance that of the first shape.

    A ray that begins inside of a thing meets it at once. One that touches a thing, or is in it for at most TOUCH_M,
    does not meet it.
    """
    count = bundles.ways.shape[1]
    if C is not None:
        hits = Hits(np.empty(count), np.empty(count, np.int64))
        _compiled(placed, bundles, *hits)
        return hits
    hits = Hits(np.full(count, np.inf), np.full(count, NOTHING, np.int64))
    for pairs in _near(placed, bundles):
        entries, before = _entries(placed, bundles, pairs), hits.distances[pairs.rays]
        np.minimum.at(hits.distances, pairs.rays, entries)
        nearest = np.flatnonzero((entries < before) & (entries == hits.distances[pairs.rays]))[::-1]
        # Shapes of a ray are in their order: the last written one is the first of them.
        hits.things[pairs.rays[nearest]] = placed.things[pairs.shapes[nearest]]
    return hits


def _compiled(placed: Placed, bundles: Bundles, least: Floats, things: NDArray[np.int64] | None) -> None:
    """Write the distances of first hits, and the numbers of things, by the kernel."""
    forms = placed.forms
    C.first_hits(
        *(placed.columns, placed.radii, forms.half, forms.forms, placed.things, forms.mesh_numbers),
        tuple([triangles.arrays for triangles, _ in forms.meshes]),
        *(np.ascontiguousarray(bundles.origins), np.ascontiguousarray(bundles.ranges)),
        *(np.ascontiguousarray(bundles.passing), bundles.starts, bundles.lengths),
        *(np.ascontiguousarray(bundles.ways), least, things),
    )


def _near(placed: Placed, bundles: Bundles) -> Iterator[Pairs]:
    """Yield rays and the shapes near to them: those of a ray in the order of shapes."""
    bundle, shapes = placed.met(*bundles.box())
    kept = placed.things[shapes] != bundles.passing[bundle]
    if not kept.all():
        bundle, shapes = bundle[kept], shapes[kept]
    if not len(bundle):
        return
    lengths = bundles.lengths[bundle]
    shortest, longest = int(lengths.min()), int(lengths.max())
    for length in [longest] if shortest == longest else np.unique(lengths).tolist():
        members = slice(None) if shortest == longest else np.flatnonzero(lengths == length)
        its, those = bundle[members], shapes[members]
        at_once = max(1, PAIRS_AT_ONCE // length)
        for begin in range(0, len(its), at_once):
            part = slice(begin, begin + at_once)
            yield _passing_near(placed, bundles, its[part], those[part], length)


def _passing_near(placed: Placed, bundles: Bundles, bundle: Indices, shapes: Indices, length: int) -> Pairs:
    """Return the rays of bundles, of this length, that meet the spheres around shapes, or nearly so."""
    origins, ranges, radii = bundles.origins[:, bundle], bundles.ranges[bundle], placed.radii[shapes]
    x, y, z = placed.middles[:, shapes] - origins
    square = x * x + y * y + z * z
    if length > 1:
        reach = ranges + radii
        near = np.flatnonzero(square <= reach * reach * ROUNDING)
        if len(near) < len(bundle):
            x, y, z, square, ranges, radii = (column[near] for column in (x, y, z, square, ranges, radii))
            bundle, shapes, origins = bundle[near], shapes[near], origins[:, near]
    first, beyond = bundles.starts[bundle], square - radii * radii
    if bundles.ways.shape[1] == length * len(bundles.starts) and int(bundles.lengths.min()) == length:  # so of all
        dx, dy, dz = bundles.ways.reshape(3, -1, length).take(bundle, axis=1)
    else:
        dx, dy, dz = bundles.ways[:, first[:, None] + np.arange(length)]
    along = dx * x[:, None]
    along += dy * y[:, None]
    along += dz * z[:, None]
    passes: NDArray[np.bool_] = along >= -radii[:, None]
    passes &= along <= (radii + ranges)[:, None]
    along *= along
    passes &= along >= beyond[:, None]
    pair, ray = passes.nonzero()
    local = placed.local(shapes, origins - placed.positions[:, shapes])
    return Pairs(first[pair] + ray, shapes[pair], local[:, pair], ranges[pair])


def _entries(placed: Placed, bundles: Bundles, pairs: Pairs) -> Floats:
    """Return the distances at which rays enter shapes, pair by pair (m); inf without a hit."""
    forms, count = placed.forms, len(pairs.rays)
    kinds = forms.forms[pairs.shapes]
    ways = placed.local(pairs.shapes, bundles.ways[:, pairs.rays])
    half = forms.half[:, pairs.shapes]
    entries = np.full(count, np.inf)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for form in forms.primitives:
            some = np.flatnonzero(kinds == form)
            if not len(some):
                continue
            chosen = slice(None) if len(some) == count else some
            starts, directions, size = pairs.starts[:, chosen], ways[:, chosen], half[:, chosen]
            if form == BOX:
                enter, leave = box_spans(starts, directions, size)
            elif form == SPHERE:
                enter, leave = sphere_spans(starts, directions, size[0])
            elif form == CYLINDER:
                enter, leave = cylinder_spans(starts, directions, size[0], size[2])
            else:
                enter, leave = capsule_spans(starts, directions, size[0], size[2])
            entries[chosen] = _within(enter, leave, pairs.ranges[chosen])
    for triangles, having in forms.meshes:
        some = np.flatnonzero(having[pairs.shapes])
        if len(some):
            entries[some] = _into_mesh(triangles, pairs.starts[:, some], ways[:, some], pairs.ranges[some])
    return entries


def _within(enter: Floats, leave: Floats, ranges: Floats) -> Floats:
    """Return the starts of spans between a ray's start and its range; inf for a touch."""
    enter = np.where(enter > 0.0, enter, 0.0)
    return np.where(np.minimum(leave, ranges) - enter > TOUCH_M, enter, np.inf)


def _into_mesh(triangles: Triangles, starts: Floats, ways: Floats, ranges: Floats) -> Floats:
    """Return the distances at which rays enter a mesh, or pass a wall of an open one."""
    entries = np.full(len(ranges), np.inf)
    lines, places = triangles.hits_of_many(starts, ways)
    if triangles.is_closed:
        lines, found = lines[::2], _within(places[::2], places[1::2], ranges[lines[::2]])
    else:
        found = np.where((places > 0.0) & (places < ranges[lines]), places, np.inf)
    np.minimum.at(entries, lines, found)
    return entries
