"""Settings of a command line, `--set a.b=VALUE`, placed in the tree of a deployment file.

The path consists of keys joined by dots, as in messages: `robots.arm.sensors.encoder.rate`. Where names have dots, the
longest key that fits is meant; a new one is written in double quotes. An entry of a list is named by its number, `[0]`
or `.0`, or by its `id`. The value is YAML. Settings apply in order; their places are `--set:N:COLUMN`, N counting
settings from 1.

A step with `*` or `?` is a pattern of whole keys (fnmatch, case-sensitive), of numbers and ids in a list, unless a key
is exactly that. The value is set wherever all of the path but its last key is there: `robots.*.sensors.pose.rate` in
the robots that have a sensor `pose`, whether or not its rate is written. A last step that is a pattern matches keys
that are there. A `*` matches dots as well, and neighbouring steps may be one key with dots, so that `robots.red.*` and
`robots."red.*"` are the robots whose names begin with `red.`. A path without a match is an error.

They apply to the file as it is written. A path may lead through what an entry has by a template or a count: then the
entry gets keys of its own, as if they were written in the file.
"""

import re
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any, Final

from foosim.common.errors import DeploymentError, UnknownName, describe, show
from foosim.common.names import nearest_name, quoted
from foosim.deployment.components import SECTIONS
from foosim.deployment.schema import Deployment
from foosim.deployment.text.expand import ENTRIES, Expansion
from foosim.deployment.text.report import Report, Stopped
from foosim.deployment.text.templates import TEMPLATES
from foosim.deployment.text.yaml import (
    SETS_RANK,
    Fields,
    Items,
    Leaf,
    Place,
    Problem,
    Tree,
    copied,
    plain,
    read_tree,
)

ENTRIES_SHOWN_MAX: Final = 8
SETS_MAX: Final = 256
SET_LENGTH_MAX: Final = 4096
NAMED: Final = {TEMPLATES, *ENTRIES, *SECTIONS, "nodes", "gateways", "hosts", "radios", "places", "surfaces"}
"""The sections whose keys are names."""

_STEP = re.compile(r'(?:"(?P<quoted>[^"]*)"|(?P<plain>[^".=\[\]]+))')
_PATTERN = re.compile(r"[*?]")
_INDEX = re.compile(r"\[(?P<index>[0-9]+)\]")


class _Misplaced(Exception):
    """A setting cannot be placed."""

    def __init__(self, column: int, text: str) -> None:
        super().__init__(text)
        self.column = column
        self.text = text


def place_sets(tree: Tree, sets: Sequence[str]) -> tuple[Tree, list[Problem]]:
    """The tree with all settings that could be placed, and the problems of the others. `tree` itself is changed."""
    problems: list[Problem] = []
    if len(sets) > SETS_MAX:
        return tree, [Problem(_place(SETS_MAX + 1, 1), describe(f"more than {SETS_MAX} settings", len(sets)))]
    for number, text in enumerate(sets, 1):
        try:
            steps, start = _read_path(text)
            value, value_problems = _read_value(text, start, number)
            problems += value_problems
            if value is not None:
                sections: dict[str, Tree | None] = {}
                for path in _paths(_Taken(tree, sections), steps):
                    _put(_Taken(tree, sections), path, copied(value), number)
        except _Misplaced as misplaced:
            problems.append(Problem(_place(number, misplaced.column), misplaced.text))
    return tree, problems


def nested(sets: Sequence[str]) -> dict[str, Any]:
    """Return arguments `a.b=VALUE` as nested plain data; raises DeploymentError with all problems."""
    tree = Fields(_place(1, 1))
    problems: list[str] = []
    for number, text in enumerate(sets, 1):
        try:
            steps, start = _read_path(text)
            value, value_problems = _read_value(text, start, number)
            problems += [_of_argument(text, problem.text) for problem in value_problems]
            node = tree
            for step, column in steps[:-1]:
                inner = node.values.setdefault(step, Fields(_place(number, column)))
                if not isinstance(inner, Fields):
                    raise _Misplaced(column, describe("set inside a value other than a mapping", step))
                node = inner
            if value is not None:
                node.values[steps[-1][0]] = value
        except _Misplaced as misplaced:
            problems.append(_of_argument(text, misplaced.text))
    if problems:
        raise DeploymentError(problems)
    content = plain(tree)
    assert isinstance(content, dict), "a mapping"
    return content


def _of_argument(text: str, problem: str) -> str:
    """Raise the error of an argument, with its text once."""
    line = f"KEY=VALUE: {problem}"
    return line if line.endswith(show(text)) else f"{line}, {show(text)}"


def _place(number: int, column: int) -> Place:
    return Place(SETS_RANK + number, number, column, "--set")


def _read_path(text: str) -> tuple[list[tuple[str, int]], int]:
    """The steps of the path with their columns, and the index at which the value starts."""
    if len(text) > SET_LENGTH_MAX:
        raise _Misplaced(1, describe(f"more than {SET_LENGTH_MAX} characters", len(text)))
    steps = []
    index = 0
    while (match := _STEP.match(text, index)) is not None:
        while match is not None:
            steps.append((next(part for part in match.groups() if part is not None), index + 1))
            index = match.end()
            match = _INDEX.match(text, index)
        if text[index : index + 1] == "=":
            return steps, index + 1
        if text[index : index + 1] != ".":
            break
        index += 1
    raise _Misplaced(index + 1, describe("not of the form key.key=VALUE", text))


def _read_value(text: str, start: int, number: int) -> tuple[Tree | None, list[Problem]]:
    def locate(index: int, line: int, column: int) -> Place:
        return _place(number, start + index + 1)

    value = text[start:]
    if not value.strip():
        return Leaf(_place(number, start + 1), None), []
    return read_tree(value, locate)


def _paths(taken: "_Taken", steps: Sequence[tuple[str, int]]) -> list[list[tuple[str, int]]]:
    """The paths that the steps stand for: themselves where none of them is a pattern."""
    if not any(_PATTERN.search(step) for step, _ in steps):
        return [[*steps]]
    missed: dict[int, set[str]] = {}
    if not (paths := _matching(taken, steps, 0, missed)) and None not in taken.sections.values():
        last = max(missed)
        raise _misplaced(steps, last, str(UnknownName("nothing matches", steps[last][0], missed[last])))
    return paths


def _misplaced(steps: Sequence[tuple[str, int]], index: int, text: str) -> _Misplaced:
    path = ".".join(step for step, _ in steps[:index])
    return _Misplaced(steps[index][1], f"{path}: {text}" if path else text)


def _matching(
    taken: "_Taken", steps: Sequence[tuple[str, int]], index: int, missed: dict[int, set[str]]
) -> list[list[tuple[str, int]]]:
    """The ends of paths that the steps from `index` stand for; `missed` gets the names that are there, by index."""
    there = taken.at()
    keys = {name: name for name in taken.names()}
    if isinstance(there, Items):
        numbers = [str(number) for number in range(len(there.items))]
        keys = {name: str(number) for name, number in _ids(there).items()} | dict(zip(numbers, numbers, strict=True))
    missed.setdefault(index, set()).update(keys)
    dots = max((name.count(".") for name in keys), default=0)
    paths = []
    for stop in range(index + 1, min(index + 1 + dots, len(steps)) + 1):
        text = ".".join(step for step, _ in steps[index:stop])
        if text in keys:
            matches = [keys[text]]
        elif _PATTERN.search(text):
            matches = list(dict.fromkeys(key for name, key in keys.items() if fnmatchcase(name, text)))
        else:
            is_new = isinstance(there, Fields) and index + 1 == stop == len(steps)
            matches = [text] if is_new else []
        for key in matches:
            further = _Taken(taken.tree, taken.sections, [*taken.steps, int(key) if isinstance(there, Items) else key])
            ends = [[]] if stop == len(steps) else _matching(further, steps, stop, missed)
            paths += [[(key, steps[index][1]), *end] for end in ends]
    return paths


def _put(taken: "_Taken", steps: Sequence[tuple[str, int]], value: Tree, number: int) -> None:
    """Replace or add the value at the path, whose start is `taken`."""
    node = tree = taken.tree
    index = 0
    while True:
        if isinstance(node, Items):
            entry = _entry(node, *steps[index])
            if index + 1 == len(steps):
                node.items[entry] = value
                return
            node = node.items[entry]
            index += 1
            taken.steps.append(entry)
            continue
        if not isinstance(node, Fields):
            raise _Misplaced(steps[index][1], describe("set inside a value other than a mapping", steps[index][0]))
        key, used = _key(node.values, steps, index) or _key(taken.names(), steps, index) or (steps[index][0], 1)
        if index + used == len(steps):
            if taken.steps[:1] == [TEMPLATES] and plain(value) is None and key in node.values:
                del node.keys[key], node.values[key]  # a null of a template with nothing below it would stay
                if key not in _Taken(tree, {}, taken.steps).names():
                    return
            node.keys[key] = _place(number, steps[index][1])
            node.values[key] = value
            return
        if key not in node.values:
            _open(taken, node, key, steps, index, number)
        node = node.values[key]
        index += used
        taken.steps.append(key)


@dataclass(slots=True)
class _Taken:
    """The path through a tree so far, in the tree with expanded templates and counts."""

    tree: Tree
    sections: dict[str, Tree | None]
    """Of the expanded tree, from their first use on; None for an invalid one. All paths of a setting share them."""
    steps: list[str | int] = field(default_factory=list)

    def names(self) -> Collection[str]:
        """The keys of the mapping at its end."""
        there = self.at()
        return there.values if isinstance(there, Fields) else ()

    def at(self, *more: str) -> Tree | None:
        """The node at its end, or some steps further."""
        way = [*self.steps, *more]
        if not way or not isinstance(self.tree, Fields):
            return self.tree if not way else None
        if (name := str(way[0])) not in self.sections:
            self.sections[name] = None
            with suppress(Stopped):
                self.sections[name] = Expansion(self.tree, Report()).section(name)
        node = self.sections[name]
        for step in way[1:]:
            if isinstance(node, Fields) and isinstance(step, str):
                node = node.values.get(step)
            elif isinstance(node, Items) and isinstance(step, int) and step < len(node.items):
                node = node.items[step]
            else:
                return None
        return node


def _key(keys: Collection[str], steps: Sequence[tuple[str, int]], index: int) -> tuple[str, int] | None:
    """The longest key of a mapping that matches the rest of the path, and its number of steps."""
    for used in range(len(steps) - index, 0, -1):
        key = ".".join(step for step, _ in steps[index : index + used])
        if key in keys:
            return key, used
    return None


def _open(taken: _Taken, node: Fields, key: str, steps: Sequence[tuple[str, int]], index: int, number: int) -> None:
    """Add the value that a key on the way has by a template or a count, or an empty mapping for a section that is left
    out, which is checked with the file; a missing name on the way is an error."""
    place = _place(number, steps[index][1])
    names = taken.names()
    if key in names:
        there = taken.at(key)
        node.keys[key] = place
        node.values[key] = Fields(place) if there is None or isinstance(there, Fields) else copied(there)
        return
    if taken.steps[-1] not in NAMED if taken.steps else key in Deployment.model_fields or key == TEMPLATES:
        node.keys[key], node.values[key] = place, Fields(place)
        return
    nearest = None
    for stop in range(len(steps) - 1, index, -1):
        name = ".".join(step for step, _ in steps[index:stop])
        if nearest is None and (nearest := nearest_name(name, {*node.values, *names})) is not None:
            key = name
    raise _misplaced(steps, index, describe("unknown key", key, quoted(nearest)))


def _entry(node: Items, step: str, column: int) -> int:
    """The index of a list's entry, from its number or its id."""
    if step.isascii() and step.isdigit() and len(step) < 6 and int(step) < len(node.items):
        return int(step)
    ids = _ids(node)
    if step in ids:
        return ids[step]
    named = {index: name for name, index in ids.items()}
    entries = [f"{index} (id {named[index]})" if index in named else str(index) for index in range(len(node.items))]
    more = ", ..." if len(entries) > ENTRIES_SHOWN_MAX else ""
    choices = f"the list has {', '.join(entries[:ENTRIES_SHOWN_MAX])}{more}" if entries else "the list is empty"
    raise _Misplaced(column, f"no such entry, {show(step)}: {choices}")


def _ids(node: Items) -> dict[str, int]:
    """The indices of a list's entries by their ids."""
    ids: dict[str, int] = {}
    for index, item in enumerate(node.items):
        name = item.values.get("id") if isinstance(item, Fields) else None
        if isinstance(name, Leaf) and isinstance(name.value, str):
            ids.setdefault(name.value, index)
    return ids
