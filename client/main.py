"""The process `foosim-player`: players that the deployment declares, between their classes and the radio plane.

One address is all that it needs: class, rate, robots and parameters come with the welcome. Several players in a process
have a presence each, and are to the run what they would be alone. They share a session, a loop and a thread; those with
certificates, which are of one name each, have their own.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from foosim.client.core import ClientCore
from foosim.client.errors import PlayerError
from foosim.client.process_group import Crew
from foosim.common import limits
from foosim.common.errors import BadValue
from foosim.common.names import is_name
from foosim.protocol import channels, identity
from foosim.protocol.channels import VHUB, Plane
from foosim.runtime.command import DONE, PkiOption, VersionOption, new_app, run_app
from foosim.runtime.health import ProgressOption
from foosim.runtime.loop import Wire
from foosim.runtime.process import Stop, die_with_parent, end_with_stack, new_boot
from foosim.runtime.process_shell import ProcessShell, client_session
from foosim.runtime.transport.certificates import Credentials
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import Session


class PlayerProcess:
    """The players of one session, until the run ends, the vHub is gone for good, or `stop`."""

    def __init__(
        self,
        names: Sequence[str],
        session: Session,
        inbox: Inbox,
        world: str = "",
        credentials: Credentials | None = None,
        progress: Path | None = None,
    ) -> None:
        now_ns = time.monotonic_ns()
        self.crew = Crew([ClientCore(name, new_boot(), now_ns, world) for name in names])
        self._absent = [Wire(session, Plane.RADIO, inbox, name) for name in names]
        """Those of players that are not admitted yet."""
        log = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} others"
        first = self._absent[0]
        self._shell = ProcessShell(
            self.crew, log, first, inbox, lambda now_ns: self.crew.deadline_ns(), progress, credentials
        )
        self._loop = self._shell.loop
        self._loop.turn = self._turn
        self._loop.on_alive, self._loop.stood = self._on_alive, self.crew.rest
        for wire in self._absent:  # a loop waits in the queue of one player, not in those of several
            wire.read(channels.CLIENT_READS, channels.CLIENT_WAITS if len(names) == 1 else ())
        self._shell.watch_router(VHUB, session.locator)

    def run(self) -> int:
        """Take part until the end; return the exit code. Raises PlayerError for a player that fails."""
        try:
            self._loop.run(lambda: self._shell.stopped or self.crew.is_over)
        except PlayerError:
            self._loop.perform()  # the vHub has the reason, the log the place
            raise
        code = self.crew.leave()
        self._loop.perform()
        return code

    def stop(self) -> None:
        """Have `run` return soon; a signal handler may call this."""
        self._shell.stop()

    def _turn(self, now_ns: int) -> None:
        self._shell.check(now_ns)
        if self._absent:
            self._be_present()
        self.crew.step(now_ns)

    def _be_present(self) -> None:
        """Report the players that were admitted."""
        welcome = {core.name for core in self.crew.cores if core.deployment is not None}
        for wire in self._absent:
            if wire.name in welcome:
                wire.declare_alive()
        self._absent = [wire for wire in self._absent if wire.name not in welcome]

    def _on_alive(self, plane: Plane, name: str, is_alive: bool) -> None:
        self._shell.on_alive(name, is_alive)
        if name == VHUB:
            self.crew.hub_alive(is_alive, time.monotonic_ns())


class Fleet:
    """The sessions of one process, each in a thread. The first one that fails, or is refused, stops all."""

    def __init__(self, players: Sequence[PlayerProcess]) -> None:
        self._players = players

    def run(self) -> int:
        """Take part until the end; return the greatest exit code. Raises the error of a player that failed."""
        with ThreadPoolExecutor(len(self._players)) as pool:
            running = [pool.submit(player.run) for player in self._players]
            for ended in as_completed(running):
                if ended.exception() is not None or ended.result() != DONE:
                    self.stop()
        failed = [error for ended in running if (error := ended.exception()) is not None]
        if failed:
            raise failed[0]
        return max(ended.result() for ended in running)

    def stop(self) -> None:
        """Have `run` return soon; a signal handler may call this."""
        for player in self._players:
            player.stop()


def run_players(
    names: Sequence[str], connect: str, world: str = "", pki: Path | None = None, progress: Path | None = None
) -> int:
    """Run declared players until their run ends; return the exit code. `pki` has their certificates, or passwords.

    Raises Refused when no vHub can be reached, PlayerError when a class cannot be loaded or fails.
    """
    for name in names:
        if not is_name(name):
            raise BadValue("not a name for a player", name)
        if names.count(name) > 1:
            raise BadValue("a player that is named twice", name)
    stop = Stop()
    with ExitStack() as stack:
        players: list[PlayerProcess] = []
        for crew in [names] if pki is None else [[name] for name in names]:  # a session has one certificate
            who, limit = identity.client(crew[0]), limits.RADIO_MESSAGE_BYTES_MAX
            link = client_session(connect, who, pki, stop, limit, sets_runtime=not players)
            session, inbox, credentials = stack.enter_context(link)
            first = progress if not players else None  # the others end when its loop does not go round any more
            players.append(PlayerProcess(crew, session, inbox, world, credentials, first))
        if len(players) == 1:
            stop.then(players[0].stop)
            return players[0].run()
        fleet = Fleet(players)
        stop.then(fleet.stop)
        return fleet.run()


app = new_app()


@app.command()
def player(
    name: Annotated[list[str], typer.Option(help="Name of a player in the deployment; may be repeated.")],
    connect: Annotated[str, typer.Option(help="Address of the vHub's radio plane: tcp/HOST:PORT.")],
    world: Annotated[str, typer.Option(help="Refuse to join a run of another world.")] = "",
    pki: PkiOption = None,
    progress_file: ProgressOption = None,
    version: VersionOption = False,
) -> None:
    """Run players: the classes that the deployment names for them.

    The process ends with the run.

    Exit codes: 0 when the run ended, 1 when a player failed or the vHub was lost for longer than the deployment's
    `deadlines.vhub_back`, 3 when the vHub refused it.
    """
    die_with_parent()
    end_with_stack()
    raise typer.Exit(run_players(name, connect, world, pki, progress_file))


def main() -> None:
    """Entry of `foosim-player`."""
    run_app(app, "foosim-player")


if __name__ == "__main__":
    main()
