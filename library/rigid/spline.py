"""A smooth way through positions at times: the monotone cubic of Fritsch and Butland.

Between two points it is a cubic. Its speed at a point is the weighted harmonic mean of the slopes on both sides, 0
where one rises and the other does not, and 0 at both ends. So the way between two points never leaves what lies between
their positions: limits that hold for the points hold for the way.

Source: F. N. Fritsch and J. Butland, A method for constructing local monotone piecewise cubic interpolants, SIAM
Journal on Scientific and Statistical Computing 5 (1984), with the weights of `PchipInterpolator` of scipy.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence


def position_at(times: Sequence[float], positions: Sequence[float], time: float) -> float:
    """Return where the way is at a time (s) from the first of its times on; from the last one on it stays there.

    Times rise; there are two at least, and as many positions.
    """
    if time >= times[-1]:
        return positions[-1]
    place = bisect_right(times, time) - 1
    span = times[place + 1] - times[place]
    share = (time - times[place]) / span
    here, there = positions[place], positions[place + 1]
    leaving, coming = (span * _speed(times, positions, point) for point in (place, place + 1))
    way = there - here
    return here + share * (
        leaving + share * (3.0 * way - 2.0 * leaving - coming + share * (leaving + coming - 2.0 * way))
    )


def fastest(times: Sequence[float], positions: Sequence[float]) -> float:
    """Return the greatest speed of the way, in either direction: that of a point, or of the vertex of the parabola
    that the speed is between two."""
    speeds = [_speed(times, positions, point) for point in range(len(times))]
    found = [abs(speed) for speed in speeds]
    for place in range(len(times) - 1):
        slope = (positions[place + 1] - positions[place]) / (times[place + 1] - times[place])
        found.append(abs(slope))  # infinite between points that are too far apart
        leaving, coming = speeds[place], speeds[place + 1]
        rising, bending = 6.0 * slope - 4.0 * leaving - 2.0 * coming, 3.0 * (leaving + coming - 2.0 * slope)
        if bending and 0.0 < (vertex := -0.5 * rising / bending) < 1.0:
            found.append(abs(leaving + vertex * (rising + vertex * bending)))
    return max(found)


def _speed(times: Sequence[float], positions: Sequence[float], point: int) -> float:
    """Return the speed at a point."""
    if point in (0, len(times) - 1):
        return 0.0
    before, after = times[point] - times[point - 1], times[point + 1] - times[point]
    coming = (positions[point] - positions[point - 1]) / before
    leaving = (positions[point + 1] - positions[point]) / after
    if coming * leaving <= 0.0:
        return 0.0
    of_coming, of_leaving = 2.0 * after + before, after + 2.0 * before
    return (of_coming + of_leaving) / (of_coming / coming + of_leaving / leaving)
