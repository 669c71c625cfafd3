"""Watchdog thread of a rehearsal: reports progress, and interrupts a player that hangs.

A player that does not return is interrupted by a signal, as by Ctrl-C: its stack is logged, and the run ends in order.
If that fails, because the player is in C code or catches every exception, the thread calls `on_stuck`. C code that
holds the interpreter lock stops this thread, too: then a faulthandler timer, which this thread keeps resetting, ends
the process. The timer is suspended while Ctrl-Z has stopped the process.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Final

from foosim.client.errors import Unanswered
from foosim.simulation.onlooker import LOOK_S, Onlooker
from foosim.simulation.system import System

INTERRUPT: Final = signal.SIGUSR1
INTERRUPTS_MAX: Final = 3
"""Number of interrupts, one second apart, before a player is declared stuck."""
AGAIN_S: Final = 1.0
WIND_S: Final = 1.0
"""Period at which the faulthandler timer is reset."""
STARVED_S: Final = 20.0
"""Margin beyond a player's deadline after which the faulthandler timer ends the process."""


class Attendant:
    """Watches a system while it runs: use it as a context."""

    def __init__(
        self,
        system: System,
        report: Callable[[str], None] | None = None,
        on_stuck: Callable[[str], None] | None = None,
    ) -> None:
        """`report` gets progress lines; `on_stuck` is called for a player that cannot be interrupted and may end the
        process."""
        self._onlooker = Onlooker(system.supervisor.state, time.monotonic())
        self._system, self._report, self._on_stuck = system, report, on_stuck
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._attend, name="attendant", daemon=True)
        self._reason = ""
        self._interrupts, self._interrupted_s = 0, 0.0
        self._before: Callable[[int, FrameType | None], object] | int | None = None
        self._ends_process = on_stuck is not None
        self._wound_s = 0.0
        self._winding = threading.RLock()  # a Ctrl-Z may arrive while the timer is reset
        self._can_interrupt = threading.current_thread() is threading.main_thread()
        stops = signal.getsignal(signal.SIGTSTP) is signal.SIG_DFL
        self._rests = self._ends_process and self._can_interrupt and stops

    def __enter__(self) -> Attendant:
        if self._can_interrupt:
            self._before = signal.signal(INTERRUPT, self._interrupt)
            if self._rests:
                signal.signal(signal.SIGTSTP, self._stop)
        self._wind()
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        self._thread.join()
        if self._ends_process:
            faulthandler.cancel_dump_traceback_later()
            if self._rests:
                signal.signal(signal.SIGTSTP, signal.SIG_DFL)
        if self._can_interrupt:
            signal.signal(INTERRUPT, self._before)

    def _attend(self) -> None:
        at_work = self._system.at_work
        while not self._over.wait(LOOK_S):
            now_s = time.monotonic()
            if now_s >= self._wound_s + WIND_S:
                self._wound_s = now_s
                self._wind()
            line = self._onlooker.look(now_s, at_work)
            if line and self._report is not None:
                self._report(line)
            self._reason = self._onlooker.overdue(at_work)
            if not self._reason:
                self._interrupts = 0
            elif now_s >= self._interrupted_s + AGAIN_S:
                self._interrupted_s = now_s
                self._end_player()

    def _wind(self) -> None:
        """Reset the timer that ends the process and prints its stack once a player's deadline has passed."""
        if self._ends_process:
            limit_s = self._onlooker.allowed_s + STARVED_S
            with self._winding:
                faulthandler.dump_traceback_later(limit_s, exit=True, file=sys.__stderr__ or 2)

    def _stop(self, number: int, frame: FrameType | None) -> None:
        """Stop on Ctrl-Z with the timer off; restart the timer when the process continues."""
        with self._winding:
            faulthandler.cancel_dump_traceback_later()
            signal.signal(signal.SIGTSTP, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGTSTP)
            signal.signal(signal.SIGTSTP, self._stop)
        self._wind()

    def _end_player(self) -> None:
        """Interrupt the hanging player; after the last interrupt, call `on_stuck`."""
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
        """In the player's thread: raise, if the player is still in the same turn."""
        if self._reason and self._onlooker.overdue(self._system.at_work):
            raise Unanswered(self._reason)
