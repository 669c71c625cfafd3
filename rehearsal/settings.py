"""How to rehearse, and what a rehearsal knows of each of its processes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from foosim.client.core import ClientCore
from foosim.node.core import NodeCore
from foosim.node.engines.interface import EngineFactory
from foosim.protocol.messages import Epoch
from foosim.rehearsal.bus import CALM, Message, Observer, Weather
from foosim.rehearsal.clock import Clock
from foosim.runtime.standstill import Standstill
from foosim.supervisor.core import SupervisorCore
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import Closing
from foosim.world.frame import Frame


@dataclass
class Process:
    """One process of the rehearsal: its core, and what a shell would know."""

    name: str
    core: Any
    turn: Callable[[int], None]
    slow_ns: int = 0
    """Virtual time that each of its turns takes which says something."""
    busy_until_ns: int = 0
    wake_ns: int = 0
    """When it is woken next, if nothing comes before."""
    inbox: deque[Message] = field(default_factory=deque)
    """What came while it was busy, in order of arrival."""
    took: Callable[[int, int], None] = lambda begun_ns, ended_ns: None
    """Told how long its turns took, as a shell tells."""
    clock: Clock = field(default_factory=Clock)
    due_ns: int = 0
    """When its loop means to look again at the latest, by its own clock."""
    standstill: Standstill = field(default_factory=lambda: Standstill(0))
    stood: Callable[[int, int], None] = lambda stood_ns, now_ns: None
    """Told for how long its loop stood still, as a shell tells."""

    def begin(self, virtual_ns: int) -> None:
        """Its loop begins to go round."""
        self.due_ns = self.clock.at(virtual_ns)
        self.standstill = Standstill(self.due_ns)

    def look(self, virtual_ns: int) -> int:
        """Its loop goes round, which may have stood still: return the time on its clock."""
        now_ns = self.clock.at(virtual_ns)
        stood_ns = self.standstill.look(self.due_ns, now_ns)
        if stood_ns:
            self.stood(stood_ns, now_ns)
        return now_ns


@dataclass
class AtWork:
    """Whose turn it is: for whoever looks on from another thread."""

    name: str = ""
    tick: int = -1
    """The tick that a player acts at; -1 while it is at none."""
    acts: bool = False
    """Whether it is a player's own code."""
    turns: int = 0
    """How many there have been; while it is the same number, it is the same turn."""


@dataclass
class Settings:
    """How to rehearse: everything beside the deployment. `slow_ns` is by process name."""

    run: str = "rehearsal"
    ticks: int = 0
    weather: Weather = CALM
    slow_ns: Mapping[str, int] = field(default_factory=dict)
    clocks: Mapping[str, Clock] = field(default_factory=dict)
    """By process; who has none here goes by virtual time."""
    clients: Mapping[str, Callable[[ClientCore], Callable[[int], None]]] = field(default_factory=dict)
    """Lockstep clients beside the players, by name: each gets its core and gives its turn."""
    factory: EngineFactory | None = None
    hub: type[HubCore] = HubCore
    supervisor: type[SupervisorCore] = SupervisorCore
    node: type[NodeCore] = NodeCore
    """The cores' classes: tests plant faults by subclasses."""
    keeps_journals: bool = False
    """Whether the supervisor's journal is kept, so that it can be started again."""
    restart_ns: int = 0
    """Virtual time after which a node that was refused is started again, as a launcher does; 0: it is not."""
    observer: Observer | None = None
    observes: Collection[str] = ("journal", "publish", "receive")
    """What the observer is told of."""
    on_commit: Callable[[Frame], None] | None = None
    on_closing: Callable[[Closing], None] | None = None
    on_epoch: Callable[[Epoch], None] | None = None
    closing: Callable[[HubCore, int], bool] = lambda hub, passed_ns: True
    """Whether the vHub has closed its capture, and in its `recording` how far it is, so long after the run's end."""
    on_say: Callable[[str, str, str], None] | None = None
    on_journal: Callable[[str, bytes], None] | None = None
