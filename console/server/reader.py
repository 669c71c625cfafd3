"""One browser: what it follows, and a bounded outbox from which its connection takes as fast as it can.

Of messages that newer ones replace (moments, status, figures of links) only the newest waits: a browser that reads
slowly, or not at all, costs no more than one message of each kind. Answers, marks and notes wait in their order; who
has let too many of them wait is cut off. Pure: `server` moves the bytes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from typing import Final, Literal

from foosim.console.shown.drawing import packed
from foosim.console.shown.source import Curve, Link, Moment

Role = Literal["viewer", "operator"]
WAITING_MAX: Final = 256
"""Messages in their order that wait for one browser."""


class Shown:
    """One moment of a source; as bytes for each choice of numbers after its poses, which browsers share."""

    def __init__(self, source: int, generation: int, moment: Moment) -> None:
        self.source, self.generation, self.moment = source, generation, moment
        self._packed: dict[tuple[int, ...], bytes] = {}

    def message(self, fields: tuple[int, ...]) -> bytes:
        """Return the binary message with the numbers at these places."""
        found = self._packed.get(fields)
        if found is None:
            found = self._packed[fields] = packed(self.source, self.generation, self.moment, fields)
        return found


@dataclass
class Follows:
    """The subscription of one browser to one source."""

    hz: float = 50.0
    overlays: frozenset[str] = frozenset()
    link: Link | None = None
    curves: tuple[Curve, ...] = ()
    fields: tuple[int, ...] = ()
    next_s: float = 0.0
    """Before this time no further moment is sent."""


class TooSlow(Exception):
    """A browser has let too many messages wait that nothing replaces."""


@dataclass
class Reader:
    """One authenticated browser."""

    name: str
    role: Role
    wake: Callable[[], None]
    """Called when something waits."""
    follows: dict[int, Follows] = field(default_factory=dict)
    """By source; all are followed until the page requests otherwise."""
    _first: dict[Hashable, bytes] = field(default_factory=dict)
    """Messages that others depend on, the newest only: sources and scenes."""
    _ordered: deque[bytes] = field(default_factory=deque)
    _newest: dict[Hashable, bytes | Shown] = field(default_factory=dict)

    def put_first(self, key: Hashable, message: bytes) -> None:
        self._first[key] = message
        self.wake()

    def put(self, message: bytes) -> None:
        """Add a message that is never replaced. Raises TooSlow."""
        if len(self._ordered) >= WAITING_MAX:
            raise TooSlow(f"{WAITING_MAX} messages wait for this page: it reads too slowly")
        self._ordered.append(message)
        self.wake()

    def put_newest(self, key: Hashable, message: bytes | Shown) -> None:
        """Add a message that replaces the waiting one of this key."""
        self._newest[key] = message
        self.wake()

    def show(self, shown: Shown, now_s: float) -> None:
        """Add a moment, at the page's rate; moments of jumps and pauses are always added."""
        follows = self.follows[shown.source]
        if follows.hz <= 0.0:
            return
        urgent = shown.moment.jump or shown.moment.paused
        # A quarter of a period early counts as due: moments that come at this very rate are a little early or late.
        if now_s < follows.next_s - 0.25 / follows.hz and not urgent:
            return
        follows.next_s = max(follows.next_s + 1.0 / follows.hz, now_s)
        key = "moment", shown.source
        waiting = self._newest.get(key)
        if isinstance(waiting, Shown) and waiting.moment.jump and not shown.moment.jump:
            shown = Shown(shown.source, shown.generation, replace(shown.moment, jump=True))
        self.put_newest(key, shown)

    def take(self) -> bytes | str | None:
        """Return the next message, text for JSON; None when nothing waits."""
        if self._first:
            return self._first.pop(next(iter(self._first))).decode()
        if self._ordered:
            return self._ordered.popleft().decode()
        if not self._newest:
            return None
        message = self._newest.pop(next(iter(self._newest)))
        if isinstance(message, Shown):
            return message.message(self.follows[message.source].fields)
        return message.decode()
