"""Occupied places: the thing at the place to which an entity is put during a run."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from foosim.world.assembly.world import models_of
from foosim.world.clearance.overlaps import overlapped
from foosim.world.component_types.descriptions import overrides
from foosim.world.layout import Entity, Layout
from foosim.world.moving.solids import distance, scenery_of, solid, solids
from foosim.world.moving.upright import Upright, upright_of
from foosim.world.spec import WorldSpec


def occupied_by(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity) -> str:
    """Return the thing that an entity overlaps in the numbers of a frame, scenery or an entity; empty without one.

    Rigid bodies are compared by their shapes, entities that move by kinematics by their cylinders.
    """
    found = overlapped(spec, layout, numbers, entity) if layout.couples or entity.is_rigid else ""
    return found or _met_upright(spec, layout, numbers, entity)


def _met_upright(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity) -> str:
    made = layout.shared("uprights", spec, partial(_Uprights, spec, layout))
    its = made.uprights.get(entity.index)
    if its is None:
        return ""
    x, y, z = _place(entity, numbers)
    shapes, rows = made.shapes, made.rows
    is_in = distance(*rows.beside(np.array([x]), np.array([y]))) < its.radius + rows.radius
    is_in &= (rows.low < z + its.high) & (rows.high > z + its.low)
    for shape, met in zip(shapes, is_in.tolist(), strict=True):
        if met:
            return f"the {shape.name or 'scenery'}"
    for index, other in made.uprights.items():
        if index == entity.index:
            continue
        there_x, there_y, there_z = _place(layout.entities[index], numbers)
        dx, dy, least = there_x - x, there_y - y, its.radius + other.radius
        is_level = z + its.low < there_z + other.high and there_z + other.low < z + its.high
        if dx * dx + dy * dy < least * least and is_level:
            return layout.entities[index].name
    return ""


class _Uprights:
    """The entities of a layout that move by kinematics, by index, and the scenery."""

    def __init__(self, spec: WorldSpec, layout: Layout) -> None:
        self.uprights: dict[int, Upright] = {
            index: upright_of(model)
            for index, model in models_of(spec, layout).items()
            if overrides(type(model), "upright") and "position" in layout.entities[index].offsets
        }
        self.shapes = list(scenery_of(spec))
        self.rows = solids([solid(shape) for shape in self.shapes])


def _place(entity: Entity, numbers: Sequence[float]) -> Sequence[float]:
    at = entity.offsets["position"]
    return numbers[at : at + 3]
