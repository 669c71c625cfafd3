"""Two driven wheels, for motions and actuators: the method `wheels()` of a model returns them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from foosim.common.errors import BadValue
from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.world.components.entities import Motors, made_model
from foosim.world.components.view import View
from foosim.world.layout import Entity, Layout
from foosim.world.spec import WorldSpec


@dataclass(frozen=True, slots=True)
class WheelMotors:
    """The motors of two wheels of this radius (m): their greatest torque (N m), the place of the wheels' rates in a
    frame (rad/s, the left one first), and the tick (s)."""

    radius: float
    torque: float
    speeds_at: int
    tick_s: float


@dataclass(frozen=True, slots=True)
class Wheels:
    """Two wheels, `track` apart (m): greatest speed (m/s) and acceleration (m/s2) of their rims.

    `turn_rate` (rad/s) is how fast they may turn their robot. On the ground the left and the right wheel roll less far
    than they turn, by these shares. Wheels of a rigid robot have `motors`.
    """

    track: float
    speed: float
    acceleration: float
    turn_rate: float
    slips: tuple[float, float] = (0.0, 0.0)
    motors: WheelMotors | None = None

    def set_points(self, left: float, right: float, view: View) -> Motors:
        """Return the set-points of the motors of both wheels, so that their rims approach these speeds (m/s).

        A motion gets the speeds themselves, with the greatest acceleration. A joint's motor gets the speed that its
        wheel can have after the tick, with the greatest torque: where that is too little, as in front of a wall, the
        next tick continues from the actual speed.
        """
        motors = self.motors
        if motors is None:
            return (left, self.acceleration), (right, self.acceleration)
        at, radius = motors.speeds_at, motors.radius
        step = self.acceleration * motors.tick_s
        now, other = view.numbers[at] * radius, view.numbers[at + 1] * radius
        left = min(max(left, now - step), now + step)
        right = min(max(right, other - step), other + step)
        return (left / radius, motors.torque), (right / radius, motors.torque)


def wheels_of(spec: WorldSpec, layout: Layout, entity: Entity) -> Wheels:
    """Return the wheels of an entity. Raises BadValue for a model that does not define them."""
    model: Any = made_model(spec, layout, entity)
    found: Wheels | None = model.wheels()
    if found is None:
        raise BadValue("a model with wheel_speeds needs a method wheels that returns them", entity.model)
    return found


def slips_of(spec: WorldSpec, name: str, slip: float) -> tuple[float, float]:
    """Return by which shares the wheels of a robot slip: each between none and `slip`, drawn by the robot's name."""
    words = draw_words(draw_key(spec.seed, "slip", name), 0)
    return slip * unit_interval(words[0]), slip * unit_interval(words[1])
