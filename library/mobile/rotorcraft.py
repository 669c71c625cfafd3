"""A rotorcraft that flies upright from waypoint to waypoint, moved by kinematics: nothing of its rotors is computed."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Annotated, ClassVar, Final

import numpy as np

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.library.mobile.arcs import Floats, approached, approached_together, shorter, upright_turn, wrapped
from foosim.library.mobile.set_points import set_points_of
from foosim.library.mobile.vehicles import (
    Acceleration,
    Antenna,
    FreeMotion,
    Height,
    Radius,
    Speed,
    TurnRate,
    Vehicle,
    VehicleModel,
)
from foosim.world.component_types.descriptions import BODY
from foosim.world.component_types.registry import model
from foosim.world.components.entities import Motors
from foosim.world.components.view import WritableView
from foosim.world.layout import Entity
from foosim.world.scene import Colour

WHITE: Final[Colour] = (0.90, 0.90, 0.92, 1.0)
Ceiling = Annotated[float, Quantity(units.LENGTH, "1 m", "100 km")]


class RotorcraftRobot(Vehicle):
    """A rotorcraft as a cylinder around its rotors. Its usual actuator is `pilot`, of the kind `waypoint`.

    `speed` is the greatest over the ground, `climb` the greatest upwards and downwards; `acceleration` is the greatest
    of both together, `turn_rate` how fast it turns about the vertical. It takes waypoints up to `ceiling` above z = 0:
    by default 120 m, the limit of the open category (Regulation (EU) 2019/947). The other defaults are those of a
    quadrotor of 1 kg in slow flight.
    """

    height: Height = default("15 cm")
    antenna_height: Antenna = default("10 cm")
    radius: Radius = default("30 cm")
    speed: Speed = default("5 m/s")
    climb: Speed = default("2 m/s")
    acceleration: Acceleration = default("3 m/s2")
    turn_rate: TurnRate = default("90 deg/s")
    ceiling: Ceiling = default("120 m")


NO_GOAL: Final[Motors] = ((0.0, 0.0),) * 4
EACH: Final = 0.7071067811865476
"""Which share of the acceleration each of both takes, over the ground and in height: together they have all of it."""
ARRIVED_M: Final = 1e-6
"""A rotorcraft that is nearer to its waypoint is there: far above rounding."""


class RotorcraftMotion(FreeMotion):
    """To a waypoint, within limits of speed, climb and acceleration, as far as nothing is in the way.

    Over the ground and in height the speed that is wanted is the greatest from which a body that moves in steps of dt
    still stops at its goal, with a deceleration a. In m steps, each slower than the one before it by a dt, it covers d
    = m v dt - a dt^2 m (m - 1) / 2; the last one is no faster than a dt where m is the least whole number of at
    least (sqrt(1 + 8 d / (a dt^2)) - 1) / 2. So v = d / (m dt) + a dt (m - 1) / 2.

    The velocity over the ground and that in height approach the wanted ones by at most a dt each, where a is the
    acceleration over the square root of 2: one is never kept from braking by the other. The heading turns the shorter
    way, at most so fast. A rotorcraft that is stopped by an obstacle (`moving.free_way`) has the velocity of the way
    that was left to it.
    """

    fields: ClassVar = (*BODY, "heading", "arrived", "blocked")

    def take(self, entities: Sequence[Entity]) -> None:
        """Keep their accelerations."""
        super().take(entities)
        robots = [self.at.spec.robots[entity.name] for entity in entities]
        self._acceleration = np.array([its.acceleration for its in robots if isinstance(its, RotorcraftRobot)])
        assert len(self._acceleration) == len(robots), "the motion rotorcraft moves rotorcraft"

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: WritableView) -> None:
        """Advance these rotorcraft by a tick.

        Motors are four: x, y and z (m) and the heading (rad) to come to, each with the greatest speed there; none of
        one without a waypoint, which brakes.
        """
        dt, count = self.dt, len(entities)
        state, near = self.start(entities, view)
        place, velocity, heading = state[:, 0:3].copy(), state[:, 7:10].copy(), state[:, 13].copy()
        set_points = set_points_of(motors, NO_GOAL)
        has_goal = np.array([bool(its) for its in motors])
        goal, most = np.where(has_goal[:, None], set_points[:, :3, 0], place), set_points[:, :, 1]
        yaw = np.where(has_goal, set_points[:, 3, 0], heading)
        is_stopped = np.zeros(count, bool)
        for _ in range(self.substeps):
            wanted = np.where(has_goal[:, None], self._wanted(goal - place, most), 0.0)
            step = self._acceleration * (EACH * dt)
            velocity[:, 0:2] = approached_together(velocity[:, 0:2], wanted[:, 0:2], step)
            velocity[:, 2] = approached(velocity[:, 2], wanted[:, 2], step)
            place, shares, stops = near.free_way(place, velocity * dt)
            velocity = velocity * shares[:, None]
            is_stopped |= stops
            turned = np.minimum(np.maximum(shorter(yaw - heading), -most[:, 3] * dt), most[:, 3] * dt)
            heading = wrapped(heading + turned)
        z, w = upright_turn(heading)
        after = np.zeros((count, self.state.width))
        after[:, 0:3], after[:, 5], after[:, 6], after[:, 7:10] = place, z, w, velocity
        after[:, 12], after[:, 13], after[:, 15] = turned / dt, heading, is_stopped
        after[:, 14] = has_goal & (_length(goal - place) <= ARRIVED_M) & (np.abs(shorter(yaw - heading)) <= ARRIVED_M)
        self.state.write(view, after)

    def _wanted(self, way: Floats, most: Floats) -> Floats:
        """Return the wanted velocities for the ways that are left (m)."""
        level = _length(way[:, 0:2])
        along = np.where(level > 0.0, level, 1.0)
        share = self._fastest(level, most[:, 0]) / along
        climb = self._fastest(np.abs(way[:, 2]), most[:, 2])
        wanted = np.empty_like(way)
        wanted[:, 0], wanted[:, 1] = way[:, 0] * share, way[:, 1] * share
        wanted[:, 2] = np.where(way[:, 2] < 0.0, -climb, climb)
        return wanted

    def _fastest(self, way: Floats, most: Floats) -> Floats:
        """Return the greatest speed that still allows a stop at the end of this way."""
        dt, brake = self.dt, self._acceleration * EACH
        steps = np.maximum(np.ceil((np.sqrt(1.0 + 8.0 * way / (brake * dt * dt)) - 1.0) / 2.0), 1.0)
        found: Floats = np.minimum(way / (steps * dt) + brake * dt * (steps - 1.0) / 2.0, most)
        return found


def _length(vectors: Floats) -> Floats:
    """Return the lengths of vectors of shape (n, axes)."""
    square = vectors[:, 0] * vectors[:, 0]
    for axis in range(1, vectors.shape[1]):
        square = square + vectors[:, axis] * vectors[:, axis]
    found: Floats = np.sqrt(square)
    return found


@model(
    "rotorcraft",
    RotorcraftRobot,
    slots={**BODY, "heading": 1, "arrived": 1, "blocked": 1},
    motion=RotorcraftMotion,
    actuators={"pilot": {"kind": "waypoint"}},
    units={"heading": ("rad",)},
)
class Rotorcraft(VehicleModel):
    """A rotorcraft that stays upright.

    `arrived` is 1 while it hovers at its waypoint, `blocked` whether an obstacle stopped it in the tick.
    """

    colour: ClassVar = WHITE

    @property
    def fastest(self) -> float:
        """The greatest speed over ground and upwards together (m/s)."""
        speed, climb = self.settings.speed, self.settings.climb
        return sqrt(speed * speed + climb * climb)
