"""The reader of captures: a finished or an unfinished file as numpy arrays, and the inputs of a re-simulation.

A file is read from start to end, with at most a chunk and the requested columns in memory: frames, packets and rows
are read when they are used. A damaged file, or a file of another format, raises `CaptureError`; a file whose
writer was killed gives everything up to its last whole chunk, and reports that.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
from mcap import records
from numpy.typing import NDArray

from foosim.capture.columns import (
    Frames,
    Integers,
    Numbers,
    Packets,
    Poses,
    frame_of,
    frames_of,
    packet_columns,
    poses_of,
)
from foosim.capture.contents import ASSETS, CUT, CUT_CHAIN, CUT_DIGEST, CUT_TICK, DEPLOYMENT, VERSIONS
from foosim.capture.mcap.checks import CHECKS, CaptureError
from foosim.capture.mcap.format import Message
from foosim.capture.parts import (
    END_METADATA,
    METADATA,
    NEXT,
    ORIGIN,
    ORIGIN_CHAIN,
    ORIGIN_DIGEST,
    ORIGIN_TICK,
    Joined,
    files_from,
    has_end,
)
from foosim.capture.rows import (
    CLIENTS,
    EPOCHS,
    FORMAT,
    FRAME,
    LAYOUT,
    METRICS,
    PACKETS,
    PROFILE,
    RECOVERIES,
    ROW_TYPES,
    TICK,
    ClientRow,
    DigestHex,
    EditRow,
    EpochRow,
    FrameRow,
    LayoutRow,
    MetricRow,
    PacketRow,
    RecoveryRow,
    Row,
    TickRow,
    delivered_of,
    edit_of,
)
from foosim.common.errors import Malformed, Refused
from foosim.common.json_text import decode_json
from foosim.common.names import nearest_name
from foosim.common.struct_types import Counter
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.world.assembly.initial_state import first_chain
from foosim.world.assembly.world import build_scene
from foosim.world.edits import Edit
from foosim.world.frame import Frame
from foosim.world.layout import Layout, build_layout
from foosim.world.robot_packets import Delivered
from foosim.world.start import Origin

DECODERS: Final = {topic: msgspec.json.Decoder(kind) for topic, kind in ROW_TYPES.items()}
"""Decodes and checks a row of each topic."""


class TickMark(msgspec.Struct, frozen=True, gc=False):
    """What of a row of /tick is read where the world is not simulated again; the rest is passed over."""

    tick: Counter
    digest: DigestHex
    edits: list[EditRow]


class FrameMark(msgspec.Struct, frozen=True, gc=False):
    """The tick of a row of /frame."""

    tick: Counter


TICK_MARKS: Final = msgspec.json.Decoder(TickMark)
FRAME_MARKS: Final = msgspec.json.Decoder(FrameMark)


def row_of(decoder: msgspec.json.Decoder[Any], message: Message, place: str = "") -> Any:
    """Return the row of a message. Raises CaptureError, whose text begins with `place`, for one that is damaged."""
    try:
        return decoder.decode(message.data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise CaptureError(f"{place}{message.topic} at {message.log_ns} ns: {error}") from None


@dataclass(frozen=True, slots=True)
class CapturedTick:
    """One tick as the capture has it: the frame's digests, and the inputs of the tick that led to it."""

    tick: int
    digest: bytes
    entities: tuple[bytes, ...]
    """64-bit digests, in name order."""
    edits: list[Edit]
    delivered: list[Delivered]


@dataclass(slots=True)
class About:
    """The description of a capture, beside its rows."""

    path: Path
    library: str = ""
    metadata: dict[str, str] = field(default_factory=dict)
    end: dict[str, str] = field(default_factory=dict)
    deployment_text: str = ""
    files: dict[str, bytes] = field(default_factory=dict)
    """The files that the deployment refers to, by path."""
    versions: dict[str, str] = field(default_factory=dict)
    finished: bool = False
    unfinished_bytes: int = 0
    start_ns: int = 0
    end_ns: int = 0
    """Simulated times of the first and the last message, once the file was read to its end."""
    chunk_starts: Sequence[int] = ()
    """That of the first message in each chunk, up to the one that is being read."""

    @property
    def deployment_name(self) -> str:
        return self.metadata["deployment"]


class Scan:
    """One pass over a file: yields the messages of some topics and collects the file's metadata (`about`)."""

    def __init__(self, path: Path, since_ns: int = 0) -> None:
        """`since_ns`: what was recorded long before that time is passed by, if it can be (`McapFile`)."""
        self.about = About(path)
        self._path = path
        self._since_ns = since_ns

    def messages(self, topics: frozenset[str] | None = None) -> Iterator[Message]:
        """Yield the messages of some topics (None: all), from the first one after the checked metadata."""
        file = Joined(self._path, self._since_ns, topics)
        self.about.chunk_starts = file.chunk_starts
        checked = False
        for content in file.contents():
            if isinstance(content, Message):
                if not checked:
                    self._check(file)
                    checked = True
                yield content
            else:
                self._take(content)
        about = self.about
        is_described = file.is_checked and about.metadata and about.deployment_text
        if not (checked or file.finished or is_described) and file.profile in ("", PROFILE):
            raise CaptureError(f"{self._path}: the capture is cut off before its first row")
        self._check(file)
        self.about.library = file.library
        self.about.finished = file.finished and NEXT not in self.about.end
        self.about.unfinished_bytes = file.unfinished_bytes
        self.about.start_ns, self.about.end_ns = min((file.end_ns, *file.chunk_starts)), file.end_ns

    def rows(self, topics: frozenset[str]) -> Iterator[tuple[str, Row]]:
        """Yield the rows of some topics."""
        for message in self.messages(topics):
            yield message.topic, self.decode(DECODERS[message.topic], message)

    def decode(self, decoder: msgspec.json.Decoder[Any], message: Message) -> Any:
        """Return the row of a message. Raises CaptureError."""
        return row_of(decoder, message, f"{self._path}: ")

    def _check(self, file: Joined) -> None:
        """Refuse other files, and captures of another format, before rows are read."""
        if file.profile != PROFILE or not self.about.metadata:
            raise CaptureError(f"{self._path}: no capture of foosim, its profile is {file.profile!r}, not {PROFILE!r}")
        found = self.about.metadata.get("format", "")
        if found != str(FORMAT):
            raise CaptureError(f"{self._path}: format {found!r} of the capture is unsupported, valid is '{FORMAT}'")
        if not self.about.deployment_text or "deployment" not in self.about.metadata:
            raise CaptureError(f"{self._path}: the capture has no deployment")
        if not file.is_checked:
            raise CaptureError(f"{self._path}: the capture lacks its metadata {CHECKS!r}")

    def _take(self, content: records.Metadata | records.Attachment) -> None:
        about = self.about
        if isinstance(content, records.Metadata):
            if content.name == METADATA:
                about.metadata = content.metadata
            elif content.name == END_METADATA:
                about.end = content.metadata
            return
        try:
            if content.name == DEPLOYMENT:
                about.deployment_text = content.data.decode()
            elif content.name.startswith(ASSETS):
                about.files[content.name.removeprefix(ASSETS)] = content.data
            elif content.name == VERSIONS:
                about.versions = msgspec.convert(decode_json(content.data), dict[str, str])
        except (Malformed, UnicodeDecodeError, msgspec.ValidationError) as error:
            raise CaptureError(f"{self._path}: attachment {content.name}: {error}") from None


@dataclass(frozen=True)
class CaptureData:
    """A capture, opened. Packets and frames are read at their first use, rows each time from the file."""

    about: About
    deployment: Deployment
    ticks: Integers
    """Ticks of the frames whose digests are there, ascending; all from 0 on in a whole capture."""
    digests: NDArray[np.uint8]
    """D(tick) of each, (n, 32)."""
    frame_ticks: Integers
    """Ticks of the frames that are there themselves."""
    edit_kinds: frozenset[str]
    """Kinds of the edits that the run had."""
    clients: tuple[ClientRow, ...]
    epochs: tuple[EpochRow, ...]
    recoveries: tuple[RecoveryRow, ...]

    @property
    def path(self) -> Path:
        return self.about.path

    @property
    def finished(self) -> bool:
        return self.about.finished

    @cached_property
    def frames(self) -> Frames:
        """All captured frames."""
        scan = Scan(self.path)
        reader = FrameReader(scan, self.deployment)
        rows = [row for message in scan.messages(FrameReader.TOPICS) if (row := reader.row(message)) is not None]
        return frames_of(str(self.path), reader.layout, build_scene(self.deployment, reader.layout).bodies, rows)

    def each_frame(self) -> Iterator[Frame]:
        """Yield the captured frames one by one."""
        scan = Scan(self.path)
        reader = FrameReader(scan, self.deployment)
        for message in scan.messages(FrameReader.TOPICS):
            frame = reader.frame(message)
            if frame is not None:
                yield frame

    def first_frame(self) -> Frame | None:
        """Return the first captured frame, None when there is none."""
        return next(self.each_frame(), None)

    @cached_property
    def packets(self) -> Packets:
        """All packets with their fates."""
        return packet_columns(row for row in self.rows(PACKETS) if isinstance(row, PacketRow))

    def rows(self, topic: str) -> Iterator[Row]:
        """Yield the rows of a topic, in the order of the file."""
        if topic not in ROW_TYPES:
            raise CaptureError(f"{self.path}: no rows of {topic!r}, there are {', '.join(sorted(ROW_TYPES))}")
        for _, row in Scan(self.path).rows(frozenset({topic})):
            yield row

    def metrics(self) -> dict[str, tuple[Integers, Numbers]]:
        """Return the ticks of each metric and its values from their closings on, by name (`MetricRow`)."""
        found: dict[str, tuple[array[int], array[float]]] = {}
        for row in self.rows(METRICS):
            assert isinstance(row, MetricRow)
            ticks, values = found.setdefault(row.name, (array("q"), array("d")))
            ticks.append(row.tick)
            values.append(row.value)
        return {name: (np.array(ticks), np.array(values)) for name, (ticks, values) in sorted(found.items())}

    def captured_ticks(self) -> Iterator[CapturedTick]:
        """Yield the inputs of a re-simulation, tick by tick."""
        for row in self.rows(TICK):
            assert isinstance(row, TickRow)
            yield captured_tick(row)

    def poses(self, name: str) -> Poses:
        """Return the poses of a link (`red.attack/slide`), or of an entity's last link (`red.attack`)."""
        names: set[str] = set()
        for body in self.frames.bodies.values():
            links = [part.name for part in body.links]
            names.update((body.name, *links))
            if name == body.name or name in links:
                return poses_of(self.frames, body, name if name in links else links[-1])
        nearest = nearest_name(name, sorted(names))
        hint = f", nearest is {nearest}" if nearest else ""
        raise CaptureError(f"{self.path}: nothing with a body is called {name!r}{hint}")


def captured_tick(row: TickRow) -> CapturedTick:
    """Return the inputs of a re-simulation in a row."""
    return CapturedTick(
        row.tick,
        bytes.fromhex(row.digest),
        tuple(bytes.fromhex(digest) for digest in row.entities),
        [edit_of(edit) for edit in row.edits],
        [delivered_of(delivered) for delivered in row.deliveries],
    )


def read_about(path: Path) -> About:
    """Return the description of a capture, finished or not, before its first row. Raises CaptureError."""
    scan = Scan(path)
    for _ in scan.messages():
        break
    scan.about.finished = has_end(files_from(path)[-1])
    return scan.about


def deployment_of(about: About) -> Deployment:
    """Return the deployment that a capture has attached. Raises CaptureError when it is not valid here."""
    try:
        return load_deployment(about.deployment_text, about.deployment_name).with_assets(about.files)
    except Refused as error:
        raise CaptureError(f"{about.path}: its deployment is not valid:\n{error}") from None


def open_capture(path: Path | str) -> CaptureData:
    """Open a capture, also an unfinished one. Raises CaptureError when it is none, or damaged."""
    scan = Scan(Path(path))
    ticks: array[int] = array("q")
    frame_ticks: array[int] = array("q")
    digests = bytearray()
    edit_kinds: set[str] = set()
    others: dict[str, list[Any]] = {CLIENTS: [], EPOCHS: [], RECOVERIES: []}
    for message in scan.messages(frozenset({TICK, FRAME, *others})):
        if message.topic == TICK:
            mark = scan.decode(TICK_MARKS, message)
            if ticks and mark.tick <= ticks[-1]:
                raise CaptureError(f"{path}: tick {mark.tick} follows tick {ticks[-1]}")
            ticks.append(mark.tick)
            digests += bytes.fromhex(mark.digest)
            edit_kinds.update(edit.kind for edit in mark.edits)
        elif message.topic == FRAME:
            frame_ticks.append(scan.decode(FRAME_MARKS, message).tick)
        else:
            others[message.topic].append(scan.decode(DECODERS[message.topic], message))
    return CaptureData(
        scan.about,
        deployment_of(scan.about),
        np.array(ticks, dtype=np.int64),
        np.frombuffer(bytes(digests), dtype=np.uint8).reshape(len(ticks), 32),
        np.array(frame_ticks, dtype=np.int64),
        frozenset(edit_kinds),
        tuple(others[CLIENTS]),
        tuple(others[EPOCHS]),
        tuple(others[RECOVERIES]),
    )


class FrameReader:
    """Reads the frames of a pass over a file, checked against the deployment's layout, which the file names first."""

    TOPICS: Final = frozenset({LAYOUT, FRAME})

    def __init__(self, scan: Scan, deployment: Deployment) -> None:
        self._scan = scan
        self.layout = build_layout(deployment)
        self._is_named = False

    def frame(self, message: Message) -> Frame | None:
        """Return the frame that a message of `TOPICS` brings; None where that is the layout. Raises CaptureError."""
        row = self.row(message)
        return None if row is None else frame_of(self.layout, row)

    def row(self, message: Message) -> FrameRow | None:
        """Return the row of a frame that a message brings; None where that is the layout. Raises CaptureError."""
        row: LayoutRow | FrameRow = self._scan.decode(DECODERS[message.topic], message)
        path = self._scan.about.path
        if isinstance(row, LayoutRow):
            check_layout(path, self.layout, row)
            self._is_named = True
            return None
        if not self._is_named:
            raise CaptureError(f"{path}: a frame without a layout before it")
        check_frame(path, self.layout, row)
        return row


def beginning_of(about: About) -> Origin | None:
    """Return where a capture begins, a cut or its run, None: at frame 0. Raises CaptureError."""
    entries, what = about.metadata, "it was cut"
    source, tick, digest, chain = CUT, CUT_TICK, CUT_DIGEST, CUT_CHAIN
    if CUT not in entries:
        what = "its run began"
        source, tick, digest, chain = ORIGIN, ORIGIN_TICK, ORIGIN_DIGEST, ORIGIN_CHAIN
        if ORIGIN_TICK not in entries:
            return None
    try:
        digests = bytes.fromhex(entries[digest]), bytes.fromhex(entries[chain])
        return Origin(int(entries[tick]), entries[source], *digests)
    except (KeyError, ValueError) as error:
        raise CaptureError(f"{about.path}: its record of where {what} is incomplete: {error}") from None


def chain_at_start(about: About) -> bytes:
    """Return the chain over all frames up to the first one that a capture has. Raises CaptureError."""
    return first_chain(beginning_of(about))


def check_whole(about: About) -> None:
    """Raise CaptureError for a cut: it lacks the frame that its run began with."""
    if CUT in about.metadata:
        source, tick = about.metadata[CUT], about.metadata.get(CUT_TICK)
        raise CaptureError(
            f"{about.path}: a cut of {source} from tick {tick} on; a run is verified from where it began: "
            f"verify {source}, or this from its first frame on (--from-first-frame)"
        )


def check_layout(path: Path, layout: Layout, row: LayoutRow) -> None:
    """Raise CaptureError where a row names another layout than the deployment has here.

    What the numbers of frames mean depends on it.
    """
    if layout.digest.hex() != row.digest or layout.size != row.size:
        named = "`foosim capture info` names the version that captured it"
        raise CaptureError(f"{path}: its layout is not what this version builds: {named}")


def check_frame(path: Path, layout: Layout, row: FrameRow) -> None:
    """Raise CaptureError for a row of a frame of another layout."""
    if len(row.values) != 8 * layout.size or any(box.index >= len(layout.entities) for box in row.outboxes):
        raise CaptureError(f"{path}: frame {row.tick} does not fit its layout of {layout.size} numbers")
