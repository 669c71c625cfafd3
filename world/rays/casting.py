"""Rays against placed shapes: what each meets first. Each ray has the bits that it has alone.

Rays that begin at one place are a bundle, as those of a scanner are. A box around a bundle says which shapes may be
met, the sphere around each of these which ray comes near; only what is near is computed exactly. Neither changes a
distance, of which the least is taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.world.rays.boxes import Floats
from foosim.world.rays.kernels import box_spans, capsule_spans, cylinder_spans, sphere_spans
from foosim.world.rays.shapes import NOTHING, Placed
from foosim.world.rays.solids import BOX, CAPSULE, CYLINDER, SPHERE, TOUCH_M
from foosim.world.rays.triangles import Triangles

Indices = NDArray[np.intp]
BUNDLE: Final = 32
"""Rays of a bundle at most: fewer of a fan go in a direction of their own, to which fewer shapes are near."""
PAIRS_AT_ONCE: Final = 16_384
"""So many pairs of a ray and a shape are compared at once: what is computed stays in a cache."""


class Hits(NamedTuple):
    """What rays meet first: how far away (m), inf where that is nothing, and the number of the thing, else -1."""

    distances: Floats
    things: NDArray[np.int64]


class Bundles:
    """Rays as bundles: origins and unit directions (3, n), ranges (n,), numbers of the things that they pass (n,)."""

    def __init__(self, origins: Floats, ways: Floats, ranges: Floats, passing: NDArray[np.int64]) -> None:
        self.origins, self.ways, self.ranges, self.passing = origins, ways, ranges, passing
        count = len(ranges)
        changed = np.ones(count, np.bool_)
        changed[1:] = (origins[:, 1:] != origins[:, :-1]).any(axis=0) | (passing[1:] != passing[:-1])
        runs = np.flatnonzero(changed)
        lengths = np.diff(np.append(runs, count))
        pieces = -(-lengths // BUNDLE)
        within = np.arange(int(pieces.sum())) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        self.starts = np.repeat(runs, pieces) + within * BUNDLE
        self.lengths = np.minimum(np.repeat(lengths, pieces) - within * BUNDLE, BUNDLE)
        ends = origins + ways * ranges
        low, high = np.minimum(origins, ends), np.maximum(origins, ends)
        self.low = np.minimum.reduceat(low, self.starts, axis=1) if count else low
        self.high = np.maximum.reduceat(high, self.starts, axis=1) if count else high


def cast(placed: Placed, bundles: Bundles) -> Hits:
    """Return what rays meet first of placed shapes; of things at the same distance that of the first shape.

    A ray that begins inside of something meets it at once. One that touches something, or is in it for no more than
    TOUCH_M, does not meet it.
    """
    count = len(bundles.ranges)
    hits = Hits(np.full(count, np.inf), np.full(count, NOTHING, np.int64))
    asked, shapes = placed.near.met(bundles.low, bundles.high)
    kept = placed.things[shapes] != bundles.passing[bundles.starts[asked]]
    asked, shapes = asked[kept], shapes[kept]
    for near, those in _near(placed, bundles, asked, shapes):
        entries = _entries(placed, bundles, near, those)
        is_met = entries < np.inf
        rays, chosen, enters = near[is_met], those[is_met], entries[is_met]
        if not len(rays):
            continue
        firsts = np.flatnonzero(np.append(True, rays[1:] != rays[:-1]))
        least = np.minimum.reduceat(enters, firsts)
        hits.distances[rays[firsts]] = least
        nearest = np.flatnonzero(enters == np.repeat(least, np.diff(np.append(firsts, len(rays)))))[::-1]
        hits.things[rays[nearest]] = placed.things[chosen[nearest]]  # the last one that is written is the first shape
    return hits


def _near(placed: Placed, bundles: Bundles, asked: Indices, shapes: Indices) -> Iterator[tuple[Indices, Indices]]:
    """Yield pairs of rays and shapes that they come near to: those of a ray together, in the order of shapes."""
    counts = np.bincount(asked, minlength=len(bundles.starts))
    begins = np.cumsum(counts) - counts
    for length in np.unique(bundles.lengths[counts > 0]).tolist():
        members = np.flatnonzero((bundles.lengths == length) & (counts > 0))
        members = members[np.argsort(-counts[members], kind="stable")]
        begin = 0
        while begin < len(members):
            widest = int(counts[members[begin]])
            some = members[begin : begin + max(1, PAIRS_AT_ONCE // (widest * length))]
            begin += len(some)
            places = begins[some][:, None] + np.arange(widest)
            is_there = np.arange(widest) < counts[some][:, None]
            candidates = np.where(is_there, shapes[np.where(is_there, places, 0)], NOTHING)
            rays = bundles.starts[some][:, None] + np.arange(length)
            bundle, ray, place = np.nonzero(_passes(placed, bundles, rays, candidates))
            yield rays[bundle, ray], candidates[bundle, place]


def _passes(placed: Placed, bundles: Bundles, rays: Indices, candidates: Indices) -> NDArray[np.bool_]:
    """Return which rays (b, r) of bundles meet the spheres around shapes (b, c), or nearly so: shape (b, r, c)."""
    x, y, z = placed.middles[:, candidates] - bundles.origins[:, rays[:, :1]]
    radii = placed.radii[candidates]
    beyond = (x * x + y * y + z * z - radii * radii)[:, None, :]
    dx, dy, dz = bundles.ways[:, rays]
    along = dx[:, :, None] * x[:, None, :]
    along += dy[:, :, None] * y[:, None, :]
    along += dz[:, :, None] * z[:, None, :]
    passes: NDArray[np.bool_] = along >= -radii[:, None, :]
    passes &= along <= radii[:, None, :] + bundles.ranges[rays][:, :, None]
    along *= along
    passes &= along >= beyond
    return passes


def _entries(placed: Placed, bundles: Bundles, rays: Indices, chosen: Indices) -> Floats:
    """Return where rays enter shapes, pair by pair (m); inf where they do not."""
    forms = placed.forms
    kinds = forms.forms[chosen]
    entries = np.full(len(rays), np.inf)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for form in (BOX, CYLINDER, SPHERE, CAPSULE):
            if form not in forms.present:
                continue
            some = np.flatnonzero(kinds == form)
            if not len(some):
                continue
            starts, ways, shape = _from_shapes(placed, bundles, rays[some], chosen[some], is_turned=form != SPHERE)
            half = forms.half[:, shape]
            if form == BOX:
                enter, leave = box_spans(starts, ways, half)
            elif form == SPHERE:
                enter, leave = sphere_spans(starts, ways, half[0])
            elif form == CYLINDER:
                enter, leave = cylinder_spans(starts, ways, half[0], half[2])
            else:
                enter, leave = capsule_spans(starts, ways, half[0], half[2])
            entries[some] = _within(enter, leave, bundles.ranges[rays[some]])
    for triangles, having in forms.meshes:
        some = np.flatnonzero(having[chosen])
        if len(some):
            starts, ways, _ = _from_shapes(placed, bundles, rays[some], chosen[some], is_turned=True)
            entries[some] = _into_mesh(triangles, starts, ways, bundles.ranges[rays[some]])
    return entries


def _from_shapes(
    placed: Placed, bundles: Bundles, rays: Indices, shapes: Indices, *, is_turned: bool
) -> tuple[Floats, Floats, Indices]:
    """Return starts and ways of rays in the frames of shapes, and the shapes; a sphere need not be turned to."""
    starts, ways = bundles.origins[:, rays] - placed.positions[:, shapes], bundles.ways[:, rays]
    if is_turned:
        starts, ways = placed.local(shapes, starts), placed.local(shapes, ways)
    return starts, ways, shapes


def _within(enter: Floats, leave: Floats, ranges: Floats) -> Floats:
    """Return where spans begin that a ray has from its start to its range; inf where they are no more than a touch."""
    enter = np.where(enter > 0.0, enter, 0.0)
    return np.where(np.minimum(leave, ranges) - enter > TOUCH_M, enter, np.inf)


def _into_mesh(triangles: Triangles, starts: Floats, ways: Floats, ranges: Floats) -> Floats:
    """Return where rays meet a mesh: where they enter it, or pass a wall of one that is not closed."""
    entries = np.full(len(ranges), np.inf)
    lines, places = triangles.hits_of_many(starts, ways)
    if triangles.is_closed:
        lines, found = lines[::2], _within(places[::2], places[1::2], ranges[lines[::2]])
    else:
        found = np.where((places > 0.0) & (places < ranges[lines]), places, np.inf)
    np.minimum.at(entries, lines, found)
    return entries
