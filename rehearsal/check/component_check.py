"""Checks that the forms of a deployment obey the laws: the number of nodes is nothing, and all memory is in the frame.

The deployment is rehearsed several times; what differs is named with its first tick and slot. A form that remembers
something in an object, asks a clock, draws from a running generator or by its place among others, sums in the order of
the file or keeps an entity as a number is found by that, whatever it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

from foosim.common.errors import Refused
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.loader import load_deployment
from foosim.rehearsal.check.changes import changed
from foosim.rehearsal.check.differences import (
    Frames,
    Senses,
    alone_and_together,
    first_difference,
    first_other_reading,
)
from foosim.rehearsal.run import rehearse
from foosim.rehearsal.system import Settings, System
from foosim.world.assembly.used_forms import forms_of
from foosim.world.forms.forms import Form

NODES: Final = (1, 2, 3)
MOVES: Final = 12
"""Moves of robots between nodes, and as often all objects of a node are made anew."""


def used_form(text: str, name: str, wanted: str) -> Form:
    """Return the form of a deployment that is wanted: a name, a form and a name, or module:Class.

    Raises Refused where the deployment uses none or several of that name.
    """
    forms = forms_of(load_deployment(text, name))
    called = {label: form for form in forms for label in (f"{form.form} {form.name}", f"{form.form} {_path(form)}")}
    found = [form for form in forms if wanted in (form.name, _path(form))]
    found = found or [form for label, form in called.items() if label == wanted]
    if len(found) == 1:
        return found[0]
    names = ", ".join(f"{form.form} {form.name}" for form in found or forms)
    raise Refused(f"{name} uses {'several forms' if found else 'no form'} called {wanted!r}; there are {names}")


def _path(form: Form) -> str:
    return f"{form.module}:{form.made.__qualname__}"


def broken_laws(text: str, name: str, ticks: int, seed: int = 1) -> Iterator[str]:
    """Yield which laws a deployment's forms break, in words, as each is found."""
    alone = Frames()
    first = rehearse(text, name, ticks, 1, settings=Settings(on_commit=alone))
    if first.json["failed"]:
        yield str(first.json["reason"])
        return
    for nodes in NODES:
        frames = Frames()
        prepare = partial(_shuffle, seed=seed, ticks=ticks)
        many = rehearse(text, name, ticks, nodes, settings=Settings(on_commit=frames), prepare=prepare)
        if many.json["failed"] or many.digests != first.digests:
            where = first_difference(alone.frames, frames.frames) or str(many.json["reason"])
            shared = f"on {nodes} nodes" if nodes > 1 else "on one node"
            yield f"{shared}, with robots moved and objects made anew, the world is another one: {where}"
    senses = Senses(text, name)
    yield from alone_and_together(senses, alone.frames)
    for what, other in changed(text, name):
        frames = Frames()
        beside = rehearse(other, name, ticks, 1, settings=Settings(on_commit=frames))
        where = first_difference(alone.frames, frames.frames)
        where = where or first_other_reading(senses, alone.frames, Senses(other, name), frames.frames)
        if beside.json["failed"] or where:
            yield f"{what} the world is another one: {where or beside.json['reason']}"


def _shuffle(system: System, *, seed: int, ticks: int) -> None:
    """Move random robots to random nodes, and make all objects of random nodes anew, at drawn ticks."""
    robots, nodes = sorted(system.supervisor.state.owners), sorted(system.solvers)

    def move(robot: str, word: int) -> None:
        others = [node for node in nodes if node != system.supervisor.state.owners[robot]]
        if others:
            system.request("move", robot=robot, node=others[word % len(others)])

    for number in range(MOVES):
        robot, word, at, other, when, *_ = draw_words(draw_key(seed, "component_check"), number)
        system.at_tick(1 + at % max(1, ticks - 10), partial(move, robots[robot % len(robots)], word))
        rebuild: Callable[[], None] = system.solvers[nodes[other % len(nodes)]].rebuild
        system.at_tick(1 + when % max(1, ticks - 10), rebuild)
