"""Compare two captures, channel by channel: the first row of each that differs, in which field, and how many there are.

The typed function behind `foosim capture diff`. Two equal runs differ in values of the real world's clock, so fields
whose names begin with `wall_` and the channel `/log` are not compared. Both files are read at once, closing by closing;
the memory holds one closing of each and the rows by which a channel of one is ahead.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from foosim.capture.foxglove import LOG, POSES, VIEW_TYPES
from foosim.capture.foxglove_reader import read_poses
from foosim.capture.mcap.format import Message
from foosim.capture.reader import DECODERS, About, Scan, deployment_of, row_of
from foosim.capture.rows import ROW_TYPES, TICK, FrameRow
from foosim.common.errors import no_such

WALL: Final = "wall_"
LOG_TIME, SEQUENCE = "log_time", "sequence"
"""What a message has beside its row. A packet's own `sequence` is a field of its row, and has the same name."""
AHEAD_MAX: Final = 100_000
"""By how many rows a channel of one capture may be ahead of the other's; then they differ in order."""
VALUE_LENGTH_MAX: Final = 120
NOTHING: Final = "no such row"


@dataclass(frozen=True, slots=True)
class Difference:
    """The first difference of a channel: `row` counts its rows from 0, `field` is where in it, with both values.

    `time_ns` is the simulated time of the row, `tick` the tick of that time. `field` is empty where one
    capture has no such row.
    """

    topic: str
    time_ns: int
    tick: int
    row: int
    field: str
    a: str
    b: str


@dataclass(slots=True)
class Channel:
    """One channel of both captures: how many rows there are, and how many before the first difference."""

    rows: list[int] = field(default_factory=lambda: [0, 0])
    equal: int = 0
    first: Difference | None = None


@dataclass(frozen=True, slots=True)
class Diff:
    """The result of a comparison. `about` names unequal metadata of the two, which do not affect the result."""

    channels: Mapping[str, Channel]
    about: tuple[str, ...]

    @property
    def first(self) -> Difference | None:
        """The earliest difference; of several at a time that of the first channel by name."""
        found = [channel.first for channel in self.channels.values() if channel.first is not None]
        return min(found, key=lambda difference: (difference.time_ns, difference.topic), default=None)

    @property
    def equal(self) -> bool:
        return self.first is None


def fields_of_rows() -> set[str]:
    """Return the names of all fields of rows, also of rows within rows."""
    names = {LOG_TIME, SEQUENCE}
    for kind in ROW_TYPES.values():
        schema = msgspec.json.schema(kind)
        for part in schema["$defs"].values():
            names |= part["properties"].keys()
    return names


def check_ignored(ignored: Iterable[str]) -> tuple[frozenset[str], frozenset[str]]:
    """Return fields and channels to ignore; raises BadValue for a name that no row has."""
    fields, topics = fields_of_rows(), {*ROW_TYPES, *VIEW_TYPES}
    for name in ignored:
        known = topics if name.startswith("/") else fields
        if name not in known:
            what = "channel" if name.startswith("/") else "field of a row"
            raise no_such(f"--ignore: no {what}", name, known)
    names = frozenset(ignored)
    return names - topics, (names & topics) | {LOG}


def diff_captures(a: Path, b: Path, ignored: Iterable[str] = ()) -> Diff:
    """Compare two captures. `ignored` names fields, and channels by their `/name`.

    Raises CaptureError for a file that cannot be read, BadValue for a name in `ignored` that no row has.
    """
    fields, topics = check_ignored(ignored)
    scans = Scan(a), Scan(b)
    closings = zip_longest(_closings(scans[0]), _closings(scans[1]), fillvalue=None)
    comparison: _Comparison | None = None
    for pair in closings:
        if comparison is None:
            tick_ns = deployment_of(scans[0].about).tick_ns
            comparison = _Comparison(tick_ns, fields, topics)
        for side, messages in enumerate(pair):
            comparison.take(side, messages or [])
        comparison.compare(pair[0] is None, pair[1] is None)
    if comparison is None:
        comparison = _Comparison(1, fields, topics)
    comparison.compare(True, True)
    return Diff(dict(sorted(comparison.channels.items())), _about(scans[0].about, scans[1].about))


def _closings(scan: Scan) -> Iterator[list[Message]]:
    """Yield messages in the order of the file, cut before each row of /tick."""
    messages: list[Message] = []
    for message in scan.messages():
        if (message.topic == TICK and messages) or len(messages) >= AHEAD_MAX:
            yield messages
            messages = []
        messages.append(message)
    if messages:
        yield messages


def _about(a: About, b: About) -> tuple[str, ...]:
    """Return the names of metadata and files in which two captures differ."""
    keys = sorted({*a.metadata, *b.metadata})
    differing = [f"metadata {key}" for key in keys if a.metadata.get(key) != b.metadata.get(key)]
    if a.deployment_text != b.deployment_text:
        differing.append("the deployment")
    if a.files != b.files:
        differing.append("files of the deployment")
    if a.versions != b.versions:
        differing.append("versions of libraries")
    if a.end != b.end:
        differing.append("how they ended")
    return tuple(differing)


class _Comparison:
    """Compares the rows of both sides, and keeps the rows by which one is ahead."""

    def __init__(self, tick_ns: int, fields: frozenset[str], topics: frozenset[str]) -> None:
        self.channels: dict[str, Channel] = {}
        self._tick_ns = tick_ns
        self._fields = fields
        self._topics = topics
        self._ahead: dict[str, tuple[deque[Message], deque[Message]]] = {}

    def take(self, side: int, messages: Iterable[Message]) -> None:
        for message in messages:
            topic = message.topic
            if topic in self._topics:
                continue
            channel = self.channels.get(topic)
            if channel is None:
                channel = self.channels[topic] = Channel()
                self._ahead[topic] = deque(), deque()
            channel.rows[side] += 1
            if channel.first is None:
                self._ahead[topic][side].append(message)

    def compare(self, a_ended: bool, b_ended: bool) -> None:
        """Compare all rows that both sides have; a side that has ended has no row for what the other has more."""
        for topic, (ones, others) in self._ahead.items():
            channel = self.channels[topic]
            while ones and others and channel.first is None:
                self._compare(channel, ones.popleft(), others.popleft())
            too_far = max(len(ones), len(others)) > AHEAD_MAX
            if channel.first is None and ((ones and (b_ended or too_far)) or (others and (a_ended or too_far))):
                message = (ones or others)[0]
                sides = ("a row", NOTHING) if ones else (NOTHING, "a row")
                channel.first = self._difference(channel, message, "", *sides)
            if channel.first is not None:
                ones.clear()
                others.clear()

    def _compare(self, channel: Channel, one: Message, other: Message) -> None:
        found: tuple[str, Any, Any] | None = None
        if one.data != other.data and not _differ_in_walls(one, other):
            found = first_difference(_content(one), _content(other), self._fields)
        for name, value_a, value_b in (
            (LOG_TIME, one.log_ns, other.log_ns),
            (SEQUENCE, one.sequence, other.sequence),
        ):
            if found is None and value_a != value_b and name not in self._fields:
                found = name, value_a, value_b
        if found is None:
            channel.equal += 1
        else:
            name, value_a, value_b = found
            channel.first = self._difference(channel, one, name, *_texts(value_a, value_b))

    def _difference(self, channel: Channel, at: Message, name: str, a: str, b: str) -> Difference:
        return Difference(at.topic, at.log_ns, at.log_ns // self._tick_ns, channel.equal, name, a, b)


def _differ_in_walls(one: Message, other: Message) -> bool:
    """Whether two rows are equal except for wall times, as most rows of two equal runs are."""
    unwalled = _UNWALLED.get(one.topic)
    if not unwalled:
        return False
    rows = (row_of(DECODERS[message.topic], message) for message in (one, other))
    a, b = (msgspec.structs.replace(row, **unwalled) for row in rows)
    return bool(a == b)


_UNWALLED: Final = {
    topic: dict.fromkeys((name for name in kind.__struct_fields__ if name.startswith(WALL)), 0)
    for topic, kind in ROW_TYPES.items()
}
"""What a topic's rows have in place of those fields."""


def _content(message: Message) -> Any:
    """Return a message as plain values by name."""
    if message.topic == POSES:
        poses = read_poses(message.data)
        return {pose.link: {"position": [*pose.position], "orientation": [*pose.orientation]} for pose in poses}
    if message.topic in VIEW_TYPES or message.topic not in DECODERS:
        return {"content": message.data.hex()}
    row = row_of(DECODERS[message.topic], message)
    content = _plain(row)
    if isinstance(row, FrameRow) and len(row.values) % 8 == 0:
        content["values"] = np.frombuffer(row.values, dtype="<f8").tolist()
    return content


def _plain(value: Any) -> Any:
    """Return a row as plain values with all its fields: a file may leave out default values."""
    if isinstance(value, msgspec.Struct):
        return {name: _plain(getattr(value, name)) for name in value.__struct_fields__}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value.hex() if isinstance(value, bytes) else value


def first_difference(a: Any, b: Any, ignored: frozenset[str], path: str = "") -> tuple[str, Any, Any] | None:
    """Return where two values differ first, as `deliveries[2].payload`, with both; None when they are equal.

    Fields that are ignored, or whose names begin with `wall_`, are not looked at.
    """
    if isinstance(a, dict) and isinstance(b, dict):
        for name in [*a, *(name for name in b if name not in a)]:
            if name in ignored or name.startswith(WALL):
                continue
            place = f"{path}.{name}" if path else name
            if name not in a or name not in b:
                return place, a.get(name, "no such field"), b.get(name, "no such field")
            found = first_difference(a[name], b[name], ignored, place)
            if found is not None:
                return found
        return None
    if isinstance(a, list) and isinstance(b, list):
        for index, (one, other) in enumerate(zip(a, b, strict=False)):
            found = first_difference(one, other, ignored, f"{path}[{index}]")
            if found is not None:
                return found
        return None if len(a) == len(b) else (path, f"{len(a)} of them", f"{len(b)} of them")
    return None if a == b and type(a) is type(b) else (path, a, b)


def _texts(a: Any, b: Any) -> tuple[str, str]:
    """Return two different values as texts; of long ones the part where they differ."""
    one, other = (value if isinstance(value, str) else msgspec.json.encode(value).decode() for value in (a, b))
    if max(len(one), len(other)) <= VALUE_LENGTH_MAX:
        return one, other
    pairs = enumerate(zip(one, other, strict=False))
    common = next((index for index, (a_sign, b_sign) in pairs if a_sign != b_sign), min(len(one), len(other)))
    start = max(0, common - VALUE_LENGTH_MAX // 4)
    return _part(one, start), _part(other, start)


def _part(text: str, start: int) -> str:
    stop = start + VALUE_LENGTH_MAX
    return f"{'...' if start else ''}{text[start:stop]}{'...' if stop < len(text) else ''}"
