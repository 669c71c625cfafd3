"""The file of a capture: writes closings, epochs and log lines as rows, in the caller's thread.

A new file is never written over an old one. A file that its writer left unfinished is gone on with behind its last
whole chunk: what it has already is not written again, so a whole journal may be fed to it.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import msgspec

from foosim.capture.contents import (
    ASSETS,
    DEPLOYMENT,
    OWN,
    VERSIONS,
    check_new,
    declare_topics,
    library_versions,
    sync_folder,
    write_all,
)
from foosim.capture.foxglove import LOG, POSES, SCENE, View
from foosim.capture.mcap.checks import CHECKS, CaptureError
from foosim.capture.mcap.earlier_crc import EarlierCrc
from foosim.capture.mcap.format import Book, Message
from foosim.capture.mcap.scan import Scanned, read_messages
from foosim.capture.mcap.writer import McapWriter
from foosim.capture.parts import END_METADATA, METADATA, NEXT, part_path, parts_at
from foosim.capture.rows import FORMAT, FRAME, LAYOUT, PACKETS, PROFILE
from foosim.capture.shown_readings import ShownReadings
from foosim.capture.state_at import HOLDING
from foosim.common.json_text import encode_json
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Epoch
from foosim.runtime.disk import Room, room_on_disk, size_like
from foosim.vhub.network.custom_models import model_versions
from foosim.vhub.recording.model_hash import MODEL_HASH, model_hash
from foosim.vhub.recording.rows_of_closing import add_packets, epoch_entry, frame_row, plan_of, world_rows
from foosim.vhub.recording.split import Split
from foosim.vhub.recording.unfinished import Left, Progress, look, run_of
from foosim.vhub.state.records import Closing
from foosim.world.assembly.used_forms import foreign_versions
from foosim.world.frame import Frame


@dataclass(frozen=True, slots=True)
class Line:
    """A log line that waits for the capture."""

    level: str
    text: str
    tick: int


Item = Closing | Epoch | Line


@dataclass(frozen=True, slots=True)
class Described:
    """The capture's description of its run, beside the rows. `metadata` is added to that of the deployment.

    `versions` are those that the run depended on, None: this process's.
    """

    deployment: Deployment
    name: str
    text: str
    metadata: Mapping[str, str]
    versions: Mapping[str, str] | None = None


class CaptureFile:
    """One capture on the disk. Raises CaptureError when it exists already, or cannot be written.

    With `journal_tick`, from which on a journal has all ticks, a file that is there is one that this run left
    unfinished: it is gone on with behind its last whole chunk. A file that ends before its description is begun anew;
    one that has its end is refused. A capture that is split (`capture.split_size`, `split_time`) goes on in another
    file where `begins_next` says so and `go_on` is called; of its files that were left the last is gone on with.
    """

    def __init__(self, path: Path, described: Described, journal_tick: int | None = None) -> None:
        capture = described.deployment.capture
        self.path = path
        self.done = Progress()
        self._described = described
        self._plan = plan_of(described.deployment)
        self._view = View(described.deployment)
        self._shown = ShownReadings(described.deployment)
        self._encode = msgspec.json.Encoder().encode
        self._reserve = capture.reserve_bytes
        self._bytes_max = capture.bytes_max
        self._split = Split(path, capture, self._plan.tick_ns) if capture.is_split else None
        self.is_syncing = False
        self._swap = threading.Lock()
        """Held while the file is replaced by the next one, and while it is synced."""
        self._known: Frame | None = None
        """The frame of the last closing, written or pending."""
        self._file = -1
        try:
            found = None if journal_tick is None else self._go_on_with_left(journal_tick)
            if journal_tick is None:
                self._file = self._open(path, os.O_WRONLY | os.O_EXCL)
            self.mcap = self._writer(self._file, None if found is None else found.book)
            if found is None:
                self._channels = self._describe(self.mcap, {} if self._split is None else self._split.entries())
            else:
                self._channels = {channel.topic: channel.id for channel in found.book.channels}
            self._saved = replace(self.done)
        except OSError as error:
            self._let_go()
            raise self.disk_error(error) from None
        except CaptureError:
            self._let_go()
            raise

    # --- writing -----------------------------------------------------------------------------------------------------

    def write(self, item: Item) -> bool:
        """Write the rows of a closing, an epoch or a log line; return False without writing when the file has them."""
        if isinstance(item, Line):
            self._write_view(LOG, item.tick, self._view.log_line(item.level, item.text, item.tick))
        elif isinstance(item, Epoch):
            if item.epoch <= self.done.epoch:
                return False
            topic, log_ns, publish_ns, sequence, row = epoch_entry(item, self._plan)
            self._add(Message(topic, log_ns, publish_ns, sequence, self._encode(row)))
            self.done.epoch = item.epoch
        elif self._has(item.frame.tick):
            self._pass(item.frame)
            return False
        else:
            self._write_closing(item)
        return True

    def copy(self, message: Message) -> None:
        """Add a message of another file of the run; `done` is the caller's."""
        self._add(message)

    def _has(self, tick: int) -> bool:
        """Whether the file has the rows of a closing; the last frame comes again with the packets in flight."""
        done, known = self.done, self._known
        return tick < done.tick or (tick == done.tick and (done.in_flight or known is None or known.tick < tick))

    def _write_closing(self, closing: Closing) -> None:
        encode, done, tick = self._encode, self.done, closing.frame.tick
        for topic, log_ns, publish_ns, sequence, row in world_rows(closing, self._plan, self._known):
            self._add(Message(topic, log_ns, publish_ns, sequence, encode(row)))
            if topic == FRAME:
                done.frame = tick
        add_packets(self.mcap, self._channels[PACKETS], closing.fates, encode)
        self._write_views(closing.frame)
        if self._shown.topics:
            for topic, data in self._shown.messages(tick, closing.sensed):
                self._write_view(topic, tick, data)
        self._known = closing.frame
        done.tick = tick
        if self._split is not None:
            self._split.wrote(tick)

    def _add(self, message: Message) -> None:
        """Add a message to the chunk, and keep it where the next file must begin with it."""
        stamps = message.log_ns, message.publish_ns, message.sequence
        self.mcap.add_message(self._channels[message.topic], *stamps, message.data)
        if self._split is not None:
            self._split.in_force.take(message)

    def _pass(self, frame: Frame) -> None:
        """Record that the file has a frame."""
        self._view.turn_to(frame)
        self._known = frame

    def _write_views(self, frame: Frame) -> None:
        known = self._known
        if known is not None and known.tick == frame.tick:
            return
        scene = self._view.turn_to(frame)
        if scene is not None:
            self._write_view(SCENE, frame.tick, scene)
        if scene is not None or frame.tick % self._view.poses_every == 0:
            self._write_view(POSES, frame.tick, self._view.poses(frame))

    def _write_view(self, topic: str, tick: int, data: bytes) -> None:
        at_ns = tick * self._plan.tick_ns
        self._add(Message(topic, at_ns, at_ns, tick & 0xFFFF_FFFF, data))

    def end_chunk(self) -> None:
        """Write the collected chunk to the file: a kill does not lose it from now on."""
        self.mcap.end_chunk()
        self._saved = replace(self.done)

    def room(self) -> Room:
        """Return the bytes that can still be written: the lesser of the disk's space and the capture's limit."""
        last = self.mcap.summary_bytes
        on_disk = room_on_disk(self._file, self._reserve)
        rooms = [replace(on_disk, left=on_disk.left - last)]
        if self._bytes_max is not None:
            left = self._bytes_max - self.total_bytes - last
            reserve = min(self._reserve, self._bytes_max // 8)
            where = f"of the {size_like(self._bytes_max, reserve)} that it may have"
            rooms.append(Room(left, reserve, where))
        return min(rooms, key=lambda room: room.left / room.reserve)

    def give_up(self) -> None:
        """Drop the collected chunk and truncate a part of it in the file, which is then valid but unfinished."""
        self.mcap.drop_chunk()
        self.done = replace(self._saved)
        os.ftruncate(self._file, self.mcap.offset)
        os.lseek(self._file, self.mcap.offset, os.SEEK_SET)

    def finish(self, metadata: Mapping[str, str]) -> None:
        """Write the last frame, the result, and the summary, and sync the file.

        When the disk refuses the end, the file stays whole, without one.
        """
        frame = self._known
        if frame is not None and self.done.frame < frame.tick == self.done.tick:
            self._write_view(FRAME, frame.tick, self._encode(frame_row(frame)))
        self._end(metadata)

    def _end(self, metadata: Mapping[str, str]) -> None:
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
        """Sync the file."""
        with self._swap:
            self.is_syncing = True
            try:
                os.fdatasync(self._file)
            finally:
                self.is_syncing = False

    def close(self) -> None:
        """Close the file as it is."""
        os.close(self._file)

    @property
    def total_bytes(self) -> int:
        """Size of the capture in bytes, over all its files."""
        return self.mcap.offset + (0 if self._split is None else self._split.earlier_bytes)

    def disk_error(self, error: OSError) -> CaptureError:
        """Return the message for a failed write."""
        path = self.path if self._split is None else self._split.path
        return CaptureError(f"{path}: cannot be written, {error.strerror}")

    # --- a new file --------------------------------------------------------------------------------------------------

    def _open(self, path: Path, flags: int) -> int:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if flags & os.O_EXCL:
                check_new(path, is_split=self._split is not None)
            return os.open(path, flags | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise CaptureError(f"{path}: cannot be created, {error.strerror}") from None

    def _writer(self, file: int, book: Book | None = None) -> McapWriter:
        earlier = None if book is None else EarlierCrc(file, book.offset)
        return McapWriter(lambda content: write_all(file, content), PROFILE, book, earlier)

    def _describe(self, mcap: McapWriter, own: Mapping[str, str]) -> dict[str, int]:
        """Write what the run depends on beside its inputs, then the file's `own` metadata; its digests last.

        Return the channels of its topics.
        """
        described, deployment = self._described, self._described.deployment
        channels = declare_topics(mcap, self._shown.topics)
        content = {
            MODEL_HASH: model_hash(deployment),
            "format": str(FORMAT),
            **described.metadata,
            "world": deployment.world,
            "seed": str(deployment.seed),
            "tick_ns": str(deployment.tick_ns),
            "deployment": described.name,
            **own,
        }
        mcap.add_metadata(METADATA, content)
        mcap.add_attachment(DEPLOYMENT, "application/yaml", described.text.encode())
        for path, file in deployment.asset_files.items():
            mcap.add_attachment(ASSETS + path, "application/octet-stream", file)
        mcap.add_attachment(VERSIONS, "application/json", self._versions)
        mcap.add_checks()
        return channels

    @cached_property
    def _versions(self) -> bytes:
        described = self._described
        deployment = described.deployment
        now = library_versions() | model_versions(deployment.network) | foreign_versions(deployment)
        return encode_json(described.versions or now)

    def _let_go(self) -> None:
        if self._file >= 0:
            os.close(self._file)
        self._file = -1

    # --- the next file -----------------------------------------------------------------------------------------------

    def begins_next(self, item: Item) -> bool:
        """Whether an item begins the next file: call `begin_next`, then write it."""
        if self._split is None or not isinstance(item, Closing) or item.frame.tick <= self.done.tick:
            return False
        return self._split.is_due(item.frame.tick, self.mcap.offset)

    def begin_next(self, closing: Closing) -> None:
        """End this file, and begin the next one, for a closing; old files may be removed.

        Raises OSError, and all is as it was, when the disk refuses.
        """
        split = self._split
        assert split is not None
        self.end_chunk()
        path = part_path(self.path, split.number + 1)
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        try:
            mcap = self._writer(file)
            self._describe(mcap, split.entries(closing))
            self._repeat(mcap, closing.frame)
            sync_folder(path.parent)
            self._end({"reason": "goes on", "last_tick": str(self.done.tick), NEXT: path.name})
        except OSError:
            os.close(file)
            path.unlink(missing_ok=True)
            raise
        with self._swap:
            os.close(self._file)
            self._file = file
        gone = split.begin_next(closing.frame.tick, self.mcap.offset, mcap.offset)
        self.mcap = mcap
        for old in gone:
            old.unlink(missing_ok=True)

    def _repeat(self, mcap: McapWriter, frame: Frame) -> None:
        """Write the first chunk of a file that begins with a frame: the active state, and a log line.

        There is always something in it: who comes from the file before passes the first chunk by.
        """
        split = self._split
        assert split is not None
        at_ns = frame.tick * self._plan.tick_ns
        is_new = self._known is None
        text = f"goes on from {split.path.name}"
        line = Message(LOG, at_ns, at_ns, 0, self._view.log_line("info", text, frame.tick))
        for message in (*split.in_force.messages(), line):
            if not is_new or message.topic not in (LAYOUT, SCENE):
                mcap.add_message(self._channels[message.topic], at_ns, at_ns, message.sequence, message.data)
        mcap.end_chunk()

    # --- files that were left unfinished -----------------------------------------------------------------------------

    def _go_on_with_left(self, journal_tick: int) -> Scanned | None:
        """Open the last unfinished file, and truncate it after its last valid chunk; None when it must be begun anew.

        A file without a tick, which is not the only one, is dropped: it comes again behind the one before.
        """
        there = {0: self.path} if self._split is None else parts_at(self.path) or {0: self.path}
        dropped: list[Left] = []
        for number, path in sorted(there.items(), reverse=True):
            self._let_go()
            self._file = self._open(path, os.O_RDWR)
            left = look(self._file, path)
            if left.done.tick >= 0 or number == min(there):
                break
            dropped.append(left)
        self.done = left.done
        for found in (left, *dropped):
            self._check_left(found, journal_tick)
        for found in dropped:
            found.path.unlink()
        return self._cut(number, left)

    def _check_left(self, left: Left, journal_tick: int) -> None:
        run = self._described.metadata.get("run", "")
        if (run_of(left) or run) != run:
            raise CaptureError(f"{left.path}: is that of run {run_of(left)}, not of run {run}")
        if left.found.book.chunks and not _is_described(left.found):
            raise CaptureError(f"{left.path}: no capture of foosim, it lacks {CHECKS}")
        if left.found.is_damaged and journal_tick > self.done.tick + 1:
            lost = f"{left.torn_bytes} bytes from there on would be lost, no journal has tick {self.done.tick + 1}"
            raise CaptureError(f"{left.path}: byte {left.found.book.offset}: damaged; {lost}")

    def _cut(self, number: int, left: Left) -> Scanned | None:
        found, split = left.found, self._split
        is_described = _is_described(found)
        if number and not is_described:
            raise CaptureError(f"{left.path}: ends before its description, and no file before it is there")
        if split is not None and is_described:
            first = found.book.chunks[0].chunk_start_offset if found.book.chunks else found.book.offset
            split.take_over(number, first, is_empty=left.done.tick < 0)
            own = {key: value for key, value in found.metadata[METADATA].items() if key not in OWN}
            self._described = replace(self._described, metadata=own)
            with os.fdopen(os.dup(self._file), "rb") as stream:
                for message in read_messages(stream, found.book, HOLDING):
                    split.in_force.take(message)
        end = found.book.offset if is_described else 0
        os.ftruncate(self._file, end)
        os.lseek(self._file, end, os.SEEK_SET)
        return found if is_described else None


def _is_described(found: Scanned) -> bool:
    return CHECKS in found.metadata
