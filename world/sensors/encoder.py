"""Position and angle of a rod, with Gaussian noise from keyed draws."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.common.keyed_random import draw_words, gaussian
from foosim.world.payloads import payload_struct
from foosim.world.robots.foosball_rod import RodSensor
from foosim.world.sensors.fitting import Fitting

_PAYLOAD = payload_struct("encoder")


class Encoder:
    """Payload: slide in m and spin in rad, two little-endian float64."""

    def __init__(self, settings: RodSensor, at: Fitting) -> None:
        self._start = at.robot.offsets["joint_positions"]
        self._position_noise_m = settings.position_noise
        self._angle_noise_rad = settings.angle_noise
        self._key = at.key

    def sample(self, numbers: Sequence[float], tick: int) -> bytes:
        words = draw_words(self._key, tick)
        return _PAYLOAD.pack(
            numbers[self._start] + self._position_noise_m * gaussian(words[0]),
            numbers[self._start + 1] + self._angle_noise_rad * gaussian(words[1]),
        )
