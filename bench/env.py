"""An environment's step: the table at 100 Hz, five ticks of four substeps, with and without the emulated network.

Runs are equal to the bit, so of each step the least time over some of them counts, and of bare ticks too: on a machine
that others use the rest is theirs. Rods hold their places, or go where actions that are drawn send them. The scaling is
that of Gymnasium's vector over processes, by turns with one process and with two.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from statistics import median
from typing import Final

import gymnasium
import numpy as np

from bench.bare_tick import BareTable
from foosim.library.table.learning.exercises import PLAYER
from foosim.library.table.learning.table_rewards import Goals
from foosim.simulation.env import TABLE, FoosimEnv, FoosimParallelEnv, parallel_env

RUNS: Final = 8
BARE_TICKS: Final = 5
"""Bare ticks between two readings of the clock: as many as a step has."""
SWAY: Final = {"*/position.spin": (-3.0, 3.0)}
TURNS: Final = 5
PROCESSES: Final = 2
MADE: Final = partial(FoosimEnv, TABLE, sets=(PLAYER,))
"""One agent, and no other player."""


@dataclass(frozen=True, slots=True)
class EnvStep:
    """A step's time: `us` of the wall, and as multiples of the bare tick of Bullet in the same run."""

    what: str
    steps: int
    us: float
    bare_tick_us: float
    in_bare_ticks: float


@dataclass(frozen=True, slots=True)
class Scaling:
    """Steps a second of one process and of several, and the share of as many times one."""

    processes: int
    one_per_s: float
    all_per_s: float
    share: float


def env(seconds: float = 2.0) -> list[EnvStep | Scaling]:
    """Measure steps for so much simulated time, then the scaling."""
    steps = max(10, round(100 * seconds))
    found: list[EnvStep | Scaling] = []
    for network in (False, True):
        for sways in (False, True):
            made = parallel_env(TABLE, network=network, reward=Goals, bounds=SWAY)
            what = f"{'emulated network' if network else 'no network'}, rods {'moved' if sways else 'held'}"
            found.append(_measured(what, made, steps, sways))
            made.close()
    return [*found, _scaling(steps)]


def _measured(what: str, made: FoosimParallelEnv, steps: int, sways: bool) -> EnvStep:
    table = BareTable()
    agents = made.possible_agents
    draw = np.random.default_rng(1)
    actions = []
    for _ in range(steps):
        spaces = [made.action_space(agent) for agent in agents]
        drawn = [space.low + (space.high - space.low) * draw.random(space.shape) for space in spaces]
        held = [np.zeros(space.shape) for space in spaces]
        actions.append(dict(zip(agents, drawn if sways else held, strict=True)))
    least, bare = [float("inf")] * steps, [float("inf")] * steps
    for _ in range(RUNS):
        made.reset(seed=1)
        for number, action in enumerate(actions):
            begun_ns = time.perf_counter_ns()
            made.step(action)
            least[number] = min(least[number], time.perf_counter_ns() - begun_ns)
            begun_ns = time.perf_counter_ns()
            table.run(BARE_TICKS)
            bare[number] = min(bare[number], (time.perf_counter_ns() - begun_ns) / BARE_TICKS)
    table.close()
    us, bare_us = sum(least) / steps / 1e3, sum(bare) / steps / 1e3
    return EnvStep(what, steps, round(us, 1), round(bare_us, 1), round(us / bare_us, 2))


def _scaling(steps: int) -> Scaling:
    rates: dict[int, list[float]] = {1: [], PROCESSES: []}
    vectors = {count: gymnasium.vector.AsyncVectorEnv([MADE] * count) for count in rates}
    try:
        for count, vector in vectors.items():
            vector.reset(seed=[*range(count)])
        for _ in range(TURNS):
            for count, vector in vectors.items():
                actions = np.zeros_like(vector.action_space.sample())
                begun_ns = time.perf_counter_ns()
                for _ in range(steps):
                    vector.step(actions)
                rates[count].append(count * steps * 1e9 / (time.perf_counter_ns() - begun_ns))
    finally:
        for vector in vectors.values():
            vector.close()
    one, several = median(rates[1]), median(rates[PROCESSES])
    return Scaling(PROCESSES, round(one), round(several), round(several / (PROCESSES * one), 2))


def lines(rows: list[EnvStep | Scaling]) -> list[str]:
    """Return the figures for people."""
    found = []
    for row in rows:
        if isinstance(row, EnvStep):
            text = f"{row.what:32}{row.us:8.0f} us a step = {row.in_bare_ticks:.2f} b (b {row.bare_tick_us:.0f} us)"
        else:
            text = (
                f"{row.processes} processes: {row.all_per_s:.0f} steps/s, one {row.one_per_s:.0f}: "
                f"{100 * row.share:.0f} % of {row.processes} times one"
            )
        found.append(text)
    return found
