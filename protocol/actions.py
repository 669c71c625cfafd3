"""What a core asks its shell to do, in order: journal, publish, say.

A core appends actions to its list while it takes a message or the time; the shell performs them in that order, so that
what must be written before it is spoken is.
"""

from __future__ import annotations

from dataclasses import dataclass

from foosim.protocol.channels import Channel


@dataclass(frozen=True)
class Publish:
    """Put `payload` on a channel; `name` fills the key (the sender, or the one addressed)."""

    channel: Channel
    name: str
    payload: bytes


@dataclass(frozen=True)
class Journal:
    """Append one record to the process's journal, before anything that comes after."""

    record: bytes


@dataclass(frozen=True)
class Say:
    """Something for people: a line of the log. `level` is info, warning or error."""

    level: str
    text: str


Action = Publish | Journal | Say
