"""Counts signals that would end the process, so that a launcher can end its run in order."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def counted_signals(count: Callable[[], None]) -> Iterator[None]:
    """Call `count` at each Ctrl-C, SIGTERM or SIGHUP instead of ending."""

    def take(number: int, frame: object) -> None:
        count()

    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.signal(number, take) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
