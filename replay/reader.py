"""Reads a capture ahead of its replay: a thread between the file and the core, with a bounded queue.

What is wanted can change at any time (a seek, a further round): the thread drops what it was reading and begins there.
What the file holds long before that is passed by, chunk by chunk.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from foosim.capture.foxglove import SCENE
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import About, Scan
from foosim.capture.state_at import LatchedTopic
from foosim.common.errors import BadValue
from foosim.common.limits import COUNTER_MAX
from foosim.common.units import format_ns
from foosim.deployment.schema import Deployment
from foosim.replay.core import Reading, Span
from foosim.replay.entries import Entries, Entry, Selection

AHEAD_BYTES: Final = 64 * 1024 * 1024
TOGETHER_MAX: Final = 512


def read_span(
    path: Path, from_ns: int | None = None, until_ns: int | None = None, for_ns: int | None = None
) -> tuple[Span, About]:
    """Return what of a capture is to be played, and what it says about itself, by its chunks' heads alone.

    Raises CaptureError for what is none, BadValue for times that it does not have.
    """
    scan = Scan(path, COUNTER_MAX)
    for _ in scan.messages():
        pass
    about = scan.about
    first_ns, last_ns = about.start_ns, about.end_ns
    ends = f"the capture has {format_ns(first_ns)} to {format_ns(last_ns)}"
    if from_ns is not None and from_ns > last_ns:
        raise BadValue(f"--from: {ends}", format_ns(from_ns))
    if until_ns is not None and until_ns < max(first_ns, from_ns or 0):
        raise BadValue(f"--until: before the beginning; {ends}", format_ns(until_ns))
    begin_ns = max(first_ns, from_ns or 0)
    stops = [last_ns, *([] if until_ns is None else [until_ns]), *([] if for_ns is None else [begin_ns + for_ns])]
    return Span(begin_ns, min(stops)), about


@dataclass(frozen=True, slots=True)
class Read:
    """What was read for the wish of that number; behind the last of it, or behind a problem, comes nothing."""

    number: int
    entries: list[Entry]
    is_last: bool = False
    problem: str = ""


class ReadAhead:
    """The thread and its queue. `ask`, `take` and `close` are for one other thread; `wake` is called by this one."""

    def __init__(
        self,
        path: Path,
        deployment: Deployment,
        selection: Selection,
        span: Span,
        entries_max: int,
        wake: Callable[[], None],
    ) -> None:
        self.entries: Final = Entries(deployment, selection)
        self._path = path
        self._tick_ns = deployment.tick_ns
        self._span = span
        self._entries_max = entries_max
        self._wake = wake
        self._scenes: LatchedTopic | None = None
        self._changed = threading.Condition()
        """Guards what follows; notified at each change that is waited for."""
        self._asked: Reading | None = None
        self._closed = False
        self._queue: deque[Entry] = deque()
        self._bytes = 0
        self._end: Read | None = None
        self._thread = threading.Thread(target=self._run, name="read ahead", daemon=True)
        self._thread.start()

    def ask(self, reading: Reading) -> None:
        """Have another part read; what was read is dropped. The same wish once more changes nothing."""
        if reading == self._asked:
            return
        with self._changed:
            self._asked = reading
            self._queue.clear()
            self._bytes, self._end = 0, None
            self._changed.notify_all()

    def take(self) -> Read | None:
        """Return some of what is there, None while there is nothing new."""
        with self._changed:
            if self._asked is None or not (self._queue or self._end):
                return None
            entries = [self._queue.popleft() for _ in range(min(len(self._queue), TOGETHER_MAX))]
            self._bytes -= sum(len(entry.payload) for entry in entries)
            self._changed.notify_all()
            if self._queue or self._end is None:
                return Read(self._asked.number, entries)
            end, self._end = self._end, None
            return Read(end.number, entries, end.is_last, end.problem)

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()

    def _run(self) -> None:
        done: Reading | None = None
        while True:
            with self._changed:
                while not self._closed and self._asked == done:
                    self._changed.wait()
                if self._closed:
                    return
                done = self._asked
            assert done is not None
            self._put_end(done, self._read(done))

    def _read(self, reading: Reading) -> str:
        """Read one part; return what is wrong with the file, empty when nothing is."""
        scan = Scan(self._path, max(0, reading.from_ns - 2 * self._tick_ns))
        try:
            scene = self._scene_at(reading.from_ns)
            if scene is not None and not self._put(reading, scene):
                return ""
            for entry in self.entries.of(scan.messages(), scan.decode):
                if entry.time_ns > self._span.last_ns:
                    break
                if entry.time_ns >= reading.from_ns and not self._put(reading, entry):
                    break
        except CaptureError as error:
            return str(error)
        return ""

    def _scene_at(self, time_ns: int) -> Entry | None:
        """Return the scene that holds where one begins in the midst, None where none is to be said."""
        if not self.entries.has_scene or not time_ns:
            return None
        if self._scenes is None:
            self._scenes = LatchedTopic(self._path, SCENE)
        message = self._scenes.before(time_ns)
        return None if message is None else self.entries.view(message, time_ns)

    def _put(self, reading: Reading, entry: Entry) -> bool:
        """Queue an entry, as soon as there is room; False when it is not wanted any more."""
        with self._changed:
            while self._is_full() and self._asked == reading and not self._closed:
                self._changed.wait()
            if self._asked != reading or self._closed:
                return False
            is_first = not self._queue
            self._queue.append(entry)
            self._bytes += len(entry.payload)
        if is_first:
            self._wake()
        return True

    def _is_full(self) -> bool:
        """A single entry larger than the room goes in alone."""
        return len(self._queue) >= self._entries_max or (bool(self._queue) and self._bytes >= AHEAD_BYTES)

    def _put_end(self, reading: Reading, problem: str) -> None:
        with self._changed:
            if self._asked == reading:
                self._end = Read(reading.number, [], True, problem)
        self._wake()
