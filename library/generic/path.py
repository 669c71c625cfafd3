"""Paths in time: waypoints in the world, and between two of them the place and the heading that time has come to."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple


class Point(NamedTuple):
    """A place in the world (m), a heading (rad), and when to be there (s)."""

    x: float
    y: float
    z: float
    yaw: float
    time: float

    def way_to(self, other: Point) -> float:
        """Return how far it is to another one (m)."""
        dx, dy, dz = other.x - self.x, other.y - self.y, other.z - self.z
        return sqrt(dx * dx + dy * dy + dz * dz)


@dataclass(frozen=True, slots=True)
class Path:
    """Points in the order of their times, at least two; again from the first after the last one in a loop."""

    points: tuple[Point, ...]
    times: tuple[float, ...]
    is_loop: bool

    @property
    def fastest(self) -> float:
        """The greatest speed between two points (m/s)."""
        pairs = zip(self.points, self.points[1:], strict=False)
        return max(one.way_to(other) / (other.time - one.time) for one, other in pairs)

    def after(self, clock: float, time: float) -> float:
        """Return the clock of a path (s) after some time; it stops at the end of the path."""
        clock, last = clock + time, self.times[-1]
        if clock < last:
            return clock
        return clock - last if self.is_loop else last

    def at(self, clock: float) -> tuple[float, float, float, float]:
        """Return the place (m) and the heading (rad) at a time, straight from point to point; before the first one as
        there."""
        number = bisect_right(self.times, clock) - 1
        if number < 0:
            return self.points[0][:4]
        if number >= len(self.points) - 1:
            return self.points[-1][:4]
        one, other = self.points[number], self.points[number + 1]
        share = (clock - one.time) / (other.time - one.time)
        return (
            one.x + (other.x - one.x) * share,
            one.y + (other.y - one.y) * share,
            one.z + (other.z - one.z) * share,
            one.yaw + (other.yaw - one.yaw) * share,
        )


def path_of(points: Sequence[Point], *, is_loop: bool) -> Path:
    """Return the path along points that have their times."""
    return Path(tuple(points), tuple(point.time for point in points), is_loop)


def path_at_speed(points: Sequence[Point], speed: float, *, is_loop: bool) -> Path:
    """Return the path along points at one speed (m/s), and from the last one to the first where it is a loop.

    No two that follow each other are at one place.
    """
    timed = [points[0]._replace(time=0.0)]
    for point in (*points[1:], *(points[:1] if is_loop else ())):
        timed.append(point._replace(time=timed[-1].time + timed[-1].way_to(point) / speed))
    return path_of(timed, is_loop=is_loop)
