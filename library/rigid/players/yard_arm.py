"""The controller of an arm that stands between two lanes of a yard: it reaches over each in turn, and gives way.

It hears by radio where the scouts are. While one is near on a side, or has not been heard for a while, the arm stays
away from that side; where it can reach over neither it stands upright.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot
from typing import Any, Final

from foosim.client.player import Player, Samples, Turn
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.library.mobile.players.yard_reports import Heard
from foosim.library.rigid.joint_position import JointPositions
from foosim.library.rigid.joint_state import JointState
from foosim.library.rigid.urdf import UrdfRobot

UPRIGHT: Final = (0.0,) * 7
OVER_A_LANE: Final = (0.0, 1.15, 0.0, 0.75, 0.0, -0.4, 0.0)
"""Joints of an arm that reaches out, its hand a third of a metre above the floor; the first one says where to."""
ASIDE_RAD: Final = 1.5
"""How far the first joint turns to either side, from x."""
NEAR_M: Final = 2.0
"""A scout is in the way of the arm if it is nearer than this to its foot."""
SILENT_S: Final = 1.5
"""After this time without a report a scout may be anywhere."""
THERE_RAD: Final = 0.05
STAY_S: Final = 1.0
"""How long it stays over a lane."""


class Arm(Player):
    """The player. Its parameters are `arm` and the list `scouts`, the robots to which it gives way."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        name, scouts = parameters.get("arm"), parameters.get("scouts")
        robot = deployment.robots.get(name) if isinstance(name, str) else None
        if not isinstance(name, str) or not isinstance(robot, UrdfRobot):
            raise BadValue("parameter arm is not a robot from a URDF file", name)
        self._name = name
        if not isinstance(scouts, list) or set(parameters) != {"arm", "scouts"}:
            raise BadValue("the parameters are arm, and the list scouts", sorted(parameters))
        robots = sorted(deployment.robots)
        for scout in scouts:
            if scout not in robots:
                raise UnknownName("parameter scouts names an unknown robot", scout, robots)
        self._scouts = [robots.index(scout) for scout in scouts]
        self._x, self._y, _ = robot.at.position
        self._tick_s = deployment.tick_ns / 1e9
        self.heard = Heard()
        self.side = 1.0
        """Over which lane it reaches next: 1 to the left of x, -1 to the right."""
        self._since_s: float | None = None
        """Since when it has been where it was to be."""

    def act(self, tick: int, samples: Samples) -> Turn:
        """Move to the next lane that is free."""
        now_s = tick * self._tick_s
        self.heard.take(samples)
        if not self._is_free(self.side, now_s) and self._is_free(-self.side, now_s):
            self.side, self._since_s = -self.side, None
        wanted = UPRIGHT
        if self._is_free(self.side, now_s):
            wanted = (ASIDE_RAD * self.side, *OVER_A_LANE[1:])
        state = samples.get((self._name, "state"))
        if state is not None and isinstance(state.value, JointState) and wanted is not UPRIGHT:
            self._stay(wanted, state.value.positions, now_s)
        return Turn({self._name: JointPositions(wanted)})

    def _stay(self, wanted: tuple[float, ...], there: tuple[float, ...], now_s: float) -> None:
        """Stay for a while over a lane, then turn to the other."""
        if max(abs(to - at) for to, at in zip(wanted, there, strict=True)) > THERE_RAD:
            self._since_s = None
        elif self._since_s is None:
            self._since_s = now_s
        elif now_s - self._since_s > STAY_S:
            self.side, self._since_s = -self.side, None

    def _is_free(self, side: float, now_s: float) -> bool:
        """Whether no scout can be near on a side."""
        for number in self._scouts:
            report = self.heard.reports.get(number)
            if report is None or now_s - report.time > SILENT_S:
                return False
            if hypot(report.x - self._x, report.y - self._y) < NEAR_M and (report.y - self._y) * side > 0.0:
                return False
        return True
