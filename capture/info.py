"""A capture in short, for people and scripts: by one pass over the file, with nothing of it kept but counts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import msgspec

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Message
from foosim.capture.parts import files_from
from foosim.capture.reader import DECODERS, TICK_MARKS, FrameReader, Scan, TickMark, chain_at_start, deployment_of
from foosim.capture.rows import CLIENTS, EPOCHS, METRICS, PACKETS, RECOVERIES, TICK, Fate
from foosim.common import struct_types
from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import count_commands
from foosim.world.frame import CHAIN_START, chain_next


@dataclass(frozen=True, slots=True)
class CaptureInfo:
    """A capture in short, for people and scripts. Digests are hex; `packets` counts fates, `causes` drops by cause.

    `first_tick` is the tick of its first frame, with which its run began unless it is a cut, `ticks` the tick of
    its last one. `nodes` and `clients` took part in the run; `arithmetic` has each digest of a fixed small run of
    the nodes' engine. `recoveries` counts losses and returns. `files` are the deployment's files, with their bytes.
    """

    path: str
    parts: tuple[str, ...]
    """The files that it was read from, in their order."""
    bytes: int
    finished: bool
    unfinished_bytes: int
    library: str
    metadata: Mapping[str, str]
    end: Mapping[str, str]
    versions: Mapping[str, str]
    first_tick: int
    ticks: int
    tick_ns: int
    duration_ns: int
    digest: str
    chain: str
    nodes: tuple[str, ...]
    arithmetic: tuple[str, ...]
    clients: tuple[str, ...]
    packets: Mapping[str, int]
    causes: Mapping[str, int]
    commands: Mapping[str, int]
    """Commands that robots had clamped and refused by its last frame; nothing where this version cannot read that."""
    channels: Mapping[str, int]
    """Packets by channel."""
    payload_bytes: int
    recoveries: int
    files: Mapping[str, int]
    topics: Mapping[str, int]
    metrics: Mapping[str, float]
    """The last value of each metric."""


class PacketMark(msgspec.Struct, frozen=True, gc=False):
    """What of a packet is counted here; the rest of its row is passed over."""

    channel: str
    fate: Fate
    cause: str
    size: struct_types.Counter


PACKET_MARKS: Final = msgspec.json.Decoder(PacketMark)


def capture_info(path: Path | str) -> CaptureInfo:
    """Return a capture in short, by one pass over the file."""
    path = Path(path)
    scan = Scan(path)
    found = _Counts(scan)
    for message in scan.messages():
        found.take(message)
    about, first, sizes = scan.about, max(0, found.first), _sizes(path)
    deployment = deployment_of(about)
    tick_ns = deployment.tick_ns
    return CaptureInfo(
        str(path),
        tuple(sizes),
        sum(sizes.values()),
        about.finished,
        about.unfinished_bytes,
        about.library,
        about.metadata,
        about.end,
        about.versions,
        first,
        found.tick,
        tick_ns,
        (found.tick - first) * tick_ns,
        found.digest.hex(),
        found.chain.hex(),
        tuple(sorted(found.nodes)),
        tuple(sorted(found.arithmetic - {""})),
        tuple(sorted(found.clients)),
        {"offered": found.fates.total(), **{fate: found.fates[fate] for fate in ("delivered", "dropped", "in_flight")}},
        dict(sorted(found.causes.items())),
        found.commands(deployment),
        dict(sorted(found.channels.items())),
        found.payload_bytes,
        found.topics[RECOVERIES],
        {name: len(content) for name, content in sorted(about.files.items())},
        dict(sorted(found.topics.items())),
        dict(sorted(found.metrics.items())),
    )


def _sizes(path: Path) -> dict[str, int]:
    """Return the bytes of each file that is read, by its name."""
    try:
        return {file.name: file.stat().st_size for file in files_from(path)}
    except OSError as error:  # a run that keeps only the last lets files go meanwhile
        raise CaptureError(f"{error.filename}: cannot be read, {error.strerror}") from None


class _Counts:
    """What is kept of the messages that went by."""

    def __init__(self, scan: Scan) -> None:
        self.topics: Counter[str] = Counter()
        self.fates: Counter[str] = Counter()
        self.causes: Counter[str] = Counter()
        self.channels: Counter[str] = Counter()
        self.payload_bytes = 0
        self.first, self.tick, self.digest, self.chain = -1, 0, b"", CHAIN_START
        self.nodes: set[str] = set()
        self.arithmetic: set[str] = set()
        self.clients: set[str] = set()
        self.metrics: dict[str, float] = {}
        self._last: dict[str, Message] = {}
        """The layout, then the last frame."""
        self._scan = scan

    def take(self, message: Message) -> None:
        topic, decode = message.topic, self._scan.decode
        self.topics[topic] += 1
        if topic == PACKETS:
            packet = decode(PACKET_MARKS, message)
            self.fates[packet.fate] += 1
            self.channels[packet.channel] += 1
            self.payload_bytes += packet.size
            if packet.cause:
                self.causes[packet.cause] += 1
        elif topic in FrameReader.TOPICS:
            self._last[topic] = message
        elif topic == TICK:
            self._take_tick(decode(TICK_MARKS, message))
        elif topic == CLIENTS:
            self.clients.add(decode(DECODERS[CLIENTS], message).client)
        elif topic == METRICS:
            metric = decode(DECODERS[METRICS], message)
            self.metrics[metric.name] = metric.value
        elif topic == EPOCHS:
            epoch = decode(DECODERS[EPOCHS], message)
            self.nodes.update(epoch.roster)
            self.arithmetic.add(epoch.arithmetic)

    def commands(self, deployment: Deployment) -> dict[str, int]:
        """Return how many commands the last frame counts; nothing without one, or of another version's layout."""
        reader = FrameReader(self._scan, deployment)
        frame = None
        try:
            for message in self._last.values():
                frame = reader.frame(message)
        except CaptureError:
            return {}
        return {} if frame is None else count_commands(frame)

    def _take_tick(self, mark: TickMark) -> None:
        self.tick, self.digest = mark.tick, bytes.fromhex(mark.digest)
        if self.first < 0:
            self.first, self.chain = mark.tick, chain_at_start(self._scan.about)
        else:
            self.chain = chain_next(self.chain, self.digest)
