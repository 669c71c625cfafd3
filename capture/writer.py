"""The writer of a capture: a thread that writes the rows of journalled closings, and never loses one silently.

`keep` hands a closing over and returns; when the writer lags by more than the queue holds, `keep` waits, which slows
the run, and logs that once. Rows are flushed at least every `capture.flush`, synced each second by a thread of
its own, and readable when the process is killed. When disk space is low (`protocol.disk`) or the disk refuses,
`state` has the reason; the owner ends the run, or continues without a capture, as the deployment wants it. A writer
that has given up has an end in its file and counts refused rows: offered = written + refused.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from queue import SimpleQueue
from typing import Final

from foosim.capture import contents as capture_contents
from foosim.capture.file import CaptureFile, Described, Item, Line, Tick
from foosim.common import limits
from foosim.runtime.disk import Level

GATHER_S: Final = 0.02
"""How long the writer collects closings: it wakes once for several, and takes the interpreter's lock less often."""
BATCH_ROWS: Final = 2_000
"""Rows between two readings of the clock."""
SYNC_NS: Final = 1_000_000_000
WAIT_S: Final = 0.1
"""Interval of the calls of `while_waiting`."""


@dataclass(frozen=True, slots=True)
class CaptureStatistics:
    """Progress of a capture: rows written and pending, and how often the run had to wait for it.

    `offered` counts what was handed over: ticks, packets, epochs and lines of the log. All of it is in the file
    (`written`), or not (`refused`), or on its way.
    """

    bytes: int
    offered: int
    written: int
    refused: int
    queued_rows: int
    waits: int
    synced_tick: int


@dataclass(frozen=True, slots=True)
class CaptureState:
    """State of a capture. At FULL it must end while the rest still fits; at OUT it is finished, and refuses rows."""

    level: Level = Level.FINE
    text: str = ""


class CaptureWriter:
    """Writes one capture in a thread.

    Raises CaptureError when the file exists already (it is never overwritten) or cannot be written. With `journal_tick`
    it continues a capture that this run left unfinished (`CaptureFile`): `put` everything that the journal has, from
    that tick on; captured rows are not written again. `say` takes messages for people as (level, text).
    `put`, `log`, `finish` and `leave` are for one thread.
    """

    def __init__(
        self,
        path: Path,
        described: Described,
        say: Callable[[str, str], None] | None = None,
        journal_tick: int | None = None,
    ) -> None:
        self.path = path
        self._say = say or (lambda level, text: None)
        self._flush_ns = described.deployment.capture.flush_ns
        self.state = CaptureState()
        self.states: deque[CaptureState] = deque()
        """The states in order, for one reader, which removes them: the thread may change state more than once between
        two readings."""
        self.stops_world = described.deployment.capture.on_full == "stop_world"
        self._offered = self._written = self._refused = self._pending = self._passed = 0
        """Rows by their end, with the rows of a resumed capture; pending ones are in the chunk that is being
        collected, passed ones came again."""
        self._error: BaseException | None = None
        self._queue: deque[Item] = deque()
        self._queued_rows = self._waits = 0
        self._is_over = False
        """Whether the queue accepts no more items."""
        self._ending: Mapping[str, str] | None = None
        """The result of the run, where the file is to be finished."""
        self._idle = False
        """Whether the thread waits for a notification of the next row."""
        self._changed = threading.Condition()
        """Guards the queue, the error and the ends; notified when they change."""
        self._file = CaptureFile(path, described, journal_tick)
        self._offered = self._written = self._file.rows_before
        self.begun_with = replace(self._file.done)
        """How far the resumed capture was."""
        self.has_ended = False
        """Whether the thread has ended."""
        self.on_end: Callable[[], None] = lambda: None
        """Called at the end of the thread, in it."""
        self.while_waiting: Callable[[], None] = lambda: None
        """Called repeatedly while `put` or `log` waits, in the caller's thread."""
        self._thread = threading.Thread(target=self._run, name="capture", daemon=True)
        self._syncer = _Syncer(self._file)
        self._thread.start()

    # --- what the owner calls ----------------------------------------------------------------------------------------

    def log(self, level: str, text: str, tick: int) -> None:
        """Queue a log line of the run; `level` is info, warning or error."""
        self.put(Line(level, text, tick))

    def finish(self, metadata: Mapping[str, str] | None = None) -> None:
        """Write the queue, the last frame and the summary; a second call does nothing. `metadata`: the result."""
        self.begin_finish(metadata)
        self._end()
        self._raise_error()

    def begin_finish(self, metadata: Mapping[str, str] | None = None) -> None:
        """Begin to finish, as `finish` does, and return at once."""
        with self._changed:
            if not self._is_over:
                self._ending = {} if metadata is None else dict(metadata)
            self._is_over = True
            self._changed.notify_all()

    @property
    def is_closing(self) -> bool:
        """Whether the queue is closed and its items are still being written."""
        return self._is_over and not self.has_ended

    @property
    def is_syncing(self) -> bool:
        """Whether a sync of the file is under way."""
        return self._file.is_syncing

    def leave(self) -> None:
        """Write the queue and close the file unfinished: a vHub with its journal can resume it.

        A second call does nothing. It raises nothing, since it follows an error.
        """
        self._end()

    def _end(self) -> None:
        with self._changed:
            self._is_over = True
            self._changed.notify_all()
        self._thread.join()

    @property
    def synced_tick(self) -> int:
        """The last tick whose rows are synced; the journal may drop records up to it."""
        return self._syncer.tick

    def statistics(self) -> CaptureStatistics:
        counts = self._offered - self._passed, self._written, self._refused, self._queued_rows, self._waits
        return CaptureStatistics(self._file.total_bytes, *counts, self.synced_tick)

    def put(self, item: Item) -> None:
        """Queue a closed tick, an epoch that begins, or a log line; wait while the queue is full."""
        rows = _rows_in(item)
        with self._changed:
            assert not self._is_over, "a row after the end"
            full = self._is_full(rows)
            self._waits += full
            first = full and self._waits == 1
        if first:
            self._say("warning", f"the run waits for its capture {self.path}: {self._queued_rows} rows are queued")
        while not self._takes(item, rows):
            self.while_waiting()
        self._raise_error()

    def _takes(self, item: Item, rows: int) -> bool:
        """Queue an item, waiting for space; return False after the timeout."""
        with self._changed:
            if self._is_full(rows) and self._error is None:
                self._changed.wait(WAIT_S)
            if self._is_full(rows) and self._error is None:
                return False
            self._queue.append(item)
            self._queued_rows += rows
            self._offered += rows
            if self._idle:
                self._idle = False
                self._changed.notify_all()
            return True

    def _is_full(self, rows: int) -> bool:
        """Whether an item fits; a single closing larger than the queue is accepted alone."""
        return self._queued_rows > 0 and self._queued_rows + rows > limits.CAPTURE_QUEUE_ROWS_MAX

    def _raise_error(self) -> None:
        if self._error is not None:
            raise self._error

    # --- the thread --------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            self._write_all()
        except BaseException as error:  # noqa: BLE001  # raised again by the owner's next call
            with self._changed:
                self._error = error
                self._changed.notify_all()
        finally:
            self._syncer.end()
            self._file.close()
            self.has_ended = True
            self.on_end()

    def _write_all(self) -> None:
        interval_ns = self._flush_ns * 3 // 4  # earlier, by the time of collecting and of a batch
        flush_at_ns = sync_at_ns = time.monotonic_ns()
        ending = False
        while not ending:
            until_ns = flush_at_ns if self._pending else sync_at_ns if self._syncer.lags else None
            items, ending = self._take(until_ns)
            for item in items:
                self._write_item(item)
            now_ns = time.monotonic_ns()
            if now_ns >= flush_at_ns or self._file.mcap.chunk_bytes > capture_contents.CHUNK_BYTES:
                self._flush()
                flush_at_ns = now_ns + interval_ns
            if now_ns >= sync_at_ns and self._syncer.lags and not self._pending:
                self._syncer.request()
                sync_at_ns = now_ns + SYNC_NS
        if self._ending is None:
            self._flush()
        elif self.state.level < Level.OUT:
            self._finish(self._ending)

    def _flush(self) -> None:
        """Write the collected chunk, and check the space that is left."""
        if self.state.level is Level.OUT:
            return
        try:
            self._end_chunk()
            room = self._file.room()
        except OSError as error:
            self._give_up(str(self._file.disk_error(error)))
            return
        if room.level is Level.OUT or (room.level is Level.FULL and not self.stops_world):
            self._give_up(f"{self.path}: {room}")
        elif room.level > self.state.level:
            self._come_to(CaptureState(room.level, f"{self.path}: {room}"))

    def _end_chunk(self) -> None:
        if self._syncer.error is not None:
            raise self._syncer.error
        self._file.end_chunk()
        self._written += self._pending
        self._pending = 0
        self._syncer.written(self._file.done.tick)

    def _give_up(self, text: str) -> None:
        """Finish the file, as far as the disk allows; later items are refused."""
        self._file.give_up()
        self._refused += self._pending
        self._pending = 0
        self._file.write(Line("error", f"not captured from here on: {text}", max(0, self._file.done.tick)))
        try:
            self._file.finish({"reason": f"not captured further: {text}", "last_tick": str(self._file.done.tick)})
        except OSError as error:
            self._file.give_up()
            text = f"{text}; its end could not be written, {error.strerror}"
        self._come_to(CaptureState(Level.OUT, text))

    def _come_to(self, state: CaptureState) -> None:
        self.state = state
        self.states.append(state)

    def _finish(self, ending: Mapping[str, str]) -> None:
        try:
            self._syncer.end()
            self._end_chunk()
            self._file.finish(ending)
            self._syncer.tick = self._file.done.tick
        except OSError as error:
            self._give_up(str(self._file.disk_error(error)))

    def _take(self, until_ns: int | None) -> tuple[list[Item], bool]:
        """Remove and return a batch, after a wait for items or until a flush is due.

        Also return whether nothing comes after it.
        """
        with self._changed:
            while not self._queue and not self._is_over:
                self._idle = True
                if until_ns is None:
                    self._changed.wait()
                elif not self._changed.wait(max(0, until_ns - time.monotonic_ns()) * 1e-9):
                    break
            self._idle = False
            gather = not self._is_over and 0 < self._queued_rows < BATCH_ROWS
        if gather:
            time.sleep(GATHER_S)
        items: list[Item] = []
        rows = 0
        with self._changed:
            while self._queue and rows < BATCH_ROWS:
                items.append(self._queue.popleft())
                rows += _rows_in(items[-1])
            self._queued_rows -= rows
            self._changed.notify_all()
            return items, self._is_over and not self._queue

    def _write_item(self, item: Item) -> None:
        if isinstance(item, Tick) and self._file.begins_next(item):
            self._begin_next(item)
        if self.state.level is Level.OUT:
            self._refused += _rows_in(item)
        elif self._file.write(item):
            self._pending += _rows_in(item)
        else:
            self._passed += _rows_in(item)

    def _begin_next(self, closing: Tick) -> None:
        """Begin the next file with a closing, when all earlier items are written."""
        self._flush()
        try:
            if self.state.level is not Level.OUT:
                self._file.begin_next(closing)
                self._syncer.tick = self._file.done.tick
        except OSError as error:
            self._give_up(str(self._file.disk_error(error)))


class _Syncer:
    """Syncs a file in a thread of its own, so that a slow disk delays no flush."""

    def __init__(self, file: CaptureFile) -> None:
        self.tick = -1
        """The last synced tick."""
        self.lags = False
        """Whether rows were written since the last request."""
        self.error: OSError | None = None
        self._file = file
        self._written = -1
        self._requests: SimpleQueue[int | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="capture-sync", daemon=True)
        self._thread.start()

    def written(self, tick: int) -> None:
        """Record that everything up to a tick is written."""
        self._written = tick
        self.lags = True

    def request(self) -> None:
        """Request a sync; return at once."""
        self.lags = False
        self._requests.put(self._written)

    def end(self) -> None:
        """Wait for requested syncs, and end the thread; a second call does nothing."""
        self._requests.put(None)
        self._thread.join()

    def _run(self) -> None:
        while (tick := self._requests.get()) is not None:
            try:
                self._file.sync()
                self.tick = tick
            except OSError as error:
                self.error = error


def _rows_in(item: Item) -> int:
    return 1 + item.packets if isinstance(item, Tick) else 1
