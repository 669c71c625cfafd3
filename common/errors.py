"""Errors caused from outside: bad input, a refused request, a protocol violation of a peer.

A programmer's error is an assertion. Everything that comes from outside (a file, a packet, a request, an argument)
and is not acceptable raises a `Refused` or a subclass, whose text names the place, the value and the valid
choices, so that it can be shown to a person as it is. Each part of the project adds its own classes beside its code.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import ClassVar, Final, TypeVar

from foosim.common.names import nearest_name

CHOICES_MAX: Final = 40
ABSENT: Final = object()
"""Marks a value that was not given, so that there is none to show."""

Read = TypeVar("Read")


class Refused(Exception):
    """Outside input is not accepted; the text has the place, the value, and the valid choices."""

    exit_code: ClassVar[int] = 3
    """Exit code of a command that raises it: 1 failed, 2 bad input, 3 refused."""

    def __init__(self, what: str) -> None:
        super().__init__(what)
        self.what = what


class Failed(Refused):
    """A valid request could not be carried out; the text has the obstacle."""

    exit_code = 1


class BadValue(Refused):
    """An invalid value: the problem, the value as given, the nearest valid one if any."""

    exit_code = 2

    def __init__(self, what: str, value: object = ABSENT, nearest: str | None = None) -> None:
        super().__init__(describe(what, value, nearest))
        self.problem = what
        self.value = value
        self.nearest = nearest


class NotFinite(BadValue):
    """A number in a value is not finite."""


def read_at(place: str, read: Callable[[str], Read], text: str) -> Read:
    """Return `read(text)`; its BadValue gets the place, such as an option."""
    try:
        return read(text)
    except BadValue as bad:
        raise BadValue(f"{place}: {bad.problem}", bad.value, bad.nearest) from None


class DeploymentError(Refused):
    """A deployment file with problems, all of them, one a line: `file:line:column: what, value, nearest name`."""

    exit_code = 2

    def __init__(self, problems: Sequence[str]) -> None:
        assert problems, "an error without a problem"
        super().__init__("\n".join(problems))
        self.problems = tuple(problems)


def describe(what: str, value: object, nearest: str | None = None) -> str:
    """`what, value, nearest is X` on one line, whatever the value holds."""
    text = what if value is ABSENT else f"{what}, {show(value)}"
    return text if nearest is None else f"{text}, nearest is {nearest}"


def show(value: object, length: int = 48) -> str:
    """A value formatted for a message: one line, bounded, as typed, with characters that cannot be printed escaped."""
    if isinstance(value, dict):
        return f"a mapping of {len(value)}"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    text = repr(value) if isinstance(value, str) else str(value)
    return text if len(text) <= length else text[: length - 4] + "..." + text[-1]


def no_such(what: str, value: str, choices: Iterable[str]) -> BadValue:
    """Return the error for a name outside the choices, with the nearest of them."""
    nearest = nearest_name(value, choices)
    return BadValue(what, value, None if nearest is None else show(nearest))


class Malformed(Refused):
    """Bytes, or a decoded message, that do not fit the schema or the world of the run."""


class UnknownName(BadValue):
    """A robot, channel, destination or class that does not exist; the text lists the valid ones, and what is `also`
    valid."""

    def __init__(self, what: str, value: str, choices: Iterable[str], also: str = "") -> None:
        names = sorted(set(choices))
        shown = ", ".join(names[:CHOICES_MAX]) + (", ..." if len(names) > CHOICES_MAX else "")
        shown = f"{shown or 'none'}, or {also}" if also else shown
        nearest = no_such(what, value, names).nearest
        super().__init__(f"{what} (there are: {shown or 'none'})", value, nearest)
