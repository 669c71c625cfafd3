"""The readings of many sensors in one frame: each by itself, or those of a class together, with the same bits.

Sensors that are due at one tick are due together again, so their plan is kept for each set of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import BadValue, NotFinite
from foosim.world.component_types.failures import ContractError
from foosim.world.component_types.payloads import as_floats
from foosim.world.components.fitted import BoundSensor
from foosim.world.components.view import SensingView, called, component_error, has_together, some_together

Numbers: TypeAlias = NDArray[np.float64]
MODIFIED_TOGETHER_MIN: Final = 64
"""Numbers from which on modifiers are computed together. Amid a tick little of numpy is in a cache of the processor:
arrays of fewer numbers cost more than one number after the other."""
METHODS: Final = {"sensor": "sample", "modifier": "apply"}
"""The method that computes one component alone."""
NAMED_MAX: Final = 4
"""Names of sensors in a message about several."""
PLANS_MAX: Final = 64
"""Sets of sensors whose plan is kept: those of ticks, and of robots that are out of service."""


class Sensing:
    """Samples the sensors of one layout."""

    def __init__(self) -> None:
        self._plans: dict[tuple[BoundSensor, ...], Plan] = {}
        self._wholes: dict[tuple[BoundSensor, ...], Plan] = {}
        """The plans from which plans of some rows are taken."""

    def sample(
        self,
        fitted: Sequence[BoundSensor],
        view: SensingView,
        whole: tuple[BoundSensor, ...] = (),
        rows: NDArray[np.intp] | None = None,
    ) -> list[bytes | None]:
        """Return the payload of each sensor in a frame, None of a reading that is dropped. Raises ComponentError.

        Where they are the `rows` of a `whole` that is sampled again and again, the whole is planned once.
        `view.not_finite` gets the sensors whose readings are dropped because of a non-finite number.
        """
        key = tuple(fitted)
        plan = self._plans.get(key)
        if plan is None:
            if rows is None:
                plan = Plan(key, view.tick)
            else:
                planned = self._wholes.get(whole) or _keep(self._wholes, whole, Plan(whole, view.tick))
                plan = planned if key == whole else planned.taken(key, rows, view.tick)
            _keep(self._plans, key, plan)
        return plan.sample(view)


def _keep(plans: dict[tuple[BoundSensor, ...], Plan], key: tuple[BoundSensor, ...], plan: Plan) -> Plan:
    while len(plans) >= PLANS_MAX:
        plans.pop(next(iter(plans)))
    plans[key] = plan
    return plan


@dataclass(frozen=True, slots=True)
class _Group:
    """Sensors or modifiers of one class that are computed together: the places of their sensors, themselves, their
    `together` object, the count of numbers of each, their type and names, for messages, and whether their numbers are
    sent as they are."""

    places: list[int]
    members: list[Any]
    made: Any
    size: int
    type_name: str
    what: str
    is_last: bool

    def taken(self, places: NDArray[np.intp], fitted: Sequence[BoundSensor], tick: int) -> _Group | None:
        """Return those of them that are among some sensors, at these places or -1; None where none is."""
        there = places[self.places]
        rows = (there >= 0).nonzero()[0]
        if not len(rows):
            return None
        its = there[rows].tolist()
        what = _names(self.type_name, fitted, its)
        made = some_together(what, tick, self.made, self.members, rows)
        return _Group(
            its, [self.members[row] for row in rows.tolist()], made, self.size, self.type_name, what, self.is_last
        )


_Divided: TypeAlias = tuple[list[_Group], list[int]]
"""Groups, and the places of the sensors that work alone, or whose modifier does."""


def _names(type_name: str, fitted: Sequence[BoundSensor], places: Sequence[int]) -> str:
    names = ", ".join([f"{fitted[place].channel} of {fitted[place].robot}" for place in places[:NAMED_MAX]])
    return f"{type_name} {names}{', ...' * (len(places) > NAMED_MAX)}"


class Plan:
    """The steps of sampling one set of sensors, in order. Raises ComponentError."""

    def __init__(
        self, fitted: tuple[BoundSensor, ...], tick: int, known: tuple[_Divided, list[_Divided]] | None = None
    ) -> None:
        """`known` are the groups of sensors and of modifiers, by depth, where they were taken from others."""
        self._fitted = fitted
        if known is not None:
            (self._together, self._alone), self._steps = known
            return
        everyone = [(place, one.sensor, one.size) for place, one in enumerate(fitted)]
        self._together, self._alone = self._divided(everyone, "sensor", 0, tick)
        depth = max((len(one.modifiers) for one in fitted), default=0)
        self._steps = [self._step(place, tick) for place in range(depth)]

    def taken(self, fitted: tuple[BoundSensor, ...], rows: NDArray[np.intp], tick: int) -> Plan:
        """Return that of some of the sensors, by their rows, with the same bits. Raises ComponentError."""
        places = np.full(len(self._fitted), -1, np.intp)
        places[rows] = np.arange(len(rows))

        def some(groups: list[_Group], alone: list[int]) -> _Divided:
            taken = [group.taken(places, fitted, tick) for group in groups]
            return [one for one in taken if one is not None], sorted([at for at in places[alone].tolist() if at >= 0])

        steps = [some(groups, alone) for groups, alone in self._steps]
        return Plan(fitted, tick, (some(self._together, self._alone), steps))

    @property
    def groups(self) -> list[_Group]:
        """The groups that are computed together."""
        return [*self._together, *(group for groups, _ in self._steps for group in groups)]

    def _step(self, depth: int, tick: int) -> _Divided:
        """Return the modifiers at a depth: groups, and the places of the sensors whose modifier works alone."""
        having = [(place, one) for place, one in enumerate(self._fitted) if len(one.modifiers) > depth]
        members = [(place, one.modifiers[depth].modifier, one.size) for place, one in having]
        return self._divided(members, "modifier", MODIFIED_TOGETHER_MIN, tick)

    def _divided(self, members: Sequence[tuple[int, Any, int]], type_name: str, least: int, tick: int) -> _Divided:
        """Divide (place, object, numbers) into groups of a class and a length, and the places of those without one.

        A group of one, and a group of less than `least` numbers, is computed one after the other, with the same bits.
        """
        kinds: dict[tuple[type[Any], int], list[tuple[int, Any]]] = {}
        for place, one, size in members:
            kinds.setdefault((type(one), size), []).append((place, one))
        alone, groups = [], []
        for (kind, size), its in kinds.items():
            if len(its) == 1 or len(its) * size < max(1, least) or not has_together(kind, METHODS[type_name]):
                alone += [place for place, _ in its]
                continue
            places, ones = [place for place, _ in its], [one for _, one in its]
            what = _names(type_name, self._fitted, places)
            is_last = not any(self._fitted[place].modifiers for place in places)
            made: Any = called(what, "", tick, kind.together, ones)
            groups.append(_Group(places, ones, made, size, type_name, what, is_last))
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
    """Let the modifiers of a group work on their readings; dropped readings stay dropped."""
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
        raise ContractError(compute, f"an array of float64 of the shape {shape}", rows)
    except BaseException as error:
        raise component_error(group.what, "", view.tick, error) from error


def _numbers(one: BoundSensor, reading: Any, view: SensingView) -> list[float]:
    """Return the numbers of a reading, for modifiers. Raises ComponentError."""
    try:
        numbers = as_floats(one.codec.numbers(reading))
        if numbers is not None and len(numbers) == one.size:
            return numbers
        raise ContractError(one.sensor.sample, f"a reading of {one.size} numbers", reading)
    except BaseException as error:
        raise one.failed(view.tick, error) from error


def _payload(one: BoundSensor, reading: Any, view: SensingView) -> bytes | None:
    """Return the bytes of a reading; None of one that was dropped, or has a non-finite number."""
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
        raise ContractError(one.sensor.sample, f"a reading of {one.size} numbers", reading)
    except NotFinite:
        view.not_finite.append(one)
        return None
    except BadValue as error:
        raise one.failed(view.tick, ContractError(one.sensor.sample, error.problem, reading)) from error
    except BaseException as error:
        raise one.failed(view.tick, error) from error
