"""Robots on two driven wheels, moved by kinematics.

A wheel approaches the target speed with at most the drive's acceleration and rolls a little less far than it turns.
From the speeds l and r of the wheels on the ground, v = (l + r) / 2 and w = (r - l) / track, a robot goes along an arc
(`moving.arcs`), as far as nothing is in the way (`clearance.free_way`). It turns on the spot where all is blocked, with
its wheels slipping.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from foosim.world.clearance.free_way import FreeWay
from foosim.world.components.entities import MotionMounting, Motors
from foosim.world.components.view import SolvingView
from foosim.world.forms.registry import motion
from foosim.world.layout import Entity
from foosim.world.moving.arcs import Arcs, Floats, along_arcs, approached
from foosim.world.moving.asked import asked_of
from foosim.world.moving.columns import EntityColumns
from foosim.world.moving.wheels import Wheels, wheels_of

STATE: Final = (
    "position",
    "orientation",
    "linear_velocity",
    "angular_velocity",
    "heading",
    "wheel_speeds",
    "wheel_travel",
    "blocked",
)
"""The fields that this motion writes."""
STANDING: Final[Motors] = ((0.0, 0.0), (0.0, 0.0))


class _Batch:
    """Robots that one node moves in a tick."""

    def __init__(
        self, way: FreeWay, state: EntityColumns, wheels: Mapping[int, Wheels], entities: Sequence[Entity]
    ) -> None:
        """`wheels` are by the entities' indices."""
        self.entities = list(entities)
        self.state = state.of(entities)
        self.movers = way.movers(entities, is_level=True)
        its = [wheels[entity.index] for entity in entities]
        self.track = np.array([one.track for one in its])
        self.rolls = np.array([[1.0 - one.slips[0], 1.0 - one.slips[1]] for one in its])


@motion("differential_drive", needs=STATE, writes=STATE)
class DifferentialDrive:
    """Along arcs, as far as nothing is in the way."""

    takes_arrays: Final = True

    def __init__(self, at: MotionMounting) -> None:
        self._dt = at.spec.tick_ns / 1e9 / at.spec.substeps
        self._substeps = at.spec.substeps
        self._way = FreeWay(at)
        self._state = EntityColumns(at, STATE)
        self._wheels = {entity.index: wheels_of(at.spec, at.layout, entity) for entity in at.entities}
        self._batch = self._batch_of(at.entities)

    def _batch_of(self, entities: Sequence[Entity]) -> _Batch:
        return _Batch(self._way, self._state, self._wheels, entities)

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors] | Floats, view: SolvingView) -> None:
        """Advance these robots by a tick; of each wheel the target speed (m/s) and greatest acceleration (m/s2)."""
        if self._batch.entities != entities:
            self._batch = self._batch_of(entities)
        batch, dt, count = self._batch, self._dt, len(entities)
        state = batch.state.read_at_start(view)
        place, heading = state[:, 0:3].copy(), state[:, 13].copy()
        speeds, travel = state[:, 14:16].copy(), state[:, 16:18].copy()
        asked = asked_of(motors, STANDING)
        targets, rates = asked[:, :, 0], asked[:, :, 1]
        near = self._way.near(batch.movers, view)
        is_stopped = np.zeros(count, bool)
        for _ in range(self._substeps):
            speeds = approached(speeds, targets, rates * dt)
            travel = travel + speeds * dt
            ground = speeds * batch.rolls
            ahead, turned = (ground[:, 0] + ground[:, 1]) / 2.0, (ground[:, 1] - ground[:, 0]) / batch.track * dt
            ways = np.zeros((count, 3))
            arcs = along_arcs(ahead * dt, 0.0, turned, heading)
            ways[:, 0], ways[:, 1], heading = arcs.x, arcs.y, arcs.heading
            place, shares, stops = near.free_way(place, ways)
            is_stopped |= stops
        _write(batch, view, place, arcs, ahead * shares, turned / dt, (speeds, travel, is_stopped))


def _write(
    batch: _Batch,
    view: SolvingView,
    place: Floats,
    arcs: Arcs,
    ahead: Floats,
    turn_rate: Floats,
    rest: tuple[Floats, Floats, Floats],
) -> None:
    state = np.zeros((len(place), batch.state.width))
    z, w = arcs.turn_z, arcs.turn_w
    state[:, 0:3], state[:, 5], state[:, 6] = place, z, w
    state[:, 7], state[:, 8] = ahead * (1.0 - 2.0 * z * z), ahead * (2.0 * z * w)
    state[:, 12], state[:, 13] = turn_rate, arcs.heading
    state[:, 14:16], state[:, 16:18], state[:, 18] = rest
    batch.state.write(view, state)
