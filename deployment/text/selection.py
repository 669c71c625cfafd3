"""Selectors of names in a deployment's text: globs (`scout-*`), and ranges of numbers (`scout01..20`).

A range selects those of its names that there are; numbers are written as the first one is, with zeros before them or
without. What the wildcards match, or the number of a range, is what `$1`, `$2`... stand for where an entry is made for
each robot (made.py).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Final

from foosim.common import limits
from foosim.common.errors import BadValue
from foosim.common.names import SELECTOR_LENGTH_MAX, is_selector

Chosen = tuple[str, tuple[str, ...]]
"""A name, and the texts that the wildcards match in it."""

_RANGE: Final = re.compile(r"(?P<stem>[a-z][a-z0-9_.-]*?)(?P<first>[0-9]{1,9})\.\.(?P<last>[0-9]{1,9})")
_SIGNS: Final = re.compile(r"[*?]")


def is_several(text: str) -> bool:
    """Whether a text stands for several names: a glob, or a range."""
    return len(text) <= SELECTOR_LENGTH_MAX and is_selector(text) and (bool(_SIGNS.search(text)) or ".." in text)


class Selector:
    """A glob, a range or a name, and what its wildcards match. Raises BadValue for an invalid text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._span: tuple[int, int, int] | None = None
        found = _RANGE.fullmatch(text)
        if found is not None:
            first, last = int(found["first"]), int(found["last"])
            if last < first:
                raise BadValue("a range that ends before it begins", text)
            width = len(found["first"]) if found["first"].startswith("0") else 0
            self._span = first, last, width
            self._pattern = re.compile(re.escape(found["stem"]) + "([0-9]{1,9})")
        elif ".." in text or not is_selector(text):
            raise BadValue(
                "not a selector (a name, in which * and ? stand for anything, or a range as in a-1..9)", text
            )
        else:
            self._pattern = _glob(text)

    def match(self, name: str) -> tuple[str, ...] | None:
        """Return the texts that the wildcards match, None for a name outside the selection."""
        found = self._pattern.fullmatch(name)
        if found is None:
            return None
        if self._span is not None:
            first, last, width = self._span
            number = int(found[1])
            if not first <= number <= last or found[1] != str(number).zfill(width):
                return None
        return found.groups()


@lru_cache(maxsize=256)
def _glob(text: str) -> re.Pattern[str]:
    """Return the pattern of a glob.

    A * matches as little as possible, without a second try: a glob needs no more, and many of them do not take
    exponential time.
    """
    first, *others = text.split("*")
    pattern = _fixed(first)
    for place, fixed in enumerate(others, 1):
        pattern += f"(.*){_fixed(fixed)}" if place == len(others) else f"(?>(.*?){_fixed(fixed)})"
    return re.compile(pattern, re.DOTALL)


def _fixed(text: str) -> str:
    return "".join("(.)" if sign == "?" else re.escape(sign) for sign in text)


class TooManyComparisons(Exception):
    """A deployment's selectors and names are more than can be compared with one another."""

    def __init__(self) -> None:
        super().__init__(f"more than {limits.COMPARISONS_MAX} comparisons of names with selectors")


class Population:
    """The names that selectors choose from; what each selector chooses is computed once."""

    def __init__(self, names: Iterable[str]) -> None:
        self.names = list(names)
        self._chosen: dict[str, list[Chosen]] = {}
        self._compared = 0

    def chosen(self, text: str) -> list[Chosen]:
        """Return the names that a selector chooses, in the names' order. Raises BadValue, TooManyComparisons."""
        found = self._chosen.get(text)
        if found is None:
            selector = Selector(text)
            self._compared += len(self.names)
            if self._compared > limits.COMPARISONS_MAX:
                raise TooManyComparisons
            matched = ((name, selector.match(name)) for name in self.names)
            found = self._chosen[text] = [(name, parts) for name, parts in matched if parts is not None]
        return found
