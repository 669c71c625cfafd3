"""Rest: an island whose bodies have not moved for long is copied, not solved.

A hundred boxes that lie still would cost as much as a hundred that fall. A frame has the pose that each body had when
it moved last (`still_pose`), and how many ticks it has stayed there (`still_ticks`): so rest is the same in all nodes,
and after a restart. A speed would not do: a ball at its highest point is slow, and so is a pole just past its balance.
An island is solved while one of its bodies has not been still for long enough, is commanded, or has a mover in its way
that moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.world.component_types.descriptions import POSE, STILL_POSE, STILL_TICKS
from foosim.world.components.drives import Drives
from foosim.world.edits import Edit, Remove, Set
from foosim.world.frame import Frame
from foosim.world.layout import WORLD, Entity, Layout
from foosim.world.scene import conjugate, multiply
from foosim.world.spec import WorldSpec

STILL_M: Final = 50e-6
STILL_RAD: Final = 50e-6
"""A body that stays within these of a pose is still. In the time of rest a box creeps by 22 um down a slope of 15
degrees; a ball on one of 0.05 degrees rolls by 760 um, a pole that is 2 mrad past its balance turns by 3 mrad."""
MAY_CHANGE: Final = frozenset((STILL_TICKS, STILL_POSE, "refused", "clamped"))
"""Fields of a body at rest that may change."""
REST_NS: Final = 500_000_000
"""The time for which all bodies of an island are still before they are at rest."""


class Rest:
    """The bodies at rest of a layout."""

    def __init__(self, spec: WorldSpec, layout: Layout) -> None:
        self.ticks = -(-REST_NS // spec.tick_ns)
        self._slots = {entity.index: entity.offsets[STILL_TICKS] for entity in layout.resting}

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

    def wake(self, bodies: Sequence[Entity], numbers: list[float]) -> None:
        """Begin to count anew for bodies with a new grasp."""
        for entity in bodies:
            at = self._slots.get(entity.index)
            if at is not None:
                numbers[at] = 0.0

    def keep(self, bodies: Sequence[Entity], numbers: list[float]) -> None:
        """Keep bodies at rest as they are, without new contacts."""
        for entity in bodies:
            at = entity.offsets["contacts"]
            numbers[at : at + 2] = 0.0, 0.0

    def count(self, bodies: Sequence[Entity], drives: Sequence[Drives], numbers: list[float]) -> None:
        """Count the ticks for which bodies are still after a tick, and stop bodies that come to rest with it."""
        for entity, commands in zip(bodies, drives, strict=True):
            at = self._slots.get(entity.index)
            if at is None:
                continue
            if commands.is_moving or not is_still(entity, numbers):
                numbers[at] = 0.0
                kept = entity.offsets[STILL_POSE]
                numbers[kept : kept + entity.counts[STILL_POSE]] = _pose(entity, numbers)
                continue
            numbers[at] += 1.0
            if numbers[at] == self.ticks:
                stop(entity, numbers)


def wake_edited(before: Frame, numbers: list[float], edits: Sequence[Edit]) -> None:
    """Begin to count anew for each body that an order or a rule of the world has changed; for all where an order moves
    or removes an entity, since they may have leaned on it, or sets a field of the world, as wind."""
    old = before.numbers
    if any(
        isinstance(edit, Remove) or (isinstance(edit, Set) and (edit.field == "position" or edit.name == WORLD))
        for edit in edits
    ):
        for entity in before.layout.resting:
            numbers[entity.offsets[STILL_TICKS]] = 0.0
    for entity in before.layout.resting:
        at, first, last = entity.offsets[STILL_TICKS], entity.start, entity.stop
        if numbers[at] == 0.0 or numbers[first:last] == old[first:last]:
            continue
        for field in entity.fields:
            here, count = entity.offsets[field], entity.counts[field]
            if field not in MAY_CHANGE and numbers[here : here + count] != old[here : here + count]:
                numbers[at] = 0.0


def _pose(entity: Entity, numbers: Sequence[float]) -> list[float]:
    """Return the numbers of `still_pose`: position, orientation and positions of joints, where the body has these."""
    offsets = entity.offsets
    found: list[float] = []
    for field in POSE:
        at = offsets.get(field)
        if at is not None:
            found += numbers[at : at + entity.counts[field]]
    return found


def is_still(entity: Entity, numbers: Sequence[float]) -> bool:
    """Whether a body is at its `still_pose`."""
    at = entity.offsets[STILL_POSE]
    kept, pose = numbers[at : at + entity.counts[STILL_POSE]], _pose(entity, numbers)
    joints = 0
    if "position" in entity.offsets:
        joints = 7
        a, b, c, x, y, z, w = pose[:7]
        away = (a - kept[0]) * (a - kept[0]) + (b - kept[1]) * (b - kept[1]) + (c - kept[2]) * (c - kept[2])
        u, v, t, _ = multiply(conjugate((kept[3], kept[4], kept[5], kept[6])), (x, y, z, w))
        if away > STILL_M * STILL_M or 4.0 * (u * u + v * v + t * t) > STILL_RAD * STILL_RAD:
            return False
    return all(abs(a - b) <= STILL_RAD for a, b in zip(kept[joints:], pose[joints:], strict=True))


def stop(entity: Entity, numbers: list[float]) -> None:
    """Set the velocities of a body to 0."""
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
