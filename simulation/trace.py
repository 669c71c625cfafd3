"""The record of what processes did in a rehearsal, for tests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Traced:
    """One action of a process: `what` is journal, publish or receive."""

    now_ns: int
    process: str
    what: str
    channel: str
    payload: bytes
    name: str = ""
    """The process that the channel's key names."""


Observer = Callable[[Traced], None]
