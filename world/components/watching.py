"""Guarded components: a line of theirs that changes a number of the frame without `view.write` raises.

Checks of components and trials use guards; a run does not, since a guard costs more than most components.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import wraps
from typing import Any, Final, NoReturn

from foosim.world.components.fitted import BoundActuator
from foosim.world.components.view import View

ALONE: Final = "numbers of a frame are written by view.write alone"


def _refuse(self: Any, *arguments: Any, **more: Any) -> NoReturn:
    raise TypeError(ALONE)


class ReadOnly(list[float]):
    """Numbers of a frame that cannot be written."""

    __slots__ = ()
    __setitem__ = __delitem__ = __iadd__ = __imul__ = _refuse
    append = extend = insert = remove = pop = clear = sort = reverse = _refuse


class _Seen(Sequence[float]):
    """The numbers of a view, read-only: they change as the view writes them."""

    __slots__ = ("_numbers",)

    def __init__(self, numbers: Sequence[float]) -> None:
        self._numbers = numbers

    def __len__(self) -> int:
        return len(self._numbers)

    def __getitem__(self, place: Any) -> Any:
        return self._numbers[place]

    __setitem__ = __delitem__ = _refuse


class WriteGuard:
    """A component whose calls get their numbers read-only."""

    def __init__(self, made: Any) -> None:
        self._made = made

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._made, name)
        if not callable(found):
            return found

        @wraps(found)  # messages find the method there
        def call(*arguments: Any) -> Any:
            views = [(one, one.numbers, one.start) for one in arguments if isinstance(one, View)]
            if not views:  # lists beside a view are a value's numbers, not a frame's
                return found(*(ReadOnly(one) if isinstance(one, list) else one for one in arguments))
            for view, numbers, start in views:
                view.numbers, view.start = _Seen(numbers), _Seen(start)
            try:
                return found(*arguments)
            finally:
                for view, numbers, start in views:
                    view.numbers, view.start = numbers, start

        return call


def guarded(made: Any) -> Any:
    """Return a component with a guard; typed Any, since it has the methods of the component."""
    return WriteGuard(made)


def guarded_actuator(one: BoundActuator) -> BoundActuator:
    """Return an actuator with a guard, and guards of its modifiers."""
    modifiers = tuple([replace(its, modifier=guarded(its.modifier)) for its in one.modifiers])
    return replace(one, actuator=guarded(one.actuator), modifiers=modifiers)
