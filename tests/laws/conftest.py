"""A rehearsal into which somebody speaks who takes no part in it: for law 7."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest

from foosim.protocol import channels
from foosim.protocol.channels import SUPERVISOR, VHUB, Channel, Plane
from foosim.protocol.codec import encode
from foosim.protocol.frame import Frame
from foosim.rehearsal.bus import Traced
from foosim.rehearsal.rehearse import Rehearsed, rehearse
from foosim.rehearsal.system import Settings, System

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT: Final = TABLE.read_text()
NODES: Final = ("n1", "n2")
PLAYERS: Final = ("player-blue", "player-red")
TICKS: Final = 100
SETS: Final = ("engine=pure", "table.rules.kickoff_delay=20 ms", "deadlines.start=5 s")
NOBODY: Final = "nobody"
READS: Final[Mapping[str, tuple[tuple[Channel, bool], ...]]] = {
    **dict.fromkeys(NODES, channels.NODE_READS),
    VHUB: channels.VHUB_READS,
    SUPERVISOR: channels.SUPERVISOR_READS,
    **dict.fromkeys(PLAYERS, channels.CLIENT_READS),
}
"""Who takes part, and what each reads."""


class Disturbed:
    """A rehearsal of 100 ticks on two nodes. `put` says something on a key; `go` runs, `system` is the whole."""

    text, name, ticks, sets = TEXT, TABLE.name, TICKS, SETS

    def __init__(self) -> None:
        self.settings = Settings()
        self.frames: list[Frame] = []
        self.settings.on_commit = self.frames.append
        self._system: System | None = None
        self._plans: list[tuple[int, Callable[[], None]]] = []

    @property
    def system(self) -> System:
        assert self._system is not None, "before the run"
        return self._system

    def at(self, tick: int, action: Callable[[], None]) -> None:
        """Do something when frame `tick` is committed; 0 is before anything else."""
        self._plans.append((tick, action))

    def put(self, channel: Channel, name: str, message: msgspec.Struct | bytes) -> None:
        payload = message if isinstance(message, bytes) else encode(message)
        self.system.bus.put(NOBODY, channel, name, payload, self.system.bus.now_ns)

    def go(self) -> Rehearsed:
        def prepare(system: System) -> None:
            self._system = system
            for tick, action in self._plans:
                if tick:
                    system.at_tick(tick, action)
                else:
                    action()

        return rehearse(TEXT, TABLE.name, TICKS, len(NODES), SETS, self.settings, prepare=prepare)

    def counts(self, *fields: str) -> dict[str, int]:
        """The sum of these counts of every process, as far as it has them."""
        cores: dict[str, Any] = {name: process.core for name, process in self.system.processes.items()}
        numbers = {name: core.statistics() for name, core in {**cores, VHUB: self.system.hub}.items()}
        return {name: sum(getattr(number, field, 0) for field in fields) for name, number in numbers.items()}

    def malformed(self) -> dict[str, int]:
        """How many messages each process refused; the vHub and clients call it so, the others `refused`."""
        refused, malformed = self.counts("refused"), self.counts("malformed")
        return {name: malformed[name] or refused[name] for name in refused}

    @staticmethod
    def undisturbed() -> tuple[Rehearsed, dict[str, list[bytes]]]:
        """The run that nobody disturbs, and what was published in it by plane and channel."""
        return _undisturbed()

    @staticmethod
    def hearers(channel: Channel, name: str) -> list[str]:
        """Who reads what is said on a channel's key of `name`."""
        return [who for who, read in READS.items() if {(channel, False), (channel, who == name)} & {*read}]

    @staticmethod
    def assert_untouched(result: Rehearsed) -> None:
        """The run was done, its frames and its packets are those of the undisturbed one."""
        usual, _ = _undisturbed()
        assert result.json["reason"] == "done" and len(result.digests) == TICKS
        assert result.digests == usual.digests
        accounts = [dict(one.json["packets"], refused=None) for one in (result, usual)]
        assert accounts[0] == accounts[1], "no packet was lost or came twice"


@cache
def _undisturbed() -> tuple[Rehearsed, dict[str, list[bytes]]]:
    disturbed = Disturbed()
    said: dict[str, list[bytes]] = {}

    def watch(traced: Traced) -> None:
        if traced.what == "publish":
            is_radio = traced.process in PLAYERS or traced.channel in (channels.DOWN.name, channels.CLIENT_WELCOME.name)
            plane = Plane.RADIO if is_radio else Plane.SIMULATION
            said.setdefault(plane.name + traced.channel, []).append(traced.payload)

    disturbed.settings.observer = watch
    return disturbed.go(), said


@pytest.fixture
def disturbed() -> Disturbed:
    """A rehearsal that is not run yet."""
    return Disturbed()
