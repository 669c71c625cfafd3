"""What a person sees of a rehearsal while it runs: a line each second, a player that hangs, Ctrl-C.

A rehearsal is one process on virtual time, so the process in turn blocks all others, and no deadline of a core can
expire meanwhile. A thread watches it in wall time. A player that does not return is interrupted by a signal, as by
Ctrl-C: its stack is logged, and the run ends in order. If that fails, because the player is in C code or catches every
exception, the thread calls `on_stuck`.
"""

from __future__ import annotations

import faulthandler
import signal
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Final

from foosim.client.errors import Unanswered
from foosim.simulation.settings import AtWork
from foosim.simulation.system import System
from foosim.supervisor.state import RunState
from foosim.world.assembly.world import world_status, world_texts
from foosim.world.frame import Frame

INTERRUPT: Final = signal.SIGUSR1
INTERRUPTS_MAX: Final = 3
"""Number of interrupts, one second apart, before a player is declared stuck."""
AGAIN_S: Final = 1.0
LINE_S: Final = 1.0
LOOK_S: Final = 0.05
"""Sampling period."""
STOOD_S: Final = 4 * LOOK_S
"""A longer gap between two samples means that this process was not scheduled; it is not charged to a player."""


def reached(state: RunState) -> str:
    """Progress of a run: `3.20 s of 20.00 s`."""
    tick_s = state.deployment.tick_ns / 1e9
    last = state.settings.last_tick
    return f"{(state.frame.tick - state.first_tick) * tick_s:.2f} s of {(last - state.first_tick) * tick_s:.2f} s"


class Onlooker:
    """Samples one rehearsal."""

    def __init__(self, state: RunState, now_s: float) -> None:
        self._state = state
        self._line_s = self._looked_s = now_s
        self._line_tick = state.frame.tick
        self._turns: Counter[str] = Counter()
        """Number of samples per process in turn, since the last line."""
        self._turn = -1
        self._in_turn_s = 0.0

    def look(self, now_s: float, at_work: AtWork) -> str:
        """Sample the process in turn; return a line when one is due, else an empty string."""
        elapsed_s, self._looked_s = now_s - self._looked_s, now_s
        is_same = at_work.acts and at_work.turns == self._turn
        self._in_turn_s = self._in_turn_s + min(elapsed_s, STOOD_S) if is_same else 0.0
        self._turn = at_work.turns
        self._turns[at_work.name] += 1
        if now_s < self._line_s + LINE_S:
            return ""
        frame = self._state.frame
        line = self._line(now_s - self._line_s, frame)
        self._line_s, self._line_tick = now_s, frame.tick
        self._turns.clear()
        return line

    def overdue(self, at_work: AtWork) -> str:
        """Return a message about a player at work beyond its deadline; empty when none is overdue."""
        deadlines = self._state.deployment.deadlines
        is_first = at_work.tick < 0
        allowed_ns = deadlines.start_ns if is_first else deadlines.lockstep_fast_ns
        if not at_work.acts or at_work.turns != self._turn or self._in_turn_s < allowed_ns / 1e9:
            return ""
        what = "has not joined" if is_first else f"has not answered tick {at_work.tick}"
        which = "start" if is_first else "lockstep_fast"
        return f"{at_work.name} {what} for {allowed_ns / 1e9:g} s (deadlines.{which})"

    def _line(self, elapsed_s: float, frame: Frame) -> str:
        speed = (frame.tick - self._line_tick) * self._state.deployment.tick_ns / 1e9 / elapsed_s
        parts = [f"{reached(self._state)} simulated, {speed:.2f}x"]
        deployment = self._state.deployment
        parts += world_texts(deployment, world_status(deployment, frame))
        name, count = max(sorted(self._turns.items()), key=lambda item: item[1])
        parts.append(f"waits for {name or 'start'} ({100 * count / self._turns.total():.0f} %)")
        return ", ".join(parts)


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
        self._can_interrupt = threading.current_thread() is threading.main_thread()

    def __enter__(self) -> Attendant:
        if self._can_interrupt:
            self._before = signal.signal(INTERRUPT, self._interrupt)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        if self._can_interrupt:
            signal.signal(INTERRUPT, self._before)

    def _attend(self) -> None:
        at_work = self._system.at_work
        while not self._over.wait(LOOK_S):
            now_s = time.monotonic()
            line = self._onlooker.look(now_s, at_work)
            if line and self._report is not None:
                self._report(line)
            self._reason = self._onlooker.overdue(at_work)
            if not self._reason:
                self._interrupts = 0
            elif now_s >= self._interrupted_s + AGAIN_S:
                self._interrupted_s = now_s
                self._end_player()

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


class Interrupts:
    """Counts Ctrl-C while a rehearsal runs. Use it as a context; only the main thread receives signals."""

    def __init__(self, report: Callable[[str], None]) -> None:
        self.count = 0
        self._report = report
        self._system: System | None = None
        self._handles_signals = threading.current_thread() is threading.main_thread()

    def __enter__(self) -> Interrupts:
        if self._handles_signals:
            self._before = signal.signal(signal.SIGINT, self._take)
        return self

    def __exit__(self, *_: object) -> None:
        if self._handles_signals:
            signal.signal(signal.SIGINT, self._before)

    def attend(self, system: System) -> None:
        """Make Ctrl-C end this rehearsal."""
        self._system = system

    def last_line(self, capture: Path | None, *, is_finished: bool) -> str:
        """`interrupted at 3.20 s of 20.00 s, capture run.mcap`."""
        how_far = "its start" if self._system is None else reached(self._system.supervisor.state)
        where = "no capture" if capture is None or not capture.exists() else f"capture {capture}"
        unfinished = "" if is_finished or not where.endswith(str(capture)) else " (unfinished)"
        return f"interrupted at {how_far}, {where}{unfinished}"

    def _take(self, number: int, frame: FrameType | None) -> None:
        self.count += 1
        system = self._system
        if self.count > 1 or system is None:
            raise KeyboardInterrupt
        system.soon(lambda: system.request("down"))
        self._report("ending the rehearsal; a second Ctrl-C ends it at once")
