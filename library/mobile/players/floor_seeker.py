"""Drives robots by their cameras: each turns to where more floor is seen, and slows down before what its scanner meets.

Floor is what has the colour of the middle of the lowest row of the picture.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from foosim.client.player import Commands, Player, Samples
from foosim.common.errors import BadValue
from foosim.deployment.schema import Deployment
from foosim.library.generic.laser_scanner import Scan
from foosim.library.mobile.v_w import Motion
from foosim.world.components.sight import Sight

SPEED: Final = 0.7  # m/s, where all is free ahead
SLOW_M: Final = 1.5  # it slows down from this distance ahead,
STOP_M: Final = 0.4  # and turns on the spot at this one
TURN: Final = 4.0  # rad/s for each share of the picture that one side has more floor than the other
TURN_ON_SPOT: Final = 1.2  # rad/s
ALIKE: Final = 12  # the greatest difference of a colour from 0 to 255 to that of the floor
EVERY: Final = 4  # it looks at each fourth pixel of a row and a column


class FloorSeeker(Player):
    """The player. Each of its robots has the sensors `eye`, a camera, and `scan`, a laser scanner over 180 degrees."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        """It has no parameters. Raises BadValue."""
        if parameters:
            raise BadValue("a floor seeker has no parameters", sorted(parameters))
        self._turning: dict[str, float] = {}
        """How robots turn on the spot (rad/s), until their way is free."""

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return a motion for each robot that has seen something."""
        motions = {}
        for robot in self.robots:
            eye, scan = samples.get((robot, "eye")), samples.get((robot, "scan"))
            if eye is not None and scan is not None:
                assert isinstance(eye.value, Sight) and isinstance(scan.value, Scan)
                leftwards, ways = more_floor_left(eye.value.image()), scan.value.distances
                side = len(ways) // 6  # the middle two thirds are ahead
                ahead = min(ways[side : len(ways) - side])
                if ahead < STOP_M:
                    turning = TURN_ON_SPOT if leftwards >= 0.0 else -TURN_ON_SPOT
                    motions[robot] = Motion(0.0, self._turning.setdefault(robot, turning))
                else:
                    self._turning.pop(robot, None)
                    motions[robot] = Motion(SPEED * min(1.0, (ahead - STOP_M) / (SLOW_M - STOP_M)), TURN * leftwards)
        return motions


def more_floor_left(image: NDArray[np.uint8]) -> float:
    """Return how much more of the lower half of a picture is floor on the left than on the right, from -1 to 1."""
    lower = image[image.shape[0] // 2 :: EVERY, ::EVERY].astype(np.int16)
    middle = lower.shape[1] // 2
    is_floor = (np.abs(lower - lower[-1, middle]) <= ALIKE).all(axis=2)
    return float(is_floor[:, :middle].mean() - is_floor[:, -middle:].mean())
