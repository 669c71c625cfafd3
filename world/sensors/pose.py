"""Where a rover is, as a localisation of the hall gives it, with Gaussian noise from keyed draws."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.common.keyed_random import draw_words, gaussian
from foosim.world.payloads import payload_struct
from foosim.world.robots.rover import PoseSensor
from foosim.world.sensors.fitting import Fitting

_PAYLOAD = payload_struct("pose")


class PoseTracker:
    """Payload: x and y in m in the world frame, heading in rad from +x towards +y, three little-endian float64."""

    def __init__(self, settings: PoseSensor, at: Fitting) -> None:
        self._position = at.robot.offsets["position"]
        self._heading = at.robot.offsets["heading"]
        self._position_noise_m = settings.position_noise
        self._heading_noise_rad = settings.heading_noise
        self._key = at.key

    def sample(self, numbers: Sequence[float], tick: int) -> bytes:
        words = draw_words(self._key, tick)
        return _PAYLOAD.pack(
            numbers[self._position] + self._position_noise_m * gaussian(words[0]),
            numbers[self._position + 1] + self._position_noise_m * gaussian(words[1]),
            numbers[self._heading] + self._heading_noise_rad * gaussian(words[2]),
        )
