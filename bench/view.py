"""What it costs a run that somebody looks at it: the table by turns with frames at 50 Hz and without.

The turns are of one run. One that is looked at and one that is not follow each other and are a pair, since the load of
a shared machine drifts; the figure is the median of their ratios. The reader's own process counts as well.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from statistics import median, quantiles
from typing import Final

from bench.runs import BenchError, watch

HZ: Final = 50.0
TURN_S: Final = 0.5
COST_MAX: Final = 0.02
"""How much of the tick rate one reader may take."""


@dataclass(frozen=True, slots=True)
class View:
    """Medians of the turns: ticks a second unseen and seen, frames a second that came; the share of the tick rate that
    is lost by the median of the pairs, and between which shares half of them are."""

    unseen: int
    seen: int
    frames_per_s: float
    pairs: int
    cost: float
    spread: tuple[float, float]


def view(seconds: float = 60.0) -> View:
    """Measure in a run of so many simulated seconds."""
    how = f"{HZ}", f"{TURN_S}"
    run = watch("fast", seconds, helpers=lambda simulation, radio: [["-m", "bench.viewer", simulation, *how]])
    turns = [(bool(looks), float(ticks), float(frames)) for looks, ticks, frames in json.loads(run.printed[-1])]
    pairs = [sorted(turns[at : at + 2]) for at in range(0, len(turns) - 1, 2)]
    if len(pairs) < 2:
        raise BenchError(f"{len(turns)} turns of looking at the run, at least 4 are needed: give it more --seconds")
    costs = [1.0 - seen[1] / unseen[1] for unseen, seen in pairs]
    first, _, third = quantiles(costs, n=4)
    return View(
        round(median(unseen[1] for unseen, _ in pairs)),
        round(median(seen[1] for _, seen in pairs)),
        round(median(seen[2] for _, seen in pairs), 1),
        len(pairs),
        round(median(costs), 4),
        (round(first, 4), round(third, 4)),
    )


def lines(row: View) -> list[str]:
    """Return the figures for people."""
    return [
        f"unseen {row.unseen} ticks/s, seen {row.seen} ticks/s at {row.frames_per_s:g} frames/s ({row.pairs} pairs)",
        f"cost {row.cost:.1%} of the tick rate (half of the pairs from {row.spread[0]:.1%} to {row.spread[1]:.1%}), "
        f"at most {COST_MAX:.0%} wanted",
    ]
