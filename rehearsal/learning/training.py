"""Training of a policy by CMA-ES: each generation's policies meet the same shots, and the strategy learns from ranks.

The mean of each generation's policies meets two more sets of shots. One decides which mean is kept, the curve
shows what is saved of the other, so the choice does not flatter the curve. All follows from the seed, on any number of
processes.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from math import inf, sqrt
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from msgspec.structs import replace

from foosim.client.vectors import Vector
from foosim.players.learning.exercises import DEFEND, Exercise
from foosim.players.learning.policy import PolicyFile
from foosim.rehearsal.learning.shots import Range
from foosim.rehearsal.workers import Workers

STEP: Final = 0.3
"""The first standard deviation of weights."""
SEEDS_OF_A_RUN: Final = 10_000_000
"""Runs of training by different seeds learn from different shots."""
FIRST_TEST: Final = 1_000_000
"""The seed of the first shot that a curve shows: no run learns from it, the first begins at SEEDS_OF_A_RUN."""
FIRST_CHOICE: Final = 1_500_000
"""The seed of the first shot that decides which mean is kept; none learns from it, either."""
PIECE: Final = 20
"""Shots that a process takes at once."""


class Effort(NamedTuple):
    """What training costs."""

    policies: int = 12
    """Policies of a generation."""
    shots: int = 40
    """Shots at each of them."""
    choices: int = 60
    """Shots at a mean that decide whether it is kept."""
    tests: int = 120
    """Shots at a mean that the curve shows."""


EFFORT: Final = Effort()
"""That of the command."""


class Measured(NamedTuple):
    """What the mean of a generation saves of the test's shots, and how many shots were learned from until then."""

    generation: int
    shots: int
    saved: float


class Trained(NamedTuple):
    """What training has made. The curve begins with the untrained policy, which stands still, at generation 0."""

    file: PolicyFile
    """The policy that is kept."""
    kept: Measured
    """When it was measured, and what it saves."""
    curve: list[Measured]
    by_hand: float
    """What the exercise's controller saves of the same shots that was written by hand."""


Row: TypeAlias = tuple[Vector | None, range]
"""The weights of a policy, and the seeds of the shots at it. Without weights it is the exercise's controller that was
written by hand."""
Shares: TypeAlias = Callable[[Sequence[Row]], list[float]]
"""Returns which share of its shots each row's policy saves."""


class Pace:
    """Tells whether a generation would end before a time (s of `now_s`), by the longest one so far."""

    def __init__(self, end_s: float, now_s: Callable[[], float]) -> None:
        self._end_s, self._now_s = end_s, now_s
        self._longest_s, self._last_s = 0.0, now_s()

    def has_time(self) -> bool:
        """Whether one more would. It is called after each generation."""
        now_s = self._now_s()
        self._longest_s, self._last_s = max(self._longest_s, now_s - self._last_s), now_s
        return now_s + self._longest_s <= self._end_s


_ranges: dict[str, Range] = {}
"""Those of this process, by the exercise: a range has an engine."""


def _saved(exercise: Exercise, row: Row) -> int:
    """Return how many shots are saved."""
    key = repr(exercise)
    if key not in _ranges:
        _ranges[key] = Range(exercise)
    weights, seeds = row
    return sum(_ranges[key].wins_by_hand(seeds) if weights is None else _ranges[key].wins(weights, seeds))


class _Evaluation:
    """Evaluates policies on some processes, or in this one."""

    def __init__(self, exercise: Exercise, jobs: int) -> None:
        self._exercise = exercise
        self._workers = Workers(jobs, "the training")

    def shares(self, rows: Sequence[Row]) -> list[float]:
        """Return which share of its shots each row's policy saves."""
        pieces = [
            (number, (weights, seeds[at : at + PIECE]))
            for number, (weights, seeds) in enumerate(rows)
            for at in range(0, len(seeds), PIECE)
        ]
        counts = self._workers.results(partial(_saved, self._exercise), [piece for _, piece in pieces])
        saved = [0] * len(rows)
        for (number, _), count in zip(pieces, counts, strict=True):
            saved[number] += count
        return [count / len(seeds) for count, (_, seeds) in zip(saved, rows, strict=True)]

    def close(self) -> None:
        """End the processes, or free the engine."""
        self._workers.close()
        for there in _ranges.values():
            there.close()
        _ranges.clear()


class Best(NamedTuple):
    """The weights that are kept, when they were measured, and the curve."""

    weights: Vector
    kept: Measured
    curve: list[Measured]


def learn(
    shares: Shares,
    size: int,
    generations: int,
    seed: int,
    effort: Effort,
    report: Callable[[Measured], None],
    pace: Pace,
) -> Best:
    """Learn `size` weights, beginning with zeros, for some generations: at least one, and more while there is time."""
    tests = range(FIRST_TEST, FIRST_TEST + effort.tests)
    choices = range(FIRST_CHOICE, FIRST_CHOICE + effort.choices)
    strategy = _strategy(size, seed, effort)
    curve: list[Measured] = []
    most, best = -1.0, np.zeros(size)
    for generation in range(generations + 1):
        if generation > 0:
            first = seed * SEEDS_OF_A_RUN + generation * effort.shots
            policies: list[Vector] = strategy.ask()
            found = shares([(policy, range(first, first + effort.shots)) for policy in policies])
            strategy.tell(policies, [-share for share in found])
        saved, chosen = shares([(strategy.mean, tests), (strategy.mean, choices)])
        curve.append(Measured(generation, generation * effort.policies * effort.shots, saved))
        report(curve[-1])
        if chosen >= most:  # of equals the later one
            most, best, kept = chosen, strategy.mean.copy(), curve[-1]
        if not pace.has_time() and generation > 0:
            break
    return Best(best, kept, curve)


def train(
    generations: int,
    seed: int = 1,
    jobs: int = 2,
    exercise: Exercise = DEFEND,
    *,
    effort: Effort = EFFORT,
    report: Callable[[Measured], None] = lambda measured: None,
    end_s: float = inf,
) -> Trained:
    """Train for some generations, at least one, so that training ends before a time of `time.monotonic`.

    `jobs` are processes; `report` gets each point of the curve. Raises Failed when a process was killed.
    """
    pace = Pace(end_s, time.monotonic)
    evaluation = _Evaluation(exercise, jobs)
    try:
        (by_hand,) = evaluation.shares([(None, range(FIRST_TEST, FIRST_TEST + effort.tests))])
        found = learn(evaluation.shares, exercise.untrained.size, generations, seed, effort, report, pace)
    finally:
        evaluation.close()
    file = replace(exercise.untrained, weights=found.weights.tolist())
    return Trained(file, found.kept, found.curve, by_hand)


def _strategy(size: int, seed: int, effort: Effort) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # cma says that it cannot draw without matplotlib, and is not asked to
        from cma import CMAEvolutionStrategy
    options = {"seed": seed + 1, "popsize": effort.policies, "verbose": -9}
    return CMAEvolutionStrategy(np.zeros(size), STEP, options)


def error_of(saved: float, shots: int) -> float:
    """Return the standard error of a share."""
    return sqrt(max(saved * (1.0 - saved), 0.0) / shots)
