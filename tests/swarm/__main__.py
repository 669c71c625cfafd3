"""`python -m tests.swarm FILE [--seed N] [--seeds N] [--for SPAN] [--jobs N] [--json]`: runs under random faults.

A seed draws 3 to 5 nodes, their clocks, delay, loss and duplication of messages, and 8 to 20 faults of at least three
kinds in 208 ticks, on the pure engine if it has the bodies; --for simulates longer, with more faults. Faults are:
killed, interrupted, paused, slow and stopped processes; partitions in one or both directions and clogs; jumps of memory
and clocks; old messages; lost players (every eighth seed); moved robots; added, removed and pushed bodies; pauses of
the run. Every record, message and committed tick is checked against the laws. At the end all faults heal, and every
process has to take part again. Exit code 1 when a seed broke a law.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import asdict
from functools import partial
from pathlib import Path

from foosim.common.units import parse_ns
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.text.files import read_source_file
from foosim.simulation.attendant import LINE_S
from foosim.simulation.workers import apart, executor_here
from tests.swarm.campaign import Files, Flown, fly
from tests.swarm.faults import TICKS


def fly_seeds(
    text: str, name: str, seeds: Sequence[int], ticks: int, jobs: int, files: Files = ()
) -> Generator[Flown, None, None]:
    """Fly the seeds in `jobs` processes, and yield their results in the order of the seeds.

    One job is this process. The processes end with the iterator, also amid a seed. Raises Lost when one of them was
    killed.
    """
    work = partial(fly, text, name, ticks=ticks, files=files)
    if jobs == 1:
        yield from map(work, seeds)
        return
    with executor_here(jobs) as pool:
        yield from (done.result() for done in [pool.submit(apart, work, seed) for seed in seeds])


def main(arguments: Sequence[str] | None = None) -> int:
    """Rehearse under the faults of some seeds; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.swarm", description="A deployment under random faults.")
    parser.add_argument("file", type=Path)
    parser.add_argument("--seed", type=int, default=1, help="the first seed")
    parser.add_argument("--seeds", type=int, default=1, help="number of seeds")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="number of processes")
    parser.add_argument("--for", dest="duration", help="simulated time, e.g. 60s")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    chosen = parser.parse_args(arguments)
    file: Path = chosen.file
    text, files = pin_assets(apply_sets(read_source_file(file), str(file), ()), str(file), file.parent)
    ticks = TICKS
    if chosen.duration is not None:
        ticks = -(-parse_ns(chosen.duration) // load_deployment(text, str(file)).tick_ns)
    if ticks < TICKS or chosen.seeds < 1 or chosen.jobs < 1:
        parser.error(f"at least {TICKS} ticks, for faults and healing, one seed and one job are needed")
    flown: list[Flown] = []
    told_s, count = time.monotonic(), chosen.seeds
    seeds, jobs = range(chosen.seed, chosen.seed + count), min(chosen.jobs, count)
    with closing(fly_seeds(text, str(file), seeds, ticks, jobs, tuple(files.items()))) as flights:
        for flight in flights:
            flown.append(flight)
            if flight.broken:
                longer = "" if chosen.duration is None else f" --for {chosen.duration}"
                again = f"python -m tests.swarm {file}{longer} --seed {flight.seed}"
                print(f"seed {flight.seed}: {flight.broken}", again, *flight.faults, sep="\n  ", file=sys.stderr)
            if time.monotonic() >= told_s + LINE_S:
                told_s, broken = time.monotonic(), sum(bool(flight.broken) for flight in flown)
                print(f"{len(flown)} of {count} seeds, {broken} broke a law", file=sys.stderr, flush=True)
    broken_seeds = [flight.seed for flight in flown if flight.broken]
    if chosen.json:
        print(json.dumps({"seeds": [asdict(flight) for flight in flown], "broken": broken_seeds}))
    else:
        faults, losses = sum(len(flight.faults) for flight in flown), sum(flight.losses for flight in flown)
        done, seen = sum(flight.ticks for flight in flown), sum(flight.seen for flight in flown)
        print(
            f"{count} seeds: {done} ticks, {faults} faults, {losses} nodes lost, {seen} messages and records, "
            f"{len(broken_seeds)} seeds broke a law"
        )
    return 1 if broken_seeds else 0


if __name__ == "__main__":
    sys.exit(main())
