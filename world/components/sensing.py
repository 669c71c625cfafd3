"""The readings of many sensors in one frame: each by itself, or those of a class together, with the same bits.

Sensors that are due at one tick are due together again, so what is put together is kept for each set of them.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import BadValue, NotFinite
from foosim.world.components.fitted import FittedSensor
from foosim.world.components.together import Together
from foosim.world.components.view import SensingView, component_error, has_together
from foosim.world.forms.failures import WrongResult
from foosim.world.forms.payloads import as_floats

Numbers: TypeAlias = NDArray[np.float64]
MODIFIED_TOGETHER_MIN: Final = 64
"""Numbers from which on modifiers are computed together. Amid a tick little of numpy is in a cache of the processor:
arrays of fewer numbers cost more than one number after the other."""
METHODS: Final = {"sensor": "sample", "modifier": "apply"}
"""What computes one of a form alone."""
NAMED_MAX: Final = 4
"""Sensors that a message about several names."""
PLANS_MAX: Final = 64
"""Sets of sensors whose plan is kept: those of ticks, and of robots that are out of service."""


class Sensing:
    """Samples any of the sensors of one layout, which are `everyone`."""

    def __init__(self, everyone: Sequence[FittedSensor]) -> None:
        self._plans: dict[tuple[FittedSensor, ...], Plan] = {}
        kinds: dict[Hashable, list[Any]] = {}
        for its in everyone:
            for one in (its.sensor, *[one.modifier for one in its.modifiers]):
                kinds.setdefault((type(one), its.size), []).append(one)
        self._known = Together(kinds)

    def sample(self, fitted: Sequence[FittedSensor], view: SensingView) -> list[bytes | None]:
        """Return the payload of each sensor in a frame, None of a reading that is dropped. Raises ComponentError.

        `view.not_finite` has the sensors whose readings are dropped since a number in them is not finite.
        """
        key = tuple(fitted)
        plan = self._plans.get(key)
        if plan is None:
            while len(self._plans) >= PLANS_MAX:
                self._plans.pop(next(iter(self._plans)))
            plan = self._plans[key] = Plan(fitted, view.tick, self._known)
        return plan.sample(view)


@dataclass(frozen=True, slots=True)
class _Group:
    """Sensors or modifiers of one class that are computed together: the places of their sensors, what they became, how
    many numbers each has, their names, for messages, and whether what they compute is what is sent."""

    places: list[int]
    made: Any
    size: int
    what: str
    is_last: bool


class Plan:
    """What is done for one set of sensors, in which order. Raises ComponentError."""

    def __init__(self, fitted: Sequence[FittedSensor], tick: int, known: Together) -> None:
        self._fitted, self._tick, self._known = tuple(fitted), tick, known
        everyone = [(place, one.sensor, one.size) for place, one in enumerate(fitted)]
        self._together, self._alone = self._divided(everyone, "sensor", 0)
        depth = max((len(one.modifiers) for one in fitted), default=0)
        self._steps = [self._step(place) for place in range(depth)]

    @property
    def groups(self) -> list[_Group]:
        """Those that are computed together."""
        return [*self._together, *(group for groups, _ in self._steps for group in groups)]

    def _step(self, depth: int) -> tuple[list[_Group], list[int]]:
        """Return the modifiers at a depth: groups, and the places of the sensors whose modifier works alone."""
        having = [(place, one) for place, one in enumerate(self._fitted) if len(one.modifiers) > depth]
        members = [(place, one.modifiers[depth].modifier, one.size) for place, one in having]
        return self._divided(members, "modifier", MODIFIED_TOGETHER_MIN)

    def _divided(
        self, members: Sequence[tuple[int, Any, int]], form: str, least: int
    ) -> tuple[list[_Group], list[int]]:
        """Divide (place, object, numbers) into groups of a class and a length, and the places of those without one.

        One that would be a group of its own, and those that have less than `least` numbers together, are computed
        alone, with the same bits.
        """
        kinds: dict[tuple[type[Any], int], list[tuple[int, Any]]] = {}
        for place, one, size in members:
            kinds.setdefault((type(one), size), []).append((place, one))
        alone, groups = [], []
        for (kind, size), its in kinds.items():
            if len(its) == 1 or len(its) * size < max(1, least) or not has_together(kind, METHODS[form]):
                alone += [place for place, _ in its]
                continue
            first = [self._fitted[place] for place, _ in its[:NAMED_MAX]]
            names = ", ".join([f"{one.channel} of {one.robot}" for one in first])
            what = f"{form} {names}{', ...' * (len(its) > NAMED_MAX)}"
            places = [place for place, _ in its]
            is_last = not any(self._fitted[place].modifiers for place in places)
            made = self._known.of((kind, size), [one for _, one in its], what, self._tick)
            groups.append(_Group(places, made, size, what, is_last))
        return groups, sorted(alone)

    def sample(self, view: SensingView) -> list[bytes | None]:
        """Return the payload of each sensor, None of a reading that is dropped. Raises ComponentError."""
        fitted = self._fitted
        readings: list[Any] = [None] * len(fitted)
        for place in self._alone:
            one = fitted[place]
            reading = one.sample(view)
            readings[place] = _numbers(one, reading, view) if one.modifiers else reading
        for group in self._together:
            rows = _computed(group, len(group.places), view, group.made.sample, view)
            is_sent = group.is_last and np.isfinite(rows).all()
            for place, row in zip(group.places, _packed(rows) if is_sent else rows, strict=True):
                readings[place] = row
        for depth, (groups, alone) in enumerate(self._steps):
            for place in alone:
                if readings[place] is not None:
                    readings[place] = fitted[place].modifiers[depth].apply(_listed(readings[place]), view)
            for group in groups:
                _apply_together(group, readings, view)
        return [
            reading if type(reading) is bytes else _payload(one, reading, view)
            for one, reading in zip(fitted, readings, strict=True)
        ]


def _packed(rows: Numbers) -> list[bytes]:
    """Return the payloads of readings of finite numbers, as `PayloadCodec.encode_numbers` does of each."""
    size, packed = rows.shape[1] * rows.itemsize, rows.tobytes()
    return [packed[start : start + size] for start in range(0, len(packed), size)]


def _listed(reading: Any) -> list[float]:
    return reading.tolist() if isinstance(reading, np.ndarray) else list(reading)


def _apply_together(group: _Group, readings: list[Any], view: SensingView) -> None:
    """Let the modifiers of a group work on their readings; those that were dropped before stay so."""
    there = [place for place in group.places if readings[place] is not None]
    nothing = [0.0] * len(readings[there[0]]) if there else []
    if there:
        values = np.array([nothing if readings[place] is None else readings[place] for place in group.places])
        rows = _computed(group, len(values), view, group.made.apply, values, view)
        for place, row in zip(group.places, rows, strict=True):
            if readings[place] is not None:
                readings[place] = row


def _computed(
    group: _Group, count: int, view: SensingView, compute: Callable[..., Numbers], *arguments: Any
) -> Numbers:
    shape = (count, group.size)
    try:
        rows: Any = compute(*arguments)
        if isinstance(rows, np.ndarray) and rows.shape == shape and rows.dtype == np.float64:
            return cast("Numbers", rows)
        raise WrongResult(compute, f"an array of float64 of the shape {shape}", rows)
    except BaseException as error:
        raise component_error(group.what, "", view.tick, error) from error


def _numbers(one: FittedSensor, reading: Any, view: SensingView) -> list[float]:
    """Return the numbers of a reading, for modifiers. Raises ComponentError."""
    try:
        numbers = as_floats(one.codec.numbers(reading))
        if numbers is not None and len(numbers) == one.size:
            return numbers
        raise WrongResult(one.sensor.sample, f"a reading of {one.size} numbers", reading)
    except BaseException as error:
        raise one.failed(view.tick, error) from error


def _payload(one: FittedSensor, reading: Any, view: SensingView) -> bytes | None:
    """Return the bytes of a reading; None of one that was dropped, or has a number that is not finite."""
    if reading is None:
        return None
    try:
        if isinstance(reading, np.ndarray):
            return one.codec.encode_numbers(reading.tolist())
        if isinstance(reading, list):
            return one.codec.encode_numbers(reading)
        if not one.size:
            return one.codec.encode_checked(reading)
        payload = one.codec.encode(reading)
        if len(payload) == 8 * one.size:
            return payload
        raise WrongResult(one.sensor.sample, f"a reading of {one.size} numbers", reading)
    except NotFinite:
        view.not_finite.append(one)
        return None
    except BadValue as error:
        raise one.failed(view.tick, WrongResult(one.sensor.sample, error.problem, reading)) from error
    except BaseException as error:
        raise one.failed(view.tick, error) from error
