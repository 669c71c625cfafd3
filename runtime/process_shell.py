"""The parts that every process of a run has around its core: log, loop, wire, admission, signs of life."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from foosim.common import limits
from foosim.common.addresses import parse_address
from foosim.protocol.actions import Log
from foosim.runtime.loop import Core, Loop, Wire
from foosim.runtime.process import Stop, start_log
from foosim.runtime.systemd import Notify
from foosim.runtime.transport.admission import Admission
from foosim.runtime.transport.certificates import Credentials, load_credentials, warn_of_end
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.open_plane_warning import Exposure
from foosim.runtime.transport.session import Session, use_client_runtime
from foosim.runtime.transport.settings import Security

CONNECT_S: Final = 60.0
"""How long a process tries to reach its router."""


class ProcessShell:
    """One core on one loop. The process sets the loop's hooks, calls `check` in each turn, then runs the loop."""

    def __init__(
        self,
        core: Core,
        name: str,
        wire: Wire,
        inbox: Inbox,
        deadline_ns: Callable[[int], int],
        progress: Path | None,
        credentials: Credentials | None = None,
    ) -> None:
        """`name` is that of the log. `progress` is the file for signs of life."""
        self.log = start_log(name)
        self.wire = wire
        self.stopped = False
        self.loop = Loop(core, inbox, self.log, deadline_ns)
        self.loop.connect(wire)
        self.loop.show_progress(progress)
        self.loop.notify = Notify()
        self._core = core
        self._inbox = inbox
        self._credentials = credentials
        self._admission: Admission | None = None
        self._exposure: Exposure | None = None
        warn_of_end(credentials, self.log)

    def watch_router(self, router: str, locator: str) -> None:
        """Wait for the presence of the plane's router, which shows that this process is admitted."""
        self._admission = Admission(self._credentials, router, locator, time.monotonic_ns())
        self.wire.watch_alive(router)

    def on_alive(self, name: str, is_alive: bool) -> None:
        """The presence of a process on the router's plane has begun or ended."""
        if self._admission is not None:
            self._admission.heard(name, is_alive)

    def listens(self, locator: str) -> None:
        """Log a reminder every minute while this router's plane is open to other machines without certificates."""
        self._exposure = Exposure(parse_address(locator), time.monotonic_ns())

    def check(self, now_ns: int) -> None:
        """Do what is due in each turn. Raises NotAuthorised when the router has not admitted this process in time."""
        if self._admission is not None:
            self._admission.check(now_ns)
        if self._exposure is not None and (reminder := self._exposure.due(now_ns)):
            self._core.actions.append(Log("warning", reminder))

    def stop(self) -> None:
        """Have the loop look whether it is over; a signal handler may call this."""
        self.stopped = True
        self._inbox.wake()


@contextmanager
def client_session(
    connect: str,
    identity: str,
    pki: Path | None,
    stop: Stop,
    bytes_max: int = limits.MESSAGE_BYTES_MAX,
    *,
    sets_runtime: bool = False,
) -> Iterator[tuple[Session, Inbox, Credentials | None]]:
    """Connect to the router at `connect`, with the certificate of `identity` where `pki` names a folder.

    `sets_runtime`: the first session of a process that is no router, which chooses Zenoh's client runtime.
    Raises CertificateError, ConnectError after `CONNECT_S` or when `stop` is set.
    """
    credentials = load_credentials(pki, identity)
    security = None if credentials is None else Security(credentials)
    if sets_runtime:
        use_client_runtime()
    with Session.client(connect, CONNECT_S, bytes_max, stop.is_set, security) as session:
        yield session, Inbox(limits.INBOX_MESSAGES_MAX), credentials
