"""YAML from outside, read into a small tree with the place of each node, and written back.

PyYAML composes the nodes, by its pure-Python parser: the C loader crashes on deep nesting. Anchors, aliases, tags and
merge keys, and texts that are too large, too deep or too numerous, are refused before they are composed; all problems
are reported together. No object is constructed by PyYAML. Scalars have the values of YAML 1.2's core schema: `on`, `no`
and `12:30:45` are text, `1e5` is a number. Keys are always text.
"""

import json
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final

import yaml

from foosim.common import limits
from foosim.common.errors import describe

DEPTH_MAX: Final = 16
NODES_MAX: Final = 20_000
NUMBER_LENGTH_MAX: Final = 40
KEY_LENGTH_MAX: Final = 512
"""Longer keys are written after a question mark: readers search for a colon within 1,024 characters."""
SETS_RANK: Final = 1_000
"""The rank of places in settings of a command line: files are before it."""

_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_NULL = re.compile(r"null|Null|NULL|~|")
_BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
# Names, paths, selectors and quantities, which no version of YAML reads as anything but text, but for some words.
_PLAIN = re.compile(r"[A-Za-z_](?:[\w./*?:%-]*[\w/*?%-])?|-?[0-9]+(?:\.[0-9]+)? [A-Za-z%][A-Za-z0-9%/]*", re.ASCII)
_WORDS = frozenset(("y", "n", "yes", "no", "on", "off", "true", "false", "null"))


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A place in a file: line and column from 1, in characters.

    `rank` orders files: the deployment's is 0, its includes follow, then settings of a command line.
    """

    rank: int
    line: int
    column: int
    file: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True, order=True)
class Problem:
    """One line of an error report."""

    place: Place
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


Scalar = bool | int | float | str | None


@dataclass(slots=True)
class Leaf:
    """A scalar."""

    place: Place
    value: Scalar


@dataclass(slots=True)
class Items:
    """A sequence."""

    place: Place
    items: "list[Tree]" = field(default_factory=list)


@dataclass(slots=True)
class Fields:
    """A mapping: the value and the place of each key."""

    place: Place
    values: "dict[str, Tree]" = field(default_factory=dict)
    keys: dict[str, Place] = field(default_factory=dict)


Tree = Leaf | Items | Fields

Locate = Callable[[int, int, int], Place]
"""From index in the text, line and column, which PyYAML counts from 0, to a place."""


class _Stop(Exception):
    """The rest of the text is not read."""


def locate_in(file: str, rank: int = 0) -> Locate:
    """Return the function that gives places in a file of that name."""
    return lambda index, line, column: Place(rank, line + 1, column + 1, file)


def read_tree(text: str, locate: Locate) -> tuple[Tree | None, list[Problem]]:
    """Return the tree of the one document in `text`, and every problem. The tree is None where anything is refused.

    A duplicate key is a problem that leaves a tree, with the first value, so that the schema's problems can be reported
    together with it.
    """
    start = locate(0, 0, 0)
    if (size := len(text.encode("utf-8", "surrogatepass"))) > limits.DEPLOYMENT_BYTES_MAX:
        return None, [Problem(start, describe(f"more than {limits.DEPLOYMENT_BYTES_MAX} bytes", size))]
    try:
        composer = _Composer(text, locate)
    except yaml.reader.ReaderError as error:
        before = text[: error.position]
        place = locate(len(before), before.count("\n"), len(before) - before.rfind("\n") - 1)
        return None, [Problem(place, describe("a character that YAML does not allow", text[error.position]))]
    tree = None
    try:
        if not composer.check_node():
            return None, [Problem(start, describe("no YAML document", text[:40]))]
        tree = composer.tree(composer.get_node())
        if composer.check_node():
            second = composer.peek_event()  # type: ignore[no-untyped-call]
            composer.refuse(second, "more than one YAML document", "---")
    except _Stop:
        pass
    except yaml.MarkedYAMLError as error:
        what = ", ".join(part for part in (error.problem, error.context) if part)
        place = start if error.problem_mark is None else composer.place(error.problem_mark)
        composer.refusals.append(Problem(place, f"not valid YAML, {what}"))
    except (ValueError, OverflowError):
        # PyYAML's scanner passes absurd escapes and versions to chr() and int(), and their errors on.
        what = describe("not valid YAML", "a number out of range")
        composer.refusals.append(Problem(composer.place(composer.get_mark()), what))
    finally:
        composer.dispose()
    return (None if composer.refusals else tree), sorted({*composer.refusals, *composer.duplicates})


class _Composer(yaml.SafeLoader):
    """PyYAML's composer, with refusals and bounds that are checked before it descends."""

    def __init__(self, text: str, locate: Locate) -> None:
        super().__init__(text)
        self.refusals: list[Problem] = []
        self.duplicates: list[Problem] = []
        self._locate = locate
        self._depth = self._count = 0

    def place(self, mark: Any) -> Place:
        return self._locate(mark.index, mark.line, mark.column)

    def refuse(self, at: yaml.Event | yaml.Node, what: str, value: object) -> None:
        self.refusals.append(Problem(self.place(at.start_mark), describe(what, value)))

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        self._count += 1
        is_alias = isinstance(event, yaml.AliasEvent)
        if is_alias:
            self.refuse(event, _refused("aliases", "*"), f"*{event.anchor}")
        elif event.anchor is not None:
            self.refuse(event, _refused("anchors", "&"), f"&{event.anchor}")
        if getattr(event, "tag", None) is not None:
            self.refuse(event, _refused("tags", "!"), event.tag)
        if isinstance(parent, yaml.MappingNode) and index is None and not isinstance(event, yaml.ScalarEvent):
            self._stop(event, "a key is a text", "a collection or an alias")
        is_collection = isinstance(event, yaml.CollectionStartEvent)
        if self._count > NODES_MAX:
            self._stop(event, f"more than {NODES_MAX} nodes", self._count)
        if is_collection and self._depth == DEPTH_MAX:
            self._stop(event, f"nested more than {DEPTH_MAX} deep", DEPTH_MAX + 1)
        if is_alias:
            self.get_event()  # type: ignore[no-untyped-call]
            return yaml.ScalarNode("", "", event.start_mark, event.end_mark)
        event.anchor = None  # refused already: a second one of the name would end the reading
        self._depth += is_collection
        node: yaml.Node | None = super().compose_node(parent, index)
        self._depth -= is_collection
        return node

    def _stop(self, at: yaml.Event, what: str, value: object) -> None:
        self.refuse(at, what, value)
        raise _Stop

    def tree(self, node: Any) -> Tree:
        """Return the tree of a node, whose depth is bounded."""
        place = self.place(node.start_mark)
        if isinstance(node, yaml.ScalarNode):
            return Leaf(place, self._scalar(node))
        if isinstance(node, yaml.SequenceNode):
            return Items(place, [self.tree(item) for item in node.value])
        fields = Fields(place)
        for key, value in node.value:
            name, at, child = self._text(key), self.place(key.start_mark), self.tree(value)
            if name == "<<" and key.style is None:
                self.refuse(key, "merge keys are refused", name)
            if (first := fields.keys.get(name)) is not None:
                self.duplicates.append(Problem(at, describe(f"duplicate key (first in line {first.line})", name)))
                continue
            fields.values[name], fields.keys[name] = child, at
        return fields

    def _text(self, node: yaml.ScalarNode) -> str:
        text: str = node.value
        if any("\ud800" <= character <= "\udfff" for character in text):
            self.refuse(node, "half a character (a lone surrogate)", text)
        return text

    def _scalar(self, node: yaml.ScalarNode) -> Scalar:
        text = self._text(node)
        try:
            return text if node.style else resolve(text)
        except ValueError as error:
            self.refuse(node, str(error), text)
            return None


def _refused(what: str, sign: str) -> str:
    return f"{what} are refused (a text that begins with {sign} needs quotes)"


def resolve(text: str) -> Scalar:
    """Return the value of a plain scalar by YAML 1.2's core schema; raises ValueError for a number out of bounds."""
    if _NULL.fullmatch(text):
        return None
    if _BOOL.fullmatch(text):
        return text[0] in "tT"
    is_int = _INT.fullmatch(text) is not None
    if is_int or _FLOAT.fullmatch(text):
        if len(text) > NUMBER_LENGTH_MAX:
            raise ValueError(f"a number of more than {NUMBER_LENGTH_MAX} characters")
        value = int(text, {"0o": 8, "0x": 16}.get(text[:2], 10)) if is_int else float(text)
        if math.isinf(value):
            raise ValueError("a number is finite")
        return value
    if _NOT_FINITE.fullmatch(text):
        raise ValueError("a number is finite")
    return text


def plain(tree: Tree) -> Any:
    """Return the tree as new dicts, lists and scalars; a node that is met again is one value.

    The entries of an expanded tree share what they have from a template.
    """
    known: dict[int, Any] = {}

    def of(node: Tree) -> Any:
        if isinstance(node, Leaf):
            return node.value
        value = known.get(id(node))
        if value is None:
            if isinstance(node, Items):
                value = [of(item) for item in node.items]
            else:
                value = {key: of(inner) for key, inner in node.values.items()}
            known[id(node)] = value
        return value

    return of(tree)


def copied(tree: Tree) -> Tree:
    """Return a copy of the tree; scalars are shared."""
    if isinstance(tree, Items):
        return Items(tree.place, [copied(item) for item in tree.items])
    if isinstance(tree, Fields):
        return Fields(tree.place, {key: copied(value) for key, value in tree.values.items()}, dict(tree.keys))
    return tree


def measure(tree: Tree, known: dict[int, tuple[int, int]] | None = None) -> tuple[int, int]:
    """Return depth of nesting and number of nodes, keys included, as the reader counts them.

    `known` keeps the sizes of nodes by id, so that what entries of an expanded tree share is measured once.
    """
    if isinstance(tree, Leaf):
        return 0, 1
    if known is not None and (size := known.get(id(tree))) is not None:
        return size
    children = tree.items if isinstance(tree, Items) else list(tree.values.values())
    keys = len(children) if isinstance(tree, Fields) else 0
    sizes = [measure(child, known) for child in children]
    size = 1 + max((depth for depth, _ in sizes), default=0), 1 + keys + sum(nodes for _, nodes in sizes)
    if known is not None:
        known[id(tree)] = size
    return size


def write_yaml(data: Any) -> str:
    """Return plain data as block style YAML, in its order, without comments; `read_tree` reads the same data back.

    PyYAML would take ten times as long: a second for some thousand robots. Texts that some version of YAML may read as
    anything else are in double quotes.
    """
    return "".join(_lines(data, "", "")) if isinstance(data, dict | list) and data else f"{_scalar(data)}\n"


def _lines(data: dict[Any, Any] | list[Any], first: str, indent: str) -> Iterator[str]:
    """Yield the lines of a non-empty collection. `first` begins its first line, `indent` the others."""
    entries = enumerate(data) if isinstance(data, list) else data.items()
    for key, value in entries:
        begin = f"{first}-" if isinstance(data, list) else f"{first}{_scalar(key)}:"
        if len(begin) > KEY_LENGTH_MAX:
            yield f"{first}? {_scalar(key)}\n"
            begin = f"{indent}:"
        first = indent
        if not (isinstance(value, dict | list) and value):
            yield f"{begin} {_scalar(value)}\n"
        elif isinstance(data, list):
            yield from _lines(value, f"{begin} ", f"{indent}  ")
        else:
            yield f"{begin}\n"
            inner = indent if isinstance(value, list) else f"{indent}  "
            yield from _lines(value, inner, inner)


def _scalar(value: Any) -> str:
    """Return the text of a scalar or of an empty collection."""
    if isinstance(value, float):
        text = repr(value)
        return text if "." in text else text.replace("e", ".0e")  # a text in YAML 1.1 without a point
    if isinstance(value, str) and _PLAIN.fullmatch(value) and value.lower() not in _WORDS:
        return value
    text = json.dumps(value, ensure_ascii=False)
    return text if text.isprintable() else "".join(one if one.isprintable() else f"\\U{ord(one):08x}" for one in text)
