"""Ctrl-C in a rehearsal: the first ends the run in order, the second at once."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from pathlib import Path
from types import FrameType, TracebackType

from foosim.simulation.onlooker import reached
from foosim.simulation.system import System


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

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
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
