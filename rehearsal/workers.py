"""Work in several processes: seeds of the swarm, games of a match, policies that are tried."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children, get_context
from types import TracebackType
from typing import Self, TypeVar

from foosim.common.errors import Failed
from foosim.runtime.process import end_with

Item = TypeVar("Item")
Result = TypeVar("Result")


class Workers:
    """Processes that work until `close`, or the end of the context. One job is this process."""

    def __init__(self, jobs: int, what: str) -> None:
        """`what` is named in messages: `a process of WHAT was killed`."""
        self._jobs, self._what = jobs, what
        # Spawned: a fork would inherit the locks of this process's threads.
        self._pool = ProcessPoolExecutor(jobs, get_context("spawn"), _begin, (os.getpid(),)) if jobs > 1 else None
        self._strangers = frozenset(active_children())
        """Processes that are none of these."""

    def results(self, work: Callable[[Item], Result], items: Sequence[Item]) -> Generator[Result, None, None]:
        """Do some work for each item, and yield the results in the order of the items.

        When the iterator ends before its last result, so do the processes, also amid an item. Raises Failed when one
        of them was killed.
        """
        if self._pool is None:
            yield from map(work, items)
            return
        try:
            # Ctrl-C waits until the processes are started: they inherit that it is held back.
            held = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
            try:
                pending = [self._pool.submit(work, item) for item in items]
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, held)
            yield from (one.result() for one in pending)
        except BaseException as error:  # Ctrl-C and a closed iterator, too: nobody waits for the rest any more
            self._kill()
            if isinstance(error, BrokenProcessPool):
                few = f"fewer than --jobs {self._jobs} need less memory"
                raise Failed(f"a process of {self._what} was killed; {few}") from None
            raise

    def close(self) -> None:
        """End the processes, also amid an item."""
        if self._pool is not None:
            self._kill()
            self._pool.shutdown(cancel_futures=True)

    def _kill(self) -> None:
        for process in active_children():
            if process not in self._strangers:
                process.kill()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def in_processes(
    work: Callable[[Item], Result], items: Sequence[Item], jobs: int, what: str
) -> Generator[Result, None, None]:
    """Do some work for each item in `jobs` processes of their own, as `Workers.results` does."""
    with Workers(jobs, what) as workers:
        yield from workers.results(work, items)


def _begin(parent: int) -> None:
    """Begin a worker: Ctrl-C, which a terminal sends to all, is for the process that prints."""
    end_with(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
