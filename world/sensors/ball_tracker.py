"""Position of the ball as an overhead camera's tracker gives it, with Gaussian noise from keyed draws."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.common.keyed_random import draw_words, gaussian
from foosim.world.payloads import payload_struct
from foosim.world.robots.overhead_camera import BallSensor
from foosim.world.sensors.fitting import Fitting

_PAYLOAD = payload_struct("ball")


class BallTracker:
    """Payload: x, y, z of the ball in the world frame in m, three little-endian float64; z carries no noise."""

    def __init__(self, settings: BallSensor, at: Fitting) -> None:
        self._start = at.layout["ball"].offsets["position"]
        self._noise_m = settings.noise
        self._key = at.key

    def sample(self, numbers: Sequence[float], tick: int) -> bytes:
        words = draw_words(self._key, tick)
        x, y, z = numbers[self._start : self._start + 3]
        return _PAYLOAD.pack(x + self._noise_m * gaussian(words[0]), y + self._noise_m * gaussian(words[1]), z)
