"""Packets per second through the vHub's core, in process: judged, then also journalled, then also captured.

Four free-running clients send to the table's robots over the table's links (delay, jitter, loss), a hundred packets
each tick. `radio` is captured, too: there they send by Wi-Fi with fading among the shelves and walls of the warehouse,
in each tick to twelve of its rovers, which drive, and once to one another; the air has room for that. What they and the
world say is encoded before the clock runs; reading it, judging, the record, the deliveries and, at the end, the
finished capture are in the time; garbage is collected as seldom as in the hub's process. Whatever was sent and has no
fate, or a fate and no row, is lost.
"""

from __future__ import annotations

import gc
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bench.runs import TABLE
from bench.verdict import WAREHOUSE, WIFI, Frames, circling, resting
from foosim.capture.reader import open_capture
from foosim.common import limits
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol import actions, channels
from foosim.protocol.channels import Channel
from foosim.protocol.codec import encode
from foosim.protocol.messages import Build, ClientHello, Commit, Epoch, Join, Samples, Sent, Subscription, Up
from foosim.runtime.journal import Journal
from foosim.runtime.roles.loop import collect_seldom
from foosim.vhub.core import HubCore
from foosim.vhub.recording.writer import CaptureWriter
from foosim.vhub.state.capture_queue import RecordClosing
from foosim.world.robot_packets import RobotPacket

CLIENTS: Final = tuple(f"client-{number}" for number in range(4))
PACKETS_PER_TICK: Final = 25
"""Of each client at the table."""
ROVERS_PER_TICK: Final = 12
"""To which each client sends in the warehouse."""
NEWS: Final = "news"
PAYLOAD: Final = bytes(16)
TO_REACH: Final = {"captured": 50_000, "radio": 25_000}

Message = tuple[Channel, str, bytes]


@dataclass(frozen=True, slots=True)
class HubRate:
    """One way. `packets` were sent, of which so many were `delivered` and `dropped` by the network, a few in flight at
    the end; `lost` are those without a fate, and, when captured, those whose row is not in the capture."""

    way: str
    packets: int
    packets_per_s: float
    cpu_us_per_packet: float
    delivered: int
    dropped: int
    lost: int
    waits: int
    """How often the core had to wait for the capture's writer."""


def hub(seconds: float = 2.0) -> list[HubRate]:
    """Measure each way; `seconds` is the simulated time of the table, at ticks of 2 ms: the warehouse has as many."""
    ticks = max(2, round(seconds * 500))
    table, hall = _table(ticks), _warehouse(ticks)
    ways = (("judged", table), ("journalled", table), ("captured", table), ("radio", hall))
    thresholds = gc.get_threshold()
    collect_seldom()
    rates = [_measure(way, load) for way, load in ways]
    gc.unfreeze()
    gc.set_threshold(*thresholds)
    return rates


@dataclass(frozen=True, slots=True)
class _Load:
    """A world, what its hub hears tick by tick, and how many packets there are in that."""

    text: str
    deployment: Deployment
    said: list[list[Message]]
    packets: int


def _deployment(path: Path, sets: list[str]) -> tuple[str, Deployment]:
    clients = ", ".join(f"{name}: {{}}" for name in CLIENTS)
    text = apply_sets(path.read_text(), path.name, ["players={}", f"clients={{{clients}}}", *sets])
    return text, load_deployment(text, path.name)


def _table(ticks: int) -> _Load:
    text, deployment = _deployment(TABLE, ["tick=2 ms"])
    rods = [name for name, robot in deployment.robots.items() if robot.model == "rod"]
    to = [rods[index % len(rods)] for index in range(1, PACKETS_PER_TICK + 1)]
    said = list(_script(deployment, resting(deployment), ticks, lambda tick: to))
    return _Load(text, deployment, said, ticks * len(CLIENTS) * len(to))


def _warehouse(ticks: int) -> _Load:
    places = {name: [f"{8 * n - 12} m", f"{6 * (n % 2) - 3} m", "1 m"] for n, name in enumerate(CLIENTS)}
    network = {**WIFI, "robots": {"rover*": ["wifi"], "client-*": ["wifi"]}, "places": places}
    text, deployment = _deployment(WAREHOUSE, [f"network={json.dumps(network)}"])
    rovers = [name for name in deployment.robots if name.startswith("rover")]

    def to(tick: int) -> list[str]:
        return ["", *(rovers[(tick + index) % len(rovers)] for index in range(ROVERS_PER_TICK))]

    said = list(_script(deployment, circling(deployment), ticks, to))
    return _Load(text, deployment, said, ticks * len(CLIENTS) * (ROVERS_PER_TICK + len(CLIENTS) - 1))


def _measure(way: str, load: _Load) -> HubRate:
    text, deployment, said = load.text, load.deployment, load.said
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hub.mcap"
        journal = None if way == "judged" else Journal(Path(folder), "vhub")
        writer = None if way not in TO_REACH else CaptureWriter(path, deployment, TABLE.name, text, {})
        core = HubCore("boot", bytes(32), 0)
        _start(core, text, journal)
        begun_s, begun_cpu_s = time.perf_counter(), time.process_time()
        for tick, messages in enumerate(said):
            now_ns = tick * deployment.tick_ns
            for channel, name, payload in messages:
                core.receive(channel, name, payload, now_ns)
            core.advance(now_ns)
            _perform(core, journal, writer)
        waits = 0 if writer is None else writer.statistics().waits
        if writer is not None:
            writer.finish()
        spent_s, cpu_s = time.perf_counter() - begun_s, time.process_time() - begun_cpu_s
        if journal is not None:
            journal.close()
        assert core.state is not None and core.state.closed == len(said) - 1, core.waiting_for
        packets, in_flight = core.state.packets, len(core.state.in_flight())
        fates = packets.delivered + packets.dropped
        kept = fates if writer is None else len(open_capture(path).packets)
    lost = load.packets - in_flight - min(fates, kept)
    cpu_us = round(cpu_s / load.packets * 1e6, 1)
    return HubRate(
        way, load.packets, round(load.packets / spent_s), cpu_us, packets.delivered, packets.dropped, lost, waits
    )


def _start(core: HubCore, text: str, journal: Journal | None) -> None:
    """Build the hub, let the clients join, begin."""
    build = Build(channels.VHUB, "boot", "first", "bench", TABLE.name, text, "fast", [])
    core.receive(channels.BUILD, channels.VHUB, encode(build), 0)
    core.begin(None, 0)
    for name in CLIENTS:
        heard = [Subscription(other, NEWS) for other in CLIENTS if other != name]
        hello = ClientHello(name, "boot", limits.PROTOCOL_VERSION, "", 0)
        core.receive(channels.CLIENT_HELLO, name, encode(hello), 0)
        core.receive(channels.UP, name, encode(Join(name, "boot", 0, heard)), 0)
    assert core.deployment is not None
    owners = [(robot, "n1") for robot in core.deployment.robots]
    core.receive(channels.EPOCH, channels.SUPERVISOR, encode(Epoch(1, 0, bytes(32), ["n1"], owners, [], b"")), 0)
    _perform(core, journal, None)


def _perform(core: HubCore, journal: Journal | None, writer: CaptureWriter | None) -> None:
    """Perform as the hub's process does, but for what goes to the network."""
    for action in core.actions:
        if isinstance(action, actions.Journal) and journal is not None:
            journal.append(action.record)
        elif isinstance(action, RecordClosing) and writer is not None:
            writer.keep(action.closing)
    core.actions.clear()


def _script(
    deployment: Deployment, frames: Frames, ticks: int, to: Callable[[int], list[str]]
) -> Iterator[list[Message]]:
    """Yield what the hub hears at each tick: the commit, the samples, and the clients' packets.

    `to` says to whom each client sends; a packet to nobody is news to those who hear it.
    """
    robots = [entity.name for entity in frames(0).layout.robots]
    sequence = 0
    for tick in range(ticks):
        frame = frames(tick)
        commit = Commit(1, tick, frame.digest, frame.values.tobytes(), [], [], False)
        sensed = [
            RobotPacket(robot, index, "", sensor, PAYLOAD)
            for robot in robots
            for index, sensor in enumerate(sorted(deployment.robots[robot].sensors))
            if tick % 5 == 0
        ]
        messages = [
            (channels.COMMIT, channels.VHUB, encode(commit)),
            (channels.SAMPLES, "n1", encode(Samples(tick, frame.digest, "n1", robots, sensed))),
        ]
        receivers = to(tick)
        for name in CLIENTS:
            sent = [
                Sent(sequence + index, receiver, "position" if receiver else NEWS, 0, PAYLOAD)
                for index, receiver in enumerate(receivers, 1)
            ]
            messages.append((channels.UP, name, encode(Up(name, "boot", sent))))
        sequence += len(receivers)
        yield messages


def lines(rows: list[HubRate]) -> list[str]:
    """Return the figures for people."""
    return [
        f"{row.way:12}{row.packets_per_s:9.0f} packets/s {row.cpu_us_per_packet:7.1f} us of processor each, "
        f"{row.lost} lost of {row.packets} ({row.delivered} delivered, {row.dropped} dropped by the network), "
        f"the core waited {row.waits} times for the capture"
        + (f"   (to reach {TO_REACH[row.way]}, none lost)" if row.way in TO_REACH else "")
        for row in rows
    ]
