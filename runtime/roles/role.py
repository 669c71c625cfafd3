"""A role of a process: a core, the hooks of its shell, and how its actions are performed.

A core never waits and has no input or output; its role has both. Actions are performed in order, so a record is written
before the messages that depend on it are published.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, Final, Protocol

from foosim.protocol.actions import Journal, Log, Publish
from foosim.protocol.channels import Channel, Plane
from foosim.runtime.journal import JournalError
from foosim.runtime.roles.wire import Wire

BUSY_WINDOW_NS: Final = 1_000_000_000
_LEVELS: Final = {"info": logging.INFO, "warning": logging.WARNING, "error": logging.ERROR}

Letter = tuple[Channel, str, bytes]
"""A message to a role: its channel, the name in its key, its payload."""


class Core(Protocol):
    """The interface of a core to its role."""

    actions: list[Any]

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None: ...

    def wake(self, now_ns: int) -> None: ...


class Appender(Protocol):
    """The interface of a journal to its role."""

    def append(self, record: bytes) -> None: ...


class Role:
    """One core with its hooks. Set the needed ones before its loop runs."""

    def __init__(self, name: str, core: Core, log: logging.Logger, deadline_ns: Callable[[int], int]) -> None:
        """`deadline_ns(now)` returns the time of the core's next deadline."""
        self.name: Final = name
        self.core = core
        self.deadline_ns = deadline_ns
        self.journal: Appender | None = None
        self.turn: Callable[[int], None] = lambda now_ns: None
        """Called after the core has received its messages; it may call `perform` in between."""
        self.work: Callable[[int], bool] = lambda now_ns: False
        """Does one piece of long work, when no role has a message; returns whether there was one."""
        self.other: Callable[[Any], None] | None = None
        """Performs the actions that are specific to this role."""
        self.lacking: Callable[[], tuple[Channel, int] | None] = lambda: None
        """The channel, and the number of its messages, that the core waits for; other messages of a tick do not wake
        the loop of a process with one role."""
        self.on_alive: Callable[[Plane, str, bool], None] = lambda plane, name, is_alive: None
        """The presence of a role has begun or ended."""
        self.on_log: Callable[[Log], None] = lambda log: None
        self.on_unwritten: Callable[[JournalError], None] | None = None
        """Called once when a record could not be written; later decisions are in no journal."""
        self.holds_back: Callable[[Publish], bool] | None = None
        """Whether a message is not to be published."""
        self.took: Callable[[int, int], None] = lambda begun_ns, ended_ns: None
        """Called with the begin and the end of a turn, including its actions."""
        self.stood: Callable[[int, int], None] = lambda stood_ns, now_ns: None
        """Called after a standstill of the loop, with its length and the time (`standstill`)."""
        self.busy = 0.0
        """Share of the last second that its turns took."""
        self.wake_ns = 0
        """When the core is to be woken."""
        self._log = log
        self._wires: dict[Plane, Wire] = {}
        self._window_ns = self._busy_ns = 0

    def connect(self, wire: Wire) -> None:
        """Publish messages of this wire's plane on it."""
        self._wires[wire.plane] = wire

    def close(self) -> None:
        """End the presence of the role, which has ended."""
        for wire in self._wires.values():
            wire.close()

    def take_turn(self, letters: list[Letter], now_ns: int) -> None:
        """Receive messages, take the turn, and wake the core when that is due."""
        core = self.core
        for channel, name, payload in letters:
            core.receive(channel, name, payload, now_ns)
        self.turn(now_ns)
        self.perform()
        if now_ns >= self.wake_ns:
            core.wake(now_ns)
            self.turn(now_ns)
            self.perform()
            self.wake_ns = self.deadline_ns(now_ns)
        else:
            self.wake_ns = min(self.wake_ns, self.deadline_ns(now_ns))

    def do_work(self, now_ns: int) -> bool:
        """Do one piece of long work and perform its actions; return whether there was one."""
        if not self.work(now_ns):
            return False
        self.perform()
        self.wake_ns = min(self.wake_ns, self.deadline_ns(now_ns))
        return True

    def ended_turn(self, begun_ns: int, ended_ns: int) -> None:
        """Record the duration of a turn."""
        self.took(begun_ns, ended_ns)
        self._busy_ns += ended_ns - begun_ns
        elapsed_ns = ended_ns - self._window_ns
        if elapsed_ns >= BUSY_WINDOW_NS:
            self.busy = min(1.0, self._busy_ns / elapsed_ns) if self._window_ns else 0.0
            self._window_ns, self._busy_ns = ended_ns, 0

    def perform(self) -> None:
        """Perform the core's actions, in order."""
        actions = self.core.actions
        for action in actions:
            kind = type(action)
            if kind is Publish:
                if self.holds_back is None or not self.holds_back(action):
                    self._wires[action.channel.plane].put(action.channel, action.name, action.payload)
            elif kind is Journal:
                self._append(action.record)
            elif kind is Log:
                self._log.log(_LEVELS[action.level], action.text)
                self.on_log(action)
            else:
                assert self.other is not None, action
                self.other(action)
        actions.clear()

    def _append(self, record: bytes) -> None:
        """Write a record; after a failure the journal is not written again, and `on_unwritten` is called."""
        if self.journal is None:
            return
        try:
            self.journal.append(record)
        except JournalError as error:
            if self.on_unwritten is None:
                raise
            self.journal = None
            self.on_unwritten(error)
