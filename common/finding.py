"""A problem of a deployment, at its place in the data."""

from dataclasses import dataclass
from typing import Literal

Location = tuple[str | int, ...]
"""Keys and indices from the root of the data."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem at a location in the data: at the value there, at its key, or at the mapping that lacks the key.

    `other` is the same problem at the other of two values that do not fit: reported if that one was set.
    """

    location: Location
    what: str
    value: object
    nearest: str | None = None
    at: Literal["value", "key", "missing"] = "value"
    other: "Finding | None" = None
