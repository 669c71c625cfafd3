"""Rest: an island whose bodies have all been slow for long is copied, not solved.

A hundred boxes that lie still would cost as much as a hundred that fall. Whether a body is at rest follows from its
slot `slow_ticks`, so it is the same in all nodes, and after a restart. An island is solved while one of its bodies is
not slow for long enough, is commanded, or has a mover in its way that moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.world.components.drives import Drives
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout
from foosim.world.spec import WorldSpec

SLOW_M_S: Final = 0.01
SLOW_RAD_S: Final = 0.05
"""Below these speeds a body is slow. A box that a substep's gravity lets settle is slower; one that begins to tip over
is faster within the time of rest."""
MAY_CHANGE: Final = frozenset(("slow_ticks", "partners", "refused", "clamped"))
"""Fields of a body at rest that may change: references follow their entities into another layout."""
REST_NS: Final = 500_000_000
"""How long all bodies of an island are slow before they are at rest."""


class Rest:
    """Which bodies of a layout are at rest."""

    def __init__(self, spec: WorldSpec, layout: Layout) -> None:
        self.ticks = -(-REST_NS // spec.tick_ns)
        self._slots = {entity.index: entity.offsets["slow_ticks"] for entity in layout.resting}

    def may_rest(
        self, bodies: Sequence[Entity], movers: Sequence[Entity], numbers: Sequence[float], start: Sequence[float]
    ) -> bool:
        """Whether an island is copied unless it is driven: `start` are the numbers at the start of the tick."""
        slots, ticks = self._slots, self.ticks
        for entity in bodies:
            at = slots.get(entity.index)
            if at is None or numbers[at] < ticks:
                return False
        return not movers or not any(moves(mover, start) for mover in movers)

    def keep(self, bodies: Sequence[Entity], numbers: list[float]) -> None:
        """Leave bodies at rest as they are; what they touch they have touched before."""
        for entity in bodies:
            at = entity.offsets["contacts"]
            numbers[at : at + 2] = 0.0, 0.0

    def count(self, bodies: Sequence[Entity], drives: Sequence[Drives], numbers: list[float]) -> None:
        """Count the ticks for which bodies are slow after a tick, and stop those that come to rest with it."""
        for entity, asked in zip(bodies, drives, strict=True):
            at = self._slots.get(entity.index)
            if at is None:
                continue
            if asked.is_moving or not is_slow(entity, numbers):
                numbers[at] = 0.0
                continue
            numbers[at] += 1.0
            if numbers[at] == self.ticks:
                _stop(entity, numbers)


def wake_edited(before: Frame, layout: Layout, numbers: list[float]) -> None:
    """Begin to count anew for each body that an order or a rule of the world has changed."""
    old = before.numbers
    for entity in layout.resting:
        at = entity.offsets["slow_ticks"]
        if numbers[at] == 0.0 or entity.name not in before.layout:
            continue
        was = before.layout[entity.name]
        for field in entity.fields:
            here, there, count = entity.offsets[field], was.offsets[field], entity.counts[field]
            if field not in MAY_CHANGE and numbers[here : here + count] != old[there : there + count]:
                numbers[at] = 0.0


def is_slow(entity: Entity, numbers: Sequence[float]) -> bool:
    """Whether no part of a body moves faster than what counts as slow."""
    offsets = entity.offsets
    if "linear_velocity" in offsets:
        at, spin = offsets["linear_velocity"], offsets["angular_velocity"]
        x, y, z = numbers[at : at + 3]
        a, b, c = numbers[spin : spin + 3]
        if x * x + y * y + z * z > SLOW_M_S * SLOW_M_S or a * a + b * b + c * c > SLOW_RAD_S * SLOW_RAD_S:
            return False
    at = offsets.get("joint_velocities", -1)
    if at < 0:
        return True
    return all(abs(speed) <= SLOW_RAD_S for speed in numbers[at : at + entity.counts["joint_velocities"]])


def _stop(entity: Entity, numbers: list[float]) -> None:
    for field in ("linear_velocity", "angular_velocity", "joint_velocities"):
        at = entity.offsets.get(field)
        if at is not None:
            count = entity.counts[field]
            numbers[at : at + count] = [0.0] * count


def moves(entity: Entity, numbers: Sequence[float]) -> bool:
    """Whether a part of a body has a speed."""
    for field in ("linear_velocity", "angular_velocity", "joint_velocities", "wheel_speeds"):
        at = entity.offsets.get(field)
        if at is not None and any(numbers[at : at + entity.counts[field]]):
            return True
    return False
