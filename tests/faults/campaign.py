"""`python -m tests.faults.campaign [--count N] [--seed S] [--only KIND]`: repeats faults on real processes.

Each kind (`kinds`) is made again and again at random times, on runs of its own (`cluster`), and every run must end with
the digests of an undisturbed rehearsal. It prints a table, and JSON at last.

It ends with 1 when a figure misses its limit or something did not hold; the seed in the first line repeats the times
and choices, though not what the machine did meanwhile.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Final

from bench import machine
from tests.faults.cluster import Cluster, FaultError
from tests.faults.digest import DISTURBED
from tests.faults.kinds import KINDS, NODE, Kind, Trial
from tests.faults.launched import LAUNCHED, Launched
from tests.faults.outside import OUTSIDE

COUNT: Final = 20
TRIALS_A_RUN: Final = 20
"""Then a new run begins, so that the frames of each can be computed again."""
ALL: Final = (*KINDS, *OUTSIDE, *LAUNCHED, DISTURBED)


@dataclass(slots=True)
class Found:
    """What the trials of one kind gave: all figures, what did not hold, and how many ticks were compared."""

    kind: str
    trials: int = 0
    ticks: int = 0
    figures: dict[str, list[float]] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)

    def take(self, figures: dict[str, float]) -> None:
        """Count one trial."""
        self.trials += 1
        for name, value in figures.items():
            self.figures.setdefault(name, []).append(value)


def p99(values: Sequence[float]) -> float:
    """Return the 99th percentile by nearest rank: of fewer than 100 values the largest."""
    return sorted(values)[max(0, -(-99 * len(values) // 100) - 1)]


def repeat(kind: Kind | Launched, count: int, seed: int, folder: Path) -> Found:
    """Do a fault `count` times, on as many runs as that takes."""
    found, dice, run = Found(kind.name), random.Random(f"{seed} {kind.name}"), 0
    while found.trials < count:
        run += 1
        name = f"{kind.name.replace('_', '-')}-{run}"
        try:
            if isinstance(kind, Launched):
                found.take(kind.trial(folder, name, dice))
            else:
                on_one_run(kind, count - found.trials, Place(folder, name, seed), dice, found)
        except FaultError as error:
            found.failures.append(f"{name}, trial {found.trials + 1}: {error}")
            return found
        finally:
            (folder / f"{name}.mcap").unlink(missing_ok=True)
    for figure, limit in kind.limits.items():
        value = p99(found.figures[figure])
        if value > limit:
            found.failures.append(f"{figure}: p99 {value:.0f}, at most {limit:.0f} is allowed")
    return found


@dataclass(frozen=True, slots=True)
class Place:
    """Where a run is, what it is called, and the seed of its links."""

    folder: Path
    name: str
    seed: int


def on_one_run(kind: Kind, count: int, place: Place, dice: random.Random, found: Found) -> None:
    """Do a fault to one run, up to `count` times, and end and compare the run."""
    nodes = dict.fromkeys(("red", "blue"), NODE)
    with Cluster(place.folder, place.name, kind.sets, pace=kind.pace, seed=place.seed, programs=nodes) as cluster:
        kind.prepare(cluster)
        for _ in range(min(kind.trials_a_run or TRIALS_A_RUN, count)):
            found.take(kind.trial(Trial(cluster, dice)))
        found.ticks += cluster.end(kind.altered)["ticks"]


def lines(kind: Kind | Launched, found: Found, took_s: float) -> list[str]:
    """Return the rows of one kind for people."""
    shown = []
    start = f"{kind.name:18}{found.trials:5}"
    for figure, values in found.figures.items():
        row = f"{start}  {figure:12}{median(values):9.1f}{p99(values):9.1f}{max(values):9.1f}"
        shown.append(row + (f"{kind.limits[figure]:8.0f}" if figure in kind.limits else " " * 8))
    shown = shown or [start]
    compared = f"; {found.ticks} ticks compared" if found.ticks else ""
    shown[0] += f"   {kind.title}{compared} [{took_s:.0f} s]"
    return [*shown, *(f"    FAILED: {failure}" for failure in found.failures)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Repeat the kinds that are named, or all of them; return the exit code."""
    names = [kind.name for kind in ALL]
    parser = argparse.ArgumentParser(prog="python -m tests.faults.campaign", description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT, help=f"how often each fault is made, {COUNT} by default")
    parser.add_argument("--seed", type=int, help="of times and choices; by default a new one, which is printed")
    parser.add_argument("--only", action="append", choices=names, help="this kind alone; may be repeated")
    parser.add_argument("--folder", type=Path, help="an empty one, which keeps the logs of all runs")
    chosen = parser.parse_args(arguments)
    if chosen.count < 1:
        parser.error(f"--count {chosen.count}: at least 1")
    seed = random.SystemRandom().randrange(1_000_000) if chosen.seed is None else chosen.seed
    here = machine.this_machine()
    print(f"seed {seed}; {here.cores} cores, {here.cpu}, load {here.load:.2f} before", flush=True)
    print(f"{'fault':18}{'times':>5}  {'figure (ms)':12}{'median':>9}{'p99':>9}{'max':>9}{'limit':>8}", flush=True)
    everything = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = chosen.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        os.environ["XDG_STATE_HOME"] = str(folder)  # the user's own runs keep their folders
        for kind in ALL:
            if chosen.only and kind.name not in chosen.only:
                continue
            begun_s = time.monotonic()
            found = repeat(kind, max(1, chosen.count // kind.costs), seed, folder.absolute())
            everything.append(found)
            print("\n".join(lines(kind, found, time.monotonic() - begun_s)), flush=True)
    print(json.dumps({"seed": seed, "machine": asdict(here), "faults": [asdict(found) for found in everything]}))
    return int(any(found.failures for found in everything))


if __name__ == "__main__":
    sys.exit(main())
