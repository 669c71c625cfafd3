"""Sensors of robots: one file each, registered by kind.

A sensor is a pure function of frame, seed and names. To add one: a file with a class that has `sample(numbers, tick)`
and a constructor like those here, a kind in the deployment's schema, and a row in `SENSORS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, Protocol

from foosim.common.keyed_random import draw_key
from foosim.world.layout import Entity, Layout
from foosim.world.sensors.ball_tracker import BallTracker
from foosim.world.sensors.battery import BatteryGauge
from foosim.world.sensors.encoder import Encoder
from foosim.world.sensors.fitting import Fitting
from foosim.world.sensors.odometry import Odometry
from foosim.world.sensors.pose import PoseTracker
from foosim.world.sensors.proximity import Proximity
from foosim.world.spec import WorldSpec


class Sensor(Protocol):
    """What the tick of a node asks of a sensor."""

    def sample(self, numbers: Sequence[float], tick: int) -> bytes:
        """Return the payload measured from a frame's numbers at `tick`."""


SENSORS: Final[Mapping[str, Callable[[Any, Fitting], Sensor]]] = {
    "encoder": Encoder,
    "ball": BallTracker,
    "pose": PoseTracker,
    "odometry": Odometry,
    "proximity": Proximity,
    "battery": BatteryGauge,
}


def sample_all(sensors: Sequence[Sensor], numbers: Sequence[float], tick: int) -> list[bytes]:
    """Return the payload of each sensor at `tick`; those that cost less together are sampled together."""
    near = {place: sensor for place, sensor in enumerate(sensors) if isinstance(sensor, Proximity)}
    payloads = dict(zip(near, Proximity.sample_together([*near.values()], numbers, tick), strict=True))
    return [payloads[n] if n in payloads else sensor.sample(numbers, tick) for n, sensor in enumerate(sensors)]


def make_sensor(settings: Any, spec: WorldSpec, layout: Layout, robot: Entity, channel: str) -> Sensor:
    """Return the sensor of one robot's channel, its noise keyed by seed, robot and channel."""
    key = draw_key(spec.seed, "noise", robot.name, channel)
    return SENSORS[settings.kind](settings, Fitting(spec, layout, robot, key))
