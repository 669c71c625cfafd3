"""XML from outside as a tree of elements with their lines, within bounds: for descriptions of robots.

It is read by expat, which is part of Python. A document type is refused, and with it every entity of its own: no file
names another one or grows while it is read. Text between elements, comments and processing instructions are left out.
Pure: the content is given.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final
from xml.parsers import expat

from foosim.common.errors import ABSENT, describe
from foosim.world.matter.mesh import AssetError

BYTES_MAX: Final = 1024 * 1024
ELEMENTS_MAX: Final = 20_000
DEPTH_MAX: Final = 32
ATTRIBUTES_MAX: Final = 32
TEXT_LENGTH_MAX: Final = 1000
"""Of a name and of a value."""
_LATE_DECLARATION: Final = re.compile(rb"\s+<\?xml\s[^>]*\?>")
_CUT_OFF: Final = tuple(
    expat.errors.codes[text]
    for text in (
        expat.errors.XML_ERROR_NO_ELEMENTS,
        expat.errors.XML_ERROR_UNCLOSED_TOKEN,
        expat.errors.XML_ERROR_PARTIAL_CHAR,
        expat.errors.XML_ERROR_UNCLOSED_CDATA_SECTION,
    )
)
"""Errors of a content that ends too early. Of an unclosed tag or comment expat has the line in which it begins."""


class BadElement(AssetError):
    """An invalid element of a file: the problem in words, and the line of the element."""

    def __init__(self, file: str, line: int, problem: str) -> None:
        super().__init__(f"{file}:{line}: {problem}")
        self.line, self.problem = line, problem


@dataclass(slots=True)
class Element:
    """An element of a file, the line that it begins in, its attributes, and the elements in it."""

    file: str
    line: int
    tag: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)

    @property
    def place(self) -> str:
        return f"{self.file}:{self.line}"

    def all_of(self, *tags: str) -> Iterator[Element]:
        """Yield the elements in it of these names, in their order."""
        return (child for child in self.children if child.tag in tags)

    def one_of(self, *tags: str) -> Element | None:
        """Return the one element in it of these names, None without one. Raises BadElement for different ones."""
        found = [*self.all_of(*tags)]
        for other in found[1:]:
            if (other.attributes, other.children) != (found[0].attributes, found[0].children):
                raise other.error(
                    f"a second {other.tag} in the {self.tag} of line {self.line}, different from the first"
                )
        return found[0] if found else None

    def below(self, *tags: str) -> Iterator[Element]:
        """Yield the elements of these names, without one all, at any depth in it, in their order."""
        for child in self.children:
            if not tags or child.tag in tags:
                yield child
            yield from child.below(*tags)

    def error(self, what: str, value: object = ABSENT, nearest: str | None = None) -> BadElement:
        """Return the error for an invalid part of this element."""
        return BadElement(self.file, self.line, describe(what, value, nearest))


def read_xml(name: str, content: bytes) -> Element:
    """Return the outermost element of a file's content; `name` is the file's in messages. Raises AssetError."""
    if len(content) > BYTES_MAX:
        raise AssetError(f"{name}: {len(content)} bytes, at most {BYTES_MAX} are allowed")
    if not content.strip():
        raise AssetError(f"{name}:1: an empty file")
    reading = _Reading(name)
    if late := _LATE_DECLARATION.match(content):  # files have blank lines above it, which XML does not
        content = b"\n" * late[0].count(b"\n") + content[late.end() :]
    try:
        reading.parser.Parse(content, True)
    except expat.ExpatError as error:
        what = reading.cut_off() if error.code in _CUT_OFF else f"no XML, {expat.ErrorString(error.code)}"
        raise AssetError(f"{name}:{error.lineno}: {what}") from None
    except (LookupError, ValueError) as error:  # an unknown encoding, or one with several bytes a character
        raise AssetError(f"{name}:1: no XML, {describe('an unsupported encoding', str(error))}") from None
    assert reading.root is not None, "expat refuses a document without an element"
    return reading.root


class _Reading:
    """The handlers of one file."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.root: Element | None = None
        self._open: list[Element] = []
        self._count = 0
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.StartDoctypeDeclHandler = self._doctype

    def cut_off(self) -> str:
        """Return in words the place in the tree at which the content ends too early."""
        if not self._open:
            return "the file ends here, without an element"
        inner = self._open[-1]
        return f"the file ends here, in the unclosed {inner.tag} of line {inner.line}"

    def _refuse(self, what: str, value: object = ABSENT) -> AssetError:
        return AssetError(f"{self.name}:{self.parser.CurrentLineNumber}: {describe(what, value)}")

    def _doctype(self, name: str, *_: object) -> None:
        raise self._refuse("a document type: it may define entities, and a robot needs none", name)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._count += 1
        if self._count > ELEMENTS_MAX:
            raise self._refuse(f"more than {ELEMENTS_MAX} elements")
        if len(self._open) >= DEPTH_MAX:
            raise self._refuse(f"elements more than {DEPTH_MAX} deep", tag)
        if len(attributes) > ATTRIBUTES_MAX:
            raise self._refuse(f"more than {ATTRIBUTES_MAX} attributes", tag)
        for text in (tag, *attributes, *attributes.values()):
            if len(text) > TEXT_LENGTH_MAX:
                raise self._refuse(f"more than {TEXT_LENGTH_MAX} characters", text)
        element = Element(self.name, self.parser.CurrentLineNumber, tag, attributes)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)

    def _end(self, _: str) -> None:
        self._open.pop()
