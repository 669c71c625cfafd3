"""YAML from outside, read into a small tree that knows where everything stands, and written back.

Only the events of PyYAML's pure-Python parser are used: no object is constructed by PyYAML, nothing recurses, and the
C loader (which crashes on deep nesting) is never called. Anchors, aliases, tags and merge keys are refused, as are
texts that are too big, too deep or too numerous; all of them are reported together. Scalars mean what YAML 1.2's core
schema says: `on`, `no` and `12:30:45` are text, `1e5` is a number. Keys are always text.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

import yaml

from foosim.common import limits
from foosim.common.errors import describe

DEPTH_MAX: Final = 16
NODES_MAX: Final = 20_000
NUMBER_LENGTH_MAX: Final = 40

_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_NULL = re.compile(r"null|Null|NULL|~|")
_BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """Where something stands: counted from 1, columns in characters. `rank` orders files, the deployment first."""

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
    """A mapping: each key's value, and where the key stands."""

    place: Place
    values: "dict[str, Tree]" = field(default_factory=dict)
    keys: dict[str, Place] = field(default_factory=dict)


Tree = Leaf | Items | Fields

Locate = Callable[[int, int, int], Place]
"""From what PyYAML counts from 0, the index in the text, the line and the column, to a place."""


class _Stop(Exception):
    """The rest of the text is not worth reading, or not readable."""


def locate_in(file: str) -> Locate:
    """Places in a file of that name."""
    return lambda index, line, column: Place(0, line + 1, column + 1, file)


def read_tree(text: str, locate: Locate) -> tuple[Tree | None, list[Problem]]:
    """The tree of the one document in `text`, and every problem. The tree is None unless the text is harmless.

    Duplicate keys are a problem too, but leave a tree (with the first value), so that the schema's problems can be
    reported in the same breath.
    """
    reader = _Reader(locate)
    harmless = reader.read(text)
    return (reader.root if harmless else None), sorted(set(reader.problems))


class _Reader:
    """Builds the tree from parser events with a stack of its own."""

    def __init__(self, locate: Locate) -> None:
        self.root: Tree | None = None
        self.problems: list[Problem] = []
        self._locate = locate
        self._stack: list[Items | Fields] = []
        # For each open collection the key whose value comes next: None where a key comes next, and in sequences.
        self._keys: list[tuple[str, Place] | None] = []
        self._nodes = 0
        self._documents = 0
        self._harmless = True

    def read(self, text: str) -> bool:
        size = len(text.encode("utf-8", "surrogatepass"))
        try:
            if size > limits.DEPLOYMENT_BYTES_MAX:
                raise self._stop(self._locate(0, 0, 0), f"more than {limits.DEPLOYMENT_BYTES_MAX} bytes", size)
            self._read_events(text)
        except _Stop:
            return False
        if self._documents == 0:
            self._refuse(self._locate(0, 0, 0), "no YAML document", text[:40])
        return self._harmless

    def _read_events(self, text: str) -> None:
        try:
            loader = yaml.SafeLoader(text)
        except yaml.reader.ReaderError as error:
            before = text[: error.position]
            line_start = before.rfind("\n") + 1
            place = self._locate(len(before), before.count("\n"), len(before) - line_start)
            raise self._stop(place, "a character that YAML does not allow", text[error.position]) from None
        try:
            while loader.check_event():
                self._take(loader.get_event())  # type: ignore[no-untyped-call]
        except yaml.MarkedYAMLError as error:
            what = ", ".join(part for part in (error.problem, error.context) if part)
            self.problems.append(Problem(self._at(error.problem_mark), f"not valid YAML, {what}"))
            raise _Stop from None
        except (ValueError, OverflowError):
            # PyYAML's scanner passes absurd escapes and versions to chr() and int(), and their errors on.
            raise self._stop(self._at(loader.get_mark()), "not valid YAML", "a number out of range") from None
        finally:
            loader.dispose()

    def _at(self, mark: Any) -> Place:
        return self._locate(0, 0, 0) if mark is None else self._locate(mark.index, mark.line, mark.column)

    def _take(self, event: yaml.Event) -> None:
        place = self._at(event.start_mark)
        if isinstance(event, yaml.DocumentStartEvent):
            self._documents += 1
            if self._documents > 1:
                raise self._stop(place, "more than one YAML document", "---")
        elif isinstance(event, yaml.AliasEvent):
            self._count(place)
            self._refuse(place, _refused("aliases", "*"), f"*{event.anchor}")
            self._add(Leaf(place, None))
        elif isinstance(event, yaml.ScalarEvent):
            self._open(event, place)
            self._scalar(event, place)
        elif isinstance(event, yaml.CollectionStartEvent):
            self._open(event, place)
            node = Items(place) if isinstance(event, yaml.SequenceStartEvent) else Fields(place)
            self._add(node)
            self._stack.append(node)
            self._keys.append(None)
            if len(self._stack) > DEPTH_MAX:
                raise self._stop(place, f"nested more than {DEPTH_MAX} deep", len(self._stack))
        elif isinstance(event, yaml.CollectionEndEvent):
            self._stack.pop()
            self._keys.pop()

    def _open(self, event: yaml.ScalarEvent | yaml.CollectionStartEvent, place: Place) -> None:
        self._count(place)
        if event.anchor is not None:
            self._refuse(place, _refused("anchors", "&"), f"&{event.anchor}")
        if event.tag is not None:
            self._refuse(place, _refused("tags", "!"), event.tag)

    def _count(self, place: Place) -> None:
        self._nodes += 1
        if self._nodes > NODES_MAX:
            raise self._stop(place, f"more than {NODES_MAX} nodes", self._nodes)

    def _scalar(self, event: yaml.ScalarEvent, place: Place) -> None:
        text = event.value
        if any("\ud800" <= character <= "\udfff" for character in text):
            self._refuse(place, "half a character (a lone surrogate)", text)
        if self._stack and isinstance(self._stack[-1], Fields) and self._keys[-1] is None:
            if text == "<<" and event.implicit[0]:
                self._refuse(place, "merge keys are refused", text)
            self._keys[-1] = (text, place)
            return
        value: Scalar = text
        if event.implicit[0] and event.tag is None:
            try:
                value = resolve(text)
            except ValueError as error:
                self._refuse(place, str(error), text)
        self._add(Leaf(place, value))

    def _add(self, node: Tree) -> None:
        if not self._stack:
            self.root = node
            return
        parent = self._stack[-1]
        if isinstance(parent, Items):
            parent.items.append(node)
            return
        if self._keys[-1] is None:
            raise self._stop(node.place, "a key is a text", "a collection or an alias")
        name, place = self._keys[-1]
        self._keys[-1] = None
        if name in parent.values:
            first = parent.keys[name]
            self.problems.append(Problem(place, describe(f"duplicate key (first in line {first.line})", name)))
        else:
            parent.values[name] = node
            parent.keys[name] = place

    def _refuse(self, place: Place, what: str, value: object) -> None:
        self._harmless = False
        self.problems.append(Problem(place, describe(what, value)))

    def _stop(self, place: Place, what: str, value: object) -> _Stop:
        self._refuse(place, what, value)
        return _Stop()


def _refused(what: str, sign: str) -> str:
    return f"{what} are refused (a text that begins with {sign} needs quotes)"


def resolve(text: str) -> Scalar:
    """What a plain scalar means by YAML 1.2's core schema; ValueError if it is a number that is not usable."""
    if _NULL.fullmatch(text):
        return None
    if _BOOL.fullmatch(text):
        return text[0] in "tT"
    is_int = _INT.fullmatch(text) is not None
    if is_int or _FLOAT.fullmatch(text):
        if len(text) > NUMBER_LENGTH_MAX:
            raise ValueError(f"a number of more than {NUMBER_LENGTH_MAX} characters")
        value = _integer(text) if is_int else float(text)
        if math.isinf(value):
            raise ValueError("a number is finite")
        return value
    if _NOT_FINITE.fullmatch(text):
        raise ValueError("a number is finite")
    return text


def _integer(text: str) -> int:
    base = {"0o": 8, "0x": 16}.get(text[:2], 10)
    return int(text, base)


def plain(tree: Tree) -> Any:
    """The tree as dicts, lists and scalars, all fresh."""
    if isinstance(tree, Leaf):
        return tree.value
    if isinstance(tree, Items):
        return [plain(item) for item in tree.items]
    return {key: plain(value) for key, value in tree.values.items()}


def copied(tree: Tree) -> Tree:
    """The tree with collections of its own: changing them leaves the other as it is. Scalars are shared."""
    if isinstance(tree, Items):
        return Items(tree.place, [copied(item) for item in tree.items])
    if isinstance(tree, Fields):
        return Fields(tree.place, {key: copied(value) for key, value in tree.values.items()}, dict(tree.keys))
    return tree


def measure(tree: Tree) -> tuple[int, int]:
    """Depth of nesting and number of nodes (keys too), as the reader counts them."""
    if isinstance(tree, Leaf):
        return 0, 1
    children = tree.items if isinstance(tree, Items) else list(tree.values.values())
    keys = len(children) if isinstance(tree, Fields) else 0
    sizes = [measure(child) for child in children]
    return 1 + max((depth for depth, _ in sizes), default=0), 1 + keys + sum(nodes for _, nodes in sizes)


class _Dumper(yaml.SafeDumper):
    """Writes so that `resolve` reads the same back: quotes what YAML 1.2 needs quoted beside what YAML 1.1 does."""


for _tag, _pattern, _first in (
    ("null", _NULL, ["~", "n", "N", ""]),
    ("bool", _BOOL, list("tTfF")),
    ("int", _INT, list("-+0123456789")),
    ("float", re.compile(f"{_FLOAT.pattern}|{_NOT_FINITE.pattern}"), list("-+.0123456789")),
):
    _Dumper.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(f"(?:{_pattern.pattern})$"), _first)


def write_yaml(data: Any) -> str:
    """Plain data as block style YAML, in the order given, without comments; `read_tree` reads the same data back."""
    text = yaml.dump(
        data, Dumper=_Dumper, default_flow_style=False, sort_keys=False, allow_unicode=True, width=1_000_000
    )
    assert isinstance(text, str)
    return text
