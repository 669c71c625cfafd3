"""How who goes to a place on the ground steers: towards it, and away from what its feelers meet. It plans nothing.

The speed is that from which half of the acceleration stops at the place: v = sqrt(a d). A feeler that meets something
at a share s of its length asks for a turn away from it by (1 - s) x 90 degrees from where the robot looks, whatever the
place is; the nearer one of two decides, and the right one where both are as near.
"""

from __future__ import annotations

from math import floor, pi, sqrt
from typing import Final, NamedTuple

import numpy as np

from foosim.common.exact_math import cos, sin
from foosim.world.components.beams import body_of, hull_middle, mounted_at
from foosim.world.components.mounted import Mounted
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import Mounting, View
from foosim.world.scene import shape_box

TURN_GAIN: Final = 3.0
"""rad/s of turning per rad of error."""
AWAY_RAD: Final = pi / 2.0
AHEAD_RAD: Final = pi / 3.0
"""Who cannot go aside turns on the spot as long as the place is not within this ahead."""
RAYS: Final = 7
"""Of each feeler."""
ASIDE: Final = 1.4
NOTHING_FELT: Final = (1.0, 1.0)


class Steering(NamedTuple):
    """How fast to go (m/s), in which direction from where the robot looks (rad, left), and how fast to turn (rad/s)."""

    speed: float
    direction: float
    turning: float


def shorter(angle: float) -> float:
    """Return an angle of whatever size as one of at least -180 and less than 180 degrees."""
    return angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5)


def steered(
    left_m: float, bearing: float, felt: tuple[float, float], speed: float, acceleration: float, turn_rate: float
) -> Steering:
    """Return how to go to a place `left_m` away, at a bearing from where the robot looks (rad).

    `felt` is at which share of its length the left feeler meets something, and the right one; 1 for nothing.
    """
    nearest = min(felt)
    if nearest < 1.0:
        aside = (1.0 - nearest) * AWAY_RAD
        bearing = -aside if felt[0] <= felt[1] else aside
    turning = min(max(TURN_GAIN * bearing, -turn_rate), turn_rate)
    return Steering(min(speed, sqrt(acceleration * left_m)) * nearest, bearing, turning)


class Feelers:
    """The two feelers of one robot: level fans of rays from the middle of its hull, from ahead to the left and to the
    right as far as across.

    A ray goes as far as the feelers are long, and no farther aside than `ASIDE` times the hull's half width: what the
    robot would pass does not count. A feeler meets what the ray does that meets something at the least share of its
    length.
    """

    def __init__(self, at: Mounting, length: float) -> None:
        """`length` is in m. Raises BadValue for a robot without a hull."""
        hull = body_of(at).links[0]
        self._mount = Mounted(at, mounted_at(hull_middle(hull)))
        self._around, self._robot = Surroundings(at.spec, at.layout), at.robot
        (lx, ly, _), (hx, hy, _) = shape_box(hull.shapes[0])
        aside = ASIDE * max(hx - lx, hy - ly) / 2.0
        self._turns = [AWAY_RAD * ray / (RAYS - 1) for ray in range(RAYS)]
        reaches = [min(length, aside / max(sin(turn), aside / length)) for turn in self._turns]
        self._reaches = np.array([*reaches, *reaches])

    def felt(self, view: View, heading: float, reach_m: float) -> tuple[float, float]:
        """Return at which share of its length each meets something at the start of the tick; what is farther away than
        `reach_m` does not count."""
        place, _ = self._mount.pose(view.start)
        turns = [heading + side * turn for side in (1.0, -1.0) for turn in self._turns]
        ways = np.array([(cos(turn), sin(turn), 0.0) for turn in turns])
        reaches = np.minimum(self._reaches, reach_m)
        hits = self._around.rays(view, np.array([place] * len(turns)), ways, reaches, ignoring=self._robot)
        shares = np.minimum(hits.distances / self._reaches, 1.0).tolist()
        return min(shares[:RAYS]), min(shares[RAYS:])
