"""The file of a capture: closings, epochs and lines become rows in it, one after the other, in the caller's thread.

A new file is never written over an old one. A file that its writer left unfinished is gone on with behind its last
whole chunk: what it has already is not written again, so a whole journal may be fed to it. Neighbours: `rows` and
`viewing` (what is written), `mcap_file` and `mcap_scan` (how), `capture_writer` (the thread), `capture_recovery`.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Final

import msgspec

from foosim.protocol.codec import decode_json, encode_json
from foosim.protocol.deployment import Deployment
from foosim.protocol.disk import Room, megabytes, room_on_disk
from foosim.protocol.errors import Malformed
from foosim.protocol.frame import Frame
from foosim.protocol.messages import Epoch, Origin
from foosim.vhub.link_models import model_versions
from foosim.vhub.mcap_file import McapWriter
from foosim.vhub.mcap_scan import NOTHING, UNSYNCED_BYTES, Scanned, Void, scan
from foosim.vhub.packet import IN_FLIGHT
from foosim.vhub.records import Closing
from foosim.vhub.resume import Captured
from foosim.vhub.rows import (
    EPOCHS,
    FORMAT,
    FRAME,
    PACKETS,
    PROFILE,
    ROW_TYPES,
    TICK,
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
ASSETS: Final = "assets/"
"""How the names of the files begin that the deployment refers to; their paths follow."""
VERSIONS: Final = "versions.json"
ORIGIN, ORIGIN_TICK, ORIGIN_DIGEST, ORIGIN_CHAIN = "from", "from_tick", "from_digest", "from_chain"
"""Where the run of a capture began, when not with frame 0: entries of the metadata `foosim`."""
CUT, CUT_TICK, CUT_DIGEST, CUT_CHAIN = "cut_from", "cut_tick", "cut_digest", "cut_chain"
"""Which capture a cut is of, the first frame that it has, its digest, and the chain up to it: entries there, too."""
CHUNK_BYTES: Final = 4 * 1024 * 1024
"""A chunk is ended at this size, or when it is to be flushed; a reader holds one at a time."""
_LIBRARIES: Final = (
    *("foosim", "eclipse-zenoh", "foxglove-sdk", "mcap", "msgspec", "numpy", "pybullet", "pydantic", "zstandard"),
)


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the log, on its way to the capture."""

    level: str
    text: str
    tick: int


Item = Closing | Epoch | Line


@dataclass(frozen=True, slots=True)
class Described:
    """What a capture says of its run beside the rows. `metadata` joins what the deployment tells."""

    deployment: Deployment
    name: str
    text: str
    metadata: Mapping[str, str]


@dataclass(slots=True)
class Progress:
    """How far a file is. What is -1 has not been written."""

    tick: int = -1
    """The last tick with a row of its own."""
    frame: int = -1
    epoch: int = -1
    in_flight: bool = False
    """Whether what was in flight at the end of the run is written."""


def origin_metadata(origin: Origin | None) -> dict[str, str]:
    """Return what a capture says of where its run began."""
    if origin is None:
        return {}
    digest, chain = origin.digest.hex(), origin.chain.hex()
    return {ORIGIN: origin.source, ORIGIN_TICK: str(origin.tick), ORIGIN_DIGEST: digest, ORIGIN_CHAIN: chain}


def declare_topics(mcap: McapWriter) -> dict[str, int]:
    """Declare all topics, also those that stay empty; return their channels."""
    channels = {}
    for topic, kind in ROW_TYPES.items():
        schema = (f"foosim.{kind.__name__.removesuffix('Row')}", "jsonschema", encode_json(row_schema(kind)))
        channels[topic] = mcap.add_channel(topic, "json", schema)
    for topic, message in VIEW_TYPES.items():
        view_schema = message.get_schema()
        content = (view_schema.name, view_schema.encoding, view_schema.data)
        channels[topic] = mcap.add_channel(topic, "protobuf", content)
    return channels


def library_versions() -> dict[str, str]:
    """Return the versions that a run depends on, for the capture."""
    versions = {"python": platform.python_version(), "platform": platform.platform()}
    for name in _LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions


def write_all(file: int, content: bytes) -> None:
    """Write to a file descriptor until all of it is written."""
    written = os.write(file, content)
    while written < len(content):
        written += os.write(file, content[written:])


def check_new(path: Path) -> None:
    """Raise CaptureError when there is something where a capture is to be."""
    if os.path.lexists(path):
        raise CaptureError(f"{path}: exists already; a capture is never overwritten")


class CaptureFile:
    """One capture on the disk. Raises CaptureError when it exists already, or cannot be written.

    With `journal_tick`, a file that is there is one that this run left unfinished: it is gone on with, and `torn_bytes`
    of it were cut off. A journal has all ticks from that one on: bytes that are damaged, not just cut, are only given
    up when it does. With `journal_end` so is what is further than the journal, chunk by chunk. A file that ends before
    its description is begun anew; one that has its end is refused. `at_once`: a run waits, and what was synced long ago
    is not looked through.
    """

    def __init__(
        self,
        path: Path,
        described: Described,
        journal_tick: int | None = None,
        journal_end: Captured | None = None,
        *,
        at_once: bool = False,
    ) -> None:
        self.path = path
        self.done = Progress()
        self.torn_bytes = 0
        self._plan = plan_of(described.deployment)
        self._view = View(described.deployment)
        self._encode = msgspec.json.Encoder().encode
        self._reserve = described.deployment.capture.reserve_bytes
        self._bytes_max = described.deployment.capture.bytes_max
        self._known: Frame | None = None
        """The frame of the last closing, written or not."""
        self._file = self._open(journal_tick is not None)
        try:
            run = described.metadata.get("run", "")
            found = None if journal_tick is None else self._scanned(journal_tick, journal_end, run, at_once)
            self.mcap = McapWriter(self._write_bytes, PROFILE, None if found is None else found.book)
            if found is None:
                self._channels = declare_topics(self.mcap)
                self._describe(described)
            else:
                self._channels = {channel.topic: channel.id for channel in found.book.channels}
                if found.to_index:
                    self.mcap.index_last_chunk(found.to_index)
            self._saved = replace(self.done)
        except OSError as error:
            os.close(self._file)
            raise self.disk_error(error) from None
        except CaptureError:
            os.close(self._file)
            raise

    # --- writing -----------------------------------------------------------------------------------------------------

    def write(self, item: Item) -> bool:
        """Write the rows of a closing, an epoch or a line; False, and none, when the file has them already."""
        if isinstance(item, Line):
            self._write_view(LOG, item.tick, self._view.log_line(item.level, item.text, item.tick))
        elif isinstance(item, Epoch):
            if item.epoch <= self.done.epoch:
                return False
            topic, log_ns, publish_ns, sequence, row = epoch_entry(item, self._plan)
            self.mcap.add_message(self._channels[topic], log_ns, publish_ns, sequence, self._encode(row))
            self.done.epoch = item.epoch
        elif item.frame.tick <= self.done.tick and (self._known is None or item.frame.tick > self._known.tick):
            self._pass(item.frame)
            return False
        else:
            self._write_closing(item)
        return True

    def _write_closing(self, closing: Closing) -> None:
        add, encode, channels, done = self.mcap.add_message, self._encode, self._channels, self.done
        tick = closing.frame.tick
        for topic, log_ns, publish_ns, sequence, row in rows_of(closing, self._plan, self._known):
            add(channels[topic], log_ns, publish_ns, sequence, encode(row))
            if topic == FRAME:
                done.frame = tick
        self._write_views(closing.frame)
        self._known = closing.frame
        done.tick = tick

    def _pass(self, frame: Frame) -> None:
        """Take notice of a frame that the file has."""
        known = self._known
        if known is None or known.layout.digest != frame.layout.digest:
            self._view.turn_to(frame)
        self._known = frame

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
        self.mcap.add_message(self._channels[topic], at_ns, at_ns, tick & 0xFFFF_FFFF, data)

    def end_chunk(self) -> None:
        """Write what is collected; who is killed from now on does not lose it."""
        self.mcap.end_chunk()
        self._saved = replace(self.done)

    def room(self) -> Room:
        """Return how much can still be written, on the disk and of what the capture may be, whichever is less."""
        last = self.mcap.summary_bytes
        on_disk = room_on_disk(self._file, self._reserve)
        rooms = [replace(on_disk, left=on_disk.left - last)]
        if self._bytes_max is not None:
            left = self._bytes_max - self.mcap.offset - last
            where = f"of the {megabytes(self._bytes_max)} that it may have"
            rooms.append(Room(left, min(self._reserve, self._bytes_max // 8), where))
        return min(rooms, key=lambda room: room.left / room.reserve)

    def give_up(self) -> None:
        """Drop what is collected and cut off what a disk took of it: the file is whole, without an end."""
        self.mcap.drop_chunk()
        self.done = replace(self._saved)
        os.ftruncate(self._file, self.mcap.offset)
        os.lseek(self._file, self.mcap.offset, os.SEEK_SET)

    def finish(self, metadata: Mapping[str, str]) -> None:
        """Write the last frame, how it ended, and the summary; the file is on the disk then.

        When the disk refuses the end, the file stays whole, without one.
        """
        frame = self._known
        if frame is not None and self.done.frame < frame.tick == self.done.tick:
            self._write_view(FRAME, frame.tick, self._encode(frame_row(frame)))
        self.end_chunk()
        whole = self.mcap.mark()
        try:
            self.mcap.add_metadata(END_METADATA, metadata)
            self.mcap.finish()
            self.sync()
        except OSError:
            self.mcap.rewind(whole)
            self.give_up()
            raise

    def sync(self) -> None:
        """Bring to the disk what was written."""
        os.fdatasync(self._file)

    def close(self) -> None:
        """Let go of the file, as it is."""
        os.close(self._file)

    def disk_error(self, error: OSError) -> CaptureError:
        """Return what to tell people of a disk that refuses."""
        return CaptureError(f"{self.path}: cannot be written, {error.strerror}")

    def _write_bytes(self, content: bytes) -> None:
        write_all(self._file, content)

    # --- a new file --------------------------------------------------------------------------------------------------

    def _open(self, go_on: bool) -> int:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if go_on:
                return os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
            check_new(self.path)
            return os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise CaptureError(f"{self.path}: cannot be created, {error.strerror}") from None

    def _describe(self, described: Described) -> None:
        """Write what a run depended on beside its inputs; the versions last."""
        deployment = described.deployment
        content = {
            **described.metadata,
            "format": str(FORMAT),
            "world": deployment.world,
            "seed": str(deployment.seed),
            "tick_ns": str(deployment.tick_ns),
            "deployment": described.name,
        }
        self.mcap.add_metadata(METADATA, content)
        self.mcap.add_attachment(DEPLOYMENT, "application/yaml", described.text.encode())
        for path, file in described.deployment.asset_files.items():
            self.mcap.add_attachment(ASSETS + path, "application/octet-stream", file)
        versions = library_versions() | model_versions(deployment.network)
        self.mcap.add_attachment(VERSIONS, "application/json", encode_json(versions))

    # --- a file that was left unfinished -----------------------------------------------------------------------------

    def _scanned(self, journal_tick: int, journal_end: Captured | None, run: str, at_once: bool) -> Scanned | None:
        """Return what the file has, cut at its last whole record; None when it has to be begun anew."""
        void = None if journal_end is None else _behind(journal_end, self._plan.tick_ns)
        with os.fdopen(os.dup(self._file), "rb") as stream:
            size = os.fstat(self._file).st_size
            if at_once and size > UNSYNCED_BYTES:
                with mmap(self._file, size - UNSYNCED_BYTES, access=ACCESS_READ) as old, memoryview(old) as trusted:
                    found = scan(stream, size, str(self.path), trusted, void)
            else:
                found = scan(stream, size, str(self.path), NOTHING, void)
        if found.finished:
            raise CaptureError(f"{self.path}: is finished; a capture is never overwritten")
        if found.metadata.get(METADATA, {}).get("run", run) != run:
            raise CaptureError(f"{self.path}: is that of run {found.metadata[METADATA]['run']}, not of run {run}")
        is_described = VERSIONS in {attachment.name for attachment in found.book.attachments}
        if found.book.chunks and not is_described:
            raise CaptureError(f"{self.path}: no capture of foosim, it lacks {VERSIONS}")
        self.done = _progress(found)
        end = found.book.offset if is_described else 0
        if not found.is_cut and journal_tick > self.done.tick + 1:
            why = "damaged" if not found.is_void else "further than its journal, whose end is lost"
            raise CaptureError(
                f"{self.path}: byte {end}: {why}; {found.torn_bytes} bytes from there on would be lost, "
                f"no journal has tick {self.done.tick + 1}"
            )
        self.torn_bytes = found.torn_bytes
        os.ftruncate(self._file, end)
        os.lseek(self._file, end, os.SEEK_SET)
        return found if is_described else None


def _behind(end: Captured, tick_ns: int) -> Void:
    """Return what a capture has behind the end of a journal."""
    fields = {TICK: ("tick", end.tick), EPOCHS: ("epoch", end.epoch)}

    def is_void(topic: str, data: bytes) -> bool:
        name, last = fields[topic]
        return _number(data, name) > last

    return Void(tuple(fields), max(0, end.tick) * tick_ns, is_void)


def _progress(found: Scanned) -> Progress:
    """Return how far a file is, by the last rows of its topics."""
    return Progress(
        _last_number(found, TICK, "tick"),
        _last_number(found, FRAME, "tick"),
        _last_number(found, EPOCHS, "epoch"),
        _last_row(found, PACKETS).get("fate") == IN_FLIGHT,
    )


def _last_row(found: Scanned, topic: str) -> dict[str, object]:
    return _row(found.last.get(topic, b"{}"))


def _row(data: bytes) -> dict[str, object]:
    try:
        row = decode_json(data)
    except Malformed:
        return {}
    return row if isinstance(row, dict) else {}


def _last_number(found: Scanned, topic: str, field: str) -> int:
    return _number(found.last.get(topic, b"{}"), field)


def _number(data: bytes, field: str) -> int:
    number = _row(data).get(field, -1)
    return number if isinstance(number, int) else -1
