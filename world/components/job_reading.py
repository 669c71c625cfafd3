"""The reading of the jobs of an actuator, and the settings of the sensor that takes it."""

from __future__ import annotations

from msgspec import Struct

from foosim.common.spec_base import Name
from foosim.world.component_types.quantities import Count
from foosim.world.component_types.settings import SensorSettings


class JobSettings(SensorSettings):
    """Reports the states of the jobs of the `actuator` of its robot: at its rate, and at each change."""

    actuator: Name


class Jobs(Struct, frozen=True):
    """The jobs of an actuator. Senders are the players and clients that may command the robot, in name order.

    `running` is the one whose job runs, counted from 1, 0 for none. `failure` is the reason of a failed last
    command, by the numbers of the actuator; 0 for none. Of each sender there are the number of its last job, 0 before
    the first one, and its state: 1 running, 2 done, 3 failed, 4 preempted, 5 cancelled.
    """

    running: Count
    failure: Count
    numbers: tuple[Count, ...]
    states: tuple[Count, ...]
