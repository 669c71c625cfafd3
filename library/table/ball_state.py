"""The ball's whole state: place, velocity and spin."""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct

from foosim.world.component_types.quantities import Metres, MetresPerSecond, RadiansPerSecond
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor
from foosim.world.components.view import Mounting, View


class BallStateSettings(SensorSettings):
    """Reads the ball's position, velocity and spin."""


class BallState(Struct, frozen=True):
    """The state of the ball in the world frame: where it is, how fast it moves, how fast it turns about its centre."""

    x: Metres
    y: Metres
    z: Metres
    vx: MetresPerSecond
    vy: MetresPerSecond
    vz: MetresPerSecond
    wx: RadiansPerSecond
    wy: RadiansPerSecond
    wz: RadiansPerSecond

    groups: ClassVar = {"position": ("x", "y", "z"), "velocity": ("vx", "vy", "vz"), "spin": ("wx", "wy", "wz")}


@sensor("ball_state", BallStateSettings, BallState, kit="table")
class BallStateSensor(Sensor):
    """Position, velocity and spin of the ball, in the world frame."""

    def __init__(self, settings: BallStateSettings, at: Mounting) -> None:
        offsets = at.layout["ball"].offsets
        self._starts = tuple(offsets[field] for field in ("position", "linear_velocity", "angular_velocity"))

    def sample(self, view: View) -> BallState:
        place, velocity, spin = (view.numbers[start : start + 3] for start in self._starts)
        return BallState(*place, *velocity, *spin)
