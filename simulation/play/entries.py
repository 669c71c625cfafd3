"""The entries of a replay: the messages of a capture, in the order of their times, selected and renamed.

A packet is played when it reached its receiver: a robot, or a client in lockstep, at its tick; a free-running client at
the packet's due time. Rows of packets are in the file where their fates became final, at most a tick away from that, so
entries are sorted over two ticks. Poses, scenes, log and all other rows are played at their captured times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush
from typing import Any, Final, NamedTuple

import msgspec

from foosim.capture import rows as capture_rows
from foosim.capture.foxglove import LOG as LOG_TOPIC
from foosim.capture.foxglove import POSES as TF
from foosim.capture.foxglove import SCENE as SCENE_TOPIC
from foosim.capture.foxglove import VIEW_TYPES
from foosim.capture.foxglove_reader import read_log, read_poses, renamed_scene
from foosim.capture.mcap.format import Message
from foosim.capture.rows import CLIENTS, FRAME, ROW_TYPES, TICK, ClientRow, PacketRow
from foosim.common import limits
from foosim.common.errors import BadValue, no_such
from foosim.common.names import is_name, is_robot_name
from foosim.deployment.schema import Deployment
from foosim.protocol.codec import encode
from foosim.protocol.replay_messages import (
    LOG,
    PACKETS,
    POSES,
    ROWS,
    SCENE,
    PlayedLine,
    PlayedPacket,
    PlayedPose,
    PlayedPoses,
    PlayedRow,
    PlayedScene,
)
from foosim.vhub.network.packet import DELIVERED

TOPICS: Final = (*ROW_TYPES, *VIEW_TYPES)
"""The topics that can be played."""
BIG: Final = frozenset({TICK, FRAME})
"""The topics that only a re-simulation needs, played when they are selected."""

WAITING_MAX: Final = 100_000
"""Greatest number of entries that are kept for sorting."""

Decode = Callable[[msgspec.json.Decoder[Any], Message], Any]
"""Returns the row of a message; raises CaptureError, which names file and message."""


class Entry(NamedTuple):
    """One message to publish: its captured time, stream, captured name and bytes."""

    time_ns: int
    stream: str
    topic: str
    payload: bytes


@dataclass(frozen=True, slots=True)
class Selection:
    """The names to play, and new names. A name is `/packets/SOURCE/DESTINATION/CHANNEL`, `/tf`, `/clients`, ...

    `topics` selects captured names at or below them; without any, all are played but /tick and /frame.
    """

    topics: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    """New names of endpoints and bodies."""
    channels: Mapping[str, str] = field(default_factory=dict)
    """New names of channels."""

    def has(self, name: str) -> bool:
        """Whether this name is played."""
        if not self.topics:
            return name not in BIG
        return any(name == topic or name.startswith(f"{topic}/") for topic in self.topics)


def make_selection(deployment: Deployment, topics: Sequence[str] = (), remaps: Sequence[str] = ()) -> Selection:
    """Return a selection from the options of a command. Raises BadValue, which names the option.

    A remap is `OLD:=NEW` for an endpoint or a body, `/OLD:=/NEW` for a channel.
    """
    for topic in topics:
        if not any(topic == known or topic.startswith(f"{known}/") for known in TOPICS):
            raise no_such(f"--topic: not one of {', '.join(TOPICS)}, nor below one", topic, TOPICS)
    return Selection(tuple(topics), *_renamed(deployment, remaps))


def _renamed(deployment: Deployment, remaps: Iterable[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return new names of endpoints and bodies, and of channels."""
    bodies = {name for kit in deployment.kit_types.values() for name in kit.entities}
    known = {*deployment.robots, *deployment.players, *deployment.clients, *bodies}
    names: dict[str, str] = {}
    channels: dict[str, str] = {}
    for text in remaps:
        old, new = _parse_remap(text)
        table = channels if old.startswith("/") else names
        if table is names and old not in known:
            raise no_such("--remap: the capture's deployment has no such endpoint or body", old, known)
        if old.removeprefix("/") in table:
            raise BadValue("--remap: renamed twice", old)
        table[old.removeprefix("/")] = new.removeprefix("/")
    for table, others in ((names, known - names.keys()), (channels, set[str]())):
        taken = [*table.values(), *others]
        for name in table.values():
            if taken.count(name) > 1:
                raise BadValue("--remap: two would have this name", name)
    return names, channels


def _parse_remap(text: str) -> tuple[str, str]:
    old, separator, new = text.partition(":=")
    is_channel = old.startswith("/") and new.startswith("/")
    fits = is_name(old[1:]) and is_name(new[1:]) if is_channel else is_robot_name(new) and not old.startswith("/")
    if not separator or not fits:
        raise BadValue("--remap: not OLD:=NEW for an endpoint or a body, nor /OLD:=/NEW for a channel", text)
    return old, new


class Entries:
    """The entries of one capture. `too_large` counts rows that do not fit into a message."""

    def __init__(self, deployment: Deployment, selection: Selection) -> None:
        self.too_large = 0
        self.tick_ns: Final = deployment.tick_ns
        self._selection = selection
        self._robots = frozenset(deployment.robots)
        self._lockstep = {name: player.lockstep for name, player in deployment.players.items()}
        self._lockstep |= {name: client.lockstep for name, client in deployment.clients.items()}
        """As declared, until a row of /clients has how the client joined."""
        self._decoders = {topic: msgspec.json.Decoder(kind) for topic, kind in ROW_TYPES.items()}
        self._views = {topic for topic in VIEW_TYPES if selection.has(topic)}
        self.has_scene: Final = SCENE_TOPIC in self._views
        named = [topic for topic in selection.topics if topic.startswith(capture_rows.PACKETS)]
        self._packets = bool(named or not selection.topics)
        self._topics = {topic for topic in ROW_TYPES if topic != capture_rows.PACKETS and selection.has(topic)}
        self._links: dict[str, str] = {}

    def of(self, messages: Iterable[Message], decode: Decode) -> Iterator[Entry]:
        """Yield the entries of messages that are in the order of a capture, by time."""
        waiting: list[tuple[int, int, Entry]] = []
        number = 0
        for message in messages:
            if message.topic == TICK:
                while waiting and waiting[0][0] <= message.log_ns - self.tick_ns:
                    yield heappop(waiting)[2]
            if len(waiting) >= WAITING_MAX:
                yield heappop(waiting)[2]
            entry = self._entry(message, decode)
            if entry is not None:
                number += 1
                heappush(waiting, (entry.time_ns, number, entry))
        while waiting:
            yield heappop(waiting)[2]

    def _entry(self, message: Message, decode: Decode) -> Entry | None:
        topic = message.topic
        if topic == capture_rows.PACKETS:
            return self._packet(decode(self._decoders[topic], message)) if self._packets else None
        if topic in VIEW_TYPES:
            return self.view(message) if topic in self._views else None
        if topic == CLIENTS:
            row: ClientRow = decode(self._decoders[topic], message)
            self._lockstep[row.client] = row.period > 0
        if topic not in self._topics:
            return None
        decode(self._decoders[topic], message)  # a damaged row is refused here, not by listeners
        row_played = PlayedRow(message.log_ns, topic.removeprefix("/"), message.data)
        return self._unless_too_large(Entry(message.log_ns, ROWS, topic, encode(row_played)))

    def _unless_too_large(self, entry: Entry) -> Entry | None:
        if len(entry.payload) <= limits.MESSAGE_BYTES_MAX:
            return entry
        self.too_large += 1
        return None

    def _packet(self, row: PacketRow) -> Entry | None:
        if row.fate != DELIVERED:
            return None
        topic = f"{capture_rows.PACKETS}/{row.source}/{row.destination}/{row.channel}"
        if not self._selection.has(topic):
            return None
        names = self._selection.names
        source, destination = names.get(row.source, row.source), names.get(row.destination, row.destination)
        channel = self._selection.channels.get(row.channel, row.channel)
        time_ns = self._released_ns(row)
        stamps = row.sequence, row.copy, row.sent_ns, row.due_ns
        payload = encode(PlayedPacket(time_ns, source, destination, channel, *stamps, row.payload))
        return Entry(time_ns, PACKETS, topic, payload)

    def _released_ns(self, row: PacketRow) -> int:
        arrival_ns = row.arrival_tick * self.tick_ns
        at_tick = row.destination in self._robots or self._lockstep.get(row.destination, False)
        if at_tick or arrival_ns - row.due_ns >= self.tick_ns:
            return arrival_ns
        return row.due_ns

    def view(self, message: Message, at_ns: int | None = None) -> Entry | None:
        """Return the entry of poses, a line of the log or a scene; a scene may be shown later than it was captured."""
        time_ns = message.log_ns if at_ns is None else at_ns
        if message.topic == TF:
            return self._pose(message)
        if message.topic == LOG_TOPIC:
            level, text = read_log(message.data)
            line = PlayedLine(time_ns, level, text[: limits.TEXT_LENGTH_MAX])
            return Entry(time_ns, LOG, LOG_TOPIC, encode(line))
        update = renamed_scene(message.data, self._link) if self._selection.names else message.data
        return self._unless_too_large(Entry(time_ns, SCENE, SCENE_TOPIC, encode(PlayedScene(time_ns, update))))

    def _pose(self, message: Message) -> Entry:
        poses = [
            PlayedPose(self._link(pose.link), pose.position, pose.orientation) for pose in read_poses(message.data)
        ]
        return Entry(message.log_ns, POSES, TF, encode(PlayedPoses(message.log_ns, poses)))

    def _link(self, link: str) -> str:
        name = self._links.get(link)
        if name is None:
            body, separator, part = link.partition("/")
            name = self._links[link] = f"{self._selection.names.get(body, body)}{separator}{part}"
        return name
