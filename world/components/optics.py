"""The optics of a camera, and the numbers of links that move.

A camera looks along the x axis of its mount; y is to the left, z up. A picture's rows go down, its columns
to the right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from foosim.world.scene import MOVING, Body


@dataclass(frozen=True, slots=True)
class Optics:
    """What a camera's picture depends on, beside its pose.

    `fov` is the horizontal angle of view (rad), `near` and `far` are distances along the axis (m) between which things
    are seen. Each pixel is the mean of `samples` x `samples` points. `exposure` (s) blurs what moves; `distortion` are
    Brown's k1, k2, p1, p2, k3; `noise` is the standard deviation of each value (of 255), `gain` its factor.
    """

    width: int
    height: int
    fov: float
    near: float
    far: float
    samples: int = 1
    shadows: bool = False
    exposure: float = 0.0
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    noise: float = 0.0
    gain: float = 1.0


def moving_links(bodies: Mapping[str, Body]) -> list[tuple[str, int]]:
    """Return the links whose pose is not constant, as (body, index of the link): by bodies in name order.

    The place in the list is the link's number for what draws it.
    """
    found = []
    for name, body in sorted(bodies.items()):
        moves: list[bool] = []
        for index, link in enumerate(body.links):
            moves.append(link.joint in MOVING or link.joint == "free" or (link.parent >= 0 and moves[link.parent]))
            if moves[-1]:
                found.append((name, index))
    return found
