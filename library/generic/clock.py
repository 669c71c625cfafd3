"""The simulated time, for programs that know it from readings alone."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor
from foosim.world.components.view import Mounting, View


class ClockSettings(SensorSettings):
    """Reports the simulated time."""


class Time(Struct, frozen=True):
    """The simulated time since the start of the run."""

    time: Annotated[float, Meta(extra={"unit": "s"})]


@sensor("clock", ClockSettings, Time)
class Clock(Sensor):
    """The time of each reading, which is a whole number of ticks."""

    def __init__(self, settings: ClockSettings, at: Mounting) -> None:
        self._tick_ns = at.spec.tick_ns

    def sample(self, view: View) -> Time:
        return Time(view.tick * self._tick_ns / 1e9)
