"""A camera or a head by a place in the world that it keeps looking at. A job is done when it looks there."""

from __future__ import annotations

from math import copysign, pi, sqrt
from typing import Final

from msgspec import Struct

from foosim.common.exact_math import atan2
from foosim.library.rigid.joints import JointActuator
from foosim.library.rigid.pan_tilt import PanTiltSettings, hangs_on, pan_tilt_of
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.quantities import JobNumber, Metres
from foosim.world.component_types.registry import actuator
from foosim.world.components.base import slot
from foosim.world.components.entities import Motors
from foosim.world.components.mounted import body_at, link_index
from foosim.world.components.view import IncompatibleComponent, Mounting, View, WritableView
from foosim.world.kinematics import forward_kinematics
from foosim.world.moving.progress import Approach
from foosim.world.placing import FAR_M, FIRST_LINK, MountedAt
from foosim.world.scene import Pose, Vector, cross, dot, moved, multiply, rotate

AHEAD: Final[Vector] = (1.0, 0.0, 0.0)
ROUND: Final = 2.0 * pi


class LookAtSettings(PanTiltSettings):
    """Turns two of `joints`, pan and tilt, which hangs on it, so that the x axis of `at` points at a place.

    `at` is on the link of the tilt joint where it names none. A job is done when the place is within `tolerance` of
    that axis. It has failed when the joints come no nearer to that for `patience`.
    """

    at: MountedAt = FIRST_LINK


class Sight(Struct, frozen=True):
    """What to look at in the world."""

    x: Metres
    y: Metres
    z: Metres
    job: JobNumber = 0.0


@actuator("look_at", LookAtSettings, Sight, joints="joints", jobs=True)
class LookAt(JointActuator, Approach):
    """Keeps the place of the last command, and turns towards it.

    Pan turns by the angle about its axis between where it looks and the place, tilt by that between their heights. Both
    are exact for axes at right angles to each other, and that of tilt to the view; where the joints are apart, or the
    robot moves, the loop makes up for it tick by tick.
    """

    has_target, target = slot(), slot(3)

    def __init__(self, settings: LookAtSettings, at: Mounting) -> None:
        self.group, self._settings = pan_tilt_of(settings, at), settings
        self._body, self._robot = body_at(at), at.robot
        self._pan, self._tilt = (self._body.links.index(link) for link in self.group.links)
        self._eye = self._tilt if settings.at.link is None else link_index(self._body, settings.at.link)
        self.patience_ticks = settings.patience_ns // at.spec.tick_ns

    @staticmethod
    def check(settings: LookAtSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for joints other than pan and tilt, and a link that these do not turn."""
        its = LookAt(settings, at)
        if not hangs_on(its._body, its._eye, its._tilt):
            raise IncompatibleComponent(("at", "link"), "its joints do not turn this link", settings.at.link)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest of each coordinate (m)."""
        return dict.fromkeys(("x", "y", "z"), (-FAR_M, FAR_M))

    def accept(self, command: Sight, view: WritableView) -> bool:
        """Take a place."""
        view.write(self.has_target, 1.0)
        view.write(self.target, command.x, command.y, command.z)
        self.begin(view)
        return True

    def hold(self, view: WritableView) -> None:
        """Stay at the present angles."""
        view.write(self.has_target, 0.0)
        super().hold(view)
        self.begin(view)

    def progress(self, view: WritableView) -> JobState:
        """Return whether it looks at the place, by the way of both joints that is left (rad), maybe the long one."""
        _, ahead, way = self._sight(view)
        aside, angles = cross(ahead, way), self.group.positions(view)
        angle = atan2(sqrt(dot(aside, aside)), dot(ahead, way))
        left = sum([abs(to - at) for to, at in zip(self._wanted(view), angles, strict=True)])
        return self.judge(view, left, is_there=angle <= self._settings.tolerance)

    def _sight(self, view: View) -> tuple[list[Pose], Vector, Vector]:
        """Return the poses of the links, where it looks (of length 1) and the way to the place (m): world frame."""
        poses, at = forward_kinematics(self._body, self._robot, view.numbers), self._settings.at
        _, position, orientation = poses[self._eye]
        ahead = rotate(multiply(orientation, at.orientation), AHEAD)
        x, y, z = view.read(self.target)
        return poses, ahead, moved((x, y, z), moved(position, rotate(orientation, at.position), 1.0), -1.0)

    def command(self, view: View) -> Motors:
        """Return speed and greatest force of both motors."""
        is_given = view.numbers[self.has_target.at] != 0.0
        wanted = self._wanted(view) if is_given else view.read(self.set_point)
        return self.group.towards(wanted, view, self._settings.gain)

    def _wanted(self, view: View) -> list[float]:
        """Return the angles of both joints with which it looks at the place, or nearest to it (rad)."""
        poses, ahead, way = self._sight(view)
        pan, tilt = (rotate(poses[link][2], self._body.links[link].axis) for link in (self._pan, self._tilt))
        side = atan2(dot(cross(ahead, way), pan), dot(ahead, way) - dot(ahead, pan) * dot(way, pan))
        up = _height(way, pan) - _height(ahead, pan)
        turns = side, copysign(up, up * dot(cross(tilt, ahead), pan))
        ends = zip(self.group.positions(view), turns, self.group.lows, self.group.highs, strict=True)
        return [_within(angle + more, low, high) for angle, more, low, high in ends]


def _height(way: Vector, axis: Vector) -> float:
    """Return the angle of a way above the plane at right angles to an axis (rad)."""
    along, aside = dot(way, axis), cross(way, axis)
    return atan2(along, sqrt(dot(aside, aside)))


def _within(angle: float, low: float, high: float) -> float:
    """Return an angle within limits, the other way round where it is there, else the nearer limit."""
    found = next((one for one in (angle, angle - ROUND, angle + ROUND) if low <= one <= high), angle)
    return min(max(found, low), high)
