"""Where two runs of a world differ: the first tick, and there the slots, or the reading."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from foosim.deployment.loader import load_deployment
from foosim.world.assembly.world import World, asked_together
from foosim.world.components.fitted import FittedActuator, FittedSensor, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import SensingView, View, called, has_together
from foosim.world.components.watching import ReadOnly
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout

NAMED_MAX: Final = 4
"""Actuators that a message about several names."""


@dataclass
class Frames:
    """The frames of a rehearsal, in their order."""

    frames: list[Frame] = field(default_factory=list)

    def __call__(self, frame: Frame) -> None:
        self.frames.append(frame)


def first_difference(one: Sequence[Frame], other: Sequence[Frame]) -> str:
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


class Senses:
    """The sensors of a deployment, fitted to the layouts of its frames; `count` is how many there are."""

    def __init__(self, text: str, name: str, files: Mapping[str, bytes]) -> None:
        self._deployment = load_deployment(text, name).with_assets(files)
        self._sensors: dict[bytes, list[FittedSensor]] = {}
        self.count = sum(len(robot.sensors) for robot in self._deployment.robots.values())

    def due(self, frame: Frame) -> list[FittedSensor]:
        """Return those that measure a frame."""
        layout = frame.layout
        if layout.digest not in self._sensors:
            sensors = [one for robot in layout.robots for one in sensors_of(self._deployment, layout, robot)]
            self._sensors[layout.digest] = sensors
        return [one for one in self._sensors[layout.digest] if one.is_due(frame.tick, frame.numbers)]


@dataclass
class Readings:
    """How often each sensor was sampled, how often a number of that was not finite and how often there was a reading,
    by what it is called."""

    sampled: Counter[str] = field(default_factory=Counter)
    not_finite: Counter[str] = field(default_factory=Counter)
    given: Counter[str] = field(default_factory=Counter)

    def bad(self) -> Iterator[str]:
        """Yield the sensors of which no reading is one."""
        for label, count in self.sampled.items():
            if self.not_finite[label] == count:
                yield f"{label} has a number that is not finite in each of its {count} readings"

    def notes(self) -> Iterator[str]:
        """Yield what may be as it is meant: readings that were not finite, sensors whose readings were all dropped."""
        for label, count in self.sampled.items():
            if 0 < self.not_finite[label] < count:
                yield f"{label} has a number that is not finite in {self.not_finite[label]} of its {count} readings"
            elif not self.given[label] and not self.not_finite[label]:
                yield f"{label} never gives a reading: its modifiers drop each of {count}"


def alone_and_together(senses: Senses, frames: Sequence[Frame], readings: Readings) -> Iterator[str]:
    """Yield the sensors whose readings are others beside their like than alone, and those that never give any.

    Raises ComponentError.
    """
    told: set[str] = set()
    for frame in frames:
        due = senses.due(frame)
        numbers = ReadOnly(frame.numbers)
        view = SensingView(frame.tick, numbers, frame.values)
        together = Sensing().sample(due, view)
        readings.sampled.update(map(_label, due))
        readings.not_finite.update(map(_label, view.not_finite))
        for one, payload in zip(due, together, strict=True):
            its = SensingView(frame.tick, numbers, frame.values)
            (alone,) = Sensing().sample([one], its)
            written = {at: number for at, number in its.written.items() if view.written.get(at) != number}
            label = _label(one)
            readings.given[label] += payload is not None
            if (alone != payload or written) and label not in told:
                told.add(label)
                yield f"{label} gives another reading alone than with others, at tick {frame.tick}"
    yield from readings.bad()


class Asking:
    """The actuators of a deployment that can be asked together, fitted to the layouts of its frames."""

    def __init__(self, text: str, name: str, files: Mapping[str, bytes]) -> None:
        self._deployment = load_deployment(text, name).with_assets(files)
        self._groups: dict[bytes, list[list[FittedActuator]]] = {}

    def groups(self, layout: Layout) -> list[list[FittedActuator]]:
        """Return them by motion and class, in the order of their robots."""
        if layout.digest not in self._groups:
            found: dict[tuple[str, str], list[FittedActuator]] = {}
            for index, actuators in sorted(World(self._deployment, layout).actuators.items()):
                motion = layout.entities[index].kind.motion
                for one in actuators:
                    kind = type(one.actuator)
                    if motion and has_together(kind, "command"):
                        found.setdefault((motion, f"{kind.__module__}.{kind.__qualname__}"), []).append(one)
            self._groups[layout.digest] = list(found.values())
        return self._groups[layout.digest]


def asked_alone_and_together(asking: Asking, frames: Sequence[Frame]) -> Iterator[str]:
    """Yield the actuators that ask for something else together than alone. Raises ComponentError."""
    told: set[str] = set()
    for frame in frames:
        view = View(frame.tick, ReadOnly(frame.numbers), start=frame.numbers)
        for group in asking.groups(frame.layout):
            actuators = [one.actuator for one in group]
            made: Any = type(actuators[0])
            what = f"actuators {', '.join(f'{one.channel} of {one.robot}' for one in group[:NAMED_MAX])}"
            together = called(what, "", frame.tick, made.together, actuators)
            asked = asked_together(what, together, len(group), view)
            for one, its in zip(group, asked.tolist(), strict=True):
                label = f"actuator {one.channel} of {one.robot}"
                alone = called(label, "", frame.tick, one.actuator.command, view)
                if its != [list(motor) for motor in alone] and label not in told:
                    told.add(label)
                    yield f"{label} asks for something else alone than with others, at tick {frame.tick}"


def _label(one: FittedSensor) -> str:
    return f"sensor {one.channel} of {one.robot}"


def first_other_reading(one: Senses, frames: Sequence[Frame], other: Senses, others: Sequence[Frame]) -> str:
    """Return at which tick which sensor that both have gives another reading; empty where none does."""
    for here, there in zip(frames, others, strict=False):
        found = _readings(other, there)
        for key, payload in _readings(one, here).items():
            if found[key] != payload:
                return f"tick {here.tick}, the reading of {key[1]} of {key[0]}"
    return ""


def _readings(senses: Senses, frame: Frame) -> dict[tuple[str, str], object]:
    """Return what is measured at a frame, by robot and channel."""
    due = senses.due(frame)
    payloads = Sensing().sample(due, SensingView(frame.tick, frame.numbers, frame.values))
    return {(sensor.robot, sensor.channel): payload for sensor, payload in zip(due, payloads, strict=True)}
