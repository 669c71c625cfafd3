"""Includes: files that hold sections of a deployment, as `include: [scenes/shelves.yaml]` names them.

Their sections come before those of the file that includes them. Mappings of the same section are put together; a key
that two files give is refused with both places. Paths are relative to the folder of the deployment's file, also those
in an included file, and lie inside it. A file that several include is read once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from foosim.common import limits
from foosim.common.errors import describe
from foosim.common.finding import path_text
from foosim.deployment.text.yaml import (
    NODES_MAX,
    Fields,
    Items,
    Leaf,
    Place,
    Problem,
    Tree,
    copied,
    locate_in,
    measure,
    plain,
    read_tree,
)
from foosim.world.scenery import path_problem

INCLUDE: Final = "include"
TREES_KEPT: Final = 16
"""Cached trees of files, for the next read with other settings."""


@dataclass(frozen=True, slots=True)
class Source:
    """The text of a deployment's file, and those of the files that it includes, by path."""

    text: str
    included: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Wanted:
    """A file to include, and the place of its include."""

    path: str
    place: Place
    index: int | None

    def problem(self, what: str) -> Problem:
        """Return the problem of this file."""
        location = (INCLUDE,) if self.index is None else (INCLUDE, self.index)
        return Problem(self.place, f"{path_text(location)}: {what}")


TextOf = Callable[[Wanted], str | None]
"""Returns the text of a file; None where it cannot be had."""


@lru_cache(maxsize=TREES_KEPT)
def _tree_of(text: str, file: str, rank: int) -> tuple[Tree | None, list[Problem]]:
    """The result of `read_tree`; it is not changed."""
    return read_tree(text, locate_in(file, rank))


def read_source(source: str | Source, name: str) -> tuple[Tree | None, list[Problem]]:
    """Return the tree of a text with its includes, and all problems; None where anything is refused.

    `name` is the file's in messages. The tree is the caller's own.
    """
    whole = source if isinstance(source, Source) else Source(source)
    texts, missing = dict(whole.included), []

    def text_of(wanted: Wanted) -> str | None:
        if wanted.path not in texts:
            what = "a text that came without its files, which has to stand alone"
            missing.append(wanted.problem(describe(what, wanted.path)))
        return texts.get(wanted.path)

    tree, problems = inlined(whole.text, name, text_of)
    return (None if tree is None else copied(tree)), [*problems, *missing]


def inlined(text: str, name: str, text_of: TextOf) -> tuple[Tree | None, list[Problem]]:
    """Return the tree of a deployment's text with its includes, read by `text_of`; it must not be changed."""
    tree, problems = _tree_of(text, name, 0)
    if not isinstance(tree, Fields) or INCLUDE not in tree.values:
        return tree, problems
    folder, _, file = name.rpartition("/")
    inliner = _Inliner(tree, folder, text_of)
    inliner.add(tree, (file,))
    return (inliner.tree if inliner.is_whole else None), [*problems, *inliner.problems]


class _Inliner:
    """Puts the sections of files together."""

    def __init__(self, root: Fields, folder: str, text_of: TextOf) -> None:
        self.tree = Fields(root.place)
        self.problems: list[Problem] = []
        self.is_whole = True
        self._folder = folder
        self._text_of = text_of
        self._files: list[str] = []
        self._bytes = 0
        self._nodes = measure(root)[1]

    def add(self, tree: Fields, chain: tuple[str, ...]) -> None:
        """Add the includes of a file, then its own sections. `chain` are the files on the path of includes to it."""
        for wanted in self._wanted(tree):
            problem = self._problem(wanted, chain)
            if problem:
                self._refuse(wanted.problem(describe(problem, wanted.path)))
            elif wanted.path not in self._files:
                self._include(wanted, chain)
        for key, value in tree.values.items():
            if key != INCLUDE:
                self._put(key, value, tree.keys[key])

    def _wanted(self, tree: Fields) -> Iterator[Wanted]:
        """Yield the files that one names."""
        node = tree.values.get(INCLUDE)
        if node is None:
            return
        for index, item in enumerate(node.items if isinstance(node, Items) else [node]):
            path = plain(item)
            wanted = Wanted(str(path), item.place, index if isinstance(node, Items) else None)
            if isinstance(path, str) and isinstance(item, Leaf):
                yield wanted
            else:
                self._refuse(wanted.problem(describe("not a path", path)))

    def _problem(self, wanted: Wanted, chain: tuple[str, ...]) -> str:
        if wanted.path in chain:
            circle = " includes ".join([*chain[chain.index(wanted.path) :], wanted.path])
            return f"a file that includes itself ({circle})"
        if wanted.path in self._files:
            return ""
        if len(self._files) == limits.INCLUDES_MAX:
            return f"more than {limits.INCLUDES_MAX} included files"
        if len(chain) > limits.INCLUDE_DEPTH_MAX:
            return f"more than {limits.INCLUDE_DEPTH_MAX} files that include one another"
        return path_problem(wanted.path, "the deployment's folder")

    def _include(self, wanted: Wanted, chain: tuple[str, ...]) -> None:
        self._files.append(wanted.path)
        text = self._text_of(wanted)
        if text is None:
            self.is_whole = False
            return
        self._bytes += len(text.encode())
        if self._bytes > limits.INCLUDED_BYTES_MAX:
            what = f"with it the included files have more than {limits.INCLUDED_BYTES_MAX} bytes"
            self._refuse(wanted.problem(describe(what, wanted.path)))
            return
        file = f"{self._folder}/{wanted.path}" if self._folder else wanted.path
        tree, problems = _tree_of(text, file, len(self._files))
        self.problems += problems
        if tree is None:
            self.is_whole = False
            return
        self._nodes += measure(tree)[1]
        if not isinstance(tree, Fields):
            self._refuse(Problem(tree.place, describe("not a mapping of sections", plain(tree))))
        elif self._nodes > NODES_MAX:
            self._refuse(wanted.problem(f"with it there are more than {NODES_MAX} nodes"))
        else:
            self.add(tree, (*chain, wanted.path))

    def _put(self, key: str, value: Tree, place: Place) -> None:
        """Add one section, or what of it is not there yet."""
        there = self.tree.values.get(key)
        if there is None:
            own = Fields(value.place, dict(value.values), dict(value.keys)) if isinstance(value, Fields) else value
            self.tree.values[key], self.tree.keys[key] = own, place
        elif isinstance(there, Fields) and isinstance(value, Fields):
            for name, inner in value.values.items():
                if name in there.values:
                    self._refuse_twice((key, name), value.keys[name], there.keys[name])
                else:
                    there.values[name], there.keys[name] = inner, value.keys[name]
        else:
            self._refuse_twice((key,), place, self.tree.keys[key])

    def _refuse_twice(self, path: tuple[str, ...], place: Place, first: Place) -> None:
        self.problems.append(Problem(place, f"{path_text(path)}: a key that two files give, also at {first}"))

    def _refuse(self, problem: Problem) -> None:
        self.problems.append(problem)
        self.is_whole = False
