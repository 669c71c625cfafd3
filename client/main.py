"""The process `foosim-player`: players that the deployment declares, between their classes and the radio plane.

One address is all that it needs: class, rate, robots and parameters come with the welcome. Several players in a process
have a thread, a session and a presence each, and are to the run what they would be alone. Neighbours: `core`, `player`
(the loop that the rehearsal shares), `protocol.loop`.
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
from foosim.client.player import PlayerLoop
from foosim.protocol import channels, identity, limits
from foosim.protocol.actions import Say
from foosim.protocol.admission import Admission
from foosim.protocol.certificates import Credentials, load_credentials, warn_of_end
from foosim.protocol.channels import VHUB, Plane
from foosim.protocol.command import DONE, FAILED, REFUSED, PkiOption, VersionOption, new_app, run_app
from foosim.protocol.errors import BadValue
from foosim.protocol.inbox import Inbox
from foosim.protocol.loop import Loop, Wire
from foosim.protocol.names import is_name
from foosim.protocol.probe import ProgressOption
from foosim.protocol.process import Stop, die_with_parent, new_boot, start_log
from foosim.protocol.session import Session, use_client_runtime
from foosim.protocol.session_settings import Security

CONNECT_S = 60.0


class PlayerProcess:
    """One player on one session, until the run ends, the vHub is gone for good, or `stop`."""

    def __init__(
        self,
        name: str,
        session: Session,
        inbox: Inbox,
        world: str = "",
        credentials: Credentials | None = None,
        progress: Path | None = None,
    ) -> None:
        self.core = ClientCore(name, new_boot(), time.monotonic_ns(), world)
        self.stopped = False
        self._player = PlayerLoop(self.core)
        self._inbox = inbox
        self._is_present = False
        self._admission = Admission(credentials, VHUB, session.locator, time.monotonic_ns())
        self._wire = Wire(session, Plane.RADIO, inbox, name)
        log = start_log(name)
        warn_of_end(credentials, log)
        self._loop = Loop(self.core, inbox, log, self._deadline_ns)
        self._loop.connect(self._wire)
        self._loop.show_progress(progress)
        self._loop.turn = self._turn
        self._loop.on_alive = self._on_alive
        self._wire.read(channels.CLIENT_READS, channels.CLIENT_WAITS)
        self._wire.watch_alive(VHUB)

    def run(self) -> int:
        """Take part until the end; return the exit code."""
        self._loop.run(self._is_over)
        if self.core.lost:
            self.core.actions.append(Say("error", "lost the vHub"))
        self._loop.perform()
        if self.core.refusal:
            return REFUSED
        return DONE if self.core.ended else FAILED

    def stop(self) -> None:
        """Have `run` return soon; a signal handler may call this."""
        self.stopped = True
        self._inbox.wake()

    def _is_over(self) -> bool:
        return self.stopped or self.core.ended or self.core.lost or bool(self.core.refusal)

    def _turn(self, now_ns: int) -> None:
        self._admission.check(now_ns)
        if self.core.deployment is not None and not self._is_present:
            self._is_present = True
            self._wire.declare_alive()
        self._player.step(now_ns)

    def _deadline_ns(self, now_ns: int) -> int:
        return min(self.core.deadline_ns(), self._player.deadline_ns())

    def _on_alive(self, plane: Plane, name: str, is_alive: bool) -> None:
        self._admission.heard(name, is_alive)
        if name == VHUB:
            (self.core.hub_here if is_alive else self.core.hub_gone)(time.monotonic_ns())


class Fleet:
    """The players of one process, each in a thread. The first one that fails, or is refused, stops all."""

    def __init__(self, players: Sequence[PlayerProcess]) -> None:
        self._players = players

    def run(self) -> int:
        """Take part until the end; return the greatest exit code. Raises what a player that failed raised."""
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

    Raises Refused when there is nobody to connect to, PlayerError when a class cannot be loaded or fails.
    """
    for name in names:
        if not is_name(name):
            raise BadValue("not a name for a player", name)
        if names.count(name) > 1:
            raise BadValue("a player that is named twice", name)
    use_client_runtime()
    stop = Stop()
    with ExitStack() as stack:
        players: list[PlayerProcess] = []
        for name in names:
            credentials = load_credentials(pki, identity.client(name))
            security = None if credentials is None else Security(credentials)
            limit = limits.RADIO_MESSAGE_BYTES_MAX
            session = stack.enter_context(Session.client(connect, CONNECT_S, limit, stop.is_set, security))
            inbox = Inbox(limits.INBOX_MESSAGES_MAX)
            first = progress if not players else None  # the others end when its loop does not go round any more
            players.append(PlayerProcess(name, session, inbox, world, credentials, first))
        if len(players) == 1:
            stop.then(players[0].stop)
            return players[0].run()
        fleet = Fleet(players)
        stop.then(fleet.stop)
        return fleet.run()


app = new_app()


@app.command()
def player(
    name: Annotated[
        list[str], typer.Option(help="Its name, as the deployment declares it under players; may be repeated.")
    ],
    connect: Annotated[str, typer.Option(help="Address of the vHub's radio plane: tcp/HOST:PORT.")],
    world: Annotated[str, typer.Option(help="Refuse any other world than this one.")] = "",
    pki: PkiOption = None,
    progress_file: ProgressOption = None,
    version: VersionOption = False,
) -> None:
    """Play in a run: load the class that the deployment names and let it act; of several players, each its own.

    The process ends with the run; it exits with 0 when the run ended, with 1 when the player failed or the vHub was
    gone for longer than a run waits for it, and with 3 when the vHub would not have it.
    """
    die_with_parent()
    raise typer.Exit(run_players(name, connect, world, pki, progress_file))


def main() -> None:
    """Entry of `foosim-player`."""
    run_app(app, "foosim-player")


if __name__ == "__main__":
    main()
