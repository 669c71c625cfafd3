"""Which sensors of a node's robots measure at a tick, and what their packets are called."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import itemgetter
from typing import Final, NamedTuple

from foosim.world.components.fitted import FittedSensor
from foosim.world.forms.forms import DOWN, INACTIVE
from foosim.world.layout import Entity

TURNS_MAX: Final = 64
"""Sets of schedules whose turn is kept."""


class Turn(NamedTuple):
    """Who measures at a tick: robots in service with their sensors, these one after the other, and their packets."""

    robots: tuple[tuple[Entity, tuple[FittedSensor, ...]], ...]
    sensors: tuple[FittedSensor, ...]
    heads: tuple[tuple[str, int, str], ...]
    """Robot, number among its packets and channel of each reading, where none is dropped."""
    counters: tuple[int, ...]
    """The places of the numbers that count the samples."""


class DueSensors:
    """The sensors of some robots of one layout.

    Sensors that are due at one tick are due together again: what follows from who they are is kept while the same
    robots are in service, and the same components active.
    """

    def __init__(
        self,
        robots: Sequence[Entity],
        sensors: Mapping[str, Sequence[FittedSensor]],
        switches: Mapping[str, Mapping[str, int]],
    ) -> None:
        """`sensors` and the bits of their switches are by robot."""
        self.robots = robots
        self._sensors = [tuple(sensors[robot.name]) for robot in robots]
        self._bits = [tuple([switches[one.robot][one.channel] for one in its]) for its in self._sensors]
        self._down = [robot.offsets[DOWN] for robot in robots]
        self._inactive = [robot.offsets.get(INACTIVE, robot.offsets[DOWN]) for robot in robots]
        """Of one without components its `down`, which is 0 when it is looked at."""
        everyone = [one for its in self._sensors for one in its]
        self._speaks = [one.speaks_at for one in everyone if one.speaks_at >= 0]
        self._schedules = sorted({(one.step, one.shift, one.period) for one in everyone})
        self._turns: dict[tuple[bool, ...], Turn] = {}
        """Of those who are in service now."""
        places = [*self._down, *self._inactive]
        self._state: Callable[[Sequence[float]], object] = itemgetter(*places) if places else lambda numbers: ()
        """Returns who is out of service, and what is switched off."""
        self._out: object = None
        """The same when the turns were made."""

    def at(self, tick: int, numbers: Sequence[float]) -> Turn:
        """Return who measures at a tick, at whose start the numbers of the frame are these."""
        value = numbers.__getitem__
        if any(map(value, self._speaks)):
            return self._turn(tick, numbers)
        out = self._state(numbers)
        if out != self._out:
            self._turns, self._out = {}, out
        due = tuple([(tick * step + shift) % period < step for step, shift, period in self._schedules])
        turn = self._turns.get(due)
        if turn is None:
            while len(self._turns) >= TURNS_MAX:
                self._turns.pop(next(iter(self._turns)))
            turn = self._turns[due] = self._turn(tick, numbers)
        return turn

    def _turn(self, tick: int, numbers: Sequence[float]) -> Turn:
        robots = tuple(self._due(tick, numbers))
        sensors = tuple([one for _, its in robots for one in its])
        heads = tuple([(robot.name, number, one.channel) for robot, its in robots for number, one in enumerate(its)])
        return Turn(robots, sensors, heads, tuple([one.samples_at for one in sensors]))

    def _due(self, tick: int, numbers: Sequence[float]) -> Iterator[tuple[Entity, tuple[FittedSensor, ...]]]:
        for robot, down, inactive, sensors, bits in zip(
            self.robots, self._down, self._inactive, self._sensors, self._bits, strict=True
        ):
            if numbers[down] == 0.0:
                off = int(numbers[inactive])
                its = zip(sensors, bits, strict=True)
                yield robot, tuple([one for one, bit in its if not bit & off and one.is_due(tick, numbers)])
