"""Packets per second through the vHub's core, in process: judged, then also journalled, then also captured.

Four free-running clients send to the table's robots over the table's links (delay, jitter, loss), a hundred packets
each tick. What they and the world say is encoded before the clock runs; reading it, judging, the record, the deliveries
and, at the end, the finished capture are in the time. Neighbours: `foosim.vhub.core`, `foosim.vhub.capture_writer`.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from bench.runs import TABLE
from foosim.protocol import actions, channels, limits
from foosim.protocol.channels import Channel
from foosim.protocol.codec import encode
from foosim.protocol.deployment import Deployment
from foosim.protocol.deployment_file import apply_sets, load_deployment
from foosim.protocol.frame import Frame
from foosim.protocol.journal import Journal
from foosim.protocol.layout import build_layout
from foosim.protocol.messages import Build, ClientHello, Commit, Epoch, Join, RobotPacket, Samples, Sent, Up
from foosim.protocol.start import initial_numbers
from foosim.vhub.capture_reader import open_capture
from foosim.vhub.capture_writer import CaptureWriter
from foosim.vhub.core import HubCore
from foosim.vhub.keeping import Keep

CLIENTS: Final = tuple(f"client-{number}" for number in range(4))
PACKETS_PER_TICK: Final = 25
"""Of each client."""
PAYLOAD: Final = bytes(16)
WAYS: Final = ("judged", "journalled", "captured")

Message = tuple[Channel, str, bytes]


@dataclass(frozen=True, slots=True)
class HubRate:
    """One way. `lost` are packets without a fate, and, when captured, those whose row is not in the capture."""

    way: str
    packets: int
    packets_per_s: float
    cpu_us_per_packet: float
    lost: int
    waits: int
    """How often the core had to wait for the capture's writer."""


def hub(seconds: float = 2.0) -> list[HubRate]:
    """Measure each way; `seconds` is the simulated time, at ticks of 2 ms."""
    sets = ["tick=2 ms", "players={}", f"clients={{{', '.join(f'{name}: {{}}' for name in CLIENTS)}}}"]
    text = apply_sets(TABLE.read_text(), TABLE.name, sets)
    deployment = load_deployment(text, TABLE.name)
    said = list(_script(deployment, max(2, round(seconds * 500))))
    return [_measure(way, text, deployment, said) for way in WAYS]


def _measure(way: str, text: str, deployment: Deployment, said: list[list[Message]]) -> HubRate:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hub.mcap"
        journal = None if way == "judged" else Journal(Path(folder), "vhub")
        writer = None if way != "captured" else CaptureWriter(path, deployment, TABLE.name, text, {})
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
        packets = core.state.packets
        without_fate = packets.in_flight - len(core.state.in_flight())
        without_row = 0 if writer is None else packets.delivered + packets.dropped - len(open_capture(path).packets)
    rate = packets.offered / spent_s
    per_packet_us = round(cpu_s / packets.offered * 1e6, 1)
    return HubRate(
        way, packets.offered, round(rate), per_packet_us, without_fate + without_row + packets.refused, waits
    )


def _start(core: HubCore, text: str, journal: Journal | None) -> None:
    """Build the hub, let the clients join, begin."""
    build = Build(channels.VHUB, "boot", "first", "bench", TABLE.name, text, "fast", [])
    core.receive(channels.BUILD, channels.VHUB, encode(build), 0)
    core.begin(None, 0)
    for name in CLIENTS:
        hello = ClientHello(name, "boot", limits.PROTOCOL_VERSION, "", 0)
        core.receive(channels.CLIENT_HELLO, name, encode(hello), 0)
        core.receive(channels.UP, name, encode(Join(name, "boot", 0, [])), 0)
    assert core.deployment is not None
    owners = [(robot, "n1") for robot in core.deployment.robots]
    core.receive(channels.EPOCH, channels.SUPERVISOR, encode(Epoch(1, 0, bytes(32), ["n1"], owners, [], b"")), 0)
    _perform(core, journal, None)


def _perform(core: HubCore, journal: Journal | None, writer: CaptureWriter | None) -> None:
    """Perform as the hub's process does, but for what goes to the network."""
    for action in core.actions:
        if isinstance(action, actions.Journal) and journal is not None:
            journal.append(action.record)
        elif isinstance(action, Keep) and writer is not None:
            writer.keep(action.closing)
    core.actions.clear()


def _script(deployment: Deployment, ticks: int) -> Iterator[list[Message]]:
    """Yield what the hub hears at each tick: the commit, the samples, and the clients' packets."""
    layout = build_layout(deployment)
    numbers = initial_numbers(deployment, layout)
    robots = [entity.name for entity in layout.robots]
    rods = [entity.name for entity in layout.rods]
    sequence = 0
    for tick in range(ticks):
        frame = Frame(tick, layout, np.array(numbers))
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
        for name in CLIENTS:
            sent = [
                Sent(sequence + index, rods[index % len(rods)], "position", 0, PAYLOAD)
                for index in range(1, PACKETS_PER_TICK + 1)
            ]
            messages.append((channels.UP, name, encode(Up(name, "boot", sent))))
        sequence += PACKETS_PER_TICK
        yield messages


def lines(rows: list[HubRate]) -> list[str]:
    """Return the figures for people."""
    return [
        f"{row.way:12}{row.packets_per_s:9.0f} packets/s {row.cpu_us_per_packet:7.1f} us of processor each, "
        f"{row.lost} lost of {row.packets}, the core waited {row.waits} times for the capture"
        + ("   (to reach 50000, none lost)" if row.way == "captured" else "")
        for row in rows
    ]
