"""Forms that are watched: a number that they change by anything but `view.write` is an error that names it.

Checks of components and trials watch; a run does not, since that costs more than most forms do.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Final, NoReturn

from foosim.world.components.fitted import FittedActuator, FittedModifier
from foosim.world.components.view import View, WritableView
from foosim.world.forms.failures import Misdeed
from foosim.world.layout import Entity, Layout

ALONE: Final = "numbers of a frame are written by view.write alone"


class ReadOnly(list[float]):
    """Numbers of a frame that cannot be written."""

    __slots__ = ()

    def _refuse(self, *arguments: Any, **more: Any) -> NoReturn:
        raise TypeError(ALONE)

    __setitem__ = __delitem__ = __iadd__ = __imul__ = _refuse
    append = extend = insert = remove = pop = clear = sort = reverse = _refuse


class DirectWrite(Misdeed):
    """A form has changed a number of the frame otherwise than by `view.write`."""


class Watched:
    """A form each of whose calls is followed by a comparison of all numbers that it was given.

    `places` are those that it may write by its view. Methods raise DirectWrite beside what they raise themselves.
    """

    def __init__(self, made: Any, layout: Layout, places: Iterable[int]) -> None:
        self._made, self._layout, self._places = made, layout, frozenset(places)

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._made, name)
        if not callable(found):
            return found

        def call(*arguments: Any) -> Any:
            given = [one for argument in arguments for one in _numbers_of(argument)]
            before = [numbers.copy() for numbers, _ in given]
            result = found(*arguments)
            for (numbers, is_written), old in zip(given, before, strict=True):
                if numbers != old:
                    self._compare(found, numbers, old, is_written=is_written)
            return result

        call.__name__ = name
        call.__wrapped__ = found  # type: ignore[attr-defined]  # where messages find the method
        return call

    def _compare(self, method: Any, numbers: list[float], before: list[float], *, is_written: bool) -> None:
        for place, (new, old) in enumerate(zip(numbers, before, strict=True)):
            if new is not old and new != old and not (is_written and place in self._places):
                raise DirectWrite(method, f"it writes {_slot_at(self._layout, place)} directly: {ALONE}")


def _numbers_of(argument: Any) -> list[tuple[list[float], bool]]:
    """Return the lists of numbers behind an argument, each once, with whether a view writes to it."""
    if isinstance(argument, list):
        return [(argument, False)] if argument and isinstance(argument[0], float) else []
    if not isinstance(argument, View):
        return []
    written = argument.written_to if isinstance(argument, WritableView) else None
    lists = {id(one): one for one in (argument.numbers, argument.start, written) if isinstance(one, list)}
    return [(one, one is written) for one in lists.values()]


def _slot_at(layout: Layout, place: int) -> str:
    for entity in layout.entities:
        for field, at in entity.offsets.items():
            if at <= place < at + entity.counts[field]:
                return f"{entity.name} {field}"
    return f"number {place}"


def places_of(entity: Entity, *fields: str, component: str = "") -> list[int]:
    """Return the places of fields of an entity, and of all slots of a component on it."""
    return [
        place
        for field, at in entity.offsets.items()
        if field in fields or (component and field.startswith(f"{component}."))
        for place in range(at, at + entity.counts[field])
    ]


def watched_actuator(one: FittedActuator, layout: Layout) -> FittedActuator:
    """Return an actuator that is watched, with its modifiers."""
    places = places_of(layout[one.robot], component=one.channel)
    return replace(
        one,
        actuator=Watched(one.actuator, layout, places),
        modifiers=tuple(_watched_modifier(its, layout, places) for its in one.modifiers),
    )


def _watched_modifier(one: FittedModifier, layout: Layout, places: list[int]) -> FittedModifier:
    made: Any = Watched(one.modifier, layout, places)
    return replace(
        one, modifier=made, apply_command=getattr(made, "accept", made.apply), due=getattr(made, "due", None)
    )
