"""The parts that the shells of all roles have, and the process that runs these shells."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, Protocol

from foosim.common import limits
from foosim.common.addresses import parse_address
from foosim.common.errors import Failed
from foosim.protocol.actions import Log
from foosim.protocol.channels import SUPERVISOR, Plane
from foosim.runtime.command import DONE
from foosim.runtime.process import Stop, start_log
from foosim.runtime.roles.bus import Bus
from foosim.runtime.roles.loop import Loop
from foosim.runtime.roles.role import Core, Role
from foosim.runtime.roles.wire import Wire
from foosim.runtime.run_folder import open_run
from foosim.runtime.supervisor_timeout import UNKNOWN_NS
from foosim.runtime.systemd import Notify
from foosim.runtime.transport.admission import Admission, Exposure
from foosim.runtime.transport.certificates import Credentials, load_credentials, warn_of_end
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import ConnectError, Session, use_client_runtime
from foosim.runtime.transport.settings import Security

CONNECT_S: Final = UNKNOWN_NS / 1e9
"""How long a process tries to reach its router, whose process may be started again."""
RUN: Final = "run:"
"""Before the name of a run, instead of an address."""
LOOK_S: Final = 0.02
"""The period of reading the address of its run."""


class RoleShell:
    """The parts of one role around its core. The role's own shell sets the hooks of `role`."""

    def __init__(
        self,
        process: Process,
        name: str,
        core: Core,
        deadline_ns: Callable[[int], int],
        credentials: Credentials | None = None,
    ) -> None:
        """`name` is the role's, and that of its log."""
        self.log: Final = start_log(name)
        self.role: Final = Role(name, core, self.log, deadline_ns)
        self._process = process
        self._credentials = credentials
        self._admission: Admission | None = None
        self._exposure: Exposure | None = None
        warn_of_end(credentials, self.log)

    def connect(self, session: Session, plane: Plane) -> Wire:
        """Return the role's wire on a plane, on which its messages of that plane are published."""
        wire = self._process.wire(session, plane, self.role.name)
        self.role.connect(wire)
        return wire

    def watch_router(self, wire: Wire, router: str) -> None:
        """Wait for the presence of the plane's router, which shows that this process is admitted."""
        self._admission = Admission(self._credentials, router, wire.session.locator, time.monotonic_ns())
        wire.watch_alive(router)

    def on_alive(self, name: str, is_alive: bool) -> None:
        """The presence of a role on the router's plane has begun or ended."""
        if self._admission is not None:
            self._admission.heard(name, is_alive)

    def listens(self, locator: str) -> None:
        """Log a reminder every minute while this router's plane is open to other machines without certificates."""
        self._exposure = Exposure(parse_address(locator), time.monotonic_ns())

    def check(self, now_ns: int) -> None:
        """Do the work of each turn. Raises NotAuthorised when the router has not admitted this process in time."""
        if self._admission is not None:
            self._admission.check(now_ns)
        if self._exposure is not None and (reminder := self._exposure.due(now_ns)):
            self.role.core.actions.append(Log("warning", reminder))


class Runnable(Protocol):
    """The interface of a role's shell to its process."""

    @property
    def role(self) -> Role: ...

    def is_over(self) -> bool:
        """Whether the role has nothing more to do."""

    def finish(self) -> int:
        """Perform the last actions; return the role's exit code. Raises Failed with the reason to report."""

    def leave(self) -> None:
        """Leave files as a kill would: the process ends before the role is over."""

    def stop(self) -> None:
        """Have the role be over soon; a signal handler may call this."""


class Process:
    """The shells of the roles of a process, on one loop and one inbox."""

    def __init__(
        self,
        name: str,
        progress: Path | None = None,
        *,
        is_shared: bool = False,
        on_offer: Callable[[], None] | None = None,
    ) -> None:
        """`is_shared`: it has several roles. `progress` is the file that shows the loop's progress.

        `on_offer` is for a process that another event loop drives (`step`): see `Inbox`.
        """
        self._bus = Bus() if is_shared else None
        self.inbox: Final = Inbox(limits.INBOX_MESSAGES_MAX, on_offer)
        self.loop: Final = Loop(self.inbox, start_log(name), self._bus)
        self.loop.show_progress(progress)
        self.loop.notify = Notify()
        self._shells: list[Runnable] = []
        self._code = DONE
        self._failures: list[Failed] = []

    def wire(self, session: Session, plane: Plane, name: str) -> Wire:
        """Return a wire of one of its roles."""
        return Wire(session, plane, self.inbox, name, self._bus)

    def add(self, shell: Runnable) -> None:
        """Add a role; its turns come after those of the roles before it."""
        self._shells.append(shell)
        self.loop.add(shell.role)

    def run(self) -> int:
        """Run the roles until all are over; return the greatest of their exit codes. Raises Failed.

        A role that ends unfinished ends the others too, except the supervisor, which ends the run in
        order. One that raises Failed at its end lets the others end.
        """
        try:
            self.loop.begin()
            while not self._is_over():
                self.loop.go_round()
        except BaseException:
            self._leave()
            raise
        return self.end()

    def step(self) -> int | None:
        """Do one round without sleeping, in a process that another event loop drives.

        Return when the next one is due (ns of the monotonic clock), unless `on_offer` is called before; None when the
        process is over. `self.loop.begin()` is before the first step, `end` after the last one, or after an exception.
        """
        self.loop.go_round(sleeps=False)
        return None if self._is_over() else self.loop.next_ns()

    def end(self) -> int:
        """End the remaining roles; return the greatest of all exit codes. Raises Failed, that of the first role."""
        self._leave()
        if self._failures:
            raise self._failures[0]
        return self._code

    def stop(self) -> None:
        """Have all roles be over soon; a signal handler may call this. A supervisor ends its run, and so the others."""
        for shell in self._shells:
            if shell.role.name == SUPERVISOR or not self._has_supervisor:
                shell.stop()
        self.inbox.wake()

    def _is_over(self) -> bool:
        """Finish the roles that are over; return whether the process is."""
        ended = [shell for shell in self._shells if shell.is_over()]
        if len(ended) == len(self._shells):
            self.loop.notify.stopping()
        for shell in ended:
            self._shells.remove(shell)
            try:
                self._code = max(self._code, shell.finish())
            except Failed as failed:
                self._failures.append(failed)
            finally:
                self.loop.remove(shell.role)
        return not self._shells or (self._code != DONE and not self._has_supervisor)

    @property
    def _has_supervisor(self) -> bool:
        return any(shell.role.name == SUPERVISOR for shell in self._shells)

    def _leave(self) -> None:
        shells, self._shells = self._shells, []
        for shell in shells:
            with suppress(Failed):
                shell.leave()


@contextmanager
def client_session(
    connect: str,
    identity: str,
    pki: Path | None,
    stop: Stop,
    plane: Plane = Plane.SIMULATION,
    *,
    sets_runtime: bool = False,
) -> Iterator[tuple[Session, Credentials | None]]:
    """Connect to the router of a plane at `connect`, with the certificate of `identity` where `pki` names a folder.

    `connect` is an address, or `run:NAME` for a run of this user on this machine, whose address is waited for.
    `sets_runtime`: the first session of a process other than a router, which chooses Zenoh's client runtime.
    Raises NoRun, CertificateError, ConnectError after `CONNECT_S` or when `stop` is set.
    """
    credentials = load_credentials(pki, identity)
    security = None if credentials is None else Security(credentials)
    if sets_runtime:
        use_client_runtime()
    address = address_of(connect.removeprefix(RUN), plane, stop.is_set) if connect.startswith(RUN) else connect
    bytes_max = limits.RADIO_MESSAGE_BYTES_MAX if plane is Plane.RADIO else limits.MESSAGE_BYTES_MAX
    with Session.client(address, CONNECT_S, bytes_max, stop.is_set, security) as session:
        yield session, credentials


def address_of(run: str, plane: Plane, give_up: Callable[[], bool]) -> str:
    """Return where the plane's router of a run listens, as soon as that is known.

    Raises NoRun, ConnectError for a run that has ended or when `give_up` returns True.
    """
    folder = open_run(run)
    while not give_up():
        info = folder.info()
        address = "" if info is None else info.radio if plane is Plane.RADIO else info.simulation
        if address:
            return address
        if folder.result() is not None:
            raise ConnectError(f"run {run} has ended")
        time.sleep(LOOK_S)
    raise ConnectError(f"stopped before run {run} had an address")
