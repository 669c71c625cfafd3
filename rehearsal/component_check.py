"""Checks that the forms of a deployment obey the laws: the number of nodes is nothing, and all memory is in the frame.

The deployment is rehearsed several times; what differs is named with its first tick and slot. A form that remembers
something in an object, asks a clock, draws from a running generator or sums in the order of registration is found by
that, whatever it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Final

from foosim.common.errors import Refused
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.loader import load_deployment
from foosim.rehearsal.run import rehearse
from foosim.rehearsal.system import Settings, System
from foosim.world.assembly.used_forms import forms_of
from foosim.world.components.fitted import FittedSensor, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import SensingView
from foosim.world.forms.forms import Form
from foosim.world.frame import Frame

NODES: Final = (1, 2, 3)
MOVES: Final = 12
"""Moves of robots between nodes, and as often all objects of a node are made anew."""


@dataclass
class Frames:
    """The frames of a rehearsal, in their order."""

    frames: list[Frame] = field(default_factory=list)

    def __call__(self, frame: Frame) -> None:
        self.frames.append(frame)


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
            where = _first_difference(alone.frames, frames.frames) or str(many.json["reason"])
            shared = f"on {nodes} nodes" if nodes > 1 else "on one node"
            yield f"{shared}, with robots moved and objects made anew, the world is another one: {where}"
    yield from _alone_and_together(text, name, alone.frames)


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


def _first_difference(one: Sequence[Frame], other: Sequence[Frame]) -> str:
    """Return at which tick, and in which slots, two runs differ first; empty where they do not."""
    for here, there in zip(one, other, strict=False):
        if here.digest != there.digest:
            slots = [
                f"{entity.name} {slot}"
                for entity in here.layout.entities
                for slot, at in entity.offsets.items()
                if here.numbers[at : at + entity.counts[slot]] != there.numbers[at : at + entity.counts[slot]]
            ]
            return f"tick {here.tick}, {', '.join(slots[:4]) or 'outboxes'}"
    return ""


def _alone_and_together(text: str, name: str, frames: Sequence[Frame]) -> Iterator[str]:
    """Yield the sensors whose readings are others beside their like than alone."""
    deployment = load_deployment(text, name)
    sensors: dict[bytes, list[FittedSensor]] = {}
    told: set[str] = set()
    for frame in frames:
        layout = frame.layout
        if layout.digest not in sensors:
            sensors[layout.digest] = [one for robot in layout.robots for one in sensors_of(deployment, layout, robot)]
        due = [one for one in sensors[layout.digest] if one.is_due(frame.tick, frame.numbers)]
        view = SensingView(frame.tick, frame.numbers, frame.values)
        together = Sensing().sample(due, view)
        for one, payload in zip(due, together, strict=True):
            its = SensingView(frame.tick, frame.numbers, frame.values)
            (alone,) = Sensing().sample([one], its)
            written = {at: number for at, number in its.written.items() if view.written.get(at) != number}
            label = f"sensor {one.channel} of {one.robot}"
            if (alone != payload or written) and label not in told:
                told.add(label)
                yield f"{label} gives another reading alone than with others, at tick {frame.tick}"
