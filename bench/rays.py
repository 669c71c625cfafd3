"""What a line of sight costs: a hall of 50 shelves and walls, 20 vehicles that drive, 200 pairs that talk in each tick.
And how many rays of sensors are cast in the time b.

Each way of asking by itself: pair by pair, many at once (the receivers of a broadcast), pairs of fixed antennas, whose
scenery is remembered, and pairs that were asked for in the same tick before. Neighbour: `hub`, the whole of the vHub.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass
from math import cos, sin, tau
from statistics import median
from typing import Final

import numpy as np

from bench.bare_tick import bare_tick_us
from foosim.vhub.line_of_sight.occlusion import Geometry, Sight
from foosim.world.layout import Declared, Layout
from foosim.world.rays.boxes import Floats
from foosim.world.rays.caster import Caster, Placement
from foosim.world.scene import Body, Box, Capsule, Cylinder, Link, Scene, Shape, Sphere, Vector, turn

SHELVES: Final = 50
VEHICLES: Final = 20
PAIRS: Final = 200
TICKS_PER_S: Final = 100
SHAPES: Final = 200
SIDE_M: Final = 20.0
"""Shapes are anywhere in a cube of this side."""
NEAR_SIDE_M: Final = 11.5
"""The same where rays are short: so many are near."""
FAN: Final = 24
FANS: Final = 50
NEAR_M: Final = 0.5
"""Shapes are near the way of a ray whose surface is within this distance of it."""
NEAR_RANGE_M: Final = 4.0
PER_B_NEAR: Final = 150.0
PER_B_ANYWHERE: Final = 40.0
CASTS: Final = 30
LIMIT_US: Final = 30.0
LIMIT_AGAIN_US: Final = 2.0
GREY: Final = (0.5, 0.5, 0.5, 1.0)
Pair = tuple[Vector, Vector, tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Rays:
    """Means, in us for each pair."""

    one_by_one_us: float
    fixed_us: float
    again_us: float
    placing_us: float
    """What the first line of a tick costs more, for all bodies together: part of the first two."""
    crossings: float
    """Things that a line crosses, in the mean."""
    near_per_b: float
    """Rays of sensors that are cast in the time b where few shapes lie near their ways."""
    anywhere_per_b: float
    single_per_b: float
    """The same through all of the shapes: in fans, and each from a place of its own."""
    near: int
    """The most shapes that were near the way of a ray of the first figure."""


def hall() -> tuple[Scene, Layout]:
    """Return the world: shelves in rows, and vehicles of a cylinder each."""
    shelves = [
        Shape(
            Box((1.5, 0.3, 1.0)), "walls", GREY, (4.0 * (n % 10) - 18.0, 4.0 * (n // 10) - 8.0, 1.0), name=f"shelf{n}"
        )
        for n in range(SHELVES)
    ]
    chassis = Shape(Cylinder(0.25, 0.3), "walls", GREY)
    names = [f"rover{n:02}" for n in range(VEHICLES)]
    links = {name: (Link(name, "free", (chassis,), 1.0, (1.0, 1.0, 1.0)),) for name in names}
    bodies = {name: Body(name, "ball", (0.0, 0.0, 0.0), links[name]) for name in names}
    return Scene(bodies, tuple(shelves)), Layout(dict.fromkeys(names, "ball"), Declared())


def numbers_at(layout: Layout, tick: int) -> list[float]:
    """Return a frame in which every vehicle is on its circle."""
    numbers = [0.0] * layout.size
    for index, entity in enumerate(layout.entities):
        at, turned = entity.offsets["position"], entity.offsets["orientation"]
        angle = tau * (tick / 1000.0 + index / VEHICLES)
        numbers[at : at + 3] = (15.0 + index / 10) * cos(angle), 9.0 * sin(angle), 0.15
        numbers[turned : turned + 4] = turn((0.0, 0.0, 1.0), angle)
    return numbers


def pairs_at(layout: Layout, numbers: list[float], rng: random.Random) -> list[Pair]:
    """Return pairs of antennas on vehicles."""
    pairs = []
    for _ in range(PAIRS):
        one, other = rng.sample(layout.entities, 2)
        (ax, ay, az), (bx, by, bz) = (
            numbers[entity.offsets["position"] : entity.offsets["position"] + 3] for entity in (one, other)
        )
        mast = rng.uniform(0.3, 0.5)  # so that no two pairs are the same
        pairs.append(((ax, ay, az + mast), (bx, by, bz + mast), (one.name, other.name)))
    return pairs


def rays(seconds: float = 3.0) -> Rays:
    """Ask in as many ticks as a hundredth of the seconds, each way on sights of its own."""
    scene, layout = hall()
    geometry, rng = Geometry(scene), random.Random(1)
    fixed: list[Pair] = [
        ((rng.uniform(-20, 20), rng.uniform(-10, 10), 0.5), (rng.uniform(-20, 20), rng.uniform(-10, 10), 0.5), ("", ""))
        for _ in range(PAIRS)
    ]
    spent = dict.fromkeys(("one_by_one", "fixed", "again", "placing"), 0.0)
    ticks, found = max(1, round(seconds * TICKS_PER_S)), 0
    for tick in range(ticks):
        numbers = numbers_at(layout, tick)
        pairs = pairs_at(layout, numbers, rng)
        sight, third = geometry.sight(layout, numbers), geometry.sight(layout, numbers)
        spent["one_by_one"] += _spent(_each, sight, pairs)
        spent["again"] += _spent(_each, sight, pairs)
        spent["placing"] += _spent(_each, third, fixed[:1])
        spent["fixed"] += _spent(_each, third, fixed)
        found += sum(len(sight.between(*pair)) for pair in pairs)
    each = {name: round(1e6 * total / ticks / PAIRS, 2) for name, total in spent.items()}
    sight_figures = each["one_by_one"], each["fixed"], each["again"], each["placing"], found / ticks / PAIRS
    return Rays(*sight_figures, *_cast_per_b())


def _cast_per_b() -> tuple[float, float, float, int]:
    """Return how many rays are cast in the time b: with few shapes near, and of all, in fans and each by itself."""
    rng = np.random.default_rng(2)
    turns = tau * np.tile(np.arange(FAN), FANS) / FAN
    fan = np.stack((np.cos(turns), np.sin(turns), np.zeros(len(turns))), axis=1)
    places = np.repeat(rng.uniform(-0.5, 0.5, (FANS, 3)), FAN, axis=0)
    x, y, z = ways = rng.normal(size=(3, len(turns)))
    single = (ways / np.sqrt(x * x + y * y + z * z)).T
    alone = rng.uniform(-0.5, 0.5, (len(turns), 3))
    b_us = bare_tick_us()
    figures = []
    for side_m, starts, directions, range_m in (
        (NEAR_SIDE_M, places, fan, NEAR_RANGE_M),
        (SIDE_M, places, fan, SIDE_M),
        (SIDE_M, alone, single, SIDE_M),
    ):
        world = _world_of(*crowd(side_m))
        figures.append(round(len(turns) * b_us / _cast_us(world, starts * side_m, directions, range_m), 1))
    return figures[0], figures[1], figures[2], _most_near(places * NEAR_SIDE_M, fan)


def _world_of(*shapes: Shape) -> Placement:
    return Caster(Scene({}, shapes), Layout({}, Declared())).at([])


def crowd(side_m: float) -> list[Shape]:
    """Return shapes of four kinds anywhere in a cube, each time the same."""
    rng = np.random.default_rng(3)
    kinds = (Box((0.3, 0.3, 0.5)), Sphere(0.4), Cylinder(0.3, 1.0), Capsule(0.3, 0.6))
    shapes = []
    for number in range(SHAPES):
        x, y, z, angle = (rng.uniform(-0.5, 0.5, 4) * (side_m, side_m, side_m, tau)).tolist()
        turned = turn((0.0, 0.0, 1.0), angle)
        shapes.append(Shape(kinds[number % len(kinds)], "walls", GREY, (x, y, z), turned, name=f"shape{number}"))
    return shapes


def _most_near(starts: Floats, directions: Floats) -> int:
    """Return the most shapes that are near the way of one of the rays of the first figure."""
    along = np.linspace(0.0, NEAR_RANGE_M, 9)
    spots = (starts[:, None, :] + along[:, None] * directions[:, None, :]).reshape(-1, 3)
    counts = np.zeros(len(starts), np.int64)
    for shape in crowd(NEAR_SIDE_M):
        counts += (_world_of(shape).clearance(spots, NEAR_M) <= NEAR_M).reshape(len(starts), -1).any(axis=1)
    return int(counts.max())


def _cast_us(world: Placement, starts: Floats, directions: Floats, range_m: float) -> float:
    """Return the median of the processor times of casting all rays (us)."""
    spent = []
    for _ in range(CASTS):
        begun = time.process_time()
        world.cast(starts, directions, range_m)
        spent.append(time.process_time() - begun)
    return 1e6 * median(spent)


def _each(sight: Sight, pairs: list[Pair]) -> None:
    for a, b, names in pairs:
        sight.between(a, b, names)


def _spent(work: Callable[[Sight, list[Pair]], object], sight: Sight, pairs: list[Pair]) -> float:
    """Return the processor time of asking (s): the machine may have other work."""
    begun = time.process_time()
    work(sight, pairs)
    return time.process_time() - begun


def lines(found: Rays) -> list[str]:
    """Return the figures for people."""
    return [
        f"{SHELVES} shelves, {VEHICLES} vehicles, {PAIRS} pairs a tick, {found.crossings:.1f} crossings each",
        f"pair by pair {found.one_by_one_us:.1f} us (to stay below {LIMIT_US:.0f})",
        f"of it for placing the vehicles {found.placing_us:.1f} us",
        f"between fixed antennas {found.fixed_us:.1f} us",
        f"again in the same tick {found.again_us:.2f} us (to stay below {LIMIT_AGAIN_US:.0f})",
        f"rays of sensors, at most {found.near} of {SHAPES} shapes near: {found.near_per_b:.0f} in b"
        f" (at least {PER_B_NEAR:.0f})",
        f"through {SHAPES} shapes: {found.anywhere_per_b:.0f} in b in fans of {FAN},"
        f" {found.single_per_b:.0f} each from a"
        f" place of its own (at least {PER_B_ANYWHERE:.0f})",
    ]
