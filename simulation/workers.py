"""Work in several processes: seeds of the swarm, games of a match."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children, get_context
from typing import TypeVar

from foosim.common.errors import Failed
from foosim.runtime.process import end_with

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_processes(
    work: Callable[[Item], Result], items: Sequence[Item], jobs: int, what: str
) -> Generator[Result, None, None]:
    """Do some work for each item in `jobs` processes of their own, and yield the results in the order of the items.

    One job is this process. The processes end with the iterator, also amid an item. Raises Failed when one of them was
    killed; `what` is named there: `a process of WHAT was killed`.
    """
    if jobs == 1:
        yield from map(work, items)
        return
    others = frozenset(active_children())
    # Spawned: a fork would inherit the locks of this process's threads.
    with ProcessPoolExecutor(jobs, get_context("spawn"), _begin, (os.getpid(),)) as pool:
        try:
            # Ctrl-C waits until the processes are started: they inherit that it is held back.
            held = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
            try:
                pending = [pool.submit(work, item) for item in items]
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, held)
            yield from (one.result() for one in pending)
        except BrokenProcessPool:
            few = f"fewer than --jobs {jobs} need less memory"
            raise Failed(f"a process of {what} was killed; {few}") from None
        finally:  # Ctrl-C and a closed iterator, too: nothing waits for the rest any more
            for process in active_children():
                if process not in others:
                    process.kill()
            pool.shutdown(cancel_futures=True)


def _begin(parent: int) -> None:
    """Begin a worker: Ctrl-C, which a terminal sends to all, is for the process that prints."""
    end_with(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
