"""A round base that moves in any direction, as on omnidirectional wheels, moved by kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Final

import numpy as np

from foosim.common.spec_base import default
from foosim.library.mobile.arcs import along_arcs, approached, approached_together
from foosim.library.mobile.set_points import set_points_of
from foosim.library.mobile.vehicles import Acceleration, FreeMotion, Speed, TurnRate, Vehicle, VehicleModel
from foosim.world.component_types.descriptions import BODY
from foosim.world.component_types.registry import model
from foosim.world.components.entities import Motors
from foosim.world.components.view import WritableView
from foosim.world.layout import Entity
from foosim.world.scene import Colour

TEAL: Final[Colour] = (0.10, 0.55, 0.55, 1.0)


class HolonomicRobot(Vehicle):
    """A round base that moves in any direction. Its usual actuator is `motion`, of the kind `x_y_w`.

    `speed` and `acceleration` are the greatest in any direction, and `turn_rate` is how fast it turns at most; how fast
    it turns changes by at most `acceleration` over `radius`, so that the rim has no more. The sizes are those of usual
    research robots.
    """

    speed: Speed = default("1 m/s")
    acceleration: Acceleration = default("1 m/s2")
    turn_rate: TurnRate = default("180 deg/s")


STANDING: Final[Motors] = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))


class HolonomicMotion(FreeMotion):
    """In any direction, along arcs, as far as nothing is in the way.

    The velocity in the base's own frame approaches its set-point: the vector in the plane with at most one
    acceleration, the turning with another. With it the base moves along an arc (`moving.arcs`), as far as nothing is in
    the way (`moving.free_way`); it turns where it is blocked.
    """

    fields: ClassVar = (*BODY, "heading", "base_velocity", "blocked")
    is_level: ClassVar = True

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: WritableView) -> None:
        """Advance these bases by a tick.

        Motors are three: the speeds ahead and to the left (m/s), and turning left (rad/s), each with the greatest
        acceleration (m/s2, rad/s2); that of the first holds for the vector of the first two.
        """
        dt, count = self.dt, len(entities)
        state, near = self.start(entities, view)
        place, heading, velocity = state[:, 0:3].copy(), state[:, 13].copy(), state[:, 14:17].copy()
        set_points = set_points_of(motors, STANDING)
        targets, rates = set_points[:, :, 0], set_points[:, :, 1]
        is_stopped = np.zeros(count, bool)
        for _ in range(self.substeps):
            velocity[:, 0:2] = approached_together(velocity[:, 0:2], targets[:, 0:2], rates[:, 0] * dt)
            velocity[:, 2] = approached(velocity[:, 2], targets[:, 2], rates[:, 2] * dt)
            turned = velocity[:, 2] * dt
            ways = np.zeros((count, 3))
            arcs = along_arcs(velocity[:, 0] * dt, velocity[:, 1] * dt, turned, heading)
            ways[:, 0], ways[:, 1], heading = arcs.x, arcs.y, arcs.heading
            place, shares, stops = near.free_way(place, ways)
            is_stopped |= stops
        z, w = arcs.turn_z, arcs.turn_w
        s, c = 2.0 * z * w, 1.0 - 2.0 * z * z
        ahead, left = velocity[:, 0] * shares, velocity[:, 1] * shares
        after = np.zeros((count, self.state.width))
        after[:, 0:3], after[:, 5], after[:, 6] = place, z, w
        after[:, 7], after[:, 8] = ahead * c - left * s, ahead * s + left * c
        after[:, 12], after[:, 13], after[:, 14:17], after[:, 17] = velocity[:, 2], heading, velocity, is_stopped
        self.state.write(view, after)


@model(
    "holonomic",
    HolonomicRobot,
    slots={**BODY, "heading": 1, "base_velocity": 3, "blocked": 1},
    motion=HolonomicMotion,
    actuators={"motion": {"kind": "x_y_w"}},
    tags=("vehicle",),
    units={"heading": ("rad",), "base_velocity": ("m/s", "m/s", "rad/s")},
)
class Holonomic(VehicleModel):
    """A round base that moves in any direction.

    `base_velocity` is what its wheels do, ahead, to the left and turning left; `blocked` whether an obstacle stopped it
    in the tick.
    """

    colour: ClassVar = TEAL
