"""Actuators of joints: the driven joints of a robot and their limits."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Annotated, Any, Final

from msgspec import Meta
from msgspec.structs import astuple
from pydantic import Field

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.component_types.descriptions import JOINTS_MAX, Carrier
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import Actuator, need, slot
from foosim.world.components.entities import Motors
from foosim.world.components.joint_names import JointNames, joint_indices
from foosim.world.components.mounted import body_at
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.scene import Link

FORCE_MAX: Final = 1e6
"""What a joint without a limit of its effort is driven with at most (N or N m)."""
SPEED_MAX: Final = 1e3
"""How fast a joint without a limit of its speed is driven at most (m/s or rad/s)."""

Gain = Annotated[float, Quantity(units.FREQUENCY, "0.001 Hz", "100 kHz")]
_EACH: Final = Meta(min_length=1, max_length=JOINTS_MAX)
"""A number for each joint."""
Positions = Annotated[tuple[Annotated[float, Meta(extra={"unit": "m or rad"})], ...], _EACH]
Velocities = Annotated[tuple[Annotated[float, Meta(extra={"unit": "m/s or rad/s"})], ...], _EACH]
Efforts = Annotated[tuple[Annotated[float, Meta(extra={"unit": "N or N m"})], ...], _EACH]


class JointSettings(ActuatorSettings):
    """Drives joints of a robot.

    `joints` selects them by names or by patterns of these with `*`, in this order; without it they are all that have a
    motor of their own. A pattern passes over joints that follow others.
    """

    joints: Annotated[JointNames, Field(min_length=1, max_length=JOINTS_MAX)] | None = None


class JointLoopSettings(JointSettings):
    """Those of a proportional loop: the speed of each joint is `gain` times its error, at most that of the joint.

    The loop runs once a tick, so the gain is at most the inverse of a tick: a greater one overshoots.
    """

    gain: Gain = default("20 Hz")


def checked_joint_count(settings: JointSettings, carrier: Carrier) -> int:
    """Return the count of joints that an actuator drives.

    Raises BadValue for a robot without joints, and for the gain of a loop that overshoots.
    """
    most = 1e9 / carrier.period_ns
    if isinstance(settings, JointLoopSettings) and settings.gain > most:
        raise BadValue(f"a gain that overshoots: at most the inverse of a tick, {most:g} Hz, is stable", settings.gain)
    if carrier.joints == 0:
        raise BadValue("the robot has no joints", settings.kind)
    return carrier.joints if settings.joints is None else len(settings.joints)


class JointGroup:
    """The joints that an actuator drives, in the frames of one layout."""

    def __init__(self, settings: JointSettings, at: Mounting) -> None:
        """Raises IncompatibleComponent for joints that the robot does not have, or that follow others."""
        body = body_at(at)
        self.indices = joint_indices(body, settings.joints, has_motors=True)
        self.names = tuple([body.joint_names[index] for index in self.indices])
        """What the numbers of a command are of."""
        self.links: tuple[Link, ...] = tuple(body.joints[index] for index in self.indices)
        start = at.robot.offsets["joint_positions"]
        self._positions = [start + index for index in self.indices]
        self.forces = tuple(min(link.effort, FORCE_MAX) for link in self.links)
        self.speeds = tuple(min(link.speed, SPEED_MAX) for link in self.links)
        ends = [link.limits if link.joint in ("prismatic", "revolute") else (-inf, inf) for link in self.links]
        self.lows, self.highs = tuple(low for low, _ in ends), tuple(high for _, high in ends)

    def positions(self, view: View) -> list[float]:
        """Return where the joints are (m or rad)."""
        return [view.numbers[at] for at in self._positions]

    def towards(self, wanted: Sequence[float], view: View, gain: float) -> Motors:
        """Return speed and greatest force of each motor: gain x (wanted - position), at most the speed of the joint."""
        drives = zip(wanted, self.positions(view), self.speeds, self.forces, strict=True)
        return tuple([(min(max(gain * (to - at), -most), most), force) for to, at, most, force in drives])


class JointActuator(Actuator):
    """An actuator that keeps a set-point for each joint."""

    set_point = slot(checked_joint_count)
    joint_positions = need()

    def __init__(self, settings: JointSettings, at: Mounting) -> None:
        self.group = JointGroup(settings, at)

    def names(self) -> tuple[str, ...]:
        """Return the names of the numbers of a command: those of the joints."""
        return self.group.names

    def accept(self, command: Any, view: WritableView) -> bool:
        """Take the number of each joint."""
        (numbers,) = astuple(command)
        view.write(self.set_point, *numbers)
        return True

    def hold(self, view: WritableView) -> None:
        """Make the present positions the set-points."""
        view.write(self.set_point, *self.group.positions(view))

    def excite(self, view: WritableView) -> None:
        """Move each joint by a little, for the run that compares engines."""
        view.write(self.set_point, *[position + 0.2 for position in self.group.positions(view)])
