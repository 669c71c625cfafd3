"""What can come and go costs: an absent robot a tick, and the ticks at which fifty are added.

The fleet is that of `bench.fleet`, with spares, in one process without a capture. Figures are processor time of a
rehearsal on one node.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from statistics import median

import yaml

from bench.fleet import APART_M, fleet_text
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.world.frame import Frame

ROBOTS = 200
WARM_TICKS = 100
ADDS = 50


@dataclass(frozen=True, slots=True)
class Spares:
    """What an absent robot costs a tick (us), and the greatest ticks of a run (us): the median, the 99.9th percentile,
    with `ADDS` additions as without, and with all of these there from the start."""

    absent_us: float
    without_us: tuple[float, float]
    with_adds_us: tuple[float, float]
    with_all_us: tuple[float, float]


def spares_text(spares: int, *, are_absent: bool = True) -> str:
    """Return the deployment of a fleet with `spares` more robots, in rows beside it."""
    data = yaml.safe_load(fleet_text(ROBOTS, is_heard=False))
    for number in range(spares):
        at = {"x": f"{APART_M * (number % 50)} m", "y": f"-{APART_M * (2 + number // 50)} m"}
        data["robots"][f"s{number:04}"] = {"like": "one", "at": at, "spare": are_absent}
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=200)


def ticks_us(spares: int, ticks: int, adds: int = 0, *, are_absent: bool = True) -> list[float]:
    """Return the processor times of the ticks of a run, the first ones left out (us)."""
    times: list[int] = []

    def committed(frame: Frame) -> None:
        if frame.tick >= WARM_TICKS:
            times.append(time.process_time_ns())

    def prepare(system: System) -> None:
        for number in range(adds):
            at = WARM_TICKS + 10 + number * (ticks - 20) // adds
            system.at_tick(at, partial(system.request, "add", name=f"s{number:04}"))

    gc.collect()
    text, settings = spares_text(spares, are_absent=are_absent), Settings(on_commit=committed)
    run = rehearse(text, "fleet.yaml", WARM_TICKS + ticks, 1, settings=settings, prepare=prepare)
    assert all(answer.accepted for answer in run.answers.values()), run.answers
    return [(after - before) / 1e3 for before, after in pairwise(times)]


def spares(seconds: float = 30.0, pairs: int = 3) -> list[Spares]:
    """Measure; `seconds` is the simulated time of the run with additions."""
    found = [(sum(ticks_us(many, 300)) / 300, many) for _ in range(pairs) for many in (0, ROBOTS)]
    costs = [(with_us - us) / ROBOTS for (us, _), (with_us, _) in zip(found[::2], found[1::2], strict=True)]
    ticks = round(seconds * 100)
    runs = ticks_us(ADDS, ticks), ticks_us(ADDS, ticks, ADDS), ticks_us(ADDS, ticks, are_absent=False)
    return [Spares(median(costs), *map(greatest, runs))]


def greatest(times: Sequence[float]) -> tuple[float, float]:
    """Return the median and the 99.9th percentile."""
    ranked = sorted(times)
    return median(ranked), ranked[min(len(ranked) - 1, int(0.999 * len(ranked)))]


def lines(rows: list[Spares]) -> list[str]:
    """Return the figures for people."""
    (row,) = rows
    return [
        f"an absent robot {row.absent_us:6.2f} us a tick, of {ROBOTS} beside {ROBOTS}",
        f"ticks of {ROBOTS} robots: median {row.without_us[0]:.0f} us, p99.9 {row.without_us[1]:.0f} us; with {ADDS} "
        f"additions {row.with_adds_us[0]:.0f} and {row.with_adds_us[1]:.0f} us; with these there from the start "
        f"{row.with_all_us[0]:.0f} and {row.with_all_us[1]:.0f} us",
    ]
