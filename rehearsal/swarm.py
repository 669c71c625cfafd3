"""Rehearsals under random faults, by seed: the real cores of all processes, on virtual time, in bad weather.

A seed decides the number of nodes, the weather on the bus and when which fault happens. The laws are checked at
whatever is said and closed; then everything heals, and the run must be finished. A failing seed is one command.
Neighbours: `system` (what is disturbed), `replica` (the world computed again, which must be the same).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Final, TypeVar

from foosim.protocol import channels
from foosim.protocol.codec import decode, decode_any
from foosim.protocol.deployment_file import load_deployment
from foosim.protocol.draws import draw_key, draw_words, unit_interval
from foosim.protocol.messages import Commit, Deliveries, Epoch, Part
from foosim.protocol.units import Pace
from foosim.rehearsal.bus import CALM, Traced, Weather
from foosim.rehearsal.rehearse import with_nodes
from foosim.rehearsal.replica import Replica
from foosim.rehearsal.system import Settings, System
from foosim.supervisor.plan import RunSettings
from foosim.supervisor.records import CommitRecord
from foosim.supervisor.records import Record as SupervisorRecord
from foosim.vhub.records import Closing, HubRecord, TickRecord

TICKS: Final = 240
HEALED_TICK: Final = 200
"""From here on nothing new happens, and what is down comes up."""
FAULTS: Final = (8, 20)
NODES: Final = (3, 3, 3, 4, 4, 5)
WORLDS: Final = 4
"""How many worlds there are: seeds differ in what happens to the processes, and take the next of these in turn."""
SMALL: Final = ("engine=pure", "substeps=1", "table.rules.kickoff_delay=20 ms")
"""What is computed is the same, with fewer steps to it; the ball rolls from the start."""
PATIENT: Final = ("deadlines.tick_lost=5 s", "deadlines.lockstep_fast=1 h")
"""A bus that loses a tenth of what is said and asked can keep a process for longer than a link that loses nothing."""
MS: Final = 1_000_000
RESTART_NS: Final = 500 * MS

T = TypeVar("T")


class Broken(AssertionError):
    """A law does not hold."""


class Dice:
    """Numbers of one seed, in order: a function of seed and count alone."""

    def __init__(self, seed: int) -> None:
        self._key = draw_key(seed, "swarm")
        self._count = 0

    def unit(self) -> float:
        """Return a number in [0, 1)."""
        self._count += 1
        return unit_interval(draw_words(self._key, self._count)[0])

    def between(self, low: int, high: int) -> int:
        """Return a whole number from `low` to `high`."""
        return low + int(self.unit() * (high - low + 1))

    def one_of(self, choices: Sequence[T]) -> T:
        """Return one of them."""
        return choices[self.between(0, len(choices) - 1)]


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that happens when frame `tick` is committed."""

    tick: int
    kind: str
    what: str
    do: Callable[[System], object]


@dataclass(frozen=True, slots=True)
class Plan:
    """What a seed stands for."""

    seed: int
    nodes: int
    weather: Weather
    faults: tuple[Fault, ...]


def plan_of(seed: int) -> Plan:
    """Return the plan of a seed: nodes, weather, and from 8 to 20 faults, of three kinds at least."""
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
    count = dice.between(*FAULTS)
    chosen = [dice.one_of(KINDS) for _ in range(count)]
    chosen[:3] = KINDS[seed % len(KINDS) :][:3] if seed % len(KINDS) <= len(KINDS) - 3 else KINDS[:3]
    faults = [FAULT_OF[kind](dice, names) for kind in chosen]
    return Plan(seed, nodes, weather, tuple(sorted(faults, key=lambda fault: fault.tick)))


# --- the faults ------------------------------------------------------------------------------------------------------


def _tick(dice: Dice) -> int:
    return dice.between(5, HEALED_TICK - 10)


def _here(name: str, do: Callable[[System], object]) -> Callable[[System], object]:
    """Return what is done to a process only while it is there."""
    return lambda system: do(system) if name in system.processes else None


def _kill(dice: Dice, names: Sequence[str]) -> Fault:
    name, back = dice.one_of(names), dice.between(1, 40)

    def do(system: System) -> None:
        _end(system, name, names)
        system.at_tick(system.supervisor.frame.tick + back, partial(_revive, system, name))

    return Fault(_tick(dice), "kill", f"kill {name}", _here(name, do))


def _end(system: System, name: str, names: Sequence[str]) -> None:
    """Kill a node; one is started at once if none is left, since no further tick would be committed."""
    system.kill(name)
    if not any(other in system.processes for other in names):
        system.start(name)


def _revive(system: System, name: str) -> None:
    if name not in system.processes:
        system.start(name)


def _pause(dice: Dice, names: Sequence[str]) -> Fault:
    name, for_ms = dice.one_of(names), dice.one_of((30, 300, 1_500, 3_000))
    return Fault(
        _tick(dice),
        "pause",
        f"pause {name} for {for_ms} ms",
        _here(name, lambda system: system.pause(name, for_ms * MS)),
    )


def _cut(dice: Dice, names: Sequence[str]) -> Fault:
    name, for_ms = dice.one_of(names), dice.one_of((30, 300, 1_500, 3_000))
    return Fault(
        _tick(dice),
        "cut",
        f"cut {name} off for {for_ms} ms",
        lambda system: system.bus.cut_off(name, system.bus.now_ns + for_ms * MS),
    )


def _slow(dice: Dice, names: Sequence[str]) -> Fault:
    name, slow_ns = dice.one_of([*names, channels.VHUB]), dice.between(0, 8 * MS)

    def do(system: System) -> None:
        system.processes[name].slow_ns = slow_ns

    return Fault(_tick(dice), "slow", f"{name} takes {slow_ns / MS:.1f} ms a turn", _here(name, do))


def _move(dice: Dice, names: Sequence[str]) -> Fault:
    robot, node = dice.one_of(("red.goal", "red.attack", "blue.defence", "camera")), dice.one_of(names)
    request = partial(System.request, verb="move", robot=robot, node=node)
    return Fault(_tick(dice), "move", f"move {robot} to {node}", request)


def _stop(dice: Dice, names: Sequence[str]) -> Fault:
    node = dice.one_of(names)

    def do(system: System) -> None:
        system.request("stop", node=node)
        tick = system.supervisor.frame.tick
        system.at_tick(tick + 10, partial(_here(node, lambda found: _end(found, node, names)), system))
        system.at_tick(tick + 15, partial(system.request, "start", node=node))
        system.at_tick(tick + 20, partial(_revive, system, node))

    return Fault(_tick(dice), "stop", f"stop {node}", do)


def _add(dice: Dice, names: Sequence[str]) -> Fault:
    x, y, name = dice.unit() - 0.5, 0.5 * (dice.unit() - 0.5), f"b{dice.between(2, 4)}"
    verb = dice.one_of(("add", "add", "remove"))
    arguments = {"name": name, "position": [x, y, 0.05]} if verb == "add" else {"name": name}
    return Fault(_tick(dice), "add", f"{verb} {name}", partial(System.request, verb=verb, **arguments))


def _push(dice: Dice, names: Sequence[str]) -> Fault:
    impulse = [0.04 * (dice.unit() - 0.5) for _ in range(3)]
    return Fault(_tick(dice), "push", "push the ball", partial(System.request, verb="push", impulse=impulse))


def _supervisor(dice: Dice, names: Sequence[str]) -> Fault:
    amid, down_ms = dice.between(0, 3), dice.one_of((0, 1, 30, 600))

    def do(system: System) -> None:
        if channels.SUPERVISOR not in system.processes or system.is_dying(channels.SUPERVISOR):
            return
        system.end_amid(channels.SUPERVISOR, amid)
        system.later(down_ms * MS, partial(_revive_supervisor, system, down_ms))

    return Fault(_tick(dice), "supervisor", f"end the supervisor, {amid} actions into a turn, for {down_ms} ms", do)


def _revive_supervisor(system: System, down_ms: int) -> None:
    """Start the supervisor when it has ended; it has not while it had nothing to do since."""
    if channels.SUPERVISOR in system.processes:
        system.later((down_ms + 1) * MS, partial(_revive_supervisor, system, down_ms))
    else:
        system.start(channels.SUPERVISOR)


FAULT_OF: Final[Mapping[str, Callable[[Dice, Sequence[str]], Fault]]] = {
    "kill": _kill,
    "pause": _pause,
    "move": _move,
    "cut": _cut,
    "add": _add,
    "stop": _stop,
    "slow": _slow,
    "push": _push,
    "supervisor": _supervisor,
}
KINDS: Final = list(FAULT_OF)


# --- the laws --------------------------------------------------------------------------------------------------------


class Laws:
    """Watches a run; raises Broken at the first thing that must not be."""

    def __init__(self, replica: Replica) -> None:
        self.ticks = 0
        self._replica = replica
        self._epoch = self._committed = 0
        self._solved: dict[tuple[int, int], dict[str, list[int]]] = {}
        self._written: dict[str, set[bytes]] = {channels.SUPERVISOR: set(), channels.VHUB: set()}
        self._closed = -1
        self._final = 0
        """The last tick whose deliveries were said, also together with earlier ones."""

    def see(self, traced: Traced) -> None:
        """Look at one thing that a process did."""
        if traced.what == "journal":
            self._journalled(traced)
        elif traced.what == "publish":
            self._said(traced)

    def _journalled(self, traced: Traced) -> None:
        if traced.process == channels.VHUB:
            record = decode_any(HubRecord, traced.payload)
            if isinstance(record, TickRecord):
                _hold(record.tick == self._closed + 1, f"the vHub closes tick {record.tick} after {self._closed}")
                self._closed = record.tick
            return
        record = decode_any(SupervisorRecord, traced.payload)
        if isinstance(record, CommitRecord):
            self._committed_one(decode(Commit, record.commit))
            self._written[channels.SUPERVISOR].add(record.commit)
        elif isinstance(record, Epoch):
            _hold(record.epoch == self._epoch + 1, f"epoch {record.epoch} after {self._epoch}")
            _hold(record.tick == self._committed, f"epoch {record.epoch} does not start at the last commit")
            self._epoch = record.epoch
        self._written[channels.SUPERVISOR].add(traced.payload)

    def _committed_one(self, commit: Commit) -> None:
        if commit.tick > 0:
            _hold(commit.tick == self._committed + 1, f"commit {commit.tick} after {self._committed}")
            self._committed = commit.tick
            solved = sorted(index for each in self._solved.pop((commit.epoch, commit.tick)).values() for index in each)
            _hold(solved == list(range(len(solved))), f"tick {commit.tick}: entities {solved} are solved")

    def _said(self, traced: Traced) -> None:
        if traced.channel == channels.PART.name:
            part = decode(Part, traced.payload)
            self._solved.setdefault((part.epoch, part.tick), {}).setdefault(part.node, part.solved)
        elif traced.channel in (channels.COMMIT.name, channels.EPOCH.name):
            written = traced.payload in self._written[channels.SUPERVISOR]
            _hold(written, f"{traced.channel} is said before it is written")
        elif traced.channel == channels.DELIVERIES.name:
            deliveries = decode(Deliveries, traced.payload)
            tick = deliveries.tick
            known = tick - 1 <= self._closed or tick <= self._final
            _hold(known, f"deliveries {tick} are said before tick {tick - 1} is written")
            self._final = max(self._final, deliveries.last)

    def close(self, closing: Closing) -> None:
        """Compute the tick again from what led to it: the frame must be the same to the last bit."""
        frame = closing.frame
        if frame.tick != self._replica.frame.tick + 1:
            return  # frame 0, or the last one of a run that ended before all was closed
        again = self._replica.step(closing.edits, closing.delivered)
        _hold(again.digest == closing.digest, f"frame {frame.tick} is another one than its orders and deliveries give")
        self.ticks = frame.tick


def _hold(law: bool, what: str) -> None:
    if not law:
        raise Broken(what)


# --- one seed --------------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Flown:
    """How a seed went. `broken` is empty when all laws held and the run was finished."""

    seed: int
    nodes: int
    kinds: list[str]
    faults: list[str]
    ticks: int = 0
    losses: int = 0
    joins: int = 0
    broken: str = ""
    chain: str = ""


@lru_cache(maxsize=4 * WORLDS)
def worlds(text: str, name: str, nodes: int, seed: int) -> tuple[str, str]:
    """Return the swarm's world of a deployment on some nodes, and the same on one, without players."""
    text = with_nodes(text, name, nodes, [f"seed={seed}", *SMALL, *PATIENT])
    return text, with_nodes(text, name, 1, ["players={}"])


def fly(text: str, name: str, seed: int, settings: Settings | None = None) -> Flown:
    """Rehearse a deployment under the faults of a seed, on the pure engine. `settings` may plant faulty cores."""
    plan = plan_of(seed)
    text, alone = worlds(text, name, plan.nodes, seed % WORLDS)
    replica = Replica(alone, name, load_deployment(alone, name))
    laws = Laws(replica)
    chosen = replace(
        settings or Settings(),
        weather=plan.weather,
        restart_ns=RESTART_NS,
        keeps_journals=True,
        observer=laws.see,
        observes=("journal", "publish"),
        on_closing=laws.close,
    )
    system = System(RunSettings(f"swarm-{seed}", name, text, Pace("fast"), TICKS), chosen)
    for fault in plan.faults:
        system.at_tick(fault.tick, partial(fault.do, system))
    system.at_tick(HEALED_TICK, partial(_heal, system, plan.nodes))
    flown = Flown(
        seed, plan.nodes, sorted({f.kind for f in plan.faults}), [f"tick {f.tick}: {f.what}" for f in plan.faults]
    )
    try:
        system.run()
    except AssertionError as error:
        flown.broken = f"{type(error).__name__}: {error}"
    finally:
        system.close()
        replica.close()
    told = system.supervisor.recovery.recovered
    flown.ticks, flown.chain = laws.ticks, system.supervisor.chain.hex()
    flown.losses = sum(entry.what == "node" for entry in told)
    flown.joins = sum(entry.what == "join" for entry in told)
    end = system.supervisor.end
    if not flown.broken and (end is None or end.reason != "done"):
        flown.broken = f"the run ended: {'not at all' if end is None else end.reason}"
    return flown


def _heal(system: System, nodes: int) -> None:
    """Fine weather from now on: who is down comes up, who is slow is quick."""
    system.bus.weather = CALM
    for process in system.processes.values():
        process.slow_ns = 0
    for number in range(1, nodes + 1):
        system.request("start", node=f"n{number}")
        _revive(system, f"n{number}")
