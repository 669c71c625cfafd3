"""What systemd is told: by a loop that goes round, and by none that hangs."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from foosim.runtime.systemd import Notify

MS = 1_000_000


class Manager:
    """The service manager's end of the socket."""

    def __init__(self, path: str) -> None:
        self.environment = {"NOTIFY_SOCKET": path, "HOME": "/"}
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind("\0" + path[1:] if path.startswith("@") else path)
        self._socket.setblocking(False)

    def told(self) -> list[str]:
        """What has been said since the last time."""
        found = []
        while True:
            try:
                found.append(self._socket.recv(4096).decode())
            except BlockingIOError:
                return found

    def close(self) -> None:
        self._socket.close()


@pytest.fixture(params=["path", "abstract"])
def manager(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Manager]:
    made = Manager(f"@foosim-test-{os.getpid()}" if request.param == "abstract" else str(tmp_path / "notify"))
    yield made
    made.close()


def test_the_watchdog_hears_of_the_loop_four_times_in_its_time(manager: Manager) -> None:
    manager.environment |= {"WATCHDOG_USEC": "4000000", "WATCHDOG_PID": str(os.getpid())}
    notify = Notify(manager.environment)
    assert manager.environment == {"HOME": "/"}, "children are not to think that they are meant"
    notify.progress(0)
    assert manager.told() == [], "who is not ready yet is not watched"
    notify.ready(5 * MS)
    assert manager.told() == ["READY=1", "WATCHDOG=1"]
    for now_ms in range(6, 4006):
        notify.progress(now_ms * MS)
    assert manager.told() == ["WATCHDOG=1"] * 4
    notify.stopping()
    notify.progress(9_000 * MS)
    notify.stopping()
    assert manager.told() == ["STOPPING=1\nWATCHDOG_USEC=300000000"]


@pytest.mark.parametrize("watchdog", [{}, {"WATCHDOG_USEC": "4000000", "WATCHDOG_PID": "1"}, {"WATCHDOG_USEC": "x"}])
def test_without_a_watchdog_of_its_own_it_says_when_it_begins_and_ends(
    manager: Manager, watchdog: dict[str, str]
) -> None:
    notify = Notify({**manager.environment, **watchdog})
    notify.ready(0)
    notify.progress(10_000 * MS)
    notify.stopping()
    assert manager.told() == ["READY=1", "STOPPING=1"]


def test_nobody_to_tell_is_no_error(manager: Manager) -> None:
    for environment in ({}, {"NOTIFY_SOCKET": "/nowhere/notify", "WATCHDOG_USEC": "1000"}):
        notify = Notify(dict(environment))
        notify.ready(0)
        notify.progress(10_000 * MS)
        notify.stopping()
    assert manager.told() == []
