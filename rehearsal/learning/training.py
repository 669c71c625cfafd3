"""Training of a policy by CMA-ES: each generation's policies meet the same shots, and the strategy learns from ranks.

The shots, the policies and so the result follow from the seed, on any number of processes.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from math import sqrt
from multiprocessing import get_context
from typing import Any, Final, NamedTuple

import numpy as np
from msgspec.structs import replace

from foosim.client.vectors import Vector
from foosim.players.learning.exercises import DEFEND, Exercise
from foosim.players.learning.policy import PolicyFile
from foosim.rehearsal.learning.shots import Range, size_of

POLICIES: Final = 12
"""Policies of a generation."""
SHOTS: Final = 40
"""Shots at each of them."""
TESTS: Final = 150
"""Shots that are not learned from."""
FIRST_TEST: Final = 1_000_000
"""The seed of the first of these: no generation gets there."""
TEST_EVERY: Final = 2
"""Generations from one test to the next."""
SEEDS_OF_A_RUN: Final = 10_000_000
"""Runs of training by different seeds meet different shots."""
STEP: Final = 0.5
"""The first standard deviation of weights."""


class Measured(NamedTuple):
    """What the mean of a generation saves of the test's shots: `generation` and `shots` (learned from) until then."""

    generation: int
    shots: int
    saved: float


class Trained(NamedTuple):
    """The policy that saved most of the test's shots, and how that came."""

    file: PolicyFile
    curve: list[Measured]


_range: Range | None = None
"""That of a process that evaluates policies."""


def _begin(exercise: Exercise) -> None:
    global _range  # noqa: PLW0603  # one for each process: it has an engine
    _range = Range(exercise)


def _saved(task: tuple[Vector, range]) -> float:
    """Return the share of shots, by their seeds, that a policy saves."""
    assert _range is not None
    weights, seeds = task
    return sum(_range.wins(weights, seeds)) / len(seeds)


class _Evaluation:
    """Evaluates policies on some processes, or in this one."""

    def __init__(self, exercise: Exercise, jobs: int) -> None:
        self.jobs = max(1, jobs)
        self._pool = get_context("spawn").Pool(jobs, _begin, (exercise,)) if jobs > 1 else None
        if self._pool is None:
            _begin(exercise)

    def shares(self, tasks: Sequence[tuple[Vector, range]]) -> list[float]:
        """Return what each policy saves of its shots."""
        return [*map(_saved, tasks)] if self._pool is None else self._pool.map(_saved, tasks, chunksize=1)

    def test(self, weights: Vector, shots: int) -> float:
        """Return what a policy saves of shots that are not learned from."""
        parts = [part for part in np.array_split(np.arange(FIRST_TEST, FIRST_TEST + shots), self.jobs) if len(part)]
        shares = self.shares([(weights, range(int(part[0]), int(part[-1]) + 1)) for part in parts])
        return sum(share * len(part) for share, part in zip(shares, parts, strict=True)) / shots

    def close(self) -> None:
        """End the processes."""
        if self._pool is not None:
            self._pool.terminate()
        elif _range is not None:
            _range.close()


def train(
    generations: int,
    seed: int = 1,
    jobs: int = 2,
    exercise: Exercise = DEFEND,
    *,
    shots: int = SHOTS,
    tests: int = TESTS,
    report: Callable[[Measured], None] = lambda tested: None,
    goes_on: Callable[[], bool] = lambda: True,
) -> Trained:
    """Train for some generations, or until `goes_on` says no; `report` gets each test.

    The curve begins with the untrained policy, at generation 0. `jobs` are processes.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it says that it cannot draw without matplotlib, and is not asked to
        from cma import CMAEvolutionStrategy

    size = size_of(exercise.untrained)
    strategy: Any = CMAEvolutionStrategy(np.zeros(size), STEP, {"seed": seed + 1, "popsize": POLICIES, "verbose": -9})
    evaluation = _Evaluation(exercise, jobs)
    curve: list[Measured] = []
    best = np.zeros(size)

    def test(generation: int, mean: Vector) -> None:
        nonlocal best
        saved = evaluation.test(mean, tests)
        if saved >= max((one.saved for one in curve), default=0.0):
            best = mean.copy()
        curve.append(Measured(generation, generation * POLICIES * shots, saved))
        report(curve[-1])

    try:
        test(0, best)
        for generation in range(1, generations + 1):
            first = seed * SEEDS_OF_A_RUN + generation * shots
            policies: list[Vector] = strategy.ask()
            shares = evaluation.shares([(policy, range(first, first + shots)) for policy in policies])
            strategy.tell(policies, [-share for share in shares])
            is_last = generation == generations or not goes_on()
            if generation % TEST_EVERY == 0 or is_last:
                test(generation, strategy.mean)
            if is_last:
                break
    finally:
        evaluation.close()
    return Trained(replace(exercise.untrained, weights=best.tolist()), curve)


def error_of(saved: float, shots: int) -> float:
    """Return the standard error of a share."""
    return sqrt(max(saved * (1.0 - saved), 0.0) / shots)
