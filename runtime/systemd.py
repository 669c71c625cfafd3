"""What a process tells systemd that started it as `Type=notify`: that it is ready, lives, and ends.

`WATCHDOG=1` is said from the loop, so a process whose loop hangs is restarted, though its other threads live. Without
NOTIFY_SOCKET in the environment nothing happens. The protocol is that of sd_notify(3): lines in a datagram.
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
"""How often within the watchdog's time a process that goes on says so."""
CLOSING_US: Final = 300_000_000
"""How long the watchdog is told to leave a process alone that ends: a capture may have to be finished."""


class Notify:
    """The socket of the service manager, if there is one."""

    def __init__(self, environment: MutableMapping[str, str] = os.environ, pid: int | None = None) -> None:
        """Take what the environment says; children are not to think that it is said to them."""
        path = environment.pop(SOCKET_VARIABLE, "")
        limit_us = environment.pop(WATCHDOG_VARIABLE, "")
        meant = environment.pop(WATCHDOG_PID_VARIABLE, "")
        is_watched = limit_us.isdigit() and meant in ("", str(os.getpid() if pid is None else pid))
        self._address = "\0" + path[1:] if path.startswith("@") else path
        self._every_ns = int(limit_us) * 1000 // SHARE if is_watched else 0
        self._next_ns = 0
        self._is_ready = self._is_stopping = False

    def ready(self, now_ns: int) -> None:
        """Log that the process takes part: from now on the watchdog waits for its loop."""
        self._is_ready = True
        self._say("READY=1")
        self.goes_on(now_ns)

    def goes_on(self, now_ns: int) -> None:
        """The loop has gone round: say so when it is time to."""
        if self._every_ns and self._is_ready and not self._is_stopping and now_ns >= self._next_ns:
            self._next_ns = now_ns + self._every_ns
            self._say("WATCHDOG=1")

    def stopping(self) -> None:
        """Log that the process ends, which may take a while."""
        if not self._is_stopping:
            self._is_stopping = True
            self._say(f"STOPPING=1\nWATCHDOG_USEC={CLOSING_US}" if self._every_ns else "STOPPING=1")

    def _say(self, text: str) -> None:
        if not self._address:
            return
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as sender:
            try:
                sender.sendto(text.encode(), self._address)
            except OSError:
                return  # nobody listens any more; the run goes on without being watched
