"""A rover's drive: the rims of both wheels approach their set-points of speed as fast as the motors accelerate."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from foosim.common.names import CHANNEL_DRIVE
from foosim.world.layout import Entity
from foosim.world.payloads import payload_struct
from foosim.world.spec import WorldSpec

_PAYLOAD = payload_struct(CHANNEL_DRIVE)


class DriveActuator:
    """One rover's actuator; its set-points are in the frame."""

    channel = CHANNEL_DRIVE

    def __init__(self, spec: WorldSpec, entity: Entity) -> None:
        drive = spec.hall.rover.drive
        self._set_point = entity.offsets["set_point"]
        self._speed, self._acceleration = drive.speed, drive.acceleration

    def accept(self, payload: bytes, numbers: list[float]) -> bool:
        """Take the speeds of the left and right wheel (m/s), held within the drive's; False when it is refused."""
        if len(payload) != _PAYLOAD.size:
            return False
        left, right = _PAYLOAD.unpack(payload)
        if not (isfinite(left) and isfinite(right)):
            return False
        numbers[self._set_point] = min(max(left, -self._speed), self._speed)
        numbers[self._set_point + 1] = min(max(right, -self._speed), self._speed)
        return True

    def command(self, numbers: Sequence[float]) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return (target speed in m/s, greatest acceleration in m/s2) of the left and the right wheel."""
        left, right = numbers[self._set_point], numbers[self._set_point + 1]
        return (left, self._acceleration), (right, self._acceleration)
