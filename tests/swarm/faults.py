"""Faults of the swarm: one function for each kind, in a table.

A kind draws from the seed's dice and returns a fault: a tick, a description, and an action. To
add a kind, add a function and its row.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import hypot
from typing import Final, TypeVar

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.node.core import NodeCore
from foosim.protocol import channels
from foosim.simulation.journals import ENDINGS
from foosim.simulation.system import System

TICKS: Final = 208
HEALED_TICK: Final = 180
"""From this tick on no fault starts, and stopped processes are restarted."""
MS: Final = 1_000_000
HOUR_NS: Final = 3_600_000 * MS
ASK_AGAIN_NS: Final = 150 * MS
"""Period at which an unanswered request is repeated."""
PUSH_MAX: Final = 0.8
"""In N s: a push may give a body of 21 g, the lightest of those deployed, no more than its speed limit of 40 m/s."""

T = TypeVar("T")


class Dice:
    """Numbers of one seed, in order: a function of seed and count alone."""

    def __init__(self, seed: int, what: str = "swarm") -> None:
        self._key = draw_key(seed, what)
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
    """A fault that starts when frame `tick` is committed."""

    tick: int
    kind: str
    what: str
    do: Callable[[System], object]


def random_tick(dice: Dice) -> int:
    return dice.between(5, HEALED_TICK - 10)


def _here(name: str, do: Callable[[System], object]) -> Callable[[System], object]:
    """Return an action on a process that is skipped while the process is absent."""
    return lambda system: do(system) if name in system.processes else None


def ask(system: System, verb: str, **arguments: object) -> str:
    """Repeat a request to the supervisor until it is answered; return the request's id."""
    return system.request(verb, again_ns=ASK_AGAIN_NS, **arguments)


def _unless_healed(system: System, do: Callable[[], object]) -> None:
    """Perform a scheduled action, unless healing has begun."""
    if not system.healed:
        do()


# --- nodes come and go -----------------------------------------------------------------------------------------------


def _kill(dice: Dice, names: Sequence[str]) -> Fault:
    name, back = dice.one_of(names), dice.between(1, 40)

    def do(system: System) -> None:
        end_node(system, name, names)
        system.at_tick(system.supervisor.state.frame.tick + back, partial(revive, system, name))

    return Fault(random_tick(dice), "kill", f"kill {name}", _here(name, do))


def end_node(system: System, name: str, names: Sequence[str]) -> None:
    """Kill a node; start one at once if none is left, since no further tick would be committed."""
    system.kill(name)
    if _is_none_left(system, names):
        system.start(name)


def _is_none_left(system: System, names: Sequence[str]) -> bool:
    """Whether no node is present that may take part."""
    stopped = system.supervisor.state.roster.stopped
    return not any(name in system.processes and name not in stopped for name in names)


def _leave_one(system: System, names: Sequence[str]) -> None:
    """Start a node if none is left: scheduled restarts wait for ticks that no node would compute."""
    if _is_none_left(system, names):
        stopped = system.supervisor.state.roster.stopped
        name = next((name for name in names if name not in stopped), names[0])
        ask(system, "start", node=name)
        revive(system, name)


def revive(system: System, name: str) -> None:
    """Start a process unless it is present."""
    if name not in system.processes:
        system.start(name)


def _stop(dice: Dice, names: Sequence[str]) -> Fault:
    node = dice.one_of(names)

    def do(system: System) -> None:
        asked = [ask(system, "stop", node=node)]
        when_answered(system, asked, partial(_leave_one, names=names))
        tick = system.supervisor.state.frame.tick
        system.at_tick(tick + 10, partial(_here(node, lambda found: end_node(found, node, names)), system))
        system.at_tick(tick + 15, partial(ask, system, "start", node=node))
        system.at_tick(tick + 20, partial(revive, system, node))

    return Fault(random_tick(dice), "stop", f"stop {node}", do)


def _flip(dice: Dice, names: Sequence[str]) -> Fault:
    """A memory error: one number of one node's frame changes. The other nodes must keep theirs."""
    name, place = dice.one_of(names), dice.unit()

    def do(system: System) -> None:
        core = system.processes[name].core
        if len(system.supervisor.state.members) > 1 and isinstance(core, NodeCore) and core.frame is not None:
            frame = core.frame
            values = frame.values.copy()
            values[int(place * len(values))] += 1.0
            frame.take(values)
            system.flipped.add(name)

    return Fault(random_tick(dice), "flip", f"a number of {name}'s frame changes", _here(name, do))


# --- processes pause, are slow, have a clock that jumps --------------------------------------------------------------


def _pause(dice: Dice, names: Sequence[str]) -> Fault:
    name, for_ms = dice.one_of(names), dice.one_of((30, 300, 1_500, 3_000))
    if dice.unit() < 0.3:
        name, for_ms = dice.one_of((channels.SUPERVISOR, channels.VHUB)), dice.one_of((30, 300))
    return Fault(
        random_tick(dice),
        "pause",
        f"pause {name} for {for_ms} ms",
        _here(name, lambda system: system.pause(name, for_ms * MS)),
    )


def _slow(dice: Dice, names: Sequence[str]) -> Fault:
    name, slow_ns = dice.one_of([*names, channels.VHUB]), dice.between(0, 8 * MS)

    def do(system: System) -> None:
        system.processes[name].slow_ns = slow_ns

    return Fault(random_tick(dice), "slow", f"{name} takes {slow_ns / MS:.1f} ms a turn", _here(name, do))


def _clock(dice: Dice, names: Sequence[str]) -> Fault:
    """The monotonic clock jumps, as after a suspend. The supervisor's jump is shorter than its heartbeat timeouts."""
    name = dice.one_of([*names, channels.VHUB, channels.SUPERVISOR])
    by_ns = dice.between(MS, 400 * MS if name == channels.SUPERVISOR else HOUR_NS)
    what = f"the clock of {name} jumps by {by_ns / 1e9:.3f} s"
    return Fault(random_tick(dice), "clock", what, lambda system: system.set_forward(name, by_ns))


# --- the network -----------------------------------------------------------------------------------------------------


def _cut(dice: Dice, names: Sequence[str]) -> Fault:
    name, for_ms = dice.one_of(names), dice.one_of((30, 300, 1_500, 3_000))
    ways = dice.one_of((("both ways", True, True), ("to others", True, False), ("from others", False, True)))

    def do(system: System) -> None:
        system.bus.cut_off(name, system.bus.now_ns + for_ms * MS, output=ways[1], input_=ways[2])

    return Fault(random_tick(dice), "cut", f"cut {name} off {ways[0]} for {for_ms} ms", do)


def _clog(dice: Dice, names: Sequence[str]) -> Fault:
    """Delays all messages of several processes; the delays end in another order, and the messages arrive at once."""
    chosen = [name for name in (*names, channels.VHUB, channels.SUPERVISOR) if dice.unit() < 0.5] or [names[0]]
    times = [(name, dice.between(0, 50), dice.between(60, 600)) for name in chosen]

    def do(system: System) -> None:
        for name, from_ms, to_ms in times:
            until_ns = system.bus.now_ns + to_ms * MS
            system.later(from_ms * MS, partial(_unless_healed, system, partial(system.bus.clog, name, until_ns)))

    return Fault(random_tick(dice), "clog", f"clog {', '.join(chosen)} one after the other", do)


def _echo_of_old(dice: Dice, names: Sequence[str]) -> Fault:
    """For a while every message is delivered a second time, much later."""
    for_ms = dice.one_of((20, 100, 400))

    def do(system: System) -> None:
        system.bus.repeat_until(system.bus.now_ns + for_ms * MS)

    return Fault(random_tick(dice), "late", f"repeat all messages of {for_ms} ms, late", do)


# --- people ----------------------------------------------------------------------------------------------------------


def _move(dice: Dice, names: Sequence[str]) -> Fault:
    place, node = dice.unit(), dice.one_of(names)

    def do(system: System) -> None:
        robots = sorted(system.supervisor.state.owners)
        ask(system, "move", robot=robots[int(place * len(robots))], node=node)

    return Fault(random_tick(dice), "move", f"move robot {place:.2f} of all to {node}", do)


def _add(dice: Dice, names: Sequence[str]) -> Fault:
    """Of those who may leave one that is absent is added, a ball anywhere, or any is removed."""
    x, y, place = dice.unit() - 0.5, 0.5 * (dice.unit() - 0.5), dice.between(2, 4)
    verb = dice.one_of(("add", "add", "remove"))

    def do(system: System) -> None:
        frame = system.supervisor.state.frame
        leaving = [entity for entity in frame.layout.entities if entity.can_leave]
        if verb == "add":
            leaving = [entity for entity in leaving if entity.is_absent(frame.numbers)]
        if leaving:
            chosen = leaving[int((x + 0.5) * place * len(leaving)) % len(leaving)]
            at = {"at": f"{x:.4f},{y:.4f},0.05"} if verb == "add" and chosen.model == "ball" else {}
            ask(system, verb, name=chosen.name, **at)

    return Fault(random_tick(dice), "add", f"{verb} one of those who may leave", do)


def _push(dice: Dice, names: Sequence[str]) -> Fault:
    """Sometimes at the permitted maximum, twice in one tick: then the body goes into quarantine."""
    hard = dice.one_of((0.04, 0.04, 0.04, 4.0))
    impulse = [hard * (dice.unit() - 0.5) for _ in range(3)]
    size = hypot(*impulse)
    is_too_hard = size > PUSH_MAX
    if is_too_hard:
        impulse = [PUSH_MAX * part / size for part in impulse]

    def do(system: System) -> None:
        for _ in range(1 + is_too_hard):
            ask(system, "push", impulse=impulse)

    return Fault(random_tick(dice), "push", "push the first free body", do)


def _tempo(dice: Dice, names: Sequence[str]) -> Fault:
    """Pause the run, step it, change the pace, and resume it."""
    for_ms, ticks, pace = dice.between(1, 400), dice.between(1, 5), dice.one_of(("fast", "1x", "20x"))

    def do(system: System) -> None:
        asked = [ask(system, "pause"), ask(system, "step", count=ticks)]
        system.later(for_ms * MS, partial(when_answered, system, asked, go_on))

    def go_on(system: System) -> None:
        asked = [] if system.healed else [ask(system, "rate", pace=pace)]
        asked.append(ask(system, "resume"))
        system.later(300 * MS, partial(when_answered, system, asked, be_fast))

    def be_fast(system: System) -> None:
        if not system.healed:
            ask(system, "rate", pace="fast")

    return Fault(random_tick(dice), "tempo", f"pause for {for_ms} ms, step {ticks}, then {pace}", do)


def when_answered(system: System, asked: Sequence[str], do: Callable[[System], None]) -> None:
    """Resume when all earlier requests are answered: a late one would undo a later one."""
    if all(identity in system.answers for identity in asked):
        do(system)
    else:
        system.later(ASK_AGAIN_NS, partial(when_answered, system, asked, do))


# --- supervisor and vHub ----------------------------------------------------------------------------------------------


def _supervisor(dice: Dice, names: Sequence[str]) -> Fault:
    amid, down_ms = dice.between(0, 3), dice.one_of((0, 1, 30, 600))

    def do(system: System) -> None:
        if channels.SUPERVISOR not in system.processes or system.is_dying(channels.SUPERVISOR):
            return
        system.end_amid(channels.SUPERVISOR, amid)
        system.later(down_ms * MS, partial(_revive_supervisor, system, down_ms))

    return Fault(
        random_tick(dice), "supervisor", f"end the supervisor, {amid} actions into a turn, for {down_ms} ms", do
    )


def _revive_supervisor(system: System, down_ms: int) -> None:
    """Start the supervisor once it has ended, which happens only with its next actions."""
    if channels.SUPERVISOR in system.processes:
        system.later((down_ms + 1) * MS, partial(_revive_supervisor, system, down_ms))
    else:
        system.start(channels.SUPERVISOR)


def _hub(dice: Dice, names: Sequence[str]) -> Fault:
    ending, back_ms = dice.one_of(ENDINGS), dice.one_of((1, 40, 400, 2_000))
    what = f"the vHub ends, {ending}, for {back_ms} ms"
    return Fault(random_tick(dice), "vhub", what, lambda system: system.kill_hub(ending, back_ms * MS))


def _both(dice: Dice, names: Sequence[str]) -> Fault:
    """Supervisor and vHub end together; both resume from their journals, in either order."""
    hub_ms, down_ms = dice.between(20, 300), dice.one_of((1, 40, 400, 2_000))

    def do(system: System) -> None:
        system.kill_hub("now", hub_ms * MS)
        if channels.SUPERVISOR in system.processes and not system.is_dying(channels.SUPERVISOR):
            system.end_amid(channels.SUPERVISOR, 0)
            system.later(down_ms * MS, partial(_revive_supervisor, system, down_ms))

    what = f"the vHub ends for {hub_ms} ms, and the supervisor for {down_ms} ms"
    return Fault(random_tick(dice), "both", what, do)


def lose_player(dice: Dice, names: Sequence[str]) -> Fault:
    """A player's process is killed and restarted; sometimes the run has continued without it by then."""
    place, back_ms, left_ms = dice.unit(), dice.one_of((1, 40, 400, 2_000)), dice.one_of((0, 0, 20, 200))
    which = f"player {place:.2f} of all ends, for {back_ms} ms"
    what = f"{which}; the run waits {left_ms} ms at 20x" if left_ms else which

    def do(system: System) -> None:
        asked = [ask(system, "rate", pace="20x")] if left_ms else []
        when_answered(system, asked, kill)

    def kill(system: System) -> None:
        name = sorted(system.players)[int(place * len(system.players))]
        if name not in system.processes:
            return
        system.kill(name)
        system.later(back_ms * MS, partial(revive, system, name))
        if left_ms:
            be_fast = partial(ask, system, "rate", pace="fast")
            for after_ms, then in ((left_ms, partial(_give_up_waiting, system, name)), (left_ms + 300, be_fast)):
                system.later(after_ms * MS, partial(_unless_healed, system, then))

    return Fault(random_tick(dice), "player", what, do)


def _give_up_waiting(system: System, name: str) -> None:
    """Expire a realtime run's deadline for a player: in a swarm, deadlines last as long as the run."""
    session, releases = system.hub.sessions.by_name.get(name), system.hub.releases
    if session is not None and session.away_ns >= 0 and releases is not None and releases.factor:
        session.away_ns = system.now_of(channels.VHUB)
        session.answered()


def set_something(dice: Dice, names: Sequence[str]) -> Fault:
    """A robot goes out of service or comes back, or something is put elsewhere; where something is, it is refused."""
    place, is_down, is_put = dice.unit(), dice.unit() < 0.6, dice.unit() < 0.5
    where = f"{8.0 * (dice.unit() - 0.5):.2f},{8.0 * (dice.unit() - 0.5):.2f}"

    def do(system: System) -> None:
        layout = system.supervisor.state.frame.layout
        placed = [entity.name for entity in layout.entities if "position" in entity.offsets] if is_put else []
        named = placed or [robot.name for robot in layout.robots]
        field, value = ("at", where) if placed else ("down", is_down)
        ask(system, "set", name=named[int(place * len(named))], field=field, value=value)

    what = f"put something at {where}" if is_put else f"set down={is_down} on robot {place:.2f} of all"
    return Fault(random_tick(dice), "set", what, do)


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
    "vhub": _hub,
    "flip": _flip,
    "clog": _clog,
    "clock": _clock,
    "late": _echo_of_old,
    "tempo": _tempo,
    "both": _both,
}
KINDS: Final = list(FAULT_OF)
LOSES_PLAYERS: Final[tuple[int, ...]] = (7, 10, 15)
"""Remainders modulo 16 of the seeds that also lose players. The losses have separate dice, so that they do not change
the other faults. 7 and 15 are in the last world, where players act at arrival; 10 is not."""
SETS: Final = 11
"""The remainder modulo 16 of the seeds that also set something, with separate dice."""
CHANGES_THE_WORLD: Final = frozenset({"add", "push", "player", "set", "strike"})
"""Kinds that change the world. All others leave it bit-identical."""
ONCE: Final[tuple[str, ...]] = ("flip",)
"""Kinds of which a seed has at most one: if all nodes had changed frames, none would be right."""


def loses_players(seed: int) -> bool:
    """Whether a seed also loses players."""
    return seed % 16 in LOSES_PLAYERS
