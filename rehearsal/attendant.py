"""Attends a rehearsal from a thread of its own: shows its progress, and does not let a player that hangs hold it up.

A player that does not return is interrupted by a signal, as a person's Ctrl-C would: its stack is logged, and the run
ends in order. Where that does not help, since it is in C code or catches whatever is raised, `on_stuck` is called from
the thread. Neighbours: `onlooker` decides, `rehearse` starts it.
"""

from __future__ import annotations

import faulthandler
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Final

from foosim.client.failing import Unanswered
from foosim.rehearsal.onlooker import LOOK_S, Onlooker
from foosim.rehearsal.system import System

INTERRUPT: Final = signal.SIGUSR1
INTERRUPTS_MAX: Final = 3
"""How often a player is interrupted, a second apart, before it is given up."""
AGAIN_S: Final = 1.0


class Attendant:
    """Looks on a system while it runs: use it as a context."""

    def __init__(
        self,
        system: System,
        say: Callable[[str], None] | None = None,
        on_stuck: Callable[[str], None] | None = None,
    ) -> None:
        """`say` takes lines of progress; `on_stuck` is told of a player that cannot be interrupted, and may end the
        process."""
        self._onlooker = Onlooker(system.supervisor, time.monotonic())
        self._system, self._say, self._on_stuck = system, say, on_stuck
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._attend, name="attendant", daemon=True)
        self._reason = ""
        self._interrupts, self._interrupted_s = 0, 0.0
        self._before: Callable[[int, FrameType | None], object] | int | None = None
        self._can_interrupt = threading.current_thread() is threading.main_thread()

    def __enter__(self) -> Attendant:
        if self._can_interrupt:
            self._before = signal.signal(INTERRUPT, self._interrupt)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        self._thread.join()
        if self._can_interrupt:
            signal.signal(INTERRUPT, self._before)

    def _attend(self) -> None:
        at_work = self._system.at_work
        while not self._over.wait(LOOK_S):
            now_s = time.monotonic()
            line = self._onlooker.look(now_s, at_work)
            if line and self._say is not None:
                self._say(line)
            self._reason = self._onlooker.overdue(at_work)
            if not self._reason:
                self._interrupts = 0
            elif now_s >= self._interrupted_s + AGAIN_S:
                self._interrupted_s = now_s
                self._end_player()

    def _end_player(self) -> None:
        """Interrupt the player that hangs; give it up when that has not helped."""
        if self._can_interrupt and self._interrupts < INTERRUPTS_MAX:
            self._interrupts += 1
            thread = threading.main_thread().ident
            assert thread is not None
            signal.pthread_kill(thread, INTERRUPT)
        elif self._on_stuck is not None:
            faulthandler.dump_traceback(sys.__stderr__ or 2)
            stuck, self._on_stuck = self._on_stuck, None
            stuck(self._reason)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        """In the thread of the player: raise within it, if it is still in the same turn."""
        if self._reason and self._onlooker.overdue(self._system.at_work):
            raise Unanswered(self._reason)
