"""Settings of a rehearsal, and its state of each process: its clock, its inbox, what it did."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from foosim.client.core import ClientCore
from foosim.node.core import NodeCore
from foosim.node.physics.interface import EngineFactory
from foosim.protocol.messages import Epoch
from foosim.runtime.roles.bus import CALM, Message, Weather
from foosim.runtime.roles.standstill import Standstill
from foosim.supervisor.core import SupervisorCore
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import Closing
from foosim.world.frame import Frame

MILLION = 1_000_000


@dataclass
class Clock:
    """One process's monotonic clock: its reading at virtual time 0, and its rate error.

    Clocks of processes differ, as on separate machines, so times of two processes are not comparable.
    """

    offset_ns: int = 0
    drift_ppm: int = 0

    def at(self, virtual_ns: int) -> int:
        """Return its reading at a virtual time."""
        return virtual_ns + self.offset_ns + virtual_ns * self.drift_ppm // MILLION

    def when(self, clock_ns: int) -> int:
        """Return the first virtual time at which its reading is at least this."""
        passed_ns = clock_ns - self.offset_ns
        if not self.drift_ppm:
            return passed_ns
        return -(-passed_ns * MILLION // (MILLION + self.drift_ppm))


@dataclass(frozen=True)
class Traced:
    """One action of a process: `what` is journal, publish or receive."""

    now_ns: int
    process: str
    what: str
    channel: str
    payload: bytes
    name: str = ""
    """The process that the channel's key names."""


Observer = Callable[[Traced], None]


@dataclass
class Process:
    """One process of the rehearsal: its core, and the state that a shell would have."""

    name: str
    core: Any
    turn: Callable[[int], None]
    slow_ns: int = 0
    """Virtual time that each turn takes in which it publishes something."""
    busy_until_ns: int = 0
    wake_ns: int = 0
    """When it is woken next, if no message arrives before."""
    inbox: deque[Message] = field(default_factory=deque)
    """Messages that arrived while it was busy, in order of arrival."""
    took: Callable[[int, int], None] = lambda begun_ns, ended_ns: None
    """Called with the duration of each turn, as a shell does."""
    clock: Clock = field(default_factory=Clock)
    due_ns: int = 0
    """Latest planned wake-up of its loop, by its own clock."""
    standstill: Standstill = field(default_factory=lambda: Standstill(0))
    stood: Callable[[int, int], None] = lambda stood_ns, now_ns: None
    """Called with the duration of each standstill of its loop, as a shell does."""

    def begin(self, virtual_ns: int) -> None:
        """Start its loop."""
        self.due_ns = self.clock.at(virtual_ns)
        self.standstill = Standstill(self.due_ns)

    def look(self, virtual_ns: int) -> int:
        """Run one pass of its loop, reporting a standstill; return the time on its clock."""
        now_ns = self.clock.at(virtual_ns)
        stood_ns = self.standstill.look(self.due_ns, now_ns)
        if stood_ns:
            self.stood(stood_ns, now_ns)
        return now_ns


@dataclass
class AtWork:
    """The process in turn, readable from another thread."""

    name: str = ""
    tick: int = -1
    """The tick at which a player acts; -1 outside of ticks."""
    acts: bool = False
    """Whether the player's own code runs."""
    turns: int = 0
    """Number of turns so far; an equal number identifies the same turn."""


@dataclass
class Settings:
    """Settings of a rehearsal beside the deployment. `slow_ns` is by process name."""

    run: str = "rehearsal"
    ticks: int = 0
    weather: Weather = CALM
    slow_ns: Mapping[str, int] = field(default_factory=dict)
    clocks: Mapping[str, Clock] = field(default_factory=dict)
    """By process; processes without an entry use virtual time."""
    clients: Mapping[str, Callable[[ClientCore], Callable[[int], None]]] = field(default_factory=dict)
    """Lockstep clients beside the players, by name: each takes its core and returns its turn function."""
    factory: EngineFactory | None = None
    hub: type[HubCore] = HubCore
    supervisor: type[SupervisorCore] = SupervisorCore
    node: type[NodeCore] = NodeCore
    """The cores' classes: tests plant faults by subclasses."""
    is_guarded: bool = False
    """Whether components that write to the frame otherwise than by their views are errors."""
    keeps_journals: bool = False
    """Whether the supervisor's journal is kept, so that it can be restarted."""
    restart_ns: int = 0
    """Virtual time after which a refused node is restarted, as a launcher does; 0: it is not."""
    observer: Observer | None = None
    observes: Collection[str] = ("journal", "publish", "receive")
    """The actions that the observer receives."""
    on_commit: Callable[[Frame], None] | None = None
    on_closing: Callable[[Closing], None] | None = None
    on_epoch: Callable[[Epoch], None] | None = None
    closing: Callable[[HubCore, int], bool] = lambda hub, passed_ns: True
    """State of the vHub's capture, including `recording`, this long after the run's end."""
    on_log: Callable[[str, str, str], None] | None = None
    on_journal: Callable[[str, bytes], None] | None = None
