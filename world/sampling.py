"""The ticks at which robots send packets: a pure function of deployment and frame.

At a tick without a due sensor and with empty outboxes, every node's samples are empty, and each process computes that:
they are neither sent nor awaited. At 100 Hz and ticks of 2 ms this saves four messages of five on this way. Where no
sample is due and no packet fills an outbox the vHub also computes it before the frame arrives.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from foosim.common.names import CHANNEL_ECHO
from foosim.world.frame import Frame
from foosim.world.layout import trigger_slot
from foosim.world.robot_packets import Delivered
from foosim.world.spec import WorldSpec


class Sampling:
    """The ticks of all sensors of a deployment, and the numbers of frames that trigger some of them."""

    def __init__(self, spec: WorldSpec) -> None:
        sensors = [sensor for robot in spec.robots.values() for sensor in robot.sensors.values()]
        self._schedules = tuple(sorted({spec.schedule(sensor) for sensor in sensors}))
        self._triggers = sorted(
            {
                (name, channel, trigger)
                for name, robot in spec.robots.items()
                for channel, sensor in robot.sensors.items()
                if (trigger := sensor.component_type.trigger_by(sensor))
            }
        )
        """Robots with a sensor that has a trigger, its channel, and the trigger."""
        self._layout = b""
        self._places = np.zeros(0, np.intp)

    def is_due(self, tick: int) -> bool:
        """Whether some sensor samples at a tick by its rate."""
        return any((tick * step + shift) % period < step for step, shift, period in self._schedules)

    @property
    def triggered(self) -> frozenset[tuple[str, str]]:
        """Robots and channels of the sensors that may measure at any tick."""
        return frozenset([(robot, channel) for robot, channel, _ in self._triggers])

    def is_silent(self, frame: Frame) -> bool:
        """Whether no robot sends anything at the frame's tick."""
        return not frame.outboxes and not self.is_due(frame.tick) and not self._has_spoken(frame)

    def _has_spoken(self, frame: Frame) -> bool:
        if not self._triggers:
            return False
        layout = frame.layout
        if layout.digest != self._layout:
            self._layout = layout.digest
            self._places = np.array(
                [
                    layout[name].offsets[trigger_slot(layout[name], channel, field)]
                    for name, channel, field in self._triggers
                    if name in layout
                ],
                np.intp,
            )
        return bool(frame.values[self._places].any())


def are_answered(packets: Iterable[Delivered]) -> bool:
    """Whether robots fill their outboxes by one of these packets."""
    return any(packet.channel == CHANNEL_ECHO for packet in packets)
