"""Bounding volumes of rods and balls: a kit of such bodies has them, instead of the volumes of bodies of any kind."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Final

REACHED: Final = ("rod", "ball")
"""The rigid models that may share a solve."""
MARGIN_M = 0.001
"""Added to every bounding volume: contacts are found up to Bullet's breaking threshold of 1 mm."""


@dataclass(frozen=True)
class Reach:
    """Bounding volumes. `ball_m` is the radius of a grown ball; `rods` are (index, name, x of the axis) in order of x,
    with one half width and one band of z; `balls` are (index, start of the position); `alone` are the islands of
    entities without contacts."""

    ball_m: float
    rods: tuple[tuple[int, str, float], ...]
    axes: tuple[float, ...]
    half_width_m: float
    z_low_m: float
    z_high_m: float
    balls: tuple[tuple[int, int], ...]
    alone: tuple[Island, ...] = ()

    def without(self, absent: Collection[int]) -> Reach:
        """Return the volumes of all but some entities, by their indices."""
        balls = tuple([ball for ball in self.balls if ball[0] not in absent])
        alone = tuple([one for one in self.alone if one.entities[0] not in absent])
        return replace(self, balls=balls, alone=alone)


@dataclass(frozen=True)
class Island:
    """Indices of its entities, ascending, and the robot (its name) whose owner solves it; empty without one."""

    entities: tuple[int, ...]
    nearest: str
