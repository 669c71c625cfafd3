"""The process `foosim role player`: players that the deployment declares, between their classes and the radio plane.

The vHub sends class, rate, robots and parameters with the welcome. Each player of a process is a role with its own
presence. Players share the process's loop, and its session where there are no certificates, which have one name each.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Final, Protocol

import typer

from foosim.client.core import ClientCore
from foosim.client.errors import PlayerError
from foosim.client.loading import load_player, look_in
from foosim.client.playing import PlayerLoop, report_failure
from foosim.common.errors import BadValue
from foosim.common.names import is_name
from foosim.protocol import channels
from foosim.protocol.actions import Log
from foosim.protocol.channels import VHUB, Plane
from foosim.runtime.command import DONE, FAILED, REFUSED, PathOption, PkiOption, new_app
from foosim.runtime.file_cache import FileCache
from foosim.runtime.health import ProgressOption
from foosim.runtime.process import Stop, die_with_parent, new_boot
from foosim.runtime.roles.shell import Process, RoleShell, client_session
from foosim.runtime.transport.certificates import Credentials
from foosim.runtime.transport.session import Session


class Driver(Protocol):
    """What acts for a client: a player, or a gateway."""

    def step(self, now_ns: int) -> None:
        """Advance after every message and wake. Raises PlayerError for a player that fails."""

    def deadline_ns(self) -> int:
        """When it acts next without a message."""


class ClientShell:
    """One client, until the run ends, the vHub is gone for good, its player fails, or `stop`."""

    def __init__(
        self,
        process: Process,
        name: str,
        session: Session,
        world: str = "",
        credentials: Credentials | None = None,
        driver: Callable[[ClientCore], Driver] | None = None,
    ) -> None:
        """`driver` acts for the client; by default the player of its name."""
        self.core = ClientCore(name, new_boot(), time.monotonic_ns(), world, FileCache())
        self._driver = PlayerLoop(self.core, load_player) if driver is None else driver(self.core)
        self._failure: PlayerError | None = None
        self._is_present = self._is_stopped = False
        self._shell = RoleShell(process, name, self.core, lambda now_ns: self._deadline_ns(), credentials)
        self.role: Final = self._shell.role
        self.role.turn = self._turn
        self.role.on_alive, self.role.stood = self._on_alive, self.core.rest
        self._wire = self._shell.connect(session, Plane.RADIO)
        self._wire.read(channels.CLIENT_READS, channels.CLIENT_WAITS)
        self._shell.watch_router(self._wire, VHUB)

    def is_over(self) -> bool:
        """Whether the run has ended, or the player leaves it."""
        core = self.core
        return self._is_stopped or core.ended or core.lost or bool(core.refusal or self._failure)

    def finish(self) -> int:
        """Perform the last actions; return the exit code. Raises PlayerError for a player that has failed."""
        if self.core.lost:
            self.core.actions.append(Log("error", "lost the vHub"))
        self.role.perform()  # of one that has failed, the vHub gets the reason, the log the place
        if self._failure is not None:
            raise self._failure
        if self.core.refusal:
            return REFUSED
        return DONE if self.core.ended else FAILED

    def leave(self) -> None:
        """A player keeps nothing in files."""

    def stop(self) -> None:
        """Have the player leave the run; a signal handler may call this."""
        self._is_stopped = True

    def _turn(self, now_ns: int) -> None:
        self._shell.check(now_ns)
        if self.core.deployment is not None and not self._is_present:
            self._is_present = True
            self._wire.declare_alive()
        if self._failure is None:
            try:
                self._driver.step(now_ns)
            except PlayerError as error:
                report_failure(self.core, error)
                self._failure = error

    def _deadline_ns(self) -> int:
        return min(self.core.deadline_ns(), self._driver.deadline_ns())

    def _on_alive(self, plane: Plane, name: str, is_alive: bool) -> None:
        self._shell.on_alive(name, is_alive)
        if name == VHUB:
            (self.core.hub_here if is_alive else self.core.hub_gone)(time.monotonic_ns())


class Sessions:
    """The sessions of the clients of a process: one for all, with certificates one each, because these have a name."""

    def __init__(self, stack: ExitStack, connect: str, pki: Path | None, stop: Stop) -> None:
        """They are closed with the `stack`."""
        self._stack, self._connect, self._pki, self._stop = stack, connect, pki, stop
        self._newest: tuple[Session, Credentials | None] | None = None

    def of(self, name: str) -> tuple[Session, Credentials | None]:
        """Return the session of a client. Raises Refused when no vHub can be reached."""
        if self._newest is None or self._pki is not None:
            is_first = self._newest is None
            link = client_session(
                self._connect, f"client.{name}", self._pki, self._stop, Plane.RADIO, sets_runtime=is_first
            )
            self._newest = self._stack.enter_context(link)
        return self._newest


def run_players(
    names: Sequence[str], connect: str, world: str = "", pki: Path | None = None, progress: Path | None = None
) -> int:
    """Run declared players until their run ends; return the exit code. `pki` has their certificates.

    Raises Refused when no vHub can be reached.
    """
    for name in names:
        if not is_name(name):
            raise BadValue("not a name for a player", name)
        if names.count(name) > 1:
            raise BadValue("player named twice", name)
    stop = Stop()
    log = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} others"
    process = Process(log, progress, is_shared=len(names) > 1)
    with ExitStack() as stack:
        sessions = Sessions(stack, connect, pki, stop)
        for name in names:
            session, credentials = sessions.of(name)
            process.add(ClientShell(process, name, session, world, credentials))
        stop.then(process.stop)
        return run_to_end(process)


def run_to_end(process: Process) -> int:
    """Run a process with players; return the exit code. A player that fails has its text in the log."""
    try:
        return process.run()
    except PlayerError:
        return FAILED


app = new_app()


@app.command()
def player(
    name: Annotated[list[str], typer.Option(help="Name of a player in the deployment; may be repeated.")],
    connect: Annotated[str, typer.Option(help="Address of the vHub's radio plane: tcp/HOST:PORT, or run:NAME.")],
    world: Annotated[str, typer.Option(help="Refuse to join a run of another world.")] = "",
    pki: PkiOption = None,
    path: PathOption = None,
    progress_file: ProgressOption = None,
) -> None:
    """Run players: the classes that the deployment names for them.

    The process ends with the run.

    Exit codes: 0 when the run ended, 1 when a player failed or the vHub was lost for longer than the deployment's
    `deadlines.vhub_back`, 3 when the vHub refused it.
    """
    die_with_parent()
    if path is not None:
        look_in(str(path.absolute()))
    raise typer.Exit(run_players(name, connect, world, pki, progress_file))
