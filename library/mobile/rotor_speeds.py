"""The rotors of a multirotor: speeds to thrust and drag torque.

A rotor that turns at w thrusts with k w^2 along its axis and brakes its frame with m w^2 about it, against its own
sense of turning (R. Mahony, V. Kumar, P. Corke, "Multirotor aerial vehicles", IEEE RAM 19(3), 2012, section
"Rotor aerodynamics"). Rotors reach their speeds at once.
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from foosim.library.mobile.rotors import QuadrotorRobot
from foosim.world.component_types.quantities import RadiansPerSecond
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import SetPointActuator, slot
from foosim.world.components.drives import Motor, Wrench
from foosim.world.components.view import Mounting, View, WritableView

Speeds = Annotated[tuple[RadiansPerSecond, ...], Meta(min_length=4, max_length=4)]


class RotorSpeedsSettings(ActuatorSettings):
    """Turns the rotors of a quadrotor; its model has their thrust and drag."""


class RotorSpeeds(Struct, frozen=True):
    """The speeds of the four rotors (rad/s): front left, rear left, rear right, front right."""

    speeds: Speeds


@actuator("rotor_speeds", RotorSpeedsSettings, RotorSpeeds, needs=("angular_velocity",))
class RotorSpeedsActuator(SetPointActuator):
    """Rotors that keep the speeds of the last command."""

    _set_point = slot(4)

    def __init__(self, settings: RotorSpeedsSettings, at: Mounting) -> None:
        robot = at.spec.robots[at.robot.name]
        assert isinstance(robot, QuadrotorRobot), f"{at.robot.name} has no rotors"
        self._speed_max, self._thrust, self._drag = robot.rotor_speed, robot.thrust_factor, robot.drag_factor
        self._places = robot.rotor_places()

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and the greatest speed (rad/s)."""
        return {"speeds": (0.0, self._speed_max)}

    def accept(self, command: RotorSpeeds, view: WritableView) -> bool:
        """Take the speeds of all rotors."""
        view.write(self._set_point, *command.speeds)
        return True

    def excite(self, view: WritableView) -> None:
        """Turn the rotors unequally, for the run that compares engines."""
        view.write(self._set_point, *[share * self._speed_max for share in (0.70, 0.71, 0.69, 0.70)])

    def command(self, view: View) -> tuple[Motor, ...]:
        """Return nothing: rotors are no joints."""
        return ()

    def wrench(self, view: View) -> Wrench:
        """Return the sums of the rotors' forces (N) and torques (N m) in the frame of the quadrotor."""
        lift = roll = pitch = yaw = 0.0
        for speed, (x, y, sense) in zip(view.read(self._set_point), self._places, strict=True):
            thrust = self._thrust * speed * speed
            lift += thrust
            roll += y * thrust
            pitch -= x * thrust
            yaw -= sense * self._drag * speed * speed
        return (0.0, 0.0, lift), (roll, pitch, yaw)
