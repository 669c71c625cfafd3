"""What an expansion finds wrong, and how large it may become.

An entry with a problem of its own is *broken*: what is wrong with the entry as it would be otherwise is not reported.
"""

from __future__ import annotations

from typing import Final, NoReturn

from foosim.common import limits
from foosim.common.errors import ABSENT, BadValue, describe
from foosim.common.finding import Location, path_text
from foosim.deployment.text.yaml import Place, Problem, Tree, measure

PROBLEMS_MAX: Final = 100
"""How many problems are looked for and shown: a hostile file may hold many thousands, each with names to compare."""


class Stopped(Exception):
    """The rest is not expanded."""


class Report:
    """The problems of an expansion. Those for which nothing else can be checked are its end."""

    def __init__(self) -> None:
        self.problems: dict[Problem, None] = {}
        self.broken: set[tuple[str, str]] = set()
        self._sizes: dict[int, tuple[int, int]] = {}
        self._measured: list[Tree] = []
        self._nodes = 0

    def add(self, place: Place, path: Location, what: str, value: object = ABSENT, nearest: str | None = None) -> None:
        """Note a problem; raises Stopped after too many."""
        self.problems[Problem(place, f"{path_text(path)}: {describe(what, value, nearest)}")] = None
        if len(self.problems) > PROBLEMS_MAX:
            self.stop()

    def add_value(self, place: Place, path: Location, bad: BadValue) -> None:
        """Note a value that was not accepted."""
        self.add(place, path, bad.problem, bad.value, bad.nearest)

    def stop(self) -> NoReturn:
        """Expand nothing more. Raises Stopped."""
        raise Stopped

    def count(self, tree: Tree, place: Place, path: Location) -> None:
        """Count the nodes of an entry that was made at a place; raises Stopped where all are too many."""
        self._measured.append(tree)  # the sizes are known by id
        self._nodes += measure(tree, self._sizes)[1] + 1
        if self._nodes > limits.EXPANDED_NODES_MAX:
            what = f"templates and counts make more than {limits.EXPANDED_NODES_MAX} values and keys"
            self.add(place, path, what)
            self.stop()
