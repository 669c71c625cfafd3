"""What a person sees of a replay and the keys that it takes: on a terminal one line that lives, elsewhere plain lines.

Keys come one by one without Enter, so the terminal is in another mode meanwhile; it gets its own back whatever ends the
replay, and while it is stopped (Ctrl-Z). A replay in the background leaves the terminal alone.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import termios
import threading
import tty
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any, Final, Self, TextIO

SHOW_NS_LIVE: Final = 100_000_000
SHOW_NS_PLAIN: Final = 1_000_000_000
_ESCAPED: Final = {"\x1b[A": "up", "\x1b[B": "down", "\x1b[C": "right", "\x1b[D": "left"}
_BEGINNINGS: Final = ("\x1b", "\x1b[", "\x1bO")
LOOK_S: Final = 0.2
"""How soon the thread notices that it is to end."""


def split_keys(text: str) -> tuple[list[str], str]:
    """Return the keys in what a terminal sent, and the beginning of one that is not complete."""
    keys: list[str] = []
    while text:
        if text in _BEGINNINGS:
            return keys, text
        if text[:3] in _ESCAPED:
            keys.append(_ESCAPED[text[:3]])
            text = text[3:]
        elif text[:2] == "\x1bO":  # as some terminals send arrows
            text = f"\x1b[{text[2:]}"
        else:
            keys.append(text[0])
            text = text[1:]
    return keys, ""


class Keys:
    """Reads keys from a terminal in a thread, and hands each to `pressed`. Without a terminal it does nothing."""

    def __init__(self, pressed: Callable[[str], None], stream: TextIO | None = None) -> None:
        self._pressed = pressed
        self._file = -1
        self._saved: list[Any] = []
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self._before: Any = None
        stream = sys.stdin if stream is None else stream
        if stream is not None and not stream.closed and stream.isatty():
            self._file = stream.fileno()

    @property
    def are_read(self) -> bool:
        return self._thread is not None

    def __enter__(self) -> Self:
        if self._file >= 0 and self._is_ours():
            self._saved = termios.tcgetattr(self._file)
            self._before = signal.signal(signal.SIGCONT, self._go_on)
            tty.setcbreak(self._file, termios.TCSADRAIN)
            self._thread = threading.Thread(target=self._run, name="keys", daemon=True)
            self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._thread is None:
            return
        self._ended.set()
        self._thread.join()
        signal.signal(signal.SIGCONT, self._before)
        if self._is_ours():
            termios.tcsetattr(self._file, termios.TCSADRAIN, self._saved)

    def _is_ours(self) -> bool:
        """Whether this process is in the foreground: the terminal stops others that touch it."""
        try:
            return os.tcgetpgrp(self._file) == os.getpgrp()
        except OSError:
            return False

    def _go_on(self, number: int, frame: FrameType | None) -> None:
        """After a stop the shell has set the terminal to its own mode."""
        if self._is_ours():
            tty.setcbreak(self._file, termios.TCSADRAIN)

    def _run(self) -> None:
        rest = ""
        while not self._ended.is_set():
            ready, _, _ = select.select([self._file], [], [], LOOK_S)
            if not ready:
                rest = ""
                continue
            if not self._is_ours():
                self._ended.wait(LOOK_S)
                continue
            try:
                data = os.read(self._file, 64)
            except OSError:
                return
            if not data:
                return
            keys, rest = split_keys(rest + data.decode(errors="ignore"))
            for key in keys:
                self._pressed(key)


class Lines:
    """Shows what happens: lines that stay, and on a terminal one at the end that is written over."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._live = ""
        self.is_live = stream.isatty()
        self.every_ns = SHOW_NS_LIVE if self.is_live else SHOW_NS_PLAIN

    def say(self, line: str) -> None:
        """Show a line that stays."""
        self._write(f"{self._clear()}{line}\n{self._live}")

    def show(self, line: str) -> None:
        """Show where it is: in the same line, or as a line of its own where there is no terminal."""
        if not self.is_live:
            self._write(f"{line}\n")
            return
        start = self._clear()
        self._live = line
        self._write(f"{start}{line}")

    def end(self) -> None:
        """Leave the last line as it is."""
        if self._live:
            self._live = ""
            self._write("\n")

    def _clear(self) -> str:
        return "\r\x1b[K" if self._live else ""

    def _write(self, text: str) -> None:
        try:
            self._stream.write(text)
            self._stream.flush()
        except (BrokenPipeError, ValueError):  # nobody reads it: the replay goes on
            self._stream = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115  # as long as the process lives
