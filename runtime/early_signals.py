"""Signals before a run can handle them: while `up` imports and prepares, which takes seconds.

Those that come while its command is imported are noted, and raised once it can print a result; it raises later ones at
once. This module imports little, so that it is ready first.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Final

ENDING: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_noted: list[int] = []


def note_signals() -> None:
    """Note Ctrl-C, SIGTERM and SIGHUP from now on, instead of ending."""
    for number in ENDING:
        signal.signal(number, lambda number, frame: _noted.append(number))


def raise_noted() -> None:
    """Raise KeyboardInterrupt for a signal that was noted."""
    if _noted:
        _interrupt(_noted.pop(0), None)


def interrupting_signals() -> AbstractContextManager[None]:
    """Raise KeyboardInterrupt at each Ctrl-C, SIGTERM or SIGHUP until the run handles them."""
    return handling(_interrupt)


@contextmanager
def handling(handler: Callable[[int, object], None]) -> Iterator[None]:
    """Call `handler` with the number of each Ctrl-C, SIGTERM or SIGHUP instead of ending."""
    before = {number: signal.signal(number, handler) for number in ENDING}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt(f"{signal.Signals(number).name} ended foosim up before the run began")
