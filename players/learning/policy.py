"""A learned policy: from what was read to what is commanded, by a network with one hidden layer.

Each reading is carried on to the present by its rate of change and its age. Inputs are these readings, their rates and
1. Commands see the hidden units and the inputs themselves. All arithmetic is + - * / in numpy, element by element, so
that it has equal bits everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Final, TypeAlias

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from foosim.client.vectors import NEVER_S, Bounds, Column
from foosim.common.errors import BadValue, UnknownName

Numbers: TypeAlias = NDArray[np.float64]
SMOOTHING: Final = 0.6
"""The share of a new measurement in a rate of change."""
INSTANT_S: Final = 1e-6
"""Times of measurements that differ by less are one: they are found from ages, with rounding."""
RATE_MAX: Final = 20.0
"""A rate (1/s, in the reading's unit) above this is that of what was put elsewhere."""


Scale: TypeAlias = Annotated[float, Meta(gt=0)]


class PolicyFile(Struct, frozen=True, forbid_unknown_fields=True):
    """A policy as its file has it: what it reads and commands, and its weights.

    `readings` and `commands` are globs of `robot/channel`, `bounds` are of `robot/channel.field`, as an environment
    takes them; `columns` are the readings by name that it uses, with what each and its rate are divided by, `moves` the
    commands by name that it gives: others stay in the middle of their bounds. `hidden` is the number of hidden units.
    `weights` are those of the hidden units, one after the other, then those of the moves; none are zeros.
    """

    readings: list[str]
    commands: list[str]
    bounds: dict[str, Bounds]
    columns: dict[str, tuple[Scale, Scale]]
    moves: list[str]
    hidden: Annotated[int, Meta(ge=0)]
    weights: list[float] = []

    @property
    def shapes(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """The weights of the hidden units, (hidden, inputs), and of the moves, (moves, hidden + inputs)."""
        inputs = 2 * len(self.columns) + 1
        return (self.hidden, inputs), (len(self.moves), self.hidden + inputs)

    @property
    def size(self) -> int:
        """The number of weights."""
        return sum(rows * columns for rows, columns in self.shapes)


def column_name(column: Column) -> str:
    """Return `robot/channel.field`."""
    return f"{column.robot}/{column.channel}.{column.field}"


class Policy:
    """Reads vectors with ages (`client.vectors.ReadingVector`), gives vectors of commands."""

    def __init__(self, file: PolicyFile, readings: Sequence[Column], commands: Sequence[Column]) -> None:
        """Raises BadValue for a policy that does not fit these columns."""
        names, moved = [column_name(column) for column in readings], [column_name(column) for column in commands]
        for name in file.columns:
            if name not in names:
                raise UnknownName("the policy uses what is not read", name, names)
        for name in file.moves:
            if name not in moved:
                raise UnknownName("the policy moves what is not commanded", name, moved)
        self._moves = np.array([moved.index(name) for name in file.moves], np.intp)
        channels = [(column.robot, column.channel) for column in readings if column.field == "age"]
        self._places = np.array([names.index(name) for name in file.columns], np.intp)
        aged = [(readings[place].robot, readings[place].channel) for place in self._places]
        first_age = len(readings) - len(channels)
        self._ages = np.array([first_age + channels.index(pair) for pair in aged], np.intp)
        self._scale = np.array([1.0 / value for value, _ in file.columns.values()])
        self._rate_scale = np.array([1.0 / rate for _, rate in file.columns.values()])
        low, high = np.array([one.low for one in commands]), np.array([one.high for one in commands])
        self._middle, self._half = (low + high) / 2, (high - low) / 2
        self._file = file
        self._first, self._second = (np.zeros(shape) for shape in file.shapes)
        self.set_weights(file.weights or [0.0] * file.size)
        self._time = self._value = self._rate = np.zeros(0)
        self.begin()

    def set_weights(self, weights: Sequence[float] | Numbers) -> None:
        """Take other weights, (size,). Raises BadValue for another number of them, or one that is not finite."""
        numbers = np.asarray(weights, np.float64)
        size, (of_hidden, of_moves) = self._file.size, self._file.shapes
        if numbers.shape != (size,) or not np.isfinite(numbers).all():
            raise BadValue(f"a policy of this shape has {size} finite weights", numbers.size)
        cut = of_hidden[0] * of_hidden[1]
        self._first, self._second = numbers[:cut].reshape(of_hidden), numbers[cut:].reshape(of_moves)

    def begin(self) -> None:
        """Forget what was read."""
        count = len(self._places)
        self._time, self._value, self._rate = np.full(count, -np.inf), np.zeros(count), np.zeros(count)

    def act(self, vector: Numbers, now_s: float) -> Numbers:
        """Return what is commanded at a time, (commands,), from what was read by then."""
        age, value = vector[self._ages], vector[self._places]
        has_come = age != NEVER_S
        time = np.where(has_come, now_s - age, -np.inf)
        is_new, is_known = time > self._time + INSTANT_S, self._time > -np.inf
        passed = np.where(is_new & is_known, time - np.where(is_known, self._time, 0.0), 1.0)
        measured = (value - self._value) / passed
        fits = is_new & is_known & (np.abs(measured) < RATE_MAX)
        first = fits & (self._rate == 0.0)
        share = np.where(first, 1.0, SMOOTHING)
        rate = np.where(fits, self._rate + share * (measured - self._rate), np.where(is_new, 0.0, self._rate))
        self._time, self._value, self._rate = (
            np.where(is_new, time, self._time),
            np.where(is_new, value, self._value),
            rate,
        )
        present = self._value + rate * np.where(has_come, age, 0.0)
        inputs = np.concatenate((present * self._scale, rate * self._rate_scale, (1.0,)))
        hidden = np.concatenate((_squashed((self._first * inputs).sum(axis=1)), inputs))
        commands: Numbers = self._middle.copy()
        commands[self._moves] += self._half[self._moves] * _squashed((self._second * hidden).sum(axis=1))
        return commands


def _squashed(numbers: Any) -> Any:
    """Return numbers between -1 and 1."""
    return numbers / (1.0 + np.abs(numbers))
