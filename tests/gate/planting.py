"""How a bug is planted: attributes of classes and modules are swapped for a while and put back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from tests.swarm.campaign import undisturbed


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
    """Collects the mutants of a module: `@register(name, rule, seed)` before each function."""

    def __init__(self) -> None:
        self.mutants: list[Mutant] = []

    def __call__(
        self, name: str, rule: str, seed: int
    ) -> Callable[[Callable[[Planting], None]], Callable[[Planting], None]]:
        def note(plant: Callable[[Planting], None]) -> Callable[[Planting], None]:
            self.mutants.append(Mutant(name, rule, seed, plant))
            return plant

        return note
