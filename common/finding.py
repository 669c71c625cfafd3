"""A problem of a deployment, at its place in the data."""

import re
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

from foosim.common.errors import describe, show

Location = tuple[str | int, ...]
"""Keys and indices from the root of the data."""

WRITTEN: Final = object()
"""Stands for the value, or the name of the key, that is written at a location."""

_PLAIN_KEY = re.compile(r"[A-Za-z0-9_.-]{1,48}")


def path_text(location: Location) -> str:
    """A location as messages print it: `nodes.red.robots[1]`."""
    text = ""
    for step in location:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            name = step if _PLAIN_KEY.fullmatch(step) else show(step)
            text += f".{name}" if text else name
    return text


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem at a location in the data: at the value there, at its key, or at the mapping that lacks the key.

    `other` is the same problem at the other of two values that do not fit: reported if that one was set. `valid` are
    the keys that could be in the place of an unknown one.
    """

    location: Location
    what: str
    value: object = WRITTEN
    nearest: str | None = None
    at: Literal["value", "key", "missing"] = "value"
    other: "Finding | None" = None
    valid: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The line without a place: `path: what, value, nearest is X`."""
        path = path_text(self.location if self.at == "value" else self.location[:-1])
        text = describe(self.what, self.value, self.nearest)
        return f"{path}: {text}" if path else text


def with_written(finding: Finding, data: Any) -> Finding:
    """Return a finding with the value at its location in plain data, and at that of its `other`."""
    if finding.other is not None:
        finding = replace(finding, other=with_written(finding.other, data))
    if finding.value is not WRITTEN:
        return finding
    value = data
    for step in finding.location if finding.at == "value" else ():
        if isinstance(value, dict):
            value = value.get(step)
        elif isinstance(value, list) and isinstance(step, int):  # else a single text is in place of a list
            value = value[step]
    return replace(finding, value=value if finding.at == "value" else finding.location[-1])
