"""The terminal of a replay: single keys without Enter, and one line of progress that is written over.

Keys need another mode of the terminal. The terminal gets its own mode back at the end of the replay, and the shell sets
its own while the replay is stopped (Ctrl-Z). A replay in the background does not touch the terminal.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import termios
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, TextIO

from foosim.runtime.keys import is_foreground, split_keys

LOOK_S: Final = 0.2
"""The interval at which the thread checks whether it has to end."""


@contextmanager
def keys_of_terminal(pressed: Callable[[str], object]) -> Iterator[bool]:
    """Pass each key to `pressed`, from a thread, while the context lasts; gives False where there is no terminal."""
    stream = sys.stdin
    if stream is None or stream.closed or not stream.isatty() or not is_foreground(stream.fileno()):
        yield False
        return
    file, ended = stream.fileno(), threading.Event()
    saved = termios.tcgetattr(file)

    def set_mode(*_: object) -> None:
        if is_foreground(file):
            tty.setcbreak(file, termios.TCSADRAIN)

    before = signal.signal(signal.SIGCONT, set_mode)
    set_mode()
    thread = threading.Thread(target=_read, args=(file, pressed, ended), name="keys", daemon=True)
    thread.start()
    try:
        yield True
    finally:
        ended.set()
        thread.join()
        signal.signal(signal.SIGCONT, before)
        if is_foreground(file):
            termios.tcsetattr(file, termios.TCSADRAIN, saved)


def _read(file: int, pressed: Callable[[str], object], ended: threading.Event) -> None:
    rest = ""
    while not ended.is_set():
        if not is_foreground(file):
            ended.wait(LOOK_S)
            continue
        if not select.select([file], [], [], LOOK_S)[0]:
            rest = ""
            continue
        try:
            data = os.read(file, 64)
        except OSError:
            return
        if not data:
            return
        keys, rest = split_keys(rest + data.decode(errors="ignore"))
        for key in keys:
            pressed(key)


class Lines:
    """Lines of output; on a terminal the progress is one line that is written over."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._is_live = stream.isatty()
        self._progress = ""
        self.every_ns: Final = 100_000_000 if self._is_live else 1_000_000_000

    def print(self, line: str) -> None:
        """Write a line that stays."""
        self._write(f"{self._erased()}{line}\n{self._progress}")

    def show(self, line: str) -> None:
        """Write the progress."""
        erased = self._erased()
        self._progress = line if self._is_live else ""
        self._write(f"{erased}{line}{'' if self._is_live else chr(10)}")

    def end(self) -> None:
        """Keep the last progress."""
        if self._progress:
            self._progress = ""
            self._write("\n")

    def _erased(self) -> str:
        return "\r\x1b[K" if self._progress else ""

    def _write(self, text: str) -> None:
        try:
            self._stream.write(text)
            self._stream.flush()
        except (BrokenPipeError, ValueError):  # the replay continues without its reader
            self._stream = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115  # as long as the process lives
