"""The actions of a core, which its shell performs: journal, publish, log.

A core appends actions to its list while it handles a message or the time. The shell performs them in that order, so a
record is written before the messages that depend on it are published.
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
    """Append one record to the process's journal, before any later action."""

    record: bytes


@dataclass(frozen=True)
class Log:
    """Write a line to the log; `level` is info, warning or error."""

    level: str
    text: str


Action = Publish | Journal | Log
