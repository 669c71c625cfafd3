"""The loop of every process: pass messages to the core, perform its actions, sleep until a message or a deadline.

A core never waits and has no input or output; the loop has both. Actions are performed in order, so a record is written
before the messages that depend on it are published. The loop measures the share of time in which it does not sleep.
"""

from __future__ import annotations

import gc
import logging
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, Protocol

from foosim.protocol.actions import Journal, Log, Publish
from foosim.protocol.channels import ALIVE, CHANNELS, Channel, Plane
from foosim.runtime.journal import JournalError
from foosim.runtime.progress import EVERY_NS, ProgressFile
from foosim.runtime.standstill import Standstill
from foosim.runtime.systemd import Notify
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import Publisher, Session

BUSY_WINDOW_NS: Final = 1_000_000_000
NS_PER_S: Final = 1_000_000_000
GC_THRESHOLDS: Final = (20_000, 20, 100)
_BY_KEY: Final = {channel.key.removesuffix("/{name}"): channel for channel in CHANNELS}
_NAMED: Final = "/{name}"
NEVER_NS: Final = 2**63 - 1
_LEVELS: Final = {"info": logging.INFO, "warning": logging.WARNING, "error": logging.ERROR}


def collect_seldom() -> None:
    """Exclude the loaded objects from garbage collection, and make collections rare."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(*GC_THRESHOLDS)


class Wire:
    """One process on one plane: reads and publishes by the table of channels, under its own name."""

    def __init__(self, session: Session, plane: Plane, inbox: Inbox, name: str) -> None:
        self.session = session
        self.plane = plane
        self.name = name
        self._inbox = inbox
        self._publishers: dict[str, Publisher] = {}

    def read(self, reads: Sequence[tuple[Channel, bool]], waits: Sequence[Channel] = ()) -> None:
        """Read these channels: (channel, whether only what is addressed to this name).

        `waits` are those in whose queues the reader itself waits: the fastest path, for messages of every tick.
        """
        mine = {channel.key for channel, own in reads if own}
        wanted = {channel.key for channel, _ in reads}

        def read_key(key: str) -> tuple[str, str] | None:
            known = channel_of(key)
            if known is None or known[0].key not in wanted or (known[0].key in mine and known[1] != self.name):
                return None
            return known[0].key, known[1]

        for channel, own in reads:
            if channel.plane is not self.plane:
                continue
            key = channel.key_for(self.name) if own else channel.key_for_all
            if channel in waits:
                self.session.receive(key, channel.key, read_key, self._inbox)
            else:
                self.session.subscribe(key, channel.key, self._inbox)

    def put(self, channel: Channel, name: str, payload: bytes) -> None:
        """Publish on a channel; `name` is the sender, or the receiver where one is addressed."""
        key = channel.key_for(name)
        publisher = self._publishers.get(key)
        if publisher is None:
            publisher = self._publishers[key] = self.session.publisher(key, channel.express, channel.blocking)
        publisher.put(payload)

    def declare_alive(self) -> None:
        """Declare presence under this name, after admission, since one name has one presence."""
        self.session.declare_alive(ALIVE[self.plane].replace("{name}", self.name))

    def watch_alive(self, name: str = "*") -> None:
        """Observe the presence of processes."""
        self.session.watch_alive(ALIVE[self.plane].replace("{name}", name), ALIVE[self.plane], self._inbox)


def channel_of(key: str) -> tuple[Channel, str] | None:
    """Return the channel that a key belongs to, and the name in it or its writers' role; None for any other key."""
    channel = _BY_KEY.get(key)
    if channel is not None and not channel.key.endswith(_NAMED):
        return channel, channel.writers
    stem, _, name = key.rpartition("/")
    channel = _BY_KEY.get(stem)
    return (channel, name) if channel is not None and channel.key.endswith(_NAMED) else None


class Core(Protocol):
    """The interface of a core to its loop."""

    actions: list[Any]

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None: ...

    def wake(self, now_ns: int) -> None: ...


class Appender(Protocol):
    """The interface of a journal to its loop."""

    def append(self, record: bytes) -> None: ...


class Loop:
    """Runs one core. Set the hooks that a process needs, then `run`."""

    def __init__(self, core: Core, inbox: Inbox, log: logging.Logger, deadline_ns: Callable[[int], int]) -> None:
        """`deadline_ns(now)` returns the time of the core's next deadline."""
        self.core = core
        self.deadline_ns = deadline_ns
        self.journal: Appender | None = None
        self.turn: Callable[[int], None] = lambda now_ns: None
        """Called after the core has received its messages; it may call `perform` in between."""
        self.other: Callable[[Any], None] | None = None
        """Performs the actions that are specific to this process."""
        self.lacking: Callable[[], tuple[Channel, int] | None] = lambda: None
        """The channel, and the number of its messages, that the core waits for; other messages of a tick do not wake
        the loop."""
        self.on_alive: Callable[[Plane, str, bool], None] = lambda plane, name, is_alive: None
        """The presence of a process has begun or ended."""
        self.notify = Notify({})
        """Notifies a service manager that the loop advances; none by default."""
        self.on_log: Callable[[Log], None] = lambda say: None
        self.on_unwritten: Callable[[JournalError], None] | None = None
        """Called once when a record could not be written; later decisions are in no journal."""
        self.holds_back: Callable[[Publish], bool] | None = None
        """Whether a message is not to be published."""
        self.took: Callable[[int, int], None] = lambda begun_ns, ended_ns: None
        """Called with the begin and the end of a turn, including its actions."""
        self.stood: Callable[[int, int], None] = lambda stood_ns, now_ns: None
        """Called after a standstill of the loop, with its length and the time (`standstill`)."""
        self.busy = 0.0
        """Share of the last second in which the loop did not sleep."""
        self._inbox = inbox
        self._log = log
        self._wires: dict[Plane, Wire] = {}
        self._channels: dict[str, Channel] = {channel.key: channel for channel in CHANNELS}
        self._planes = {key: plane for plane, key in ALIVE.items()}
        now_ns = time.monotonic_ns()
        self._wake_ns = now_ns
        self._window_ns = self._turn_ns = now_ns
        self._slept_ns = 0
        self._standstill = Standstill(now_ns)
        self._progress: ProgressFile | None = None
        self._sign_ns = NEVER_NS

    def show_progress(self, path: Path | None) -> None:
        """Write the loop's progress to this file; do nothing without a path. Raises Failed."""
        if path is not None:
            self._progress = ProgressFile(path)
            self._sign_ns = 0

    def connect(self, wire: Wire) -> None:
        """Publish messages of this wire's plane on it."""
        self._wires[wire.plane] = wire

    def run(self, until: Callable[[], bool]) -> None:
        """Run until `until` returns true; `Inbox.wake` has it checked."""
        collect_seldom()
        self.notify.ready(time.monotonic_ns())
        while not until():
            self.go_round()
        self.notify.stopping()

    def go_round(self) -> None:
        """Sleep until a message or a deadline, then handle it."""
        core = self.core
        slept_ns = time.monotonic_ns()
        self.took(self._turn_ns, slept_ns)
        lacking = self.lacking()
        due_ns = min(self._wake_ns, self._sign_ns)
        timeout_s = max(0, due_ns - slept_ns) / NS_PER_S
        lacks, count = ("", 1) if lacking is None else (lacking[0].key, lacking[1])
        items = self._inbox.take(timeout_s, lacks, count)
        now_ns = self._turn_ns = time.monotonic_ns()
        self._measure(now_ns, now_ns - slept_ns)
        stood_ns = self._standstill.look(due_ns, now_ns)
        if stood_ns:
            self.stood(stood_ns, now_ns)
        self.notify.goes_on(now_ns)
        channels = self._channels
        for key, name, payload in items:
            channel = channels.get(key)
            if channel is not None:
                core.receive(channel, name, payload, now_ns)
            elif key in self._planes:
                self.on_alive(self._planes[key], name, payload == b"+")
        self.turn(now_ns)
        self.perform()
        if now_ns >= self._wake_ns:
            core.wake(now_ns)
            self.turn(now_ns)
            self.perform()
            self._wake_ns = self.deadline_ns(now_ns)
        else:
            self._wake_ns = min(self._wake_ns, self.deadline_ns(now_ns))
        if now_ns >= self._sign_ns:
            self._sign(now_ns)

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

    def _sign(self, now_ns: int) -> None:
        assert self._progress is not None, "signs are due only when there is a file for them"
        self._sign_ns = now_ns + EVERY_NS
        try:
            self._progress.write(now_ns)
        except OSError as error:  # the sign gets old; the run itself is not affected
            self._log.warning("the progress file could not be written: %s", error.strerror)

    def _measure(self, now_ns: int, slept_ns: int) -> None:
        self._slept_ns += slept_ns
        elapsed_ns = now_ns - self._window_ns
        if elapsed_ns >= BUSY_WINDOW_NS:
            self.busy = 1.0 - min(1.0, self._slept_ns / elapsed_ns)
            self._window_ns = now_ns
            self._slept_ns = 0
