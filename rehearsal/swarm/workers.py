"""Seeds of the swarm in several processes: a seed needs nothing of another."""

from __future__ import annotations

import os
import signal
from collections.abc import Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import active_children, get_context

from foosim.common.errors import Failed
from foosim.rehearsal.swarm.campaign import Flown, fly
from foosim.runtime.process import end_with


def fly_seeds(text: str, name: str, seeds: Sequence[int], ticks: int, jobs: int) -> Generator[Flown, None, None]:
    """Fly the seeds in `jobs` processes, and yield their results in the order of the seeds.

    One job is this process. The processes end with the iterator, also amid a seed. Raises Failed when one of them
    was killed.
    """
    fly_seed = partial(fly, text, name, ticks=ticks)
    if jobs == 1:
        yield from map(fly_seed, seeds)
        return
    # Spawned: a fork would inherit the locks of this process's threads.
    with ProcessPoolExecutor(jobs, get_context("spawn"), _begin, (os.getpid(),)) as pool:
        flights = [pool.submit(fly_seed, seed) for seed in seeds]
        try:
            yield from (flight.result() for flight in flights)
        except BaseException as error:  # Ctrl-C and a closed iterator, too: nobody waits for seeds any more
            for process in active_children():
                process.kill()
            if isinstance(error, BrokenProcessPool):
                raise Failed(f"a process of the swarm was killed; fewer than --jobs {jobs} need less memory") from None
            raise


def _begin(parent: int) -> None:
    """Begin a worker: Ctrl-C, which a terminal sends to all, is for the process that prints."""
    end_with(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
