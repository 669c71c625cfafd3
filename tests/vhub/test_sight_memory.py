"""Lines of sight of what moves: what is remembered of the scenery between places overlooks nothing."""

from __future__ import annotations

import random
from math import dist
from typing import Final

import pytest

from foosim.vhub.line_of_sight import occlusion
from foosim.vhub.line_of_sight.occlusion import Geometry
from foosim.world.layout import Declared, Layout
from foosim.world.rays.solids import TOUCH_M
from foosim.world.rays.spans import box_span
from foosim.world.scene import Box, Scene, Shape, Vector

GREY: Final = (0.5, 0.5, 0.5, 1.0)
HALF: Final = (0.12, 0.08, 0.16)
LITTER: Final = 150
DRIVES: Final = 30
STEPS: Final = 15


def at_random(rng: random.Random, reach: float) -> Vector:
    return rng.uniform(-reach, reach), rng.uniform(-reach, reach), rng.uniform(-reach, reach)


def crossed(boxes: dict[str, Vector], start: Vector, end: Vector) -> set[str]:
    """Every box, one by one."""
    length = dist(start, end)
    unit = ((end[0] - start[0]) / length, (end[1] - start[1]) / length, (end[2] - start[2]) / length)
    found = set()
    for name, (x, y, z) in boxes.items():
        span = box_span((start[0] - x, start[1] - y, start[2] - z), unit, HALF)
        if span is not None and min(span[1], length) - max(span[0], 0.0) > TOUCH_M:
            found.add(name)
    return found


def test_lines_that_drive_through_litter_cross_what_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their ends stay in a cell or go from cell to cell, on both sides of the origin; little is remembered."""
    rng = random.Random(26)
    monkeypatch.setattr(occlusion, "PAIRS_KEPT", 50)
    boxes = {f"box{n}": at_random(rng, 1.5) for n in range(LITTER)}
    things = tuple(Shape(Box(HALF), "walls", GREY, place, name=name) for name, place in boxes.items())
    sight = Geometry(Scene({}, things)).sight(Layout({}, Declared()), ())
    found = 0
    for _ in range(DRIVES):
        a, b, way = at_random(rng, 1.5), at_random(rng, 1.5), at_random(rng, 0.1)
        for _ in range(STEPS):
            a = a[0] + way[0], a[1] + way[1], a[2] + way[2]
            expected = crossed(boxes, min(a, b), max(a, b))
            assert {crossing.name for crossing in sight.between(a, b)} == expected
            found += len(expected)
    assert found > 300
