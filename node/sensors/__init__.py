"""Sensors of robots: one file each, registered by kind.

A sensor is a pure function of frame, seed and names. To add one: a file with a class that has `sample(numbers, tick)`
and a constructor like those here, a kind in the deployment's schema, and a row in `SENSORS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, Protocol

from foosim.node.sensors.ball import BallTracker
from foosim.node.sensors.encoder import Encoder
from foosim.protocol.draws import draw_key
from foosim.protocol.layout import Entity, Layout


class Sensor(Protocol):
    """What the tick of a node asks of a sensor."""

    def sample(self, numbers: Sequence[float], tick: int) -> bytes:
        """Return the payload measured from a frame's numbers at `tick`."""


SENSORS: Final[Mapping[str, Callable[[Any, Layout, Entity, bytes], Sensor]]] = {
    "encoder": Encoder,
    "ball": BallTracker,
}


def make_sensor(settings: Any, layout: Layout, robot: Entity, channel: str, seed: int) -> Sensor:
    """Return the sensor of one robot's channel, its noise keyed by seed, robot and channel."""
    return SENSORS[settings.kind](settings, layout, robot, draw_key(seed, "noise", robot.name, channel))
