"""Faults of worlds that live: they hit who holds something, what is held and who does a job, and set any field."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from foosim.simulation.system import System
from foosim.world.component_types.jobs import RUNNING
from foosim.world.setting.settable import AT, settable
from tests.swarm.faults import Dice, Fault, ask, end_node, random_tick, revive

VERBS: Final = ("remove", "remove", "at", "at", "down", "push", "add")
BACK_TICKS: Final = 15
"""After these ticks what was removed is added again, and who was out of service comes back."""


def busy(system: System) -> list[tuple[str, str]]:
    """Return who holds something and what is held, and, as one that holds itself, who does a job."""
    frame, found = system.supervisor.state.frame, []
    for robot in frame.layout.robots:
        for field, at in robot.offsets.items():
            number = int(frame.numbers[at])
            if field.endswith(".held") and number >= 0:
                found.append((robot.name, frame.layout.entities[number].name))
            elif field.endswith(f".{RUNNING}") and number > 0:
                found.append((robot.name, robot.name))
    return found


def _on_one(place: float, do: Callable[[System, str, str], None]) -> Callable[[System], None]:
    """Return an action on one that holds something and on that, else on one that works; it does nothing for none."""

    def chosen(system: System) -> None:
        found = busy(system)
        found = [(robot, held) for robot, held in found if robot != held] or found
        if found:
            do(system, *found[int(place * len(found))])

    return chosen


def lose_owner(dice: Dice, names: Sequence[str]) -> Fault:
    """The node of one that is busy is killed, or the robot moves to another node: the world is the same."""
    place, back, moves, node = dice.unit(), dice.between(1, 40), dice.unit() < 0.5, dice.one_of(names)

    def do(system: System, robot: str, _: str) -> None:
        owner = system.supervisor.state.owners[robot]
        if moves:
            ask(system, "move", robot=robot, node=node)
        elif owner in system.processes:
            end_node(system, owner, names)
            system.at_tick(system.supervisor.state.frame.tick + back, partial(revive, system, owner))

    what = f"to {node} moves" if moves else "the node ends of"
    return Fault(random_tick(dice), "amid", f"{what} busy robot {place:.2f} of all", _on_one(place, do))


def strike(dice: Dice, names: Sequence[str]) -> Fault:
    """Who is busy, or what is held, is removed, put elsewhere, pushed or taken out of service."""
    place, verb, hits_holder = dice.unit(), dice.one_of(VERBS), dice.unit() < 0.5
    where = f"{6.0 * (dice.unit() - 0.5):.2f},{6.0 * (dice.unit() - 0.5):.2f}"

    def do(system: System, robot: str, held: str) -> None:
        name, again = robot if hits_holder else held, system.supervisor.state.frame.tick + BACK_TICKS
        if verb == "remove":
            ask(system, "remove", name=name)
            system.at_tick(again, partial(ask, system, "add", name=name))
        elif verb == "down":
            ask(system, "set", name=robot, field="down", value=True)
            system.at_tick(again, partial(ask, system, "set", name=robot, field="down", value=False))
        elif verb == "push":
            ask(system, "push", name=held, impulse=[0.5, -0.2, 0.3])
        elif verb == "at":
            ask(system, "set", name=name, field=AT, value=where)
        else:
            ask(system, "add", name="crate", at=where)

    who = "robot" if hits_holder else "load"
    return Fault(random_tick(dice), "strike", f"{verb} busy {who} {place:.2f} of all, {where}", _on_one(place, do))


def set_field(dice: Dice, names: Sequence[str]) -> Fault:
    """A field that any entity declares is set to its least or greatest value, or a flag of it."""
    which, is_most = dice.unit(), dice.unit() < 0.5

    def do(system: System) -> None:
        state = system.supervisor.state
        layout = state.frame.layout
        fields = [
            (entity.name, field, what)
            for entity in layout.entities
            for field, what in settable(state.deployment, layout, entity).items()
            if field != AT
        ]
        name, field, what = fields[int(which * len(fields))]
        low, _, high = what.partition(",")[0].partition(" to ")
        value = (high if is_most else low) if high else is_most
        ask(system, "set", name=name, field=field, value=value)

    return Fault(random_tick(dice), "set", f"set field {which:.3f} of all to its {'most' if is_most else 'least'}", do)
