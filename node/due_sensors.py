"""The sensors of a node's robots that measure at a tick, and the names of their packets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import compress
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.component_types.descriptions import DOWN, INACTIVE
from foosim.world.components.fitted import BoundSensor
from foosim.world.layout import Entity

TURNS_MAX: Final = 64
"""The count of sets of schedules with a kept turn."""
Sensors: TypeAlias = tuple[BoundSensor, ...]


class Turn(NamedTuple):
    """The measurements of a tick: robots in service with their sensors, these in a row, and their packets."""

    robots: tuple[tuple[Entity, Sensors], ...]
    sensors: Sensors
    heads: tuple[tuple[str, int, str], ...]
    """Robot, number among its packets and channel of each reading, where none is dropped."""
    counters: tuple[int, ...]
    """The places of the numbers that count the samples."""
    whole: Sensors = ()
    rows: NDArray[np.intp] | None = None
    """The due robots among all, and the rows of their sensors; None where a component of a robot in service is switched
    off."""

    def taken(self, is_there: NDArray[np.bool_]) -> Turn:
        """Return the turn of some of the robots, with all of their due sensors."""
        robots, counts = is_there.tolist(), [len(its) for _, its in self.robots]
        measures = np.repeat(is_there, counts)
        chosen = measures.tolist()
        return Turn(
            tuple(compress(self.robots, robots)),
            tuple(compress(self.sensors, chosen)),
            tuple(compress(self.heads, chosen)),
            tuple(compress(self.counters, chosen)),
            self.sensors,
            measures.nonzero()[0],
        )


class DueSensors:
    """The sensors of some robots of one layout.

    Sensors that are due at one tick are due together again: their turn is kept while the same robots are in service,
    and the same components active.
    """

    def __init__(
        self,
        robots: Sequence[Entity],
        sensors: Mapping[str, Sequence[BoundSensor]],
        switches: Mapping[str, Mapping[str, int]],
    ) -> None:
        """`sensors` and the bits of their switches are by robot."""
        self.robots = robots
        self._sensors = [tuple(sensors[robot.name]) for robot in robots]
        self._bits = [switches[robot.name] for robot in robots]
        self._down = [robot.offsets[DOWN] for robot in robots]
        self._inactive = [robot.offsets.get(INACTIVE, robot.offsets[DOWN]) for robot in robots]
        """Of a robot without components its `down`, which is 0 when it is read."""
        everyone = [one for its in self._sensors for one in its]
        self._triggers = [one.trigger_at for one in everyone if one.trigger_at >= 0]
        self._schedules = sorted({(one.step, one.shift, one.period) for one in everyone})
        self._due: dict[tuple[bool, ...], Turn] = {}
        """The sensors of all robots, in service or not."""
        self._turns: dict[tuple[bool, ...], Turn] = {}
        """Of the robots in service."""
        self._states = np.array([self._down, self._inactive], np.intp)
        """The places of the slots for robots out of service, and for switched-off components."""
        self._out = b""
        """Their numbers when the turns were built."""

    def at(self, tick: int, numbers: Sequence[float], values: NDArray[np.float64]) -> Turn:
        """Return the turn of a tick with these numbers of the frame at its start; `values` are the same."""
        value = numbers.__getitem__
        if any(map(value, self._triggers)):
            return self._turn(self._in_service(self._due_at(tick, numbers), numbers))
        states = values[self._states]
        out = states.tobytes()
        if out != self._out:
            self._turns, self._out = {}, out
        due = tuple([(tick * step + shift) % period < step for step, shift, period in self._schedules])
        turn = self._turns.get(due)
        if turn is None:
            while len(self._turns) >= TURNS_MAX:
                self._turns.pop(next(iter(self._turns)))
            whole = self._known(due, tick, numbers)
            is_there = states[0] == 0.0
            if states[1][is_there].any():
                turn = self._turn(self._in_service([its for _, its in whole.robots], numbers))
            else:
                turn = whole.taken(is_there)
            self._turns[due] = turn
        return turn

    def _known(self, due: tuple[bool, ...], tick: int, numbers: Sequence[float]) -> Turn:
        found = self._due.get(due)
        if found is None:
            while len(self._due) >= TURNS_MAX:
                self._due.pop(next(iter(self._due)))
            found = self._due[due] = self._turn(zip(self.robots, self._due_at(tick, numbers), strict=True))
        return found

    def _due_at(self, tick: int, numbers: Sequence[float]) -> list[Sensors]:
        return [tuple([one for one in its if one.is_due(tick, numbers)]) for its in self._sensors]

    @staticmethod
    def _turn(due: Iterable[tuple[Entity, Sensors]]) -> Turn:
        robots = tuple(due)
        sensors = tuple([one for _, its in robots for one in its])
        heads = tuple([(robot.name, number, one.channel) for robot, its in robots for number, one in enumerate(its)])
        return Turn(robots, sensors, heads, tuple([one.samples_at for one in sensors]))

    def _in_service(self, due: Sequence[Sensors], numbers: Sequence[float]) -> Iterator[tuple[Entity, Sensors]]:
        """Yield the robots in service with their sensors that are switched on."""
        for robot, down, inactive, its, bits in zip(
            self.robots, self._down, self._inactive, due, self._bits, strict=True
        ):
            if numbers[down] == 0.0:
                off = int(numbers[inactive])
                yield robot, tuple([one for one in its if not bits[one.channel] & off]) if off else its
