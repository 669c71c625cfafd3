"""A problem of a deployment, at its place in the data."""

import re
from dataclasses import dataclass
from typing import Literal

from foosim.common.errors import show

Location = tuple[str | int, ...]
"""Keys and indices from the root of the data."""

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
    value: object
    nearest: str | None = None
    at: Literal["value", "key", "missing"] = "value"
    other: "Finding | None" = None
    valid: tuple[str, ...] = ()
