"""At which ticks robots have something to send: a pure function of deployment and frame.

At a tick at which no sensor is due and no outbox holds anything, every node's samples are empty, and everybody knows:
they are neither sent nor waited for. At 100 Hz and ticks of 2 ms that spares four messages of five on this way. Where
a sample is not due and no packet fills an outbox the vHub also knows it before the frame is there.
"""

from __future__ import annotations

from collections.abc import Iterable

from foosim.common.names import CHANNEL_ECHO
from foosim.world.frame import Frame
from foosim.world.robot_packets import Delivered
from foosim.world.spec import WorldSpec


class Sampling:
    """The ticks of all sensors of a deployment."""

    def __init__(self, spec: WorldSpec) -> None:
        sensors = [sensor for robot in spec.robots.values() for sensor in robot.sensors.values()]
        self._turns = tuple(sorted({spec.turns(sensor) for sensor in sensors}))
        """Period and offset, in ticks."""

    def is_due(self, tick: int) -> bool:
        """Whether some sensor samples at a tick."""
        return any(tick % period == offset for period, offset in self._turns)

    def is_silent(self, frame: Frame) -> bool:
        """Whether no robot sends anything at the frame's tick."""
        return not frame.outboxes and not self.is_due(frame.tick)


def are_answered(packets: Iterable[Delivered]) -> bool:
    """Whether robots put something into their outboxes for one of these packets."""
    return any(packet.channel == CHANNEL_ECHO for packet in packets)
