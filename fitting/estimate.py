"""Fits the surfaces of a table to measured tracks of its ball, by least squares, with confidence intervals.

Each track has a start of its own (place, velocity, how much of it rolls), which is fitted along; the surfaces are those
of all tracks. Residuals are the distances of measured places from the motion's, in x and y, and count alike. The
intervals are those of linear regression at the best fit: Student's t with the variance of the residuals, J the
derivatives (Seber and Wild, Nonlinear Regression, 1989, 5.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any, Final

import numpy as np

from foosim.common.errors import Failed
from foosim.common.keyed_random import draw_key, draw_words, gaussian
from foosim.fitting.motion import Array, Field, Motion, Pairs, Start, motion

STARTS: Final = len(Start._fields)
LEAST: Final = Pairs(0.0, 0.0, 0.0, 0.0)
MOST: Final = Pairs(0.01, 2.0, 1.0, 2.0)
STEPS: Final = Pairs(1e-6, 1e-4, 1e-4, 1e-4)
"""By how much a surface is changed for a derivative; of starts see START_STEPS."""
START_STEPS: Final = (1e-5, 1e-5, 1e-4, 1e-4, 1e-3)
BEGINNING: Final = 10
"""The count of first points from which a start is estimated."""
CONFIDENCE: Final = 0.95
HORIZONS_S: Final = (0.3, 0.6, 1.2)
"""The fit begins with this part of each track, and continues with more from its result: a rebound at a wrong time,
as after a start at a wrong speed, would keep it from the right one."""
SCALES: Final = Pairs(2e-4, 0.1, 0.1, 0.1)
HELD_M: Final = 0.003
"""Until then a surface that is SCALES off its start counts as much as a place that is this far off: a surface that so
short a track does not determine stays."""
WALLS: Final = 0.05
"""The fit begins with no more friction at walls: where that is enough to stop the slip, more of it changes nothing, and
no derivative leads back."""
ROLLS: Final = (0.9, 0.1)
"""In the starts that the fit begins with balls roll so much, and the better one of two fits counts: where a ball begins
to roll, and whether a rebound stops its slip, gives the squares several minima."""
HOPS: Final = (2, 10)
"""The counts of further fits that begin about HOP standard errors off the best one, to find other minima: the greater
one while residuals are more than SCATTER times the scatter of the measured places."""
SCATTER: Final = 1.1
HOP: Final = 4.0
HOP_MOST: Final = Start(0.003, 0.003, 0.05, 0.05, 0.3)
"""A standard error is at most that, and of surfaces at most SCALES."""
TRIES_MAX: Final = 60
SLOW: Final = 0.1
"""m/s: slower rebounds are within the noise."""
BESIDE: Final = 4
"""The count of points over which speeds before and after a rebound are measured."""
KNOWN: Final = 0.5
"""An interval that reaches farther than this share of its value, to either side, is not determined by the tracks."""


class NoLeastSquares(Failed):
    """The library that fits is not installed."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """A surface's value, half of its interval of confidence, and whether the tracks determine it."""

    value: float
    half: float

    @property
    def is_known(self) -> bool:
        return self.half <= KNOWN * abs(self.value)


@dataclass(frozen=True, slots=True)
class Result:
    """What was fitted, by field of `Pairs`; the standard deviation of the residuals (m), points, rebounds at walls; the
    root of the mean square of each track's residuals (m); whether the fit came to an end."""

    pairs: dict[str, Fitted]
    noise: float
    points: int
    rebounds: int
    of_tracks: tuple[float, ...]
    is_converged: bool


def fit(tracks: Sequence[Array], field: Field, first: Pairs) -> Result:
    """Return the surfaces that fit tracks best. The fit begins with `first`.

    The rows of a track are time (s), x and y (m). Without a rebound walls are not fitted.
    Raises NoLeastSquares.
    """
    first = first._replace(bounce=_bounce(tracks, field) or first.bounce, walls=min(first.walls, WALLS))
    names = Pairs._fields if rebounds(tracks, field) else ("rolling", "floor")
    problem = _Problem(tracks, field, first, names)
    fits = (problem.solve(_begin(tracks, field, first, names, rolls)) for rolls in ROLLS)
    scatter = sqrt(sum(len(track) * scatter_of(track) ** 2 for track in tracks) / sum(map(len, tracks)))
    best = _hop(problem, min(fits, key=_cost), scatter)
    from scipy.special import stdtrit

    factor = float(stdtrit(len(best.fun) - len(best.x), 0.5 + CONFIDENCE / 2.0))
    pairs = {
        name: Fitted(float(value), factor * float(error))
        for name, value, error in zip(names, best.x, _errors(best), strict=False)
    }
    met = sum(len(one.rebounds) for one in problem.motions(best.x))
    return Result(pairs, _noise(best), len(best.fun) // 2, met, problem.rms(best.fun), best.status > 0)


def _begin(tracks: Sequence[Array], field: Field, first: Pairs, names: Sequence[str], rolls: float) -> Array:
    """Return the vector to begin the fit of whole tracks with, from fits of ever more of each."""
    surfaces = [getattr(first, name) for name in names]
    vector = np.array(surfaces + [value for track in tracks for value in guess(track, rolls)])
    longest = max(float(track[-1, 0] - track[0, 0]) for track in tracks)
    for horizon in HORIZONS_S:
        if horizon < longest:
            shorter = [_upto(track, horizon) for track in tracks]
            vector = _Problem(shorter, field, first, names, is_held=True).solve(vector).x
    return vector


def _hop(problem: _Problem, best: Any, scatter: float) -> Any:
    """Return the best of a fit and the ones that begin near it."""
    key = draw_key(0, "fit", "hop")
    least, most = HOPS
    for hop in range(most):
        if hop >= least and _noise(best) <= SCATTER * scatter:
            break
        drawn = np.array([gaussian(draw_words(key, hop, place)[0]) for place in range(len(best.x))])
        beside = best.x + HOP * np.minimum(_errors(best), problem.hop_most) * drawn
        best = min(best, problem.solve(beside), key=_cost)
    return best


def _cost(found: Any) -> float:
    return float(found.cost)


def _noise(found: Any) -> float:
    """Return the standard deviation of the residuals (m)."""
    return sqrt(2.0 * found.cost / (len(found.fun) - len(found.x)))


def _errors(found: Any) -> Array:
    """Return the standard errors of the fitted values, infinite for undetermined ones.

    They are the roots of the diagonal of the inverse of J^T J, times the variance of the residuals.
    """
    jac = found.jac
    scale = np.sqrt((jac * jac).sum(axis=0))
    is_known = scale > 0.0
    scale[~is_known] = 1.0
    _, singular, rows = np.linalg.svd(jac / scale, full_matrices=False)
    singular = np.maximum(singular, 1e-10 * singular[0])
    errors: Array = _noise(found) * np.sqrt(((rows / singular[:, None]) ** 2).sum(axis=0)) / scale
    errors[~is_known] = np.inf
    return errors


def guess(track: Array, rolls: float) -> Start:
    """Return a start from the first points of a track, by straight lines, of a ball that rolls so much."""
    first = track[:BEGINNING]
    time = first[:, 0] - first[0, 0]
    middle = time - time.mean()
    speeds = (first[:, 1:] * middle[:, None]).sum(axis=0) / (middle * middle).sum()
    x, y = first[:, 1:].mean(axis=0) - speeds * time.mean()
    return Start(float(x), float(y), float(speeds[0]), float(speeds[1]), rolls)


def scatter_of(track: Array) -> float:
    """Return by how much the places of a track scatter (m), from each one's distance from the line of its neighbours.

    It is the median, as a standard deviation (0.6745 of it), so that rebounds and lost pictures do not count.
    """
    time, place = track[:, 0], track[:, 1:]
    later = ((time[1:-1] - time[:-2]) / (time[2:] - time[:-2]))[:, None]
    aside = place[1:-1] - (1.0 - later) * place[:-2] - later * place[2:]
    return float(np.median(np.abs(aside) / np.sqrt(1.0 + later**2 + (1.0 - later) ** 2))) / 0.6745


def _upto(track: Array, horizon: float) -> Array:
    """Return the points of so much time of a track, as many as a start is guessed from at least."""
    count = int(np.searchsorted(track[:, 0], track[0, 0] + horizon, side="right"))
    return track[: max(count, BEGINNING)]


def rebounds(tracks: Sequence[Array], field: Field) -> list[float]:
    """Return the restitution of each rebound of tracks, estimated from its points."""
    found = []
    for track in tracks:
        for axis, most in ((1, field.x), (2, field.y)):
            place = track[:, axis]
            for at in range(BESIDE, len(track) - BESIDE):
                is_farthest = abs(place[at]) == np.abs(place[at - BESIDE : at + BESIDE + 1]).max()
                if is_farthest and abs(place[at]) > most - 2.0 * field.radius:
                    before, after = (
                        _slope(track[one], axis) for one in (slice(at - BESIDE, at), slice(at + 1, at + 1 + BESIDE))
                    )
                    if before * place[at] > 0.0 > after * place[at] and abs(before) > SLOW:
                        found.append(-after / before)
    return found


def _slope(rows: Array, axis: int) -> float:
    time = rows[:, 0] - rows[:, 0].mean()
    return float((time * rows[:, axis]).sum() / (time * time).sum())


def _bounce(tracks: Sequence[Array], field: Field) -> float | None:
    """Return the median restitution of rebounds, within limits; None without a rebound."""
    found = rebounds(tracks, field)
    return min(max(float(np.median(found)), 0.05), 0.98) if found else None


class _Problem:
    """The residuals of all tracks and their derivatives, by the fitted vector: surfaces, then starts.

    `is_held`: surfaces are held to the start of the fit, by residuals of their own.
    """

    def __init__(
        self, tracks: Sequence[Array], field: Field, first: Pairs, names: Sequence[str], *, is_held: bool = False
    ) -> None:
        self._tracks, self._field, self._first, self._names = tracks, field, first, names
        self._held = len(names) if is_held else 0
        self._times = [track[:, 0] - track[0, 0] for track in tracks]
        starts = [(-field.x, field.x), (-field.y, field.y), (-50.0, 50.0), (-50.0, 50.0), (0.0, 1.0)] * len(tracks)
        low = [getattr(LEAST, name) for name in names] + [least for least, _ in starts]
        high = [getattr(MOST, name) for name in names] + [most for _, most in starts]
        self.bounds = (low, high)
        self.hop_most = np.array([*(getattr(SCALES, name) for name in names), *HOP_MOST * len(tracks)])

    def solve(self, vector: Array) -> Any:
        """Return scipy's result from this start. Raises NoLeastSquares."""
        try:
            from scipy.optimize import least_squares
        except ImportError:
            raise NoLeastSquares("the fit needs scipy: pip install 'foosim[fit]'") from None
        return least_squares(
            self.residuals,
            self._within(vector),
            self.derivatives,
            bounds=self.bounds,
            x_scale="jac",
            ftol=1e-7,
            xtol=1e-7,
            max_nfev=TRIES_MAX,
        )

    def _within(self, vector: Array) -> Array:
        """Return a vector off the bounds, on which the solver cannot begin."""
        low, high = np.array(self.bounds)
        edge = 1e-6 * (high - low)
        begun: Array = np.clip(vector, low + edge, high - edge)
        return begun

    def _pairs(self, vector: Array) -> Pairs:
        return self._first._replace(**dict(zip(self._names, map(float, vector), strict=False)))

    def _of(self, number: int, pairs: Pairs, start: Array) -> Motion:
        return motion(Start(*map(float, start)), pairs, self._field, float(self._times[number][-1]) + 1e-9)

    def _start(self, number: int, vector: Array) -> Array:
        at = len(self._names) + STARTS * number
        return vector[at : at + STARTS]

    def motions(self, vector: Array) -> list[Motion]:
        """Return the way of each track."""
        pairs = self._pairs(vector)
        return [self._of(number, pairs, self._start(number, vector)) for number in range(len(self._tracks))]

    def residuals(self, vector: Array) -> Array:
        """Return by how much each place of each motion is beside the measured one (m)."""
        held = [
            HELD_M * (vector[place] - getattr(self._first, name)) / getattr(SCALES, name)
            for place, name in enumerate(self._names[: self._held])
        ]
        beside = [
            (one.at(times) - track[:, 1:]).ravel()
            for one, times, track in zip(self.motions(vector), self._times, self._tracks, strict=True)
        ]
        return np.concatenate([*beside, np.array(held)])

    def rms(self, residuals: Array) -> tuple[float, ...]:
        """Return the root of the mean square of the residuals of each track (m)."""
        ends = np.cumsum([2 * len(track) for track in self._tracks])
        return tuple(float(np.sqrt((one * one).mean())) for one in np.split(residuals, ends[:-1]))

    def derivatives(self, vector: Array) -> Array:
        """Return the derivatives of the residuals, by central differences: a start matters to its own track alone."""
        pairs = self._pairs(vector)
        rows: Array = np.zeros((2 * sum(map(len, self._tracks)) + self._held, len(vector)))
        for place, name in enumerate(self._names[: self._held]):
            rows[place - self._held, place] = HELD_M / getattr(SCALES, name)
        row = 0
        for number, times in enumerate(self._times):
            start = self._start(number, vector)
            upto = row + 2 * len(times)
            for place, name in enumerate(self._names):
                step = getattr(STEPS, name)
                sides = [
                    self._of(number, pairs._replace(**{name: max(getattr(pairs, name) + sign * step, 0.0)}), start)
                    for sign in (1.0, -1.0)
                ]
                width = step + min(step, getattr(pairs, name))
                rows[row:upto, place] = (sides[0].at(times) - sides[1].at(times)).ravel() / width
            for place, step in enumerate(START_STEPS):
                moved = [start.copy(), start.copy()]
                moved[0][place] += step
                moved[1][place] -= step
                one, other = (self._of(number, pairs, side).at(times) for side in moved)
                rows[row:upto, len(self._names) + STARTS * number + place] = (one - other).ravel() / (2.0 * step)
            row = upto
        return rows
