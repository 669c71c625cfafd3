"""Set-points of motors, of many entities at once: an array of shape (entities, motors, 2).

Each has the target speed, and the greatest force or acceleration.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.library.mobile.wheels import Wheels
from foosim.world.components.entities import Motors
from foosim.world.components.rows import Rows
from foosim.world.components.view import Slot, View
from foosim.world.moving.columns import Columns

Floats: TypeAlias = NDArray[np.float64]


def set_points_of(motors: Sequence[Motors] | Floats, without: Motors) -> Floats:
    """Return set-points as an array; `without` are those of an entity without a command."""
    if isinstance(motors, np.ndarray):
        return motors
    numbers = np.fromiter(chain.from_iterable(chain.from_iterable(its or without for its in motors)), float)
    return numbers.reshape(len(motors), len(without), 2)


class MotionSetPoints(Rows):
    """The set-points of wheels by the actuators `v_w` of robots that move by kinematics."""

    def __init__(self, set_points: Sequence[Slot], wheels: Sequence[Wheels]) -> None:
        assert not any(its.motors for its in wheels), "wheels with motors are those of rigid robots"
        self._set_points = Columns([[slot] for slot in set_points])
        self._half_track = np.array([its.track / 2.0 for its in wheels])
        self._speed = np.array([its.speed for its in wheels])
        self._at_rest = np.empty((len(wheels), 2, 2))
        self._at_rest[:, :, 1] = np.array([its.acceleration for its in wheels])[:, None]

    def command(self, view: View) -> Floats:
        """Return the set-points, of shape (robots, 2, 2)."""
        linear, angular = self._set_points.read(view.numbers).T
        aside = angular * self._half_track
        left, right = linear - aside, linear + aside
        fastest = np.maximum(np.abs(left), np.abs(right))
        is_fast = fastest > self._speed
        share = self._speed / np.where(is_fast, fastest, 1.0)
        found = self._at_rest.copy()
        found[:, 0, 0] = np.where(is_fast, left * share, left)
        found[:, 1, 0] = np.where(is_fast, right * share, right)
        return found


class WheelSetPoints(Rows):
    """The set-points of wheels by the actuators `wheel_speeds` of robots that move by kinematics."""

    def __init__(self, set_points: Sequence[Slot], wheels: Sequence[Wheels]) -> None:
        assert not any(its.motors for its in wheels), "wheels with motors are those of rigid robots"
        self._set_points = Columns([[slot] for slot in set_points])
        self._at_rest = np.empty((len(wheels), 2, 2))
        self._at_rest[:, :, 1] = np.array([its.acceleration for its in wheels])[:, None]

    def command(self, view: View) -> Floats:
        """Return the set-points, of shape (robots, 2, 2)."""
        found = self._at_rest.copy()
        found[:, :, 0] = self._set_points.read(view.numbers)
        return found
