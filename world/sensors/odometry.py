"""How far a rover's wheels have turned, with Gaussian noise from keyed draws.

What the wheels slip is in it, and what they turned while the rover was blocked: the wheels turned, it did not move.
"""

from __future__ import annotations

from collections.abc import Sequence

from foosim.common.keyed_random import draw_words, gaussian
from foosim.world.payloads import payload_struct
from foosim.world.robots.rover import OdometrySensor
from foosim.world.sensors.fitting import Fitting

_PAYLOAD = payload_struct("odometry")


class Odometry:
    """Payload: travel of the left and the right wheel's rim since the start in m, two little-endian float64."""

    def __init__(self, settings: OdometrySensor, at: Fitting) -> None:
        self._start = at.robot.offsets["wheel_travel"]
        self._noise_m = settings.noise
        self._key = at.key

    def sample(self, numbers: Sequence[float], tick: int) -> bytes:
        words = draw_words(self._key, tick)
        return _PAYLOAD.pack(
            numbers[self._start] + self._noise_m * gaussian(words[0]),
            numbers[self._start + 1] + self._noise_m * gaussian(words[1]),
        )
