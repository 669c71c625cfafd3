"""Entries with `each: SELECTOR`: one for each robot that the selector matches, such as the controller of each scout.

In the name, in texts and in keys of such an entry `$robot` stands for the robot's name, `$1`, `$2`... for what the
wildcards of the selector match in it, and `$$` for a dollar sign. Where it runs may also follow from `$node`, the node
that owns the robot at the start: nothing else, since the world does not depend on nodes. An entry that is written under
a name that is so made holds what is different about that one.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from foosim.common.errors import BadValue
from foosim.deployment.text.yaml import Fields, Items, Leaf, Place, Tree

EACH: Final = "each"
NODE: Final = "$node"
PLACES: Final = ("process", "host", "label")
"""Keys of an entry that say where it runs."""

_SIGN: Final = re.compile(r"\$([a-z]+|[0-9]|\$)?")


@dataclass(frozen=True, slots=True)
class Each:
    """An entry for each robot. `raw` is what it says of each."""

    path: tuple[str, str]
    raw: Fields

    def values(self, robot: str, parts: tuple[str, ...]) -> dict[str, str]:
        """Return what is put in for each sign, for one robot."""
        return {"$": "$", "robot": robot} | {str(number): part for number, part in enumerate(parts, 1)}


class BadSign(Exception):
    """A text whose signs cannot be replaced, at its place."""

    def __init__(self, place: Place, bad: BadValue) -> None:
        super().__init__(bad.problem)
        self.place = place
        self.bad = bad


def put(text: str, place: Place, values: Mapping[str, str]) -> str:
    """Return a text with values in place of its signs; raises BadSign."""

    def value(found: re.Match[str]) -> str:
        known = values.get(found[1] or "")
        if known is None:
            valid = ", ".join(f"${sign}" for sign in values)
            raise BadSign(place, BadValue(f"a $ that stands for nothing here (valid are {valid})", text))
        return known

    return _SIGN.sub(value, text)


class Filling:
    """Puts values in place of the signs in trees. What has no signs is shared."""

    def __init__(self) -> None:
        self._with_signs: dict[int, bool] = {}
        self._looked: list[Tree] = []

    def entry(self, entry: Tree, values: Mapping[str, str], node: str | None) -> Tree:
        """Return an entry with values in place of all signs, and the name of a node where it says where it runs.

        Raises BadSign.
        """
        if not isinstance(entry, Fields) or node is None or not any(key in entry.values for key in PLACES):
            return self.fill(entry, values)
        placed = {**values, NODE.removeprefix("$"): node}
        filled = Fields(entry.place, keys=dict(entry.keys))
        for key, value in entry.values.items():
            filled.values[key] = self.fill(value, placed if key in PLACES else values)
        return filled

    def fill(self, node: Tree, values: Mapping[str, str]) -> Tree:
        """Return a node with values in place of all signs; raises BadSign."""
        if not self._has_signs(node):
            return node
        if isinstance(node, Leaf):
            return Leaf(node.place, put(str(node.value), node.place, values))
        if isinstance(node, Items):
            return Items(node.place, [self.fill(item, values) for item in node.items])
        filled = Fields(node.place)
        for key, value in node.values.items():
            name, place = put(key, node.keys[key], values), node.keys[key]
            if name in filled.values:
                raise BadSign(place, BadValue(f"a key that is given twice for {values['robot']}", name))
            filled.values[name], filled.keys[name] = self.fill(value, values), place
        return filled

    def _has_signs(self, node: Tree) -> bool:
        if isinstance(node, Leaf):
            return isinstance(node.value, str) and "$" in node.value
        known = self._with_signs.get(id(node))
        if known is None:
            if isinstance(node, Items):
                known = any(map(self._has_signs, node.items))
            else:
                known = any("$" in key for key in node.values) or any(map(self._has_signs, node.values.values()))
            self._with_signs[id(node)] = known
            self._looked.append(node)  # it is known by its id
        return known


def without_places_by_node(tree: Fields) -> None:
    """Take away from a tree as it is written where entries run that follows from their robots' nodes."""
    for name in ("templates", "players"):
        section = tree.values.get(name)
        for entry in section.values.values() if isinstance(section, Fields) else ():
            if not isinstance(entry, Fields):
                continue
            for key in PLACES:
                value = entry.values.get(key)
                if isinstance(value, Leaf) and isinstance(value.value, str) and NODE in value.value:
                    del entry.values[key], entry.keys[key]
