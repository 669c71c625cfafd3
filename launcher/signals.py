"""Signals that end a process, counted instead: a launcher ends its run in order first."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def counted_signals(count: Callable[[], None]) -> Iterator[None]:
    """Call `count` at each Ctrl-C (and what means the same) instead of being ended by it."""

    def take(number: int, frame: object) -> None:
        count()

    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.signal(number, take) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
