"""Rehearsals under random faults, by seed: the real cores of all processes, on virtual time, in bad weather.

A seed decides the number of nodes, their clocks, the impairments of the bus and the time and kind of each fault. The
laws are checked at every journal record, message and closing; then all faults end, and the run must finish with all
processes present. A failing seed is reproduced with one command.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import Final, TypeAlias

from foosim.client.core import ClientCore
from foosim.client.player import Packet
from foosim.common.errors import Refused
from foosim.common.names import CHANNEL_ECHO
from foosim.common.units import Pace
from foosim.deployment.loader import load_deployment
from foosim.deployment.validate import rigid_bodies
from foosim.node.core import NodeCore
from foosim.protocol import channels
from foosim.runtime.roles.bus import CALM, Weather
from foosim.simulation.run import with_nodes
from foosim.simulation.settings import Clock, Traced
from foosim.simulation.stepped_world import SteppedWorld
from foosim.simulation.system import Settings, System
from foosim.supervisor.settings import RunSettings
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.components.grasping import GripperSettings
from foosim.world.frame import Frame
from tests.swarm.faults import (
    CHANGES_THE_WORLD,
    FAULT_OF,
    HEALED_TICK,
    HOUR_NS,
    KINDS,
    MS,
    ONCE,
    SETS,
    TICKS,
    Dice,
    Fault,
    ask,
    lose_player,
    loses_players,
    revive,
    set_something,
    when_answered,
)
from tests.swarm.invariants import Laws
from tests.swarm.memory_bounds import too_large
from tests.swarm.packet_invariants import Broken, hold
from tests.swarm.strikes import lose_owner, set_field, strike

FAULTS: Final[tuple[int, ...]] = (8, 20)
NODES: Final[tuple[int, ...]] = (3, 3, 3, 4, 4, 5)
HEALED_PACE: Final = "0.02x"
"""100 ms a tick: slow enough that all processes are back before the end."""
PROGRESS_NS: Final = 10_000_000_000
"""After healing, the next tick is committed within this virtual time."""
BOUNDS_EVERY: Final = 50
"""Interval in ticks between checks of the memory bounds: a check takes as long as several ticks."""
IDLE_NS: Final = 60_000_000_000
"""The same limit during faults."""
WORLDS: Final = 4
"""Number of worlds; seed modulo this number selects one."""
PROBER: Final = "prober"
SMALL: Final[tuple[str, ...]] = (
    "substeps=1",
    f"clients={{{PROBER}: {{lockstep: true, rate: 50 Hz}}}}",
)
"""Overrides that keep the computation, with fewer steps, and add echo channels."""
PURE: Final[tuple[str, ...]] = ("engine=pure",)
"""Worlds whose bodies the pure engine has are computed by it."""
TABLE: Final = "table"
OF_TABLE: Final[tuple[str, ...]] = ("table.rules.kickoff_delay=20 ms",)
"""A table's game begins at once."""
BY_PERIOD: Final[tuple[str, ...]] = ("act=period", "arrivals={}", "rate=100 Hz")
"""In the last world players act at arrival, in the others at ticks of their own: both kinds are tested."""
PATIENT: Final[tuple[str, ...]] = (
    "deadlines.tick_lost=5 s",
    "deadlines.lockstep_fast=24 h",
    "deadlines.lockstep_realtime=24 h",
    "deadlines.client_back=24 h",
    "deadlines.start=24 h",
)
"""With a tenth of its messages lost, a process can need longer to join than on a lossless link."""
RESTART_NS: Final = 500 * MS
Files: TypeAlias = tuple[tuple[str, bytes], ...]
"""The files that a deployment refers to: paths and contents."""


@dataclass(frozen=True, slots=True)
class Plan:
    """The plan of a seed."""

    seed: int
    nodes: int
    weather: Weather
    faults: tuple[Fault, ...]
    clocks: tuple[tuple[str, Clock], ...]
    ticks: int = TICKS

    @property
    def healed_tick(self) -> int:
        return self.ticks - TICKS + HEALED_TICK

    @property
    def kinds(self) -> list[str]:
        return sorted({fault.kind for fault in self.faults})


def plan_of(seed: int, ticks: int = TICKS, *, lives: bool = False) -> Plan:
    """Return the plan of a seed: nodes, clocks, bus impairments, and 8 to 20 faults of at least three kinds.

    Their number grows with the length of the run. A world that `lives` has some more, on what it holds and does.
    """
    dice = Dice(seed)
    nodes = dice.one_of(NODES)
    names = [f"n{number}" for number in range(1, nodes + 1)]
    bad = dice.unit() < 0.7
    weather = Weather(
        seed,
        delay_ns=dice.between(0, MS) if bad else 0,
        spread_ns=dice.between(0, 3 * MS) if bad else 0,
        loss=dice.one_of((0.0, 0.02, 0.1)) if bad else 0.0,
        repeat=dice.one_of((0.0, 0.05, 0.3)) if bad else 0.0,
    )
    chosen = [KINDS[(seed + place) % len(KINDS)] for place in range(3)]
    times = max(1, ticks // TICKS)
    chosen += [dice.one_of(KINDS) for _ in range(dice.between(*FAULTS) * times - len(chosen))]
    once = [kind for place, kind in enumerate(chosen) if kind not in ONCE or kind not in chosen[:place]]
    late = max(0, ticks - TICKS)
    faults = [_later(FAULT_OF[kind](dice, names), dice.between(0, late) if late else 0) for kind in once]
    if loses_players(seed):
        of_players = Dice(seed, "players")
        lost = [lose_player(of_players, names) for _ in range(of_players.between(1, 3) * times)]
        faults += [_later(fault, of_players.between(0, late) if late else 0) for fault in lost]
    if seed % 16 == SETS:
        of_sets = Dice(seed, "sets")
        wanted = [set_something(of_sets, names) for _ in range(of_sets.between(3, 8) * times)]
        faults += [_later(fault, of_sets.between(0, late) if late else 0) for fault in wanted]
    if lives:
        of_living = Dice(seed, "living")
        kinds = [lose_owner] if seed % 2 else [lose_owner, strike, strike, set_field]
        struck = [of_living.one_of(kinds)(of_living, names) for _ in range(of_living.between(4, 10) * times)]
        faults += [_later(fault, of_living.between(0, late) if late else 0) for fault in struck]
    faults.sort(key=lambda fault: fault.tick)
    here = (*names, channels.SUPERVISOR, channels.VHUB, PROBER)
    clocks = tuple((name, Clock(dice.between(0, 2 * HOUR_NS), dice.between(-1000, 1000))) for name in here)
    return Plan(seed, nodes, weather, tuple(faults), clocks, ticks)


def _later(fault: Fault, ticks: int) -> Fault:
    return replace(fault, tick=fault.tick + ticks)


def spread(names: Sequence[str]) -> list[str]:
    """Return the first, the middle and the last one: robots of different nodes where those deal in name order."""
    return list(dict.fromkeys(names[place] for place in (0, len(names) // 2, -1)))


class Prober:
    """A lockstep client that sends numbered echo requests to robots and counts the replies."""

    def __init__(self, core: ClientCore) -> None:
        self._core = core
        self._joined = False
        self._sent = 0
        self._back: dict[bytes, int] = {}
        """The echoes received, with the tick of their arrival."""
        self._robots: list[str] = []

    def step(self, now_ns: int) -> None:
        """Join, and answer each Go with an echo request."""
        core = self._core
        if core.deployment is None or core.ended:
            return
        if not self._joined:
            self._joined = True
            deployment = core.deployment
            spec = deployment.clients[PROBER]
            assert spec.rate_hz is not None
            self._robots = spread(sorted(deployment.robots))
            heard = [(robot, CHANNEL_ECHO) for robot in self._robots]
            core.join(deployment.ticks(spec.rate_hz), heard, spec.offset_ns // deployment.tick_ns)
        if core.go is not None:
            for packet in core.go.packets:
                if packet.payload in self._back:
                    raise Broken(f"echo {packet.payload.decode()} comes back twice")
                self._back[packet.payload] = core.go.tick
            robot = self._robots[self._sent % len(self._robots)]
            self._sent += 1
            core.done([Packet(robot, CHANNEL_ECHO, f"{robot} {self._sent}".encode())])


class WatchedNode(NodeCore):
    """A node that lets the laws check the inputs of its frames."""

    def _enter(self, frame: Frame, now_ns: int) -> None:
        if self._barrier is not None:
            old = [part.node for part in self._barrier.parts.values() if part.epoch != self.epoch]
            hold(not old, f"{self.name} takes parts of {old} from another epoch than {self.epoch}")
        super()._enter(frame, now_ns)

    def _resume(self, frame: Frame, now_ns: int) -> None:
        epoch = self._awaited_epoch
        if epoch is not None:
            fits = frame.tick == epoch.tick and frame.digest == epoch.digest
            hold(fits, f"{self.name} begins epoch {epoch.epoch} from another frame than its own")
        super()._resume(frame, now_ns)


@dataclass(slots=True)
class Flown:
    """Result of a seed. `broken` is empty when all laws held and the run finished."""

    seed: int
    nodes: int
    kinds: list[str]
    faults: list[str]
    ticks: int = 0
    epochs: int = 0
    losses: int = 0
    joins: int = 0
    restarts: int = 0
    seen: int = 0
    """Number of journal records and messages that were checked."""
    virtual_s: float = 0.0
    broken: str = ""
    chain: str = ""
    packets: dict[str, int] = field(default_factory=dict)


@lru_cache(maxsize=WORLDS)
def lives(text: str, name: str) -> bool:
    """Return whether robots of a deployment hold things: faults hit these, too."""
    return any(
        isinstance(one, GripperSettings)
        for robot in load_deployment(text, name).robots.values()
        for one in robot.actuators.values()
    )


@lru_cache(maxsize=4 * WORLDS)
def worlds(text: str, name: str, nodes: int, seed: int) -> tuple[str, str]:
    """Return the swarm's world of a deployment on some nodes, and the same on one, without players."""
    deployment = load_deployment(text, name)
    of_world = list(OF_TABLE) if TABLE in deployment.kits else []
    of_world += PURE if next(rigid_bodies(deployment), None) is None else ()
    if seed != WORLDS - 1:
        acting = [player for player in deployment.players if deployment.arrivals_of(player)]
        of_world += [f"players.{player}.{what}" for player in acting for what in BY_PERIOD]
    text = with_nodes(text, name, nodes, [f"seed={seed}", *SMALL, *of_world, *PATIENT])
    return text, with_nodes(text, name, 1)


class Flight:
    """One running seed: the system, its invariants, and its healing."""

    def __init__(self, text: str, name: str, plan: Plan, settings: Settings, files: Files = ()) -> None:
        text, alone = worlds(text, name, plan.nodes, plan.seed % WORLDS)
        self.plan = plan
        self.seen = 0
        self._healed_ns = -1
        self._last_commit_ns = 0
        contents = dict(files)
        one = load_deployment(alone, name).with_assets(contents)
        self._world = SteppedWorld(one, initial_frame(one))
        self.laws = Laws(self._world, load_deployment(text, name).with_assets(contents))
        chosen = replace(
            settings,
            node=WatchedNode if settings.node is NodeCore else settings.node,
            weather=plan.weather,
            clocks=dict(plan.clocks),
            clients={PROBER: lambda core: Prober(core).step},
            restart_ns=RESTART_NS,
            keeps_journals=True,
            observer=self._see,
            observes=("journal", "publish"),
            on_closing=self.laws.close,
            on_commit=self._committed,
        )
        run = RunSettings(f"swarm-{plan.seed}", name, text, Pace("fast"), plan.ticks, files=contents)
        self.system = System(run, chosen)
        self.laws.flipped = self.system.flipped
        for fault in plan.faults:
            self.system.at_tick(fault.tick, partial(fault.do, self.system))
        self.system.at_tick(plan.healed_tick, self._heal)

    def run(self) -> None:
        """Run to the end. Raises Broken for a law that does not hold, and AssertionError of a core."""
        try:
            self.system.run()
            end = self.system.supervisor.state.end
            if end is None or end.reason != "done":
                raise Broken(f"the run ended: {'not at all' if end is None else end.reason}")
            self.laws.end(self.system, self.plan.nodes)
        finally:
            self.close()

    def close(self) -> None:
        """Free the engines."""
        self.system.close()
        self._world.close()

    def _see(self, traced: Traced) -> None:
        self.seen += 1
        idle_ns = traced.now_ns - self._last_commit_ns
        if idle_ns > (IDLE_NS if self._healed_ns < 0 else PROGRESS_NS):
            raise Broken(f"{'healed, ' * (self._healed_ns >= 0)}no tick is committed for {idle_ns / 1e9:.0f} s")
        self.laws.see(traced)
        if traced.what == "journal" and traced.process == channels.VHUB and self.system.hub.state is not None:
            self.laws.packets.account(self.system.hub.state)

    def _committed(self, frame: Frame) -> None:
        self._last_commit_ns = self.system.bus.now_ns
        if frame.tick % BOUNDS_EVERY == 0:
            large = [text for process in self.system.processes.values() for text in too_large(process.core)]
            hold(not large, f"at tick {frame.tick} memory bounds are exceeded: {', '.join(large)}")

    def _heal(self) -> None:
        """End all faults: start stopped processes, restore speeds and resume paused processes."""
        system = self.system
        self._healed_ns = self._last_commit_ns = system.bus.now_ns
        system.healed = True
        system.bus.heal()
        system.people.give_up("rate")  # or an earlier, delayed request would arrive after this one
        ask(system, "rate", pace=HEALED_PACE)
        for name, process in list(system.processes.items()):
            process.slow_ns = 0
            system.resume(name)
        stops = [identity for identity, verb in system.people.verbs.items() if verb == "stop"]
        when_answered(system, stops, self._start_all)

    def _start_all(self, system: System) -> None:
        for number in range(1, self.plan.nodes + 1):
            ask(system, "start", node=f"n{number}")
            revive(system, f"n{number}")
        for name in sorted(system.players):
            revive(system, name)


@lru_cache(maxsize=4 * WORLDS)
def undisturbed(text: str, name: str, world: int, ticks: int, files: Files = ()) -> bytes:
    """Return the digest chain of a run without faults."""
    flight = Flight(text, name, Plan(world, NODES[0], CALM, (), (), ticks), Settings(), files)
    flight.run()
    return flight.system.supervisor.state.chain


def fly(
    text: str, name: str, seed: int, settings: Settings | None = None, ticks: int = TICKS, files: Files = ()
) -> Flown:
    """Rehearse a deployment under the faults of a seed, on the pure engine if it has the bodies.

    The text has the digests of `files` (`pin_assets`). `settings` may plant faulty cores.
    Where no fault changes the world, it has to equal that of the run without faults (law 3).
    """
    plan = plan_of(seed, ticks, lives=lives(text, name))
    flown = Flown(seed, plan.nodes, plan.kinds, [f"tick {fault.tick}: {fault.what}" for fault in plan.faults])
    flight = Flight(text, name, plan, settings or Settings(), files)
    try:
        flight.run()
        if not CHANGES_THE_WORLD & {*plan.kinds}:
            same = flight.system.supervisor.state.chain == undisturbed(text, name, seed % WORLDS, ticks, files)
            hold(same, "the world differs from that of the run without faults")
    except (AssertionError, Refused, ArithmeticError, LookupError, TypeError, ValueError) as error:
        flown.broken = f"{type(error).__name__}: {error}"  # an exception of a core would have ended its process
    system, told = flight.system, flight.system.supervisor.state.recovered
    flown.ticks, flown.chain, flown.seen = flight.laws.ticks, system.supervisor.state.chain.hex(), flight.seen
    flown.epochs, flown.virtual_s = flight.laws.epoch, system.bus.now_ns / 1e9
    flown.losses = sum(entry.what == "node" for entry in told)
    flown.joins = sum(entry.what == "join" for entry in told)
    flown.restarts = sum(entry.what == channels.SUPERVISOR for entry in told)
    if system.hub.state is not None:
        packets = system.hub.state.packets
        flown.packets = {"offered": packets.offered, "delivered": packets.delivered, "dropped": packets.dropped}
    return flown
