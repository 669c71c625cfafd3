"""Checks that robots which move by kinematics start outside of scenery, and of one another.

A kit checks those of its own models. This takes geometry, so it is done when all single fields are valid.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from foosim.common.finding import Finding
from foosim.world.components.entities import made_model
from foosim.world.components.view import WritableView
from foosim.world.layout import Entity, Layout, build_layout
from foosim.world.moving.solids import Standing, distance, pairs_near, scenery_of, solid
from foosim.world.moving.upright import Upright, stands_upright, upright_of
from foosim.world.spec import WorldSpec

PLACED_BY = ("at", "path")
"""Settings with the start of a robot."""


def start_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield the robots that start in scenery or in another robot. Meshes count once their files are there."""
    names = [name for name, robot in spec.robots.items() if stands_upright(robot)]
    if not names:
        return
    layout = build_layout(spec)
    placed = [_placed(spec, layout, layout[name]) for name in names]
    places = np.array([place for place, _ in placed])
    radius, low, high = np.array([(its.radius, its.low, its.high) for _, its in placed]).T
    bottom, top = places[:, 2] + low, places[:, 2] + high
    found: dict[int, str] = {}
    shapes = list(scenery_of(spec))
    standing = Standing([solid(shape) for shape in shapes], float(np.max(radius)))
    rows, what = standing.near(places[:, 0], places[:, 1])
    solids = standing.solids.at(what)
    depth = distance(*solids.beside(places[rows, 0], places[rows, 1]))
    is_in = (depth < radius[rows] + solids.radius) & (solids.low < top[rows]) & (solids.high > bottom[rows])
    for row, number in zip(rows[is_in].tolist(), what[is_in].tolist(), strict=True):
        found.setdefault(row, f"the {shapes[number].name or 'scenery'}")
    one, other = pairs_near(places, places, 2.0 * float(np.max(radius)))
    dx, dy = places[other, 0] - places[one, 0], places[other, 1] - places[one, 1]
    least = radius[one] + radius[other]
    overlap = (dx * dx + dy * dy < least * least) & (bottom[one] < top[other]) & (bottom[other] < top[one])
    for row, earlier in zip(one[overlap].tolist(), other[overlap].tolist(), strict=True):
        if earlier < row:
            found.setdefault(row, f"the robot {names[earlier]}")
    for row, met in sorted(found.items()):
        x, y, z = placed[row][0]
        key = next((key for key in PLACED_BY if key in type(spec.robots[names[row]]).model_fields), "model")
        yield Finding(("robots", names[row], key), f"the robot starts in {met}", f"{x:g} m, {y:g} m, {z:g} m")


def _placed(spec: WorldSpec, layout: Layout, entity: Entity) -> tuple[tuple[float, float, float], Upright]:
    """Return the start of an entity (m), and its cylinder."""
    model, numbers = made_model(spec, layout, entity), [0.0] * layout.size
    model.place(WritableView(0, numbers))
    at = entity.offsets["position"]
    return (numbers[at], numbers[at + 1], numbers[at + 2]), upright_of(model)
