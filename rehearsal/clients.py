"""The players of a rehearsal, and its other lockstep clients, as processes: how they come, fail, end and come again.

A player whose own code fails says so and ends, as its process does. Neighbours: `system` runs them, `client.crew` is
the same for processes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.client.core import ClientCore
from foosim.client.errors import PlayerError
from foosim.client.failing import Unanswered, tell_failure
from foosim.client.loading import load_player
from foosim.client.player import PlayerLoop
from foosim.protocol import channels
from foosim.rehearsal.settings import Process

if TYPE_CHECKING:
    from foosim.rehearsal.system import System


class Clients:
    """All clients of one system, by name."""

    def __init__(self, system: System) -> None:
        self.players: dict[str, PlayerLoop] = {}
        self._system = system
        self._starts = 0

    def enter_all(self) -> None:
        """Let everybody in whom the deployment or the rehearsal declares."""
        system = self._system
        for name, player in sorted(system.supervisor.deployment.players.items()):
            assert player.lockstep, "a rehearsal has lockstep players only"
            self.enter_player(name, "boot")
        for name, client in sorted(system.settings.clients.items()):
            core = ClientCore(name, "boot", system.now_of(name))
            system.enter(name, core, client(core), channels.CLIENT_READS)

    def enter_player(self, name: str, boot: str) -> None:
        """Let a player's process in."""
        system = self._system
        core = ClientCore(name, boot, system.now_of(name))
        loop = self.players[name] = PlayerLoop(core, load_player)

        def turn(now_ns: int) -> None:
            at_work = system.at_work
            at_work.tick = -1 if core.go is None else core.go.tick
            try:
                at_work.acts = True
                loop.step(now_ns)
                at_work.acts = False
            except (PlayerError, Unanswered) as error:
                at_work.acts = False
                tell_failure(core, error)
                system.soon(lambda: system.leave(name))

        system.enter(name, core, turn, channels.CLIENT_READS)
        system.processes[name].stood = core.rest

    def start(self, name: str) -> None:
        """Start a player's process again, with new memory."""
        self._starts += 1
        self.enter_player(name, f"boot-{self._starts}")

    def gone(self, name: str) -> None:
        """The vHub sees that a client's presence has ended."""
        system = self._system
        hub = system.processes.get(channels.VHUB)
        if hub is not None:
            system.hub.client_gone(name, hub.clock.at(system.bus.now_ns))
            system.take_turn(hub)

    def hub_gone(self) -> None:
        """All see that the vHub's presence has ended."""
        for process in self._here():
            process.core.hub_gone(process.clock.at(self._system.bus.now_ns))
            self._system.take_turn(process)

    def hub_here(self) -> None:
        """All see that a vHub is present."""
        for process in self._here():
            process.core.hub_here(process.clock.at(self._system.bus.now_ns))
            self._system.wake(process)

    def _here(self) -> list[Process]:
        return [process for process in self._system.processes.values() if isinstance(process.core, ClientCore)]
