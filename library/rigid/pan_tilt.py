"""Pan and tilt of a camera or a head: a joint to the sides, and on it a joint up and down.

A job is done when both angles are within tolerance.
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Struct

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.library.rigid.joints import JointActuator, JointGroup, JointLoopSettings
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.quantities import JobNumber, Radians
from foosim.world.component_types.registry import actuator
from foosim.world.components.entities import Motors
from foosim.world.components.mounted import body_at
from foosim.world.components.view import IncompatibleComponent, Mounting, View, WritableView
from foosim.world.moving.progress import Approach, Patience
from foosim.world.scene import Body

Tolerance = Annotated[float, Quantity(units.ANGLE, "0.001 deg", "90 deg")]


class PanTiltSettings(JointLoopSettings):
    """Turns two of `joints`, pan and tilt, which hangs on it, to angles.

    A job is done when each is within `tolerance` of its angle. It has failed when they come no nearer for `patience`.
    """

    tolerance: Tolerance = default("1 deg")
    patience_ns: Patience = default("2 s", "patience")


def pan_tilt_of(settings: PanTiltSettings, at: Mounting) -> JointGroup:
    """Return the two joints. Raises IncompatibleComponent for others."""
    group, body = JointGroup(settings, at), body_at(at)
    path = "kind" if settings.joints is None else "joints"
    if [link.joint in ("revolute", "continuous") for link in group.links] != [True, True]:
        raise IncompatibleComponent((path,), "two joints that turn are valid, pan and tilt", [*group.names])
    pan, tilt = (body.links.index(link) for link in group.links)
    if not hangs_on(body, tilt, pan):
        raise IncompatibleComponent((path,), "the second joint must be on the first: pan, then tilt", [*group.names])
    return group


def hangs_on(body: Body, link: int, other: int) -> bool:
    """Whether a link is another one, or hangs on it."""
    while link > other:  # a parent's index is below its child's
        link = body.links[link].parent
    return link == other


class PanTiltAngles(Struct, frozen=True):
    """The angles of its joints."""

    pan: Radians
    tilt: Radians
    job: JobNumber = 0.0


@actuator("pan_tilt", PanTiltSettings, PanTiltAngles, joints="joints", jobs=True)
class PanTilt(JointActuator, Approach):
    """Keeps the angles of the last command by a proportional loop, as `joint_position` does."""

    def __init__(self, settings: PanTiltSettings, at: Mounting) -> None:
        self.group, self._settings = pan_tilt_of(settings, at), settings
        self.patience_ticks = settings.patience_ns // at.spec.tick_ns

    @staticmethod
    def check(settings: PanTiltSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent unless there are two joints that turn, one on the other."""
        pan_tilt_of(settings, at)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and the greatest of each angle (rad)."""
        pan, tilt = zip(self.group.lows, self.group.highs, strict=True)
        return {"pan": pan, "tilt": tilt}

    def accept(self, command: PanTiltAngles, view: WritableView) -> bool:
        """Take two angles."""
        self._set(view, [command.pan, command.tilt])
        return True

    def _set(self, view: WritableView, angles: list[float]) -> None:
        view.write(self.set_point, *angles)
        self.begin(view)

    def hold(self, view: WritableView) -> None:
        """Stay at the present angles."""
        self._set(view, self.group.positions(view))

    def excite(self, view: WritableView) -> None:
        """Turn a little, for the run that compares engines."""
        self._set(view, [angle + 0.2 for angle in self.group.positions(view)])

    def progress(self, view: WritableView) -> JobState:
        """Return whether both joints are there."""
        wanted, angles = view.read(self.set_point), self.group.positions(view)
        left = [abs(to - at) for to, at in zip(wanted, angles, strict=True)]
        return self.judge(view, sum(left), is_there=max(left) <= self._settings.tolerance)

    def command(self, view: View) -> Motors:
        """Return speed and greatest force of both motors."""
        return self.group.towards(view.read(self.set_point), view, self._settings.gain)
