"""A mouse: it drives from one place to the next, places that follow from the seed of the run."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2, cos, hypot, pi, sin
from typing import Any, Final

from foosim.client.player import Commands, Player, Samples
from foosim.common.errors import BadValue
from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.deployment.schema import Deployment
from foosim.library.generic.pose import Pose
from foosim.library.mobile.steering import shorter
from foosim.library.mobile.v_w import Motion

AROUND_M: Final = 6.0  # it stays within this distance of the origin, where nothing is in its way
NEAR_M: Final = 1.0  # a place is left behind at this distance
SPEED: Final = 1.0  # m/s
TURN_GAIN: Final = 2.0  # rad/s for each rad that its place is aside,
TURN_MAX: Final = 2.0  # at most this


class Mouse(Player):
    """The player. Its robot has a `pose`, and moves by speed and turn rate."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        """It has no parameters. Raises BadValue."""
        if parameters:
            raise BadValue("a mouse has no parameters", sorted(parameters))
        self._key, self._leg = draw_key(deployment.seed, "mouse"), 0

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the motion towards its place."""
        (robot,) = self.robots
        pose = samples.get((robot, "pose"))
        if pose is None:
            return {}
        assert isinstance(pose.value, Pose)
        x, y = self._place()
        if hypot(x - pose.value.x, y - pose.value.y) < NEAR_M:
            self._leg += 1
            x, y = self._place()
        aside = shorter(atan2(y - pose.value.y, x - pose.value.x) - pose.value.heading)
        turning = min(max(TURN_GAIN * aside, -TURN_MAX), TURN_MAX)
        return {robot: Motion(SPEED * max(cos(aside), 0.0), turning)}

    def _place(self) -> tuple[float, float]:
        """Return where it goes (m): any place of a disc is as likely."""
        first, other, *_ = draw_words(self._key, self._leg)
        far, turn = AROUND_M * unit_interval(first) ** 0.5, 2.0 * pi * unit_interval(other)
        return far * cos(turn), far * sin(turn)
