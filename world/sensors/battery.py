"""A rover's battery: its charge, and its voltage with Gaussian noise from keyed draws."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.common.keyed_random import draw_words, gaussian
from foosim.world.payloads import payload_struct
from foosim.world.robots.rover import BatterySensor
from foosim.world.sensors.fitting import Fitting

_PAYLOAD = payload_struct("battery")


class BatteryGauge:
    """Payload: charge as a share of the capacity, voltage in V, two little-endian float64."""

    def __init__(self, settings: BatterySensor, at: Fitting) -> None:
        battery = at.spec.hall.rover.battery
        self._charge = at.robot.offsets["charge"]
        self._capacity_j = battery.capacity
        self._empty_v, self._span_v = battery.empty, battery.full - battery.empty
        self._noise_v = settings.noise
        self._key = at.key

    def sample(self, numbers: Sequence[float], tick: int) -> bytes:
        share = numbers[self._charge] / self._capacity_j
        voltage = self._empty_v + share * self._span_v
        return _PAYLOAD.pack(share, voltage + self._noise_v * gaussian(draw_words(self._key, tick)[0]))
