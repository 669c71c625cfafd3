"""A capture in short, for people and scripts: by one pass over the file, with nothing of it kept but counts.

Neighbours: `capture_reader` (the pass), `foosim-replay info` shows it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from foosim.protocol.frame import CHAIN_START, chain_next
from foosim.vhub.capture_parts import files_from
from foosim.vhub.capture_reader import DECODERS, Scan, chain_at_start, deployment_of
from foosim.vhub.rows import CLIENTS, EPOCHS, PACKETS, RECOVERIES, TICK, CaptureError


@dataclass(frozen=True, slots=True)
class CaptureInfo:
    """A capture in short, for people and scripts. Digests are hex; `packets` counts fates, `causes` drops by cause.

    `first_tick` is that of the first frame that it has, which its run began with unless it is a cut, `ticks` that of
    the last one. `nodes` and `clients` are those that took part; `arithmetic` has each digest of a fixed small run of
    the nodes' engine. `recoveries` counts losses and returns. `files` are those of the deployment, with their bytes.
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
    channels: Mapping[str, int]
    """Packets by channel."""
    payloads: str
    """`exact`, or `hashed`: then what needs them cannot be done."""
    payload_bytes: int
    recoveries: int
    files: Mapping[str, int]
    topics: Mapping[str, int]


def capture_info(path: Path | str) -> CaptureInfo:
    """Return a capture in short, by one pass over the file."""
    path = Path(path)
    scan = Scan(path)
    topics: Counter[str] = Counter()
    fates: Counter[str] = Counter()
    causes: Counter[str] = Counter()
    channels: Counter[str] = Counter()
    payload_bytes = 0
    first, tick, digest, chain = -1, 0, b"", CHAIN_START
    nodes: set[str] = set()
    arithmetic: set[str] = set()
    clients: set[str] = set()
    for message in scan.messages():
        topics[message.topic] += 1
        if message.topic == TICK:
            row = scan.decode(DECODERS[TICK], message)
            tick, digest = row.tick, bytes.fromhex(row.digest)
            chain = chain_next(chain, digest) if first >= 0 else chain_at_start(scan.about)
            first = tick if first < 0 else first
        elif message.topic == PACKETS:
            packet = scan.decode(DECODERS[PACKETS], message)
            fates[packet.fate] += 1
            channels[packet.channel] += 1
            payload_bytes += packet.size
            if packet.cause:
                causes[packet.cause] += 1
        elif message.topic == CLIENTS:
            clients.add(scan.decode(DECODERS[CLIENTS], message).client)
        elif message.topic == EPOCHS:
            epoch = scan.decode(DECODERS[EPOCHS], message)
            nodes.update(epoch.roster)
            arithmetic.add(epoch.arithmetic)
    about, first, sizes = scan.about, max(0, first), _sizes(path)
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
        tick,
        tick_ns,
        (tick - first) * tick_ns,
        digest.hex(),
        chain.hex(),
        tuple(sorted(nodes)),
        tuple(sorted(arithmetic - {""})),
        tuple(sorted(clients)),
        {"offered": fates.total(), **{fate: fates[fate] for fate in ("delivered", "dropped", "in_flight")}},
        dict(sorted(causes.items())),
        dict(sorted(channels.items())),
        deployment.capture.payloads,
        payload_bytes,
        topics[RECOVERIES],
        {name: len(content) for name, content in sorted(about.files.items())},
        dict(sorted(topics.items())),
    )


def _sizes(path: Path) -> dict[str, int]:
    """Return the bytes of each file that is read, by its name."""
    try:
        return {file.name: file.stat().st_size for file in files_from(path)}
    except OSError as error:  # a run that keeps only the last lets files go meanwhile
        raise CaptureError(f"{error.filename}: cannot be read, {error.strerror}") from None
