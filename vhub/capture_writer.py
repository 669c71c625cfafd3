"""The writer of a capture: a thread that turns closings into rows behind the journal, and never loses one.

`keep` hands a closing over and returns; when the writer lags by more than the queue holds, `keep` waits, which slows
the run, and says so once. What is written is flushed at least every `capture.flush`, synced each second, and readable
when the process is killed. A disk error ends the writing: it is said once, and raised to the owner by whatever it
calls next. Neighbours: `rows` and `viewing` (what is written), `mcap_file` (how), `capture_reader`.
"""

from __future__ import annotations

import os
import platform
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

import msgspec

from foosim.protocol import limits
from foosim.protocol.codec import encode_json
from foosim.protocol.deployment import Deployment
from foosim.protocol.frame import Frame
from foosim.protocol.messages import Epoch
from foosim.vhub.mcap_file import McapWriter
from foosim.vhub.records import Closing
from foosim.vhub.rows import (
    FORMAT,
    FRAME,
    PROFILE,
    ROW_TYPES,
    CaptureError,
    epoch_entry,
    frame_row,
    plan_of,
    row_schema,
    rows_of,
)
from foosim.vhub.viewing import LOG, POSES, SCENE, VIEW_TYPES, View

METADATA: Final = "foosim"
END_METADATA: Final = "foosim.end"
DEPLOYMENT: Final = "deployment.yaml"
VERSIONS: Final = "versions.json"
ASSETS: Final = "assets/"
"""How the names of the files begin that the deployment refers to; their paths follow."""
GATHER_S: Final = 0.02
"""How long the writer lets closings gather: it wakes once for several, instead of taking the interpreter at each."""
BATCH_ROWS: Final = 2_000
"""How many rows are written between two looks at the clock."""
SYNC_NS: Final = 1_000_000_000
CHUNK_BYTES: Final = 4 * 1024 * 1024
"""A chunk is ended at this size, or when it is to be flushed; a reader holds one at a time."""
_LIBRARIES: Final = (
    *("foosim", "eclipse-zenoh", "foxglove-sdk", "mcap", "msgspec", "numpy", "pybullet", "pydantic", "zstandard"),
)


@dataclass(frozen=True, slots=True)
class CaptureStatistics:
    """How far a capture is: what is written, what waits, and how often the run had to wait for it."""

    rows: int
    bytes: int
    queued_rows: int
    waits: int
    written_tick: int
    synced_tick: int


@dataclass(frozen=True, slots=True)
class _Line:
    """A line of the log, on its way through the queue."""

    level: str
    text: str
    tick: int


_Item = Closing | Epoch | _Line


def library_versions() -> dict[str, str]:
    """Return the versions that a run depends on, for the capture."""
    versions = {"python": platform.python_version(), "platform": platform.platform()}
    for name in _LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions


class CaptureWriter:
    """Writes one capture. `metadata` (texts: run, fingerprint, ...) joins what the deployment tells.

    Raises CaptureError when the file exists already (it is never overwritten) or cannot be written. `say` takes what
    people should know, as (level, text). `keep`, `log` and `finish` are for one thread.
    """

    def __init__(
        self,
        path: Path,
        deployment: Deployment,
        deployment_name: str,
        deployment_text: str,
        metadata: Mapping[str, str],
        say: Callable[[str, str], None] | None = None,
    ) -> None:
        self.path = path
        self._say = say or (lambda level, text: None)
        self._plan = plan_of(deployment)
        self._view = View(deployment)
        self._flush_ns = deployment.capture.flush_ns
        self._encode = msgspec.json.Encoder().encode
        self._known: Frame | None = None
        self._frame_written = -1
        self._synced_tick = -1
        self._error: BaseException | None = None
        self._error_said = False
        self._queue: deque[_Item] = deque()
        self._queued_rows = self._waits = 0
        self._ending: Mapping[str, str] | None = None
        self._idle = False
        """Whether the thread waits to be told of the next row."""
        self._is_unsynced = True
        self._changed = threading.Condition()
        """Guards the queue, the error and the ends; notified when any of them changes in a way that is waited for."""
        self._file = self._create()
        try:
            self._mcap = McapWriter(self._write_bytes, PROFILE)
            self._channels = self._declare()
            self._describe(deployment, deployment_name, deployment_text, metadata)
        except OSError as error:
            os.close(self._file)
            raise self._disk_error(error) from None
        self._thread = threading.Thread(target=self._run, name="capture", daemon=True)
        self._thread.start()

    # --- what the owner calls ----------------------------------------------------------------------------------------

    def keep(self, item: Closing | Epoch) -> None:
        """Hand over what one closing gave, or an epoch that begins; wait while the queue is full."""
        self._put(item)

    def log(self, level: str, text: str, tick: int) -> None:
        """Hand over a line of the run's log; `level` is info, warning or error."""
        self._put(_Line(level, text, tick))

    def finish(self, metadata: Mapping[str, str] | None = None) -> None:
        """Write what waits, the last frame and the summary; a second call does nothing. `metadata`: how it ended."""
        with self._changed:
            if self._ending is None:
                self._ending = {} if metadata is None else dict(metadata)
            self._changed.notify_all()
        self._thread.join()
        self._raise_error()

    @property
    def synced_tick(self) -> int:
        """The last tick whose rows no power failure takes away; the journal is done with those before."""
        return self._synced_tick

    def statistics(self) -> CaptureStatistics:
        known = self._known
        return CaptureStatistics(
            self._mcap.messages,
            self._mcap.offset,
            self._queued_rows,
            self._waits,
            -1 if known is None else known.tick,
            self._synced_tick,
        )

    def _put(self, item: _Item) -> None:
        rows = _rows_in(item)
        with self._changed:
            assert self._ending is None, "a row after the end"
            full = self._is_full(rows)
            self._waits += full
            first = full and self._waits == 1
        if first:
            self._say("warning", f"the run waits for its capture {self.path}: {self._queued_rows} rows are queued")
        with self._changed:
            while self._is_full(rows) and self._error is None:
                self._changed.wait()
            self._queue.append(item)
            self._queued_rows += rows
            if self._idle:
                self._idle = False
                self._changed.notify_all()
        self._raise_error()

    def _is_full(self, rows: int) -> bool:
        """A single closing larger than the queue goes in alone."""
        return self._queued_rows > 0 and self._queued_rows + rows > limits.CAPTURE_QUEUE_ROWS_MAX

    def _raise_error(self) -> None:
        if self._error is None:
            return
        if not self._error_said:
            self._error_said = True
            self._say("error", f"the capture has ended: {self._error}")
        raise self._error

    # --- the thread --------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            self._write_all()
        except OSError as error:
            self._fail(self._disk_error(error))
        except BaseException as error:  # noqa: BLE001  # raised again by what the owner calls next
            self._fail(error)
        finally:
            os.close(self._file)

    def _fail(self, error: BaseException) -> None:
        with self._changed:
            self._error = error
            self._changed.notify_all()

    def _write_all(self) -> None:
        interval_ns = self._flush_ns * 3 // 4  # sooner than asked, by what gathering and a batch take
        flush_at_ns = sync_at_ns = time.monotonic_ns()
        ending = False
        while not ending:
            until_ns = flush_at_ns if self._mcap.chunk_bytes else sync_at_ns if self._is_unsynced else None
            items, ending = self._take(until_ns)
            for item in items:
                self._write_item(item)
            now_ns = time.monotonic_ns()
            if now_ns >= flush_at_ns or self._mcap.chunk_bytes > CHUNK_BYTES:
                self._mcap.end_chunk()
                flush_at_ns = now_ns + interval_ns
            if now_ns >= sync_at_ns and self._is_unsynced and not self._mcap.chunk_bytes:
                self._sync()
                sync_at_ns = now_ns + SYNC_NS
        self._end()

    def _take(self, until_ns: int | None) -> tuple[list[_Item], bool]:
        """Take a batch of what has gathered, after a wait for anything, or until something is to be flushed.

        Also return whether nothing comes after it.
        """
        with self._changed:
            while not self._queue and self._ending is None:
                self._idle = True
                if until_ns is None:
                    self._changed.wait()
                elif not self._changed.wait(max(0, until_ns - time.monotonic_ns()) * 1e-9):
                    break
            self._idle = False
            gather = self._ending is None and 0 < self._queued_rows < BATCH_ROWS
        if gather:
            time.sleep(GATHER_S)
        items: list[_Item] = []
        rows = 0
        with self._changed:
            while self._queue and rows < BATCH_ROWS:
                items.append(self._queue.popleft())
                rows += _rows_in(items[-1])
            self._queued_rows -= rows
            self._changed.notify_all()
            return items, self._ending is not None and not self._queue

    def _write_item(self, item: _Item) -> None:
        self._is_unsynced = True
        if isinstance(item, _Line):
            data = self._view.log_line(item.level, item.text, item.tick)
            self._write_view(LOG, item.tick, data)
            return
        add, encode, channels = self._mcap.add_message, self._encode, self._channels
        if isinstance(item, Epoch):
            topic, log_ns, publish_ns, sequence, row = epoch_entry(item, self._plan)
            add(channels[topic], log_ns, publish_ns, sequence, encode(row))
            return
        for topic, log_ns, publish_ns, sequence, row in rows_of(item, self._plan, self._known):
            add(channels[topic], log_ns, publish_ns, sequence, encode(row))
            if topic == FRAME:
                self._frame_written = item.frame.tick
        self._write_views(item.frame)
        self._known = item.frame

    def _write_views(self, frame: Frame) -> None:
        known = self._known
        if known is not None and known.tick == frame.tick:
            return
        changed = known is None or known.layout.digest != frame.layout.digest
        if changed:
            self._write_view(SCENE, frame.tick, self._view.turn_to(frame))
        if changed or frame.tick % self._view.poses_every == 0:
            self._write_view(POSES, frame.tick, self._view.poses(frame))

    def _write_view(self, topic: str, tick: int, data: bytes) -> None:
        at_ns = tick * self._plan.tick_ns
        self._mcap.add_message(self._channels[topic], at_ns, at_ns, tick & 0xFFFF_FFFF, data)

    def _end(self) -> None:
        """Write the last frame, how it ended, and the summary."""
        frame = self._known
        if frame is not None and self._frame_written != frame.tick:
            self._write_view(FRAME, frame.tick, self._encode(frame_row(frame)))
        self._mcap.end_chunk()
        assert self._ending is not None
        self._mcap.add_metadata(END_METADATA, self._ending)
        self._mcap.finish()
        self._sync()

    # --- the file ----------------------------------------------------------------------------------------------------

    def _create(self) -> int:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if not os.path.lexists(self.path):
                return os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise CaptureError(f"{self.path}: cannot be created, {error.strerror}") from None
        raise CaptureError(f"{self.path}: exists already; a capture is never overwritten")

    def _declare(self) -> dict[str, int]:
        """Declare all topics, also those that stay empty."""
        channels = {}
        for topic, kind in ROW_TYPES.items():
            schema = (f"foosim.{kind.__name__.removesuffix('Row')}", "jsonschema", encode_json(row_schema(kind)))
            channels[topic] = self._mcap.add_channel(topic, "json", schema)
        for topic, message in VIEW_TYPES.items():
            view_schema = message.get_schema()
            content = (view_schema.name, view_schema.encoding, view_schema.data)
            channels[topic] = self._mcap.add_channel(topic, "protobuf", content)
        return channels

    def _describe(self, deployment: Deployment, name: str, text: str, metadata: Mapping[str, str]) -> None:
        """Write what a run depended on beside its inputs."""
        content = {
            **metadata,
            "format": str(FORMAT),
            "world": deployment.world,
            "seed": str(deployment.seed),
            "tick_ns": str(deployment.tick_ns),
            "deployment": name,
        }
        self._mcap.add_metadata(METADATA, content)
        self._mcap.add_attachment(DEPLOYMENT, "application/yaml", text.encode())
        for path, file in deployment.asset_files.items():
            self._mcap.add_attachment(ASSETS + path, "application/octet-stream", file)
        self._mcap.add_attachment(VERSIONS, "application/json", encode_json(library_versions()))

    def _write_bytes(self, content: bytes) -> None:
        written = os.write(self._file, content)
        while written < len(content):
            written += os.write(self._file, content[written:])

    def _sync(self) -> None:
        os.fdatasync(self._file)
        self._is_unsynced = False
        if self._known is not None:
            self._synced_tick = self._known.tick

    def _disk_error(self, error: OSError) -> CaptureError:
        return CaptureError(f"{self.path}: cannot be written, {error.strerror}")


def _rows_in(item: _Item) -> int:
    return 1 + len(item.fates) if isinstance(item, Closing) else 1
