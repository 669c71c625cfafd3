"""Notifications to systemd from a process that it started as `Type=notify`: ready, alive, stopping.

The main loop sends `WATCHDOG=1`, so systemd restarts a process whose loop hangs while its other threads live. Without
NOTIFY_SOCKET in the environment nothing is sent. The protocol is that of sd_notify(3): lines in a datagram.
"""

from __future__ import annotations

import os
import socket
from collections.abc import MutableMapping
from typing import Final

SOCKET_VARIABLE: Final = "NOTIFY_SOCKET"
WATCHDOG_VARIABLE: Final = "WATCHDOG_USEC"
WATCHDOG_PID_VARIABLE: Final = "WATCHDOG_PID"
SHARE: Final = 4
"""Number of notifications within the watchdog's timeout."""
CLOSING_US: Final = 300_000_000
"""The watchdog's timeout (us) for a process that is stopping: it may have to finish a capture."""


class Notify:
    """The socket of the service manager, if there is one."""

    def __init__(self, environment: MutableMapping[str, str] = os.environ, pid: int | None = None) -> None:
        """Read the variables and remove them from the environment, since they do not address child processes."""
        path = environment.pop(SOCKET_VARIABLE, "")
        limit_us = environment.pop(WATCHDOG_VARIABLE, "")
        meant = environment.pop(WATCHDOG_PID_VARIABLE, "")
        is_watched = limit_us.isdigit() and meant in ("", str(os.getpid() if pid is None else pid))
        self._address = "\0" + path[1:] if path.startswith("@") else path
        self._every_ns = int(limit_us) * 1000 // SHARE if is_watched else 0
        self._next_ns = 0
        self._is_ready = self._is_stopping = False

    def ready(self, now_ns: int) -> None:
        """Report that the process has joined the run; the watchdog begins to supervise its loop."""
        self._is_ready = True
        self._notify("READY=1")
        self.progress(now_ns)

    def progress(self, now_ns: int) -> None:
        """Report progress of the loop when that is due."""
        if self._every_ns and self._is_ready and not self._is_stopping and now_ns >= self._next_ns:
            self._next_ns = now_ns + self._every_ns
            self._notify("WATCHDOG=1")

    def stopping(self) -> None:
        """Report that the process is stopping."""
        if not self._is_stopping:
            self._is_stopping = True
            self._notify(f"STOPPING=1\nWATCHDOG_USEC={CLOSING_US}" if self._every_ns else "STOPPING=1")

    def _notify(self, text: str) -> None:
        if not self._address:
            return
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as sender:
            try:
                sender.sendto(text.encode(), self._address)
            except OSError:
                return  # systemd is gone; the run continues without its watchdog
