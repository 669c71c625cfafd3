"""The inbox of a process: bounded, many writers, one reader.

Receiving threads only offer messages. The loop takes all of them, decides, and sleeps until a message or its deadline.
A receiving thread does nothing else, because other messages wait for it.

A waiting reader costs a wake-up for each message, and a receiving thread between network and reader a second one: a
quarter of the cost of a tick's messages. So an inbox can have `Source`s, in one of whose queues the reader itself
waits: that of the channel that it lacks, so that no other message wakes it. It empties the others whenever it is awake;
an offer of a thread rings the bell of the queue in which it waits.

A reader that never waits, since it runs on another program's event loop, has `on_offer` in place of that.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from typing import Final, Protocol

Item = tuple[str, str, bytes]
"""Channel, name (the sender, or the receiver where one is addressed), payload."""

_NS: Final = 1_000_000_000
_NEVER_NS: Final = 1 << 63
ALARM_S: Final = 1.0
"""Timeout for the end of the alarm thread."""


class Source(Protocol):
    """A queue of messages in which a reader can wait."""

    def poll(self) -> list[Item]:
        """Return all messages, without waiting."""

    def wait(self, count: int) -> list[Item]:
        """Wait for `count` messages or the bell; return all messages, possibly none after the bell."""

    def ring(self) -> None:
        """End a wait, from another thread."""


class Inbox:
    """Items from many threads for one reader. A full inbox drops the newest item and counts it."""

    def __init__(self, limit: int, on_offer: Callable[[], None] | None = None) -> None:
        """`on_offer` is called by a receiving thread once there is an item, and not again before the next take; and by
        `wake`. Such an inbox has no sources."""
        assert limit >= 1, limit
        self.limit: Final = limit
        self.on_offer: Final = on_offer
        self._items: list[Item] = []
        self._guard = threading.Lock()
        self._waiting = False
        self._woken = False
        self._bell = threading.Lock()  # unlocked: it has rung
        self._bell.acquire()
        self._sources: dict[str, Source] = {}
        self._source: Source | None = None
        """The source in which the reader waits, or waited last, and for how many messages."""
        self._count = 1
        self._alarm: _Alarm | None = None
        self.dropped = 0
        """How many items a full inbox has dropped."""

    def offer(self, item: Item) -> bool:
        """Add an item, from any thread; False when the inbox is full and the item is lost."""
        with self._guard:
            if len(self._items) >= self.limit:
                self.dropped += 1
                return False
            is_first = not self._items
            self._items.append(item)
        self._ring()
        if is_first and self.on_offer is not None:
            self.on_offer()
        return True

    def take(self, timeout_s: float | None, lacking: str = "", count: int = 1) -> list[Item]:
        """Return all items; wait for them until the timeout (None: without limit) or until woken.

        The reader lacks `count` messages of the channel `lacking`: fewer do not end the wait, nor do messages in the
        queues of other sources. The list is empty after a timeout.
        """
        sources = self._sources  # a session that closes takes them away
        received: list[Item] = []
        for source in sources.values():
            received += source.poll()
        if sources:
            self._source = sources.get(lacking) or next(iter(sources.values()))
            self._count = count if lacking in sources else 1
            if self._sources is not sources:
                self._source = None
        if received or self._items or (timeout_s is not None and timeout_s <= 0):
            return self._hand_over(received)
        deadline_ns = None if timeout_s is None else time.monotonic_ns() + int(timeout_s * _NS)
        while True:
            self._waiting = True  # before looking: later offers ring
            if self._items or self._woken:
                break
            received = self._wait(deadline_ns)
            if received or (deadline_ns is not None and time.monotonic_ns() >= deadline_ns):
                break
        self._waiting = False
        self._woken = False
        return self._hand_over(received)

    def wake(self) -> None:
        """End the reader's take, or its next one that would wait. A signal handler may call this: it takes no lock."""
        self._woken = True
        self._ring()
        if self.on_offer is not None:
            self.on_offer()

    def attach(self, source: Source, channel: str) -> None:
        """Let the reader wait in this channel's queue; to be called by the reader, or before its first take."""
        assert channel not in self._sources and self.on_offer is None, channel
        if self._alarm is None:
            self._alarm = _Alarm(self._ring)
        self._sources[channel] = source

    def has(self, channel: str) -> bool:
        """Whether there is a source of this channel."""
        return channel in self._sources

    def detach(self) -> None:
        """Remove the sources, since their session closes; offered items stay."""
        self._sources = {}
        source, self._source = self._source, None
        if self._alarm is not None:
            self._alarm.stop()
        if source is not None:
            source.ring()

    def _ring(self) -> None:
        """End a wait. A surplus ring only wakes the reader once more."""
        if not self._waiting:
            return
        self._waiting = False
        source = self._source
        if source is not None:
            source.ring()
            return
        with contextlib.suppress(RuntimeError):  # it has rung already
            self._bell.release()

    def _wait(self, deadline_ns: int | None) -> list[Item]:
        """Wait for a message, a ring or the deadline; return the content of the source."""
        source = self._source
        if source is not None and self._alarm is not None:
            if deadline_ns is not None:
                self._alarm.set(deadline_ns)
            return source.wait(self._count)
        left_ns = -_NS if deadline_ns is None else max(0, deadline_ns - time.monotonic_ns())
        self._bell.acquire(timeout=left_ns / _NS)
        return []

    def _hand_over(self, items: list[Item]) -> list[Item]:
        """Return the messages of the source and then the offered ones, up to the limit."""
        if self._items:
            with self._guard:  # or an offer could still append to the reader's messages
                offered, self._items = self._items, []
            items = items + offered if items else offered
        count = len(items)
        if count > self.limit:
            with self._guard:
                self.dropped += count - self.limit
            del items[self.limit :]
        return items


class _Alarm:
    """Rings at a deadline, from a thread that sleeps until then.

    A later deadline does not wake it: the thread reads it when the earlier one has passed. So a loop whose deadlines
    advance has one wake-up per expired deadline, not per new one. Only the reader writes the deadline.
    """

    def __init__(self, ring: Callable[[], None]) -> None:
        self._ring = ring
        self._changed = threading.Condition()
        self._deadline_ns = 0
        self._passed_ns = 0
        self._sleeps_until_ns = _NEVER_NS
        self._thread: threading.Thread | None = None
        self._stopped = False

    def set(self, deadline_ns: int) -> None:
        """Replace the deadline."""
        self._deadline_ns = deadline_ns
        if deadline_ns >= self._sleeps_until_ns:
            return
        with self._changed:
            if self._thread is None and not self._stopped:
                self._thread = threading.Thread(target=self._run, name="alarm", daemon=True)
                self._thread.start()
            self._changed.notify()

    def stop(self) -> None:
        """End the thread."""
        with self._changed:
            self._stopped = True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join(ALARM_S)

    def _run(self) -> None:
        while self._sleep():
            self._ring()

    def _sleep(self) -> bool:
        """Return at a deadline; False when stopped."""
        with self._changed:
            while not self._stopped:
                deadline_ns, now_ns = self._deadline_ns, time.monotonic_ns()
                if deadline_ns == self._passed_ns:
                    self._changed.wait()
                elif deadline_ns <= now_ns:
                    self._passed_ns = deadline_ns
                    return True
                else:
                    self._sleeps_until_ns = deadline_ns
                    self._changed.wait((deadline_ns - now_ns) / _NS)
                    self._sleeps_until_ns = _NEVER_NS  # awake: the reader waits until its deadline has been read
        return False
