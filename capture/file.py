"""The file of a capture: writes ticks, epochs and log lines as rows, in the caller's thread.

An existing file is never overwritten. A restarted writer leaves the files that are there as they are and begins the
next one, after their last whole chunk: it skips what they have, so a whole journal may be fed to it. The ordered end of
such a capture joins its files (`join`), unless it is split by size or time.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import msgspec

from foosim.capture.contents import (
    ASSETS,
    CHUNK_BYTES,
    DEPLOYMENT,
    OWN,
    VERSIONS,
    check_new,
    declare_topics,
    write_all,
)
from foosim.capture.foxglove import LOG, POSES, SCENE, View
from foosim.capture.left import Progress, find_left, progress
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Message
from foosim.capture.mcap.writer import McapWriter
from foosim.capture.new_file import sync_folder, written
from foosim.capture.parts import END_METADATA, METADATA, NEXT, files_from, head_of, part_path, parts_at
from foosim.capture.rows import (
    EPOCHS,
    FORMAT,
    FRAME,
    PACKETS,
    PROFILE,
    TICK,
    EpochRow,
    FrameRow,
    OutboxRow,
    OwnerRow,
    Row,
)
from foosim.capture.shown_readings import ShownReadings
from foosim.capture.split import Split
from foosim.common.errors import Failed, Refused
from foosim.common.json_text import encode_json
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Epoch
from foosim.runtime.disk import Room, room_on_disk, size_like
from foosim.world.frame import Frame
from foosim.world.robot_packets import RobotPacket

if TYPE_CHECKING:
    from foosim.capture.reader import About


Entry = tuple[str, int, int, int, Row]
"""A row with its place: topic, log time and publish time (simulated ns), sequence number."""
Encode = Callable[[Row], bytes]
ONE_FILE: Final = {"split_bytes": None, "split_ns": None, "last_ns": None}
"""Settings of a capture in one file."""


@dataclass(frozen=True, slots=True)
class Line:
    """A log line that waits for the capture."""

    level: str
    text: str
    tick: int


@dataclass(frozen=True, slots=True)
class Tick:
    """What a capture takes of a closed tick. The last one of a run has a frame and packets alone.

    `rows` returns its rows other than packets after a known frame (None: the first), `add_packets` adds the `packets`
    to a channel of a file.
    """

    frame: Frame
    digest: bytes
    chain: bytes
    rows: Callable[[Frame | None], Iterable[Entry]]
    add_packets: Callable[[McapWriter, int, Encode], None]
    packets: int
    sensed: Iterable[RobotPacket] = ()


Item = Tick | Epoch | Line


@dataclass(frozen=True, slots=True)
class Described:
    """The capture's description of its run, beside the rows. `metadata` is added to that of the deployment.

    `versions` are the versions of libraries and components of the run.
    """

    deployment: Deployment
    name: str
    text: str
    metadata: Mapping[str, str]
    versions: Mapping[str, str]


class CaptureFile:
    """One capture on the disk. Raises CaptureError when it exists already, or cannot be written.

    With `journal_tick`, the first tick of a journal, existing files are the ones that this run left unfinished.
    One without a tick is begun again; a finished one is refused. `begins_next` decides whether the next file begins
    before an item, `begin_next` begins it.
    """

    def __init__(self, path: Path, described: Described, journal_tick: int | None = None) -> None:
        capture = described.deployment.capture
        self.path = path
        self.done = Progress()
        self.rows_before = 0
        """Rows of ticks, packets, epochs and the log that the files had which are continued."""
        self._described = described
        self._tick_ns = described.deployment.tick_ns
        self._view = View(described.deployment)
        self._shown = ShownReadings(described.deployment)
        self._encode = msgspec.json.Encoder().encode
        self._reserve = capture.reserve_bytes
        self._bytes_max = capture.bytes_max
        self._is_split = capture.is_split
        self._split = Split(path, capture, self._tick_ns)
        self._own: dict[str, str] | None = None
        """The metadata of the next file of a resumed capture, until it begins with the last frame that is there."""
        self._held: list[Epoch | Line] = []
        """What comes before that."""
        self._syncs = False
        self._swap = threading.Lock()
        """Held while the file is replaced by the next one, and while it is synced."""
        self._known: Frame | None = None
        """The frame of the last closing, written or pending."""
        self._joined: CaptureFile | None = None
        """The one file of a resumed capture, while and after it is written."""
        self._is_joined = False
        self._channels: dict[str, int] = {}
        self._file = -1
        try:
            if journal_tick is None:
                check_new(path)
            else:
                self._follow(journal_tick)
            self._file = self._open(self._split.path, os.O_EXCL if journal_tick is None else os.O_TRUNC)
            self.mcap = self._writer(self._file)
            if self._own is None:
                self._channels = self._describe(self.mcap, self._split.first_entries())
            self._saved = replace(self.done)
        except OSError as error:
            self._let_go()
            raise self.disk_error(error) from None

    # --- writing -----------------------------------------------------------------------------------------------------

    def write(self, item: Item) -> bool:
        """Write the rows of a closing, an epoch or a log line; return False without writing when the files have it."""
        if isinstance(item, Epoch) and item.epoch <= self.done.epoch:
            return False
        if self._own is not None and not isinstance(item, Tick):
            self._held.append(item)
        elif isinstance(item, Line):
            self._write_view(LOG, item.tick, self._view.log_line(item.level, item.text, item.tick))
        elif isinstance(item, Epoch):
            self._add_row(EPOCHS, item.tick, epoch_row(item))
            self.done.epoch = item.epoch
        elif self._has(item.frame.tick):
            self._pass(item)
            return False
        else:
            self._write_tick(item)
        return True

    def _add_row(self, topic: str, tick: int, row: Row) -> None:
        at_ns = tick * self._tick_ns
        self._add(Message(topic, at_ns, at_ns, tick & 0xFFFF_FFFF, self._encode(row)))

    def _has(self, tick: int) -> bool:
        """Whether the file has the rows of a closing; the last frame comes again with the packets in flight."""
        done, known = self.done, self._known
        return tick < done.tick or (tick == done.tick and (done.in_flight or known is None or known.tick < tick))

    def _write_tick(self, item: Tick) -> None:
        encode, done, tick = self._encode, self.done, item.frame.tick
        assert self._own is None, "a resumed capture begins with the last tick that it has"
        for topic, log_ns, publish_ns, sequence, row in item.rows(self._known):
            self._add(Message(topic, log_ns, publish_ns, sequence, encode(row)))
            if topic == FRAME:
                done.frame = tick
        item.add_packets(self.mcap, self._channels[PACKETS], encode)
        self._write_views(item.frame)
        if self._shown.topics:
            for topic, data in self._shown.messages(tick, item.sensed):
                self._write_view(topic, tick, data)
        self._known = item.frame
        done.tick = tick
        self._split.wrote(tick)

    def _add(self, message: Message) -> None:
        """Add a message to the chunk, and keep it where the next file must begin with it."""
        stamps = message.log_ns, message.publish_ns, message.sequence
        self.mcap.add_message(self._channels[message.topic], *stamps, message.data)
        self._split.in_force.take(message)

    def _pass(self, item: Tick) -> None:
        """Take the frame of a closing that the files have; with the last of them a resumed capture begins its file."""
        self._view.turn_to(item.frame)
        self._known = item.frame
        if self._own is not None and item.frame.tick == self.done.tick:
            self._begin_resumed(item)

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
        at_ns = tick * self._tick_ns
        self._add(Message(topic, at_ns, at_ns, tick & 0xFFFF_FFFF, data))

    def end_chunk(self) -> None:
        """Write the collected chunk to the file: a kill does not lose it from now on."""
        self.mcap.end_chunk()
        self._saved = replace(self.done)

    def end_large_chunk(self) -> None:
        """End the collected chunk if it is as large as a chunk may be."""
        if self.mcap.chunk_bytes > CHUNK_BYTES:
            self.end_chunk()

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
        """Write the last frame, the result, and the summary, and sync the file; join the files of a resumed capture.

        When the disk refuses the end, the file stays whole, without one. When it refuses the joined file, the capture
        stays in several.
        """
        if self._own is not None:
            self._begin_resumed(None)
        frame = self._known
        if frame is not None and self.done.frame < frame.tick == self.done.tick:
            self._add_row(FRAME, frame.tick, frame_row(frame))
            self.done.frame = frame.tick
        self._end(metadata)
        if self._split.number and not self._is_split:
            with suppress(Refused, OSError):  # in several files it is as whole
                self._join()

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
            self._syncs = True
            try:
                os.fdatasync(self._file)
            finally:
                self._syncs = False

    @property
    def is_syncing(self) -> bool:
        """Whether a sync of the file, or of the joined one, is under way."""
        return self._syncs or (self._joined is not None and self._joined.is_syncing)

    def close(self) -> None:
        """Close the file as it is; one that a resumed capture has not begun is removed."""
        os.close(self._file)
        if self._own is not None:
            self._split.path.unlink(missing_ok=True)

    @property
    def total_bytes(self) -> int:
        """Size of the capture in bytes, over all its files; while they are joined it grows with the joined file."""
        several = 0 if self._is_joined else self.mcap.offset + self._split.earlier_bytes
        return several + (0 if self._joined is None else self._joined.mcap.offset)

    def disk_error(self, error: OSError) -> CaptureError:
        """Return the message for a failed write."""
        return CaptureError(f"{self._split.path}: cannot be written, {error.strerror}")

    # --- a new file --------------------------------------------------------------------------------------------------

    def _open(self, path: Path, flags: int) -> int:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            return os.open(path, flags | os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise CaptureError(f"{path}: cannot be created, {error.strerror}") from None

    def _writer(self, file: int) -> McapWriter:
        return McapWriter(lambda content: write_all(file, content), PROFILE)

    def _describe(self, mcap: McapWriter, own: Mapping[str, str]) -> dict[str, int]:
        """Write what the run depends on beside its inputs, then the file's `own` metadata; its digests last.

        Return the channels of its topics.
        """
        described, deployment = self._described, self._described.deployment
        channels = declare_topics(mcap, self._shown.topics)
        content = {
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
        mcap.add_attachment(VERSIONS, "application/json", encode_json(described.versions))
        mcap.add_checks()
        return channels

    def _let_go(self) -> None:
        if self._file >= 0:
            os.close(self._file)
        self._file = -1

    # --- the next file -----------------------------------------------------------------------------------------------

    def begins_next(self, item: Item) -> bool:
        """Whether an item begins the next file: call `begin_next`, then write it."""
        if not isinstance(item, Tick) or item.frame.tick <= self.done.tick:
            return False
        return self._split.is_due(item.frame.tick, self.mcap.offset)

    def begin_next(self, item: Tick) -> None:
        """End this file, and begin the next one, for a closing; old files may be removed.

        Raises OSError, and all is as it was, when the disk refuses.
        """
        split, tick = self._split, item.frame.tick
        self.end_chunk()
        path = part_path(self.path, split.number + 1)
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        try:
            mcap = self._writer(file)
            own = split.entries(split.number + 1, None) | split.begin_entries(tick, item.digest, item.chain)
            self._describe(mcap, own)
            self._repeat(mcap, tick)
            sync_folder(path.parent)
            self._end({"reason": "continues", "last_tick": str(self.done.tick), NEXT: path.name})
        except OSError:
            os.close(file)
            path.unlink(missing_ok=True)
            raise
        with self._swap:
            os.close(self._file)
            self._file = file
        gone = split.begin_next(tick, self.mcap.offset, mcap.offset)
        self.mcap = mcap
        for old in gone:
            old.unlink(missing_ok=True)

    def _repeat(self, mcap: McapWriter, tick: int, rows: Iterable[Message] = ()) -> None:
        """Write the first chunk of a file that begins with a frame: the active state, rows, and a log line.

        It is never empty: a reader that comes from the file before skips the first chunk.
        """
        at_ns = tick * self._tick_ns
        text = f"continues {self._split.path.name}"
        line = Message(LOG, at_ns, at_ns, 0, self._view.log_line("info", text, tick))
        for message in (*self._split.in_force.messages(), *rows, line):
            mcap.add_message(self._channels[message.topic], at_ns, at_ns, message.sequence, message.data)
        mcap.end_chunk()

    # --- files that were left unfinished -----------------------------------------------------------------------------

    def _follow(self, journal_tick: int) -> None:
        """Prepare the file after the existing ones, if they have a tick."""
        run = self._described.metadata.get("run", "")
        for path in parts_at(self.path).values():
            if (other := head_of(path).get("run", run)) != run:
                raise CaptureError(f"{path}: is that of run {other}, not of run {run}")
        left = find_left(self.path)
        if left is None:
            return
        if journal_tick > left.done.tick + 1:
            lost = f"{left.torn_bytes} bytes from there on would be lost, no journal has tick {left.done.tick + 1}"
            raise CaptureError(f"{left.path}: byte {left.stop}: cut or damaged; {lost}")
        self.done, self.rows_before = left.done, left.rows
        kept = {key: value for key, value in left.head.items() if key not in OWN}
        self._described = replace(self._described, metadata=kept)
        self._split.follow(left)
        self._own = self._split.entries(self._split.number, left.stop)

    def _begin_resumed(self, last: Tick | None) -> None:
        """Begin the file of a resumed capture with the last frame that is there; without it where the run has ended."""
        own, self._own = self._own, None
        assert own is not None
        tick, rows = self.done.tick, list[Message]()
        if last is not None:
            own |= self._split.begin_entries(tick, last.digest, last.chain)
            for topic, log_ns, publish_ns, sequence, row in last.rows(None):
                if topic in (TICK, FRAME):
                    rows.append(Message(topic, log_ns, publish_ns, sequence, self._encode(row)))
        try:
            self._channels = self._describe(self.mcap, own)
            self._repeat(self.mcap, tick, rows)
        except OSError as error:
            raise self.disk_error(error) from None
        self._split.wrote(tick)
        self._saved = replace(self.done)
        for item in self._held:
            self.write(item)
        self._held.clear()

    # --- one file of all ---------------------------------------------------------------------------------------------

    def copy(self, message: Message) -> None:
        """Add a message of another file, of a topic that the deployment has; end a chunk that is large."""
        if message.topic in self._channels:
            self._add(message)
        self.end_large_chunk()

    def take(self, path: Path) -> tuple[Mapping[str, str], int, str]:
        """Copy the rows of a capture up to its end or the first damage.

        Return the metadata of its end, the bytes after its last whole chunk, and the damage, empty without any.
        """
        from foosim.capture.reader import Scan  # slow, and only joined files are read

        scan, last, damage = Scan(path), dict[str, bytes](), ""
        try:
            for message in scan.messages():
                self.copy(message)
                last[message.topic] = message.data
        except CaptureError as error:
            damage = str(error)
        self.done = progress(lambda topic: last.get(topic, b""))
        return scan.about.end, scan.about.unfinished_bytes, damage

    def _join(self) -> None:
        """Replace the files of a finished capture by one. Raises Refused, and leaves them as they are."""
        room = room_on_disk(self._file, self._reserve)
        if room.left - self.total_bytes < room.reserve:
            return
        following = files_from(self.path)[1:]
        with one_file(self.path, self._described) as self._joined:
            end, _, damage = self._joined.take(self.path)
            if damage:
                raise CaptureError(damage)
            self._joined.finish(end)
        self._is_joined = True
        for file in following:
            file.unlink()


def described_as(about: About, own: Mapping[str, str]) -> Described:
    """Return the description of a capture for another file of its rows, with the `own` metadata of that."""
    from foosim.capture.reader import deployment_of  # slow, and only copies of captures need it

    metadata = {**{key: value for key, value in about.metadata.items() if key not in OWN}, **own}
    return Described(deployment_of(about), about.deployment_name, about.deployment_text, metadata, about.versions)


def epoch_row(epoch: Epoch) -> EpochRow:
    """Return the row of an epoch."""
    owners = [OwnerRow(robot, node) for robot, node in epoch.owners]
    stated = epoch.digest.hex(), list(epoch.roster), owners, epoch.arithmetic.hex()
    return EpochRow(epoch.tick, epoch.epoch, *stated)


def frame_row(frame: Frame) -> FrameRow:
    """Return the row of a frame."""
    return FrameRow(frame.tick, frame.values.tobytes(), [OutboxRow(*item) for item in frame.outboxes.items()])


@contextmanager
def one_file(out: Path, described: Described) -> Iterator[CaptureFile]:
    """Give the file of a capture that has one file alone; it gets its name `out` when it is finished.

    Raises Failed when it cannot be written; nothing of it stays then.
    """
    capture = described.deployment.capture.model_copy(update=ONE_FILE)
    described = replace(described, deployment=described.deployment.model_copy(update={"capture": capture}))
    with written(out) as part:
        part.unlink(missing_ok=True)
        try:
            file = CaptureFile(part, described)
        except CaptureError as error:
            raise Failed(str(error)) from None
        try:
            yield file
        finally:
            file.close()
