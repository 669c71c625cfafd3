"""Positions over time, from samples: used for recorded poses and for comparisons of two sources.

Between two samples a position is interpolated along a line and an orientation along the arc, but not over a gap and not
over a jump: there nothing is known. Times are ns, positions m, orientations quaternions x, y, z, w, world frame.
Pure: neighbours are `poses_csv`, `comparing`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import acos, dist, sin, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.world.scene import Quaternion, Vector

GAP_NS: Final = 1_000_000_000
"""Samples that are further apart are not connected."""
JUMP_M: Final = 0.1
JUMP_M_S: Final = 20.0
"""A step of more than the first at more than the second is a jump: the entity was placed there without a motion."""
_NEARLY_PARALLEL: Final = 0.9995

Pose = tuple[Vector, Quaternion]
Positions = Mapping[str, Pose]
Where = Callable[[int], Positions]
"""Gives the known poses of a source at a time in ns, by entity."""


def is_jump(before: Sequence[float], after: Sequence[float], passed_ns: int) -> bool:
    """Whether something did not move from one place to another in a time, but was put there."""
    way_m = dist(before, after)
    return way_m > JUMP_M and way_m * 1e9 > JUMP_M_S * max(passed_ns, 1)


def between(before: Pose, after: Pose, share: float) -> Pose:
    """Return the pose so far (0 to 1) on the way from one to another."""
    (x, y, z), (p, q, r) = before[0], after[0]
    position = x + share * (p - x), y + share * (q - y), z + share * (r - z)
    return position, _turned(before[1], after[1], share)


def _turned(a: Quaternion, b: Quaternion, share: float) -> Quaternion:
    """Return the rotation between two along the shorter arc (Shoemake, Animating rotation with quaternion curves)."""
    cosine = sum(one * other for one, other in zip(a, b, strict=True))
    if cosine < 0.0:
        b, cosine = (-b[0], -b[1], -b[2], -b[3]), -cosine
    if cosine > _NEARLY_PARALLEL:
        first, second = 1.0 - share, share
    else:
        angle = acos(cosine)
        first, second = sin((1.0 - share) * angle) / sin(angle), sin(share * angle) / sin(angle)
    x, y, z, w = (first * one + second * other for one, other in zip(a, b, strict=True))
    length = sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length


@dataclass(frozen=True, slots=True)
class Track:
    """Samples of one thing: `times_ns` (n,) ascending, `poses` (n, 7) as x, y, z, qx, qy, qz, qw."""

    times_ns: NDArray[np.int64]
    poses: NDArray[np.float64]

    def at(self, time_ns: int) -> Pose | None:
        """Return the pose at a time; None before the first sample, after the last, in a gap and in a jump."""
        number = int(self.times_ns.searchsorted(time_ns, "right")) - 1
        if number < 0:
            return None
        before_ns = int(self.times_ns[number])
        before = self._pose(number)
        if before_ns == time_ns:
            return before
        if number + 1 == len(self.times_ns):
            return None
        passed_ns = int(self.times_ns[number + 1]) - before_ns
        after = self._pose(number + 1)
        if passed_ns > GAP_NS or is_jump(before[0], after[0], passed_ns):
            return None
        return between(before, after, (time_ns - before_ns) / passed_ns)

    def _pose(self, number: int) -> Pose:
        x, y, z, qx, qy, qz, qw = self.poses[number].tolist()
        return (x, y, z), (qx, qy, qz, qw)
