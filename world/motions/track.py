"""Things that go along paths in time: place and heading are a function of a clock, which runs while nothing stops them.

The clock of a path is a slot. Where an obstacle is in the way (`clearance.free_way`) it runs less, by halves, and so
the thing waits on its path.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from foosim.world.clearance.free_way import FreeWay
from foosim.world.components.entities import MotionMounting, Motors
from foosim.world.components.view import SolvingView
from foosim.world.forms.registry import motion
from foosim.world.layout import Entity
from foosim.world.models.mover import MoverRobot
from foosim.world.moving.arcs import Floats, shorter, upright_turn
from foosim.world.moving.columns import EntityColumns

STATE: Final = ("position", "orientation", "linear_velocity", "angular_velocity", "heading", "blocked")
"""The fields that this motion writes."""


class _Batch:
    """Things that one node moves in a tick."""

    def __init__(
        self, at: MotionMounting, way: FreeWay, state: EntityColumns, clock: EntityColumns, entities: Sequence[Entity]
    ) -> None:
        self.entities = list(entities)
        self.state = state.of(entities)
        self.clock = clock.of(entities)
        self.movers = way.movers(entities)
        robots = [at.spec.robots[entity.name] for entity in entities]
        self.paths = [its.as_path() for its in robots if isinstance(its, MoverRobot)]
        assert len(self.paths) == len(robots), "the motion track moves what has a path"


@motion("track", needs=STATE, writes=STATE, slots={"clock": 1})
class Track:
    """Along a path in time, and waiting while something is in the way; `clock` is the time on the path (s)."""

    def __init__(self, at: MotionMounting) -> None:
        self._at = at
        self._tick_s = at.spec.tick_ns / 1e9
        self._way = FreeWay(at)
        self._state = EntityColumns(at, STATE)
        self._clock = EntityColumns(at, ("clock",))
        self._batch = _Batch(at, self._way, self._state, self._clock, at.entities)

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: SolvingView) -> None:
        """Advance these things by a tick; they have no motors."""
        if self._batch.entities != entities:
            self._batch = _Batch(self._at, self._way, self._state, self._clock, entities)
        batch, tick_s = self._batch, self._tick_s
        state, clocks = batch.state.read_at_start(view), batch.clock.read_at_start(view)[:, 0].tolist()

        def poses(shares: Floats) -> Floats:
            each = zip(batch.paths, clocks, shares.tolist(), strict=True)
            return np.array([path.at(path.after(clock, tick_s * share)) for path, clock, share in each])

        start, full = state[:, 0:3], poses(np.ones(len(entities)))
        near = self._way.near(batch.movers, view)
        moves = (full[:, 0:3] != start).any(axis=1)
        shares, is_stopped = near.free_share(start, lambda shares: poses(shares)[:, 0:3], moves)
        after = poses(shares) if is_stopped.any() else full
        z, w = upright_turn(after[:, 3])
        new = np.zeros_like(state)
        new[:, 0:3], new[:, 5], new[:, 6], new[:, 13] = after[:, 0:3], z, w, shorter(after[:, 3])
        new[:, 7:10], new[:, 12] = (after[:, 0:3] - start) / tick_s, shorter(after[:, 3] - state[:, 13]) / tick_s
        new[:, 14] = is_stopped
        batch.state.write(view, new)
        each = zip(batch.paths, clocks, shares.tolist(), strict=True)
        batch.clock.write(view, np.array([[path.after(clock, tick_s * share)] for path, clock, share in each]))
