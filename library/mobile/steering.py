"""Steering to a place on the ground: towards it, and away from what feelers meet, without a plan.

The speed is that from which half of the acceleration stops at the place, v = sqrt(a d), and the turning likewise by the
angle that is left. A ray of a feeler that points r from ahead, and meets something at a share s of its length, lets the
robot turn its way to that side by no more than s 90 degrees - (1 - s) (120 degrees - r): a far thing hardly
counts, and a touched one turns the way off it. The ray takes (1 - s) cos r off the speed. Where both feelers together
need more room than there is, the one that needs more decides, the left one if both need the same.
"""

from __future__ import annotations

from math import floor, pi, sqrt
from typing import Final, NamedTuple

import numpy as np

from foosim.common.exact_math import cos, sin
from foosim.world.components.beams import hull_middle, mounted_at
from foosim.world.components.mounted import Mounted, body_at
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import Mounting, View
from foosim.world.scene import shape_box

TURN_GAIN: Final = 3.0
"""rad/s of turning per rad of error."""
ACROSS_RAD: Final = pi / 2.0
OFF_RAD: Final = 2.0 * pi / 3.0
"""The angle at which a touched thing is kept: a little behind."""
AHEAD_RAD: Final = pi / 3.0
"""A robot that cannot move sideways turns on the spot until the place is within this angle ahead."""
RAYS: Final = 13
"""Of each feeler."""
ASIDE: Final = 1.7


class Felt(NamedTuple):
    """The most to the left and the least (the most to the right) that the robot may turn its way from where it looks,
    by what its feelers meet (rad); and the share of its speed that it keeps."""

    most: float
    least: float
    speed: float


NOTHING_FELT: Final = Felt(pi, -pi, 1.0)


class Steering(NamedTuple):
    """How fast to go (m/s), in which direction from where the robot looks (rad, left), and how fast to turn (rad/s)."""

    speed: float
    direction: float
    turning: float


def shorter(angle: float) -> float:
    """Return an angle of whatever size as one of at least -180 and less than 180 degrees."""
    return angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5)


def steered(left_m: float, bearing: float, felt: Felt, most: Steering, acceleration: float, turning: float) -> Steering:
    """Return how to go to a place `left_m` away, at a bearing from where the robot looks (rad).

    `most` are the greatest speed and turn rate; the accelerations are along its way (m/s2) and of its turning (rad/s2).
    """
    if felt.least <= felt.most:
        bearing = min(max(bearing, felt.least), felt.most)
    else:
        bearing = felt.most if -felt.most >= felt.least else felt.least
    rate = min(TURN_GAIN * abs(bearing), sqrt(turning * abs(bearing)), most.turning)
    speed = min(most.speed, sqrt(acceleration * left_m)) * felt.speed
    return Steering(speed, bearing, rate if bearing > 0.0 else -rate)


class Feelers:
    """The two feelers of one robot: level fans of rays from the middle of its hull, from ahead to the left and to the
    right, as far as 120 degrees.

    A ray is as long as the feelers, and reaches no farther aside than `ASIDE` times the hull's half width: what the
    robot would pass does not count. It meets something at a share of the way from the hull to its end.
    """

    def __init__(self, at: Mounting, length: float) -> None:
        """`length` is in m. Raises BadValue for a robot without a hull."""
        hull = body_at(at).links[0]
        self._mount = Mounted(at, mounted_at(hull_middle(hull)))
        self._around, self._robot = Surroundings(at.spec, at.layout), at.robot
        (lx, ly, _), (hx, hy, _) = shape_box(hull.shapes[0])
        self._radius = max(hx - lx, hy - ly) / 2.0
        aside = ASIDE * self._radius
        turns = [OFF_RAD * ray / (RAYS - 1) for ray in range(RAYS)]
        reaches = [max(min(length, aside / max(sin(turn), aside / length)), aside) for turn in turns]
        self._turns = [*turns, *(-turn for turn in turns)]
        self._aside = np.array([OFF_RAD - turn for turn in turns])
        self._reaches = np.array([*reaches, *reaches])
        self._ahead = np.array([cos(turn) for turn in self._turns])

    def felt(self, view: View, heading: float, reach_m: float) -> Felt:
        """Return what they meet at the start of the tick within `reach_m`."""
        place, _ = self._mount.pose(view.start)
        ways = np.array([(cos(heading + turn), sin(heading + turn), 0.0) for turn in self._turns])
        reaches = np.minimum(self._reaches, reach_m)
        hits = self._around.rays(view, np.array([place] * len(ways)), ways, reaches, ignoring=self._robot)
        free = (hits.distances - self._radius) / (self._reaches - self._radius)
        shares = np.minimum(np.maximum(free, 0.0), 1.0)
        taken = np.maximum((1.0 - shares) * self._ahead, 0.0)
        bounds = [np.where(its < 1.0, its * ACROSS_RAD - (1.0 - its) * self._aside, pi) for its in np.split(shares, 2)]
        return Felt(float(bounds[0].min()), -float(bounds[1].min()), 1.0 - float(taken.max()))
