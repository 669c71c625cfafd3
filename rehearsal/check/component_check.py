"""Checks that the forms of a deployment obey the laws: the number of nodes is nothing, and all memory is in the frame.

The deployment is rehearsed several times; what differs is named with its first tick and slot. A form that remembers
something in an object, asks a clock, draws from a running generator or by its place among others, sums in the order of
the file or keeps an entity as a number is found by that, whatever it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from typing import Any, Final

from foosim.common.errors import BadValue, UnknownName
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.loader import load_deployment
from foosim.rehearsal.check.changes import changed
from foosim.rehearsal.check.differences import (
    Asking,
    Frames,
    Readings,
    Senses,
    alone_and_together,
    asked_alone_and_together,
    first_difference,
    first_other_reading,
)
from foosim.rehearsal.run import Rehearsed, rehearse
from foosim.rehearsal.system import Settings, System
from foosim.world.assembly.used_forms import forms_of
from foosim.world.components.view import ComponentError
from foosim.world.forms.forms import Form
from foosim.world.frame import Frame

NODES: Final = (1, 2, 3)
MOVES: Final = 12
"""Moves of robots between nodes, and as often all objects of a node are made anew."""


def used_form(text: str, name: str, wanted: str) -> Form:
    """Return the form of a deployment that is wanted: a name, a form and a name, or module:Class.

    Raises BadValue where the deployment uses none or several of that name.
    """
    forms = forms_of(load_deployment(text, name))
    labels = {f"{form.form} {form.name}": form for form in forms}
    if wanted in labels:
        return labels[wanted]
    form_name, _, kind = wanted.rpartition(" ")
    made = _class_at(kind) if ":" in kind else None
    found = [form for form in forms if form_name in ("", form.form) and (kind == form.name or made is form.made)]
    if len(found) == 1:
        return found[0]
    if found:
        which = " or ".join(f"{form.form} {form.name}" for form in found)
        raise BadValue(f"several forms of {name} are called this: {which}", wanted)
    if " " in wanted or ":" in wanted:
        raise UnknownName(f"{name} uses no form called this", wanted, labels)
    raise UnknownName(f"{name} uses no form called this", wanted, [form.name for form in forms])


def _class_at(path: str) -> Any:
    """Return what `module:Class` is, wherever it was imported from; None where there is nothing. Raises BadValue."""
    module, _, attribute = path.partition(":")
    try:
        return getattr(import_module(module), attribute, None)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # SystemExit, too: a module may do anything
        raise BadValue(f"cannot be imported: {type(error).__name__}: {error}", path) from error


def _silent(line: str) -> None:
    """Nobody wants to know where a check is."""


@dataclass
class ComponentCheck:
    """One check of a deployment: what it found is yielded by `broken`, where it is goes to `on_step`.

    `files` are the contents of the files that the text names, by path; their digests are in it (`pin_assets`). `run`
    rehearses, from the folder that these files are in.
    """

    text: str
    name: str
    ticks: int
    seed: int = 1
    files: Mapping[str, bytes] = field(default_factory=dict)
    run: Callable[..., Rehearsed] = rehearse
    on_step: Callable[[str], None] = _silent
    now: str = "before its first rehearsal"
    sensors: int = 0
    compared: int = 0
    has_failed: bool = False
    """How many sensors the deployment has, of how many readings were compared, whether it does not even run."""
    notes: list[str] = field(default_factory=list)
    """What breaks no law, and may be meant."""

    def __post_init__(self) -> None:
        self._begun = 0
        self._changed = list(changed(self.text, self.name))
        self.count = 1 + len(NODES) + len(self._changed) + 1
        """The rehearsals, with that of another process."""

    def begin(self, what: str) -> None:
        """Say that the next rehearsal begins."""
        self._begun += 1
        self.now = f"rehearsal {self._begun} of {self.count}: {what}"
        self.on_step(self.now)

    def broken(self) -> Iterator[str]:
        """Yield which laws the deployment's forms break, in words, as each is found."""
        self.begin("on one node")
        first, alone = self._rehearsed(self.text, 1, is_watched=True)
        self.has_failed = first.json["failed"]
        if self.has_failed:
            yield str(first.json["reason"])
            return
        for nodes in NODES:
            shared = f"on {nodes} nodes" if nodes > 1 else "on one node"
            shared += ", with robots moved and objects made anew,"
            self.begin(shared.removesuffix(","))
            many, frames = self._rehearsed(self.text, nodes, partial(_shuffle, seed=self.seed, ticks=self.ticks))
            if many.json["failed"] or many.digests != first.digests:
                where = first_difference(alone, frames) or str(many.json["reason"])
                yield f"{shared} the world is another one: {where}"
        senses = Senses(self.text, self.name, self.files)
        readings = Readings()
        try:
            yield from alone_and_together(senses, alone, readings)
            yield from asked_alone_and_together(Asking(self.text, self.name, self.files), alone)
        except ComponentError as error:
            self.has_failed = True
            yield str(error)
            return
        self.notes += readings.notes()
        self.sensors, self.compared = senses.count, sum(count > 0 for count in readings.given.values())
        for what, other in self._changed:
            self.begin(what.removesuffix(","))
            beside, frames = self._rehearsed(other, 1)
            where = first_difference(alone, frames)
            where = where or first_other_reading(senses, alone, Senses(other, self.name, self.files), frames)
            if beside.json["failed"] or where:
                yield f"{what} the world is another one: {where or beside.json['reason']}"

    def _rehearsed(
        self, text: str, nodes: int, prepare: Callable[[System], None] | None = None, *, is_watched: bool = False
    ) -> tuple[Rehearsed, list[Frame]]:
        frames = Frames()
        settings = Settings(on_commit=frames, is_watched=is_watched)
        return self.run(text, self.name, self.ticks, nodes, settings=settings, prepare=prepare), frames.frames


def broken_laws(text: str, name: str, ticks: int, seed: int = 1) -> Iterator[str]:
    """Yield which laws a deployment's forms break, in words, as each is found."""
    yield from ComponentCheck(text, name, ticks, seed).broken()


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
