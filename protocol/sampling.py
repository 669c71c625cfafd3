"""At which ticks robots have something to send: a pure function of deployment and frame.

At a tick at which no sensor is due and no outbox holds anything, every node's samples are empty, and everybody knows:
they are neither sent nor waited for. At 100 Hz and ticks of 2 ms that spares four messages of five on this way.
Neighbours: `node.core` senses, `vhub.core` waits.
"""

from __future__ import annotations

from foosim.protocol.deployment import Deployment
from foosim.protocol.frame import Frame


class Sampling:
    """The periods, in ticks, of all sensors of a deployment."""

    def __init__(self, deployment: Deployment) -> None:
        rates = {sensor.rate_hz for robot in deployment.robots.values() for sensor in robot.sensors.values()}
        self.periods = tuple(sorted(deployment.ticks(rate) for rate in rates))

    def is_silent(self, frame: Frame) -> bool:
        """Whether no robot sends anything at the frame's tick."""
        tick = frame.tick
        return not frame.outboxes and all(tick % period for period in self.periods)
