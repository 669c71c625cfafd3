"""Actuators of joints: the driven joints of a robot and their limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Annotated, Final

from msgspec import Meta
from pydantic import Field

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import Name, default
from foosim.common.units import Quantity
from foosim.world.component_types.descriptions import JOINTS_MAX, Carrier
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.entities import Motors
from foosim.world.components.mounted import body_at, joint_indices
from foosim.world.components.view import Mounting, Slot, View
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
    """Drives the named joints of a robot, in this order; all, in the order of its links, where none are named."""

    joints: Annotated[list[Name], Field(min_length=1, max_length=JOINTS_MAX)] | None = None


class JointLoopSettings(JointSettings):
    """Those of a proportional loop: the speed of each joint is `gain` times its error, at most that of the joint.

    The loop runs once a tick, so the gain is at most the inverse of a tick: a greater one overshoots.
    """

    gain: Gain = default("20 Hz")


def set_points(settings: JointSettings, carrier: Carrier) -> Mapping[str, int]:
    """Return the slots of an actuator of joints: a set-point for each. Raises BadValue for a robot without joints."""
    if carrier.joints == 0:
        raise BadValue("the robot has no joints", settings.kind)
    if settings.joints is None:
        return {"set_point": carrier.joints}
    if len(settings.joints) > carrier.joints or len(set(settings.joints)) < len(settings.joints):
        raise BadValue(f"{carrier.joints} joints, each once, are valid", settings.joints)
    return {"set_point": len(settings.joints)}


def loop_points(settings: JointLoopSettings, carrier: Carrier) -> Mapping[str, int]:
    """Return the slots of a loop: as `set_points`. Raises BadValue for a gain that overshoots, too."""
    most = 1e9 / carrier.period_ns
    if settings.gain > most:
        raise BadValue(f"a gain that overshoots: at most the inverse of a tick, {most:g} Hz, is stable", settings.gain)
    return set_points(settings, carrier)


class JointGroup:
    """The joints that an actuator drives, in the frames of one layout."""

    def __init__(self, settings: JointSettings, at: Mounting) -> None:
        """Raises IncompatibleComponent for a joint that the robot does not have."""
        body = body_at(at)
        everything = range(len(body.joints))
        self.indices = tuple(everything) if settings.joints is None else joint_indices(at, settings.joints)
        links = [body.joints[index].name.removeprefix(f"{body.name}/") for index in self.indices]
        self.names = tuple(f"joint of {link}" for link in links)
        """What the numbers of a command are of."""
        self.links: tuple[Link, ...] = tuple(body.joints[index] for index in self.indices)
        self.set_point: Slot = at.slot("set_point")
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
