"""How a bug is planted: attributes of classes and modules are swapped for a while and put back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from tests.swarm.campaign import undisturbed

Bug = Callable[..., Any]
"""What is called in place of the function that it gets first."""


class Planting:
    """Swaps attributes until it is undone."""

    def __init__(self) -> None:
        self._stack = ExitStack()

    def swap(self, owner: Any, name: str, value: Any) -> Any:
        """Give `owner.name` another value; return the one that it had."""
        before = getattr(owner, name)
        self._stack.callback(setattr, owner, name, before)
        setattr(owner, name, value)
        return before

    def undo(self) -> None:
        """Put everything back, the last first."""
        self._stack.close()


def nothing(before: Bug, *given: object) -> None:
    """Do nothing instead."""


def swapping(owner: Any, name: str, bug: Bug) -> Callable[[Planting], None]:
    """Return what plants a bug in place of one function."""

    def plant(planting: Planting) -> None:
        before = getattr(owner, name)
        planting.swap(owner, name, lambda *given, **named: bug(before, *given, **named))

    return plant


@dataclass(frozen=True, slots=True)
class Mutant:
    """A planted bug: the rule that is switched off, and the first seed that finds it."""

    name: str
    rule: str
    seed: int
    plant: Callable[[Planting], None]

    @contextmanager
    def planted(self) -> Iterator[None]:
        """The bug is in the code meanwhile; what was computed with it is not kept."""
        planting = Planting()
        undisturbed.cache_clear()
        try:
            self.plant(planting)
            yield
        finally:
            planting.undo()
            undisturbed.cache_clear()


class Register:
    """Collects the mutants of a module: `@register(name, rule, seed, owner, attribute)` before each function.

    The function is called in place of the attribute, which it gets before its arguments. Without an owner it plants the
    bug itself.
    """

    def __init__(self) -> None:
        self.mutants: list[Mutant] = []

    def __call__(self, name: str, rule: str, seed: int, owner: Any = None, attribute: str = "") -> Callable[[Bug], Bug]:
        def note(bug: Bug) -> Bug:
            plant = bug if owner is None else swapping(owner, attribute, bug)
            self.mutants.append(Mutant(name, rule, seed, plant))
            return bug

        return note
