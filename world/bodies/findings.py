"""The findings of one file: its errors, after each of which reading continues with a harmless value, and its notes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from typing import Final, ParamSpec, TypeVar

from foosim.common.errors import ABSENT
from foosim.world.bodies.xml_tree import BadElement, Element
from foosim.world.matter.mesh import AssetError

SHOWN_MAX: Final = 50
"""The count of errors, and of notes, that are shown."""
NAMED_MAX: Final = 8
"""The count of names and of lines in one note."""

_LINE: Final = re.compile(r":([0-9]+): ")
Read = TypeVar("Read")
Given = ParamSpec("Given")


class BadRobot(AssetError):
    """A file with errors, `file:line: what`: they are shown in the order of their lines. `notes` are other findings."""

    def __init__(self, errors: Sequence[str], notes: tuple[str, ...]) -> None:
        super().__init__("\n".join(bounded(sorted(errors, key=_line_of))))
        self.notes = notes


def _line_of(error: str) -> int:
    found = _LINE.search(error)
    return int(found[1]) if found else 0


def bounded(texts: Sequence[str]) -> Iterator[str]:
    """Yield texts, at most `SHOWN_MAX`, and the count of the others."""
    yield from texts[:SHOWN_MAX]
    if len(texts) > SHOWN_MAX:
        yield f"... and {len(texts) - SHOWN_MAX} more"


class Findings:
    """Collects errors and notes while a file is read."""

    def __init__(self) -> None:
        self._errors: list[BadElement] = []
        self._notes: dict[tuple[str, str], list[tuple[str, int]]] = {}

    def __bool__(self) -> bool:
        """Whether there are errors."""
        return bool(self._errors)

    def read(
        self, otherwise: Read, function: Callable[Given, Read], *args: Given.args, **options: Given.kwargs
    ) -> Read:
        """Return the result of a function; after an error, which is kept, `otherwise`."""
        try:
            return function(*args, **options)
        except BadElement as error:
            self._errors.append(error)
            return otherwise

    def error(self, element: Element, what: str, value: object = ABSENT) -> None:
        """Keep the error of an element."""
        self._errors.append(element.error(what, value))

    def note(self, element: Element, what: str, why: str, name: str = "") -> None:
        """Note something about an element: notes of the same text become one, with the names and lines of all."""
        self._notes.setdefault((what, why), []).append((name, element.line))

    def notes(self) -> tuple[str, ...]:
        """Return the notes in the order of the file. Raises BadRobot with all errors if there are any."""
        kinds = sorted(self._notes.items(), key=lambda one: one[1][0][1])
        notes = tuple(bounded([_note(what, why, places) for (what, why), places in kinds]))
        if self._errors:
            raise BadRobot([*dict.fromkeys(map(str, self._errors))], notes)
        return notes


def _note(what: str, why: str, places: Sequence[tuple[str, int]]) -> str:
    names = listed([*dict.fromkeys(name for name, _ in places if name)])
    lines = [*dict.fromkeys(str(line) for _, line in places)]
    where = f"{'line' if len(lines) == 1 else 'lines'} {listed(lines)}"
    return f"{what}{' ' if names else ''}{names} ({where}): {why}"


def listed(texts: Sequence[str]) -> str:
    """Return texts with commas, at most `NAMED_MAX` of them."""
    return ", ".join(texts[:NAMED_MAX]) + (", ..." if len(texts) > NAMED_MAX else "")
