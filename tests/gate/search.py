"""`python -m tests.gate.search [NAME...] [--seeds N]`: for each planted bug, the first seed of the swarm that finds it.

Exit code 1 when a bug is found by no seed, or when its recorded seed does not find it.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Final

from tests.deployed import TABLE, TEXT
from tests.gate import node, supervisor, vhub
from tests.gate.planting import Mutant
from tests.swarm.campaign import fly

MUTANTS: Final[tuple[Mutant, ...]] = (*node.MUTANTS, *supervisor.MUTANTS, *vhub.MUTANTS)
"""Bugs planted in the cores, one rule switched off each: to add one, a function in `node`, `supervisor` or `vhub`."""
SEEDS: Final = 1000


@dataclass(frozen=True, slots=True)
class Found:
    """How the search for one bug went. `seed` is -1 when no seed found it."""

    name: str
    seed: int
    broken: str
    recorded_finds: bool
    cpu_s: float


def find(name: str, seeds: Sequence[int]) -> Found:
    """Fly seeds, one after the other, until one finds a bug."""
    mutant = next(mutant for mutant in MUTANTS if mutant.name == name)
    text = TEXT
    begun_s = time.process_time()
    with mutant.planted():
        for seed in seeds:
            broken = fly(text, TABLE.name, seed).broken
            if broken:
                recorded = seed == mutant.seed or bool(fly(text, TABLE.name, mutant.seed).broken)
                return Found(name, seed, broken, recorded, time.process_time() - begun_s)
    return Found(name, -1, "", False, time.process_time() - begun_s)


def main(arguments: Sequence[str] | None = None) -> int:
    """Search for the bugs that are named, or all; print a table; return the exit code."""
    names = [mutant.name for mutant in MUTANTS]
    parser = argparse.ArgumentParser(prog="python -m tests.gate.search", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="of the planted bugs; all by default")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="how many seeds a bug may take")
    parser.add_argument("--jobs", type=int, default=2, help="how many processes")
    chosen = parser.parse_args(arguments)
    unknown = sorted(set(chosen.names) - set(names))
    if unknown:
        parser.error(f"no bug {', '.join(unknown)}; there are {', '.join(names)}")
    missed = 0
    print(f"{'planted bug':42}{'seed':>5}  {'cpu s':>6}  found by")
    with ProcessPoolExecutor(chosen.jobs, mp_context=get_context("spawn")) as pool:
        wanted = chosen.names or names
        for found in pool.map(find, wanted, [range(1, chosen.seeds + 1)] * len(wanted)):
            missed += found.seed < 0 or not found.recorded_finds
            seed = str(found.seed) if found.seed >= 0 else "none"
            stale = "" if found.recorded_finds else "  (the recorded seed does not find it)"
            print(f"{found.name:42}{seed:>5}  {found.cpu_s:6.1f}  {found.broken[:110]}{stale}", flush=True)
    print(f"{len(wanted)} planted bugs, {missed} missed")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
