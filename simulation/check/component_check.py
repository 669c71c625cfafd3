"""Checks that the components of a deployment obey the laws: any number of nodes gives the same world, and all memory
is in the frame.

The deployment is rehearsed several times; a difference is reported with its first tick and slot. It reveals a
component that stores state in an object, reads a clock, draws from a running generator or by its place among others,
sums in the order of the file or stores an entity as a number.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

import numpy as np

from foosim.common.errors import BadValue, UnknownName
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.simulation.check.changes import changed, with_comings
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings, System
from foosim.world.assembly.versions import component_types_of
from foosim.world.assembly.world import World, commands_together
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import ComponentType
from foosim.world.components.fitted import BoundActuator, BoundSensor, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import ComponentError, SensingView, View, called, has_together, some_together
from foosim.world.components.watching import ReadOnly
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout, build_layout

NODES: Final = (1, 2, 3)
MOVES: Final = 12
"""Moves of robots between nodes, and as often all objects of a node are made anew."""
NAMED_MAX: Final = 4
"""Actuators that a message about several names."""


def used_component_type(text: str, name: str, wanted: str) -> ComponentType:
    """Return the wanted component type of a deployment, by its name, its type name and name, or module:Class.

    Raises BadValue where the deployment uses none or several of that name.
    """
    used = component_types_of(load_deployment(text, name))
    labels = {f"{one.type_name} {one.name}": one for one in used}
    if wanted in labels:
        return labels[wanted]
    type_name, _, kind = wanted.rpartition(" ")
    made = registry.class_at(kind) if ":" in kind else None
    found = [one for one in used if type_name in ("", one.type_name) and (kind == one.name or made is one.factory)]
    if len(found) == 1:
        return found[0]
    if found:
        which = " or ".join(f"{one.type_name} {one.name}" for one in found)
        raise BadValue(f"several components of {name} are called this: {which}", wanted)
    choices = [*labels] if " " in wanted or ":" in wanted else [one.name for one in used]
    raise UnknownName(f"{name} uses no component called this", wanted, choices)


@dataclass
class ComponentCheck:
    """One check of a deployment: `broken` yields its findings, `on_step` receives its progress.

    `files` are the contents of the files that the text names, by path; their digests are in it (`pin_assets`). `run`
    rehearses, from the folder that these files are in.
    """

    text: str
    name: str
    ticks: int
    seed: int = 1
    files: Mapping[str, bytes] = field(default_factory=dict)
    run: Callable[..., Rehearsed] = rehearse
    on_step: Callable[[str], None] = lambda line: None
    now: str = "before its first rehearsal"
    sensors: int = 0
    compared: int = 0
    has_failed: bool = False
    """How many sensors the deployment has, of how many readings were compared, whether it does not even run."""
    notes: list[str] = field(default_factory=list)
    """What breaks no law, and may be meant."""
    first: Mapping[str, Any] = field(default_factory=dict)
    """The result of the first rehearsal."""

    def __post_init__(self) -> None:
        self._begun = 0
        self._changed = list(changed(self.text, self.name))
        self._coming = with_comings(self.text, self.name, self.ticks, self.files)
        self.count = 1 + len(NODES) + len(self._changed) + (0 if self._coming is None else 2) + 1
        """The rehearsals, with that of another process."""

    def begin(self, what: str) -> None:
        """Say that the next rehearsal begins."""
        self._begun += 1
        self.now = f"rehearsal {self._begun} of {self.count}: {what}"
        self.on_step(self.now)

    def broken(self) -> Iterator[str]:
        """Yield which laws the deployment's components break, in words, as each is found."""
        self.begin("on one node")
        self.first, alone = self._rehearsed(self.text, 1, is_guarded=True)
        self.has_failed = self.first["failed"]
        if self.has_failed:
            yield str(self.first["reason"])
            return
        for nodes in NODES:
            shared = f"on {nodes} nodes" if nodes > 1 else "on one node"
            yield from self._other(f"{shared}, with robots moved and objects made anew,", self.text, nodes, alone)
        if self._coming is not None:
            self.begin("on one node, where everything leaves and comes back")
            first, frames = self._rehearsed(self._coming, 1)
            shared = f"on {NODES[-1]} nodes, where everything leaves and comes back,"
            yield from [str(first["reason"])] if first["failed"] else []
            yield from self._other(shared, self._coming, NODES[-1], frames)
        fitted, found = _Fitted(self.text, self.name, self.files), _Compared()
        try:
            for frame in alone:
                found.measure(fitted, frame)
                for actuators in fitted.together:
                    found.command(actuators, frame)
        except ComponentError as error:
            self.has_failed = True
            yield from (*found.differ.values(), str(error))
            return
        yield from found.broken()
        self.notes += found.notes()
        self.sensors, self.compared = fitted.count, sum(count > 0 for count in found.given.values())
        for what, text in self._changed:
            yield from self._other(what, text, 0, alone, fitted)

    def _other(
        self, what: str, text: str, nodes: int, frames: Sequence[Frame], fitted: _Fitted | None = None
    ) -> Iterator[str]:
        """Yield where a rehearsal differs from frames: on some nodes, with robots moved and objects made anew (0: one,
        undisturbed); and in readings, where `fitted` measures these frames."""
        self.begin(what.removesuffix(","))
        shuffle = partial(_shuffle, seed=self.seed, ticks=self.ticks) if nodes else None
        result, others = self._rehearsed(text, nodes or 1, shuffle)
        where = _first_difference(frames, others)
        if not where and fitted is not None:
            where = _first_other_reading(fitted, frames, _Fitted(text, self.name, self.files), others)
        if result["failed"] or where:
            yield f"{what} the world is another one: {where or result['reason']}"

    def _rehearsed(
        self, text: str, nodes: int, prepare: Callable[[System], None] | None = None, *, is_guarded: bool = False
    ) -> tuple[dict[str, Any], list[Frame]]:
        frames: list[Frame] = []
        settings = Settings(on_commit=frames.append, is_guarded=is_guarded)
        return self.run(text, self.name, self.ticks, nodes, settings=settings, prepare=prepare).json, frames


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


# --- where two runs of a world differ --------------------------------------------------------------------------------


def _first_difference(one: Sequence[Frame], other: Sequence[Frame]) -> str:
    """Return at which tick, and in which slots that both have, two runs differ first; empty where they do not."""
    for here, there in zip(one, other, strict=False):
        if here.digest != there.digest:
            slots = [
                f"{entity.name} {slot}"
                for entity in here.layout.entities
                for slot in entity.offsets
                if slot in there.layout[entity.name].offsets
                and _content(here, entity, slot) != _content(there, there.layout[entity.name], slot)
            ]
            if slots or here.layout.digest == there.layout.digest:
                return f"tick {here.tick}, {', '.join(slots[:4]) or 'outboxes'}"
    return ""


def _content(frame: Frame, entity: Entity, slot: str) -> list[float | str]:
    """Return the numbers of a slot, and the names of the entities to which it refers."""
    at = entity.offsets[slot]
    entities, references = frame.layout.entities, frame.layout.references
    return [
        entities[int(frame.numbers[place])].name
        if place in references and frame.numbers[place] >= 0.0
        else frame.numbers[place]
        for place in range(at, at + entity.counts[slot])
    ]


class _Fitted:
    """The sensors and actuators of a deployment, and which of them compute together.

    `count` is how many sensors there are.
    """

    def __init__(self, text: str, name: str, files: Mapping[str, bytes]) -> None:
        self._deployment = load_deployment(text, name).with_assets(files)
        layout = build_layout(self._deployment)
        self._sensors = [one for robot in layout.robots for one in sensors_of(self._deployment, layout, robot)]
        self.sensing = Sensing()
        self.together = _together(self._deployment, layout)
        """The actuators that compute their set-points together, by motion and class, in the order of their robots."""
        self.count = sum(len(robot.sensors) for robot in self._deployment.robots.values())

    def due(self, frame: Frame) -> list[BoundSensor]:
        """Return the sensors that measure a frame."""
        return [one for one in self._sensors if one.is_due(frame.tick, frame.numbers)]

    def readings(self, frame: Frame) -> dict[tuple[str, str], object]:
        """Return the readings at a frame, by robot and channel."""
        due = self.due(frame)
        payloads = self.sensing.sample(due, SensingView(frame.tick, frame.numbers, frame.values))
        return {(sensor.robot, sensor.channel): payload for sensor, payload in zip(due, payloads, strict=True)}


def _together(deployment: Deployment, layout: Layout) -> list[list[BoundActuator]]:
    found: dict[tuple[str, str], list[BoundActuator]] = {}
    for index, actuators in sorted(World(deployment, layout).actuators.items()):
        motion = layout.entities[index].kind.motion
        for one in actuators:
            kind = type(one.actuator)
            if motion is not None and has_together(kind, "command"):
                found.setdefault((motion.__qualname__, f"{kind.__module__}.{kind.__qualname__}"), []).append(one)
    return list(found.values())


@dataclass
class _Compared:
    """Results of sensors and actuators alone and with others, of which the first difference is kept; and how often each
    sensor was sampled, how often it had a non-finite number and how often there was a reading."""

    differ: dict[str, str] = field(default_factory=dict)
    sampled: Counter[str] = field(default_factory=Counter)
    not_finite: Counter[str] = field(default_factory=Counter)
    given: Counter[str] = field(default_factory=Counter)

    def measure(self, fitted: _Fitted, frame: Frame) -> None:
        """Compare the readings of sensors in a frame, which are taken in the other order together.

        Raises ComponentError.
        """
        numbers, due = ReadOnly(frame.numbers), fitted.due(frame)
        view = SensingView(frame.tick, numbers, frame.values)
        rows = np.arange(len(due))[::-1]
        together = fitted.sensing.sample(due[::-1], view, tuple(due), rows)[::-1]
        labels = [f"sensor {one.channel} of {one.robot}" for one in due]
        self.sampled.update(labels)
        self.not_finite.update(f"sensor {one.channel} of {one.robot}" for one in view.not_finite)
        for label, one, payload in zip(labels, due, together, strict=True):
            its = SensingView(frame.tick, numbers, frame.values)
            (alone,) = fitted.sensing.sample([one], its)
            self.given[label] += payload is not None
            if alone != payload or any(view.written.get(at) != number for at, number in its.written.items()):
                self.differ.setdefault(
                    label, f"{label} gives another reading alone than with others, at tick {frame.tick}"
                )

    def command(self, actuators: Sequence[BoundActuator], frame: Frame) -> None:
        """Compare the set-points of actuators of one class in a frame, as `measure` does. Raises ComponentError."""
        view = View(frame.tick, ReadOnly(frame.numbers), start=frame.numbers)
        members = [one.actuator for one in actuators]
        what = f"actuators {', '.join(f'{one.channel} of {one.robot}' for one in actuators[:NAMED_MAX])}"
        made = called(what, "", frame.tick, type(members[0]).together, members)
        together = some_together(what, frame.tick, made, members, np.arange(len(members))[::-1])
        set_points = commands_together(what, together, len(actuators), view)[::-1]
        for one, its in zip(actuators, set_points.tolist(), strict=True):
            label = f"actuator {one.channel} of {one.robot}"
            alone = called(f"actuator {one.channel}", one.robot, frame.tick, one.actuator.command, view)
            if its != [list(motor) for motor in alone]:
                self.differ.setdefault(
                    label, f"{label} has other set-points alone than with others, at tick {frame.tick}"
                )

    def broken(self) -> Iterator[str]:
        """Yield the differences, and the sensors without a finite reading."""
        yield from self.differ.values()
        for label, count in self.sampled.items():
            if self.not_finite[label] == count:
                yield f"{label} has a non-finite number in each of its {count} readings"

    def notes(self) -> Iterator[str]:
        """Yield what may be intended: non-finite readings, and sensors whose readings were all dropped."""
        for label, count in self.sampled.items():
            if 0 < self.not_finite[label] < count:
                yield f"{label} has a non-finite number in {self.not_finite[label]} of its {count} readings"
            elif not self.given[label] and not self.not_finite[label]:
                yield f"{label} never gives a reading: its modifiers drop each of {count}"


def _first_other_reading(one: _Fitted, frames: Sequence[Frame], other: _Fitted, others: Sequence[Frame]) -> str:
    """Return at which tick which sensor that both have gives another reading; empty where none does."""
    for here, there in zip(frames, others, strict=False):
        found = other.readings(there)
        for key, payload in one.readings(here).items():
            if found[key] != payload:
                return f"tick {here.tick}, the reading of {key[1]} of {key[0]}"
    return ""
