"""Joints to positions: a proportional loop from set-points to the speeds of the joints' motors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from msgspec import Struct

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.forms.forms import Carrier
from foosim.world.forms.registry import actuator
from foosim.world.parameters.joints import JointGroup, JointSettings, Positions, set_points

Gain = Annotated[float, Quantity(units.FREQUENCY, "0.001 Hz", "100 kHz")]


class JointPositionSettings(JointSettings):
    """Moves joints to positions: the speed of each is `gain` times its error, at most that of the joint.

    The loop runs once a tick, so the gain is at most the inverse of a tick: a greater one overshoots.
    """

    gain: Gain = default("20 Hz")


class JointPositions(Struct, frozen=True):
    """The set-points of joints, in their order (m or rad)."""

    positions: Positions


def _slots(settings: JointPositionSettings, carrier: Carrier) -> Mapping[str, int]:
    most = 1e9 / carrier.period_ns
    if settings.gain > most:
        raise BadValue(f"a gain that overshoots: at most the inverse of a tick, {most:g} Hz, is stable", settings.gain)
    return set_points(settings, carrier)


@actuator(
    "joint_position", JointPositionSettings, JointPositions, slots=_slots, needs=("joint_positions",), joints="joints"
)
class JointPositionActuator:
    """A proportional loop: speed = gain x (set-point - position); the motor has at most the effort of the joint."""

    def __init__(self, settings: JointPositionSettings, at: Mounting) -> None:
        self._group = JointGroup(settings, at)
        self._gain = settings.gain

    @staticmethod
    def check(settings: JointPositionSettings, at: Mounting) -> None:
        """Raise Misfit for a joint that the robot does not have."""
        JointGroup(settings, at)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return no bounds that are common to all joints: each has its own."""
        return {}

    def bounds(self) -> tuple[tuple[float, float], ...]:
        """Return the least and the greatest position of each joint."""
        return tuple(zip(self._group.lows, self._group.highs, strict=True))

    def names(self) -> tuple[str, ...]:
        """Return what the numbers of a command are of, by the links that hang on the joints."""
        return self._group.names

    def accept(self, command: JointPositions, view: WritableView) -> bool:
        """Take the set-points of all joints."""
        view.write(self._group.set_point, *command.positions)
        return True

    def hold(self, view: WritableView) -> None:
        """Make the present positions the set-points."""
        view.write(self._group.set_point, *self._group.positions(view))

    def stir(self, view: WritableView) -> None:
        """Move each joint by a little, for the small run that tells engines apart."""
        view.write(self._group.set_point, *[position + 0.2 for position in self._group.positions(view)])

    def command(self, view: View) -> Motors:
        """Return speed and greatest force of each motor."""
        group, gain = self._group, self._gain
        wanted = view.read(group.set_point)
        drives = zip(wanted, group.positions(view), group.speeds, group.forces, strict=True)
        return tuple([(min(max(gain * (to - at), -most), most), force) for to, at, most, force in drives])
