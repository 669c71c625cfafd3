"""Motion of bodies on a plane in a short time, many at once: speeds that approach targets, and ways along arcs.

All is element by element, of + - * / and square roots with the functions of `exact_arrays`: the bits of one do not
depend on who else is in the batch.
"""

from __future__ import annotations

from math import pi
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.common.batched.exact_arrays import sincos

Floats: TypeAlias = NDArray[np.float64]
TURN: Final = 2.0 * pi


def approached(speed: Floats, target: Floats, step: Floats | float) -> Floats:
    """Return speeds that are nearer to their targets, each by at most its step."""
    found: Floats = np.minimum(np.maximum(target, speed - step), speed + step)
    return found


def approached_together(velocity: Floats, target: Floats, step: Floats) -> Floats:
    """Return velocities, of shape (n, axes), that are nearer to their targets by a vector no longer than a step."""
    change = target - velocity
    square = change[:, 0] * change[:, 0]
    for axis in range(1, change.shape[1]):
        square = square + change[:, axis] * change[:, axis]
    length = np.sqrt(square)
    is_far = length > step
    share = step / np.where(is_far, length, 1.0)
    nearer: Floats = np.where(is_far[:, None], velocity + change * share[:, None], target)
    return nearer


class Arcs(NamedTuple):
    """Ways (x and y, m) in the world along arcs, the headings after them (rad), and z and w of their quaternions."""

    x: Floats
    y: Floats
    heading: Floats
    turn_z: Floats
    turn_w: Floats


def along_arcs(ahead: Floats, left: Floats | float, turned: Floats, heading: Floats) -> Arcs:
    """Return the motion of bodies with a constant velocity in their own frame.

    Each rolls `ahead` and `left` (m) while it turns by `turned` (rad) from `heading` on. It moves by the chord of its
    arc, the way times sin(turned / 2) / (turned / 2), in the direction half-way between (Siegwart, Nourbakhsh,
    Scaramuzza, *Introduction to Autonomous Mobile Robots*, section 3.2).
    """
    half, after = turned / 2.0, wrapped(heading + turned)
    sines, cosines = sincos(np.array((half, heading + half, 0.5 * after)))
    is_straight = half == 0.0
    chord = np.where(is_straight, 1.0, sines[0] / np.where(is_straight, 1.0, half))
    s, c = sines[1], cosines[1]
    along, across = ahead * chord, left * chord
    return Arcs(along * c - across * s, along * s + across * c, after, sines[2], cosines[2])


def wrapped(angle: Floats) -> Floats:
    """Return angles of less than one turn more as those above -180 and up to 180 degrees."""
    found: Floats = np.where(angle > pi, angle - TURN, np.where(angle <= -pi, angle + TURN, angle))
    return found


def shorter(angle: Floats) -> Floats:
    """Return angles of whatever size as those above -180 and up to 180 degrees."""
    return wrapped(angle - TURN * np.floor(angle / TURN))


def upright_turn(heading: Floats) -> tuple[Floats, Floats]:
    """Return z and w of the quaternions that turn about the vertical by these angles."""
    return sincos(0.5 * heading)
