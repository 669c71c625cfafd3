"""The rod's position actuator: a proportional loop from set-points of position and angle to motor speeds, limited.

Target speed = gain x error, at most the drive's speed; the motor reaches it with at most the drive's force. The loop is
the one of the original table (`docs/reference/table.md`); its gains and limits are in the deployment.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from foosim.common.names import CHANNEL_POSITION
from foosim.world.layout import Entity
from foosim.world.payloads import ANGLE_RAD_MAX, payload_struct
from foosim.world.robots.foosball_rod import RodRobot
from foosim.world.spec import WorldSpec

_PAYLOAD = payload_struct(CHANNEL_POSITION)


class PositionActuator:
    """One rod's actuator; its set-point is in the frame."""

    channel = CHANNEL_POSITION

    def __init__(self, spec: WorldSpec, entity: Entity) -> None:
        robot = spec.robots[entity.name]
        assert isinstance(robot, RodRobot)
        drive = spec.table.drive
        self._slide_m_max = spec.table.lines[robot.line].half_stroke
        self._set_point = entity.offsets["set_point"]
        self._position = entity.offsets["joint_positions"]
        self._slide = (drive.slide.gain, drive.slide.speed, drive.slide.force)
        self._spin = (drive.spin.gain, drive.spin.speed, drive.spin.torque)

    def accept(self, payload: bytes, numbers: list[float]) -> bool:
        """Take a command (slide in m, spin in rad) into the actuator's memory; False when it is refused."""
        if len(payload) != _PAYLOAD.size:
            return False
        slide_m, spin_rad = _PAYLOAD.unpack(payload)
        if not (isfinite(slide_m) and isfinite(spin_rad)):
            return False
        if abs(slide_m) > self._slide_m_max or abs(spin_rad) > ANGLE_RAD_MAX:
            return False
        numbers[self._set_point] = slide_m
        numbers[self._set_point + 1] = spin_rad
        return True

    def command(self, numbers: Sequence[float]) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return (target speed, greatest force) of slide and spin, in SI units."""
        gain, speed, force = self._slide
        slide = gain * (numbers[self._set_point] - numbers[self._position])
        spin_gain, spin_speed, torque = self._spin
        spin = spin_gain * (numbers[self._set_point + 1] - numbers[self._position + 1])
        return (min(max(slide, -speed), speed), force), (min(max(spin, -spin_speed), spin_speed), torque)
