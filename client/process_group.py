"""The players that share a session, as one core: messages are routed by name, and all send together.

They have one loop and one thread: threads of players that are due at the same tick would compete for the interpreter
at every message. For the run each of them is a separate player.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from foosim.client.core import ClientCore
from foosim.client.errors import PlayerError
from foosim.client.failing import report_failure
from foosim.client.loading import load_player
from foosim.client.player import PlayerFactory, PlayerLoop
from foosim.protocol.actions import Action, Log
from foosim.protocol.channels import Channel
from foosim.runtime.command import DONE, FAILED, REFUSED


class Crew:
    """One core out of several. `actions` are for the shell; `step` after every message and wake."""

    def __init__(self, cores: Sequence[ClientCore], load: Callable[[str], PlayerFactory] = load_player) -> None:
        assert cores, "a crew of nobody"
        self.actions: list[Action] = []
        self.cores = tuple(cores)
        self._players = {core.name: PlayerLoop(core, load) for core in cores}
        self._stirred: dict[str, PlayerLoop] = {}
        """Players with a message since the last step, in that order."""

    # --- what the shell calls ----------------------------------------------------------------------------------------

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        """Hand a message to the player that it names; the first player counts those with unknown names."""
        player = self._players.get(name)
        if player is None:
            player = self._players[self.cores[0].name]
        player.core.receive(channel, name, payload, now_ns)
        self._stirred[player.core.name] = player

    def wake(self, now_ns: int) -> None:
        """Repeat unanswered messages that are due."""
        for core in self.cores:
            core.wake(now_ns)
        self._stirred = dict(self._players)

    def step(self, now_ns: int) -> None:
        """Let the players in turn act. Raises PlayerError for the first one that fails; the vHub gets the reason."""
        stirred, self._stirred = self._stirred, {}
        for player in stirred.values():
            try:
                player.step(now_ns)
            except PlayerError as error:
                report_failure(player.core, error)
                raise
            finally:
                self._speak(player.core)

    def _speak(self, core: ClientCore) -> None:
        """Take a core's actions; with several cores, a log line has the player's name."""
        if len(self.cores) == 1:
            self.actions += core.actions
        else:
            self.actions += [
                Log(action.level, f"{core.name}: {action.text}") if isinstance(action, Log) else action
                for action in core.actions
            ]
        core.actions.clear()

    def hub_alive(self, is_alive: bool, now_ns: int) -> None:
        """The vHub's presence has begun or ended."""
        for core in self.cores:
            (core.hub_here if is_alive else core.hub_gone)(now_ns)
        self._stirred = dict(self._players)

    def rest(self, stood_ns: int, now_ns: int) -> None:
        """Report a standstill of the shared loop to each player."""
        for core in self.cores:
            core.rest(stood_ns, now_ns)

    def deadline_ns(self) -> int:
        """When `wake` is due next, or a player acts."""
        return min(min(player.core.deadline_ns(), player.deadline_ns()) for player in self._players.values())

    # --- the end -----------------------------------------------------------------------------------------------------

    @property
    def is_over(self) -> bool:
        """Whether the run has ended for all of them, or one is refused or lost, which ends it for the others."""
        cores = self.cores
        return all(core.ended for core in cores) or any(core.lost or core.refusal for core in cores)

    def leave(self) -> int:
        """Report the players that have lost the vHub; return the exit code."""
        for core in self.cores:
            if core.lost:
                core.actions.append(Log("error", "lost the vHub"))
            self._speak(core)
        if any(core.refusal for core in self.cores):
            return REFUSED
        return DONE if all(core.ended for core in self.cores) else FAILED
