"""Components of a class that are computed together: those of some robots are taken from those of all that there are."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np

from foosim.world.components.view import called


class Together:
    """Components of one layout, by what those that are computed together have in common.

    Who is present changes while a world goes on. What all of them became is kept, where it has a method `taken`.
    """

    def __init__(self, everyone: Mapping[Hashable, Sequence[Any]]) -> None:
        self._everyone = everyone
        self._known: dict[Hashable, tuple[Any, dict[int, int]]] = {}
        """What all with a key became, and the rows of these by their identity."""

    def of(self, key: Hashable, some: Sequence[Any], what: str, tick: int) -> Any:
        """Return what some of those with a key become. Raises ComponentError, which names them as `what`."""
        together = type(some[0]).together
        if key not in self._known:
            everyone = self._everyone[key]
            made = called(what, "", tick, together, everyone)
            self._known[key] = made, {id(one): row for row, one in enumerate(everyone)}
        made, rows = self._known[key]
        if not hasattr(made, "taken"):
            return called(what, "", tick, together, some)
        return called(what, "", tick, made.taken, np.array([rows[id(one)] for one in some]))
