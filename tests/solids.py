"""Rigid bodies without a deployment: a few bodies as entities of a frame, solved by an engine of their composition."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.node.physics.floors import as_plane
from foosim.node.physics.interface import Island
from foosim.node.physics.mujoco_islands import CompositionEngine
from foosim.world.component_types.descriptions import BODY, CONTACTS, JOINTS, NO_ENTITY, PARTNERS, PARTNERS_MAX, Model
from foosim.world.component_types.settings import EntitySettings
from foosim.world.components.drives import NO_DRIVES, Drives
from foosim.world.layout import Entity
from foosim.world.matter.physics import Contact, Physics, Side
from foosim.world.scene import ORIGIN, UPRIGHT, Body, Box, Geometry, Link, Quaternion, Shape, Sphere, Vector

TICK_S: Final = 0.01
SUBSTEPS: Final = 4
GRAVITY: Final = 9.81
WHITE: Final = (1.0, 1.0, 1.0, 1.0)
FLOOR: Final = as_plane(Shape(Box((50.0, 50.0, 0.5)), "floor", WHITE, (0.0, 0.0, -0.5)))


def physics(gravity: float = GRAVITY, erp: float = 0.05, **sides: Side) -> Physics:
    """What bodies feel: friction 0.5 and no restitution between any two, unless sides say otherwise."""
    plain = Side(0.0, 0.5**0.5)
    return Physics(gravity, {}, Contact(0.0, 0.0), 200, erp, {"default": plain, "floor": plain, **sides})


def shape(geometry: Geometry, surface: str = "default", **placed: Vector | Quaternion) -> Shape:
    """A shape of a link."""
    return Shape(geometry, surface, WHITE, **placed)  # type: ignore[arg-type]


def box(name: str, half: Vector, mass: float, speed_limit: float = 10.0, surface: str = "default") -> Body:
    """A free box of uniform density."""
    x, y, z = ((2 * side) ** 2 for side in half)
    inertia = mass * (y + z) / 12, mass * (x + z) / 12, mass * (x + y) / 12
    link = Link(name, "free", (shape(Box(half), surface),), mass, inertia)
    return Body(name, "box", ORIGIN, (link,), speed_limit=speed_limit)


def ball(name: str, radius: float, mass: float, surface: str = "default") -> Body:
    """A free sphere of uniform density."""
    inertia = 0.4 * mass * radius * radius
    link = Link(name, "free", (shape(Sphere(radius), surface),), mass, (inertia,) * 3)
    return Body(name, "sphere", ORIGIN, (link,), speed_limit=10.0)


class Solids:
    """Bodies in name order, as the entities of a frame whose numbers are here."""

    def __init__(
        self,
        bodies: Sequence[Body],
        feel: Physics | None = None,
        scenery: Sequence[Shape] = (FLOOR,),
        substeps: int = SUBSTEPS,
        tick_s: float = TICK_S,
    ) -> None:
        self.feel = physics() if feel is None else feel
        self.scenery, self.substeps, self.tick_s = tuple(scenery), substeps, tick_s
        self.bodies = sorted(bodies, key=lambda body: body.name)
        self.numbers: list[float] = []
        self.entities = [self._entity(index, body) for index, body in enumerate(self.bodies)]
        self.drives: dict[str, Drives] = {}
        self.engine = self.make(self.bodies)

    def _entity(self, index: int, body: Body) -> Entity:
        slots: dict[str, int] = dict(BODY) if body.is_free else {}
        if body.joints:
            slots |= dict.fromkeys(JOINTS, len(body.joints))
        slots |= {**CONTACTS, **PARTNERS}
        kind = Model(
            type_name="model", name=body.model, factory=object, settings=EntitySettings, slots=slots, is_rigid=True
        )
        offsets, at = {}, len(self.numbers)
        for field, count in slots.items():
            offsets[field] = at
            at += count
        entity = Entity(index, body.name, kind, len(self.numbers), at, at, offsets, slots, slots)
        self.numbers += [0.0] * (at - len(self.numbers))
        self.numbers[offsets["contacts"] + 2] = -1.0
        self.numbers[offsets["partners"] : offsets["partners"] + PARTNERS_MAX] = [NO_ENTITY] * PARTNERS_MAX
        if body.is_free:
            self.numbers[offsets["orientation"] + 3] = 1.0
        return entity

    def make(self, bodies: Sequence[Body], movers: Sequence[Body] = ()) -> CompositionEngine:
        """An engine of some bodies."""
        step_s = self.tick_s / self.substeps
        return CompositionEngine(self.feel, step_s, self.substeps, self.scenery, bodies, movers)

    def __getitem__(self, name: str) -> Entity:
        return next(entity for entity in self.entities if entity.name == name)

    def put(
        self,
        name: str,
        position: Vector,
        orientation: Quaternion = UPRIGHT,
        velocity: Vector = ORIGIN,
        spin: Vector = ORIGIN,
    ) -> None:
        """Set a free body."""
        offsets = self[name].offsets
        for field, values in (
            ("position", position),
            ("orientation", orientation),
            ("linear_velocity", velocity),
            ("angular_velocity", spin),
        ):
            self.numbers[offsets[field] : offsets[field] + len(values)] = values

    def get(self, name: str, field: str) -> list[float]:
        entity = self[name]
        at = entity.offsets[field]
        return self.numbers[at : at + entity.counts[field]]

    def set(self, name: str, field: str, *values: float) -> None:
        at = self[name].offsets[field]
        self.numbers[at : at + len(values)] = values

    def solve(self, engine: CompositionEngine, members: Sequence[Entity], numbers: list[float]) -> None:
        """Solve an island of these entities."""
        island = Island(tuple(members), (), tuple(self.drives.get(one.name, NO_DRIVES) for one in members))
        seats = engine.seats_of(island, [self.bodies[one.index] for one in members])
        engine.solve(seats, island.drives, numbers, numbers)

    def push(self, engine: CompositionEngine) -> None:
        """Solve the first body with the second one as a mover in its way."""
        island = Island((self.entities[0],), (self.entities[1],), (NO_DRIVES,))
        engine.solve(engine.seats_of(island, self.bodies), island.drives, self.numbers, self.numbers)

    def run(self, ticks: int) -> None:
        """Solve all as one island for some ticks."""
        for _ in range(ticks):
            self.solve(self.engine, self.entities, self.numbers)

    def close(self) -> None:
        self.engine.close()
