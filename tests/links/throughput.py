"""What a link of a given rate lets through by the wall clock, in real time: measured where its packets come out.

A client asks nine robots for more than their links to it carry; what it gets in a second of its own clock is compared
with the rate. The vHub releases each packet at its time, so the rate is off by as much as the run falls behind the wall
clock in between.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from bench.runs import BenchError, watch

RATE_BPS: Final = 100_000
PACKET_BYTES: Final = 50
OFFERED_HZ: Final = 4_500
"""Of all nine links together: twice what they carry."""
NAME: Final = "probe"
MARGIN_S: Final = 5.0
"""Simulated time for the client to start in, and for the last packets to come back."""
WARM_NS: Final = 1_000_000_000
"""Of the packets' time, left out at both ends: queues fill, and drain."""
WITHIN: Final = 0.02


@dataclass(frozen=True, slots=True)
class Throughput:
    """Bits a second that came out of a link, as the mean and the extremes of nine, and of how many packets."""

    packets: int
    mean_bps: float
    least_bps: float
    most_bps: float


def throughput(seconds: float = 12.0) -> Throughput:
    """Measure for so many seconds, in real time. Raises BenchError when nothing came."""
    overhead = PACKET_BYTES - 4  # an echo holds its number
    limits = f"rate: {RATE_BPS} bit/s, overhead: {overhead} B, queue: {{packets: 50}}"
    links = f"network.links=[{{id: limited, from: '*', to: {NAME}, {limits}}}]"
    sets = ["tick=5 ms", "substeps=1", "engine=pure", "players={}", f"clients={{{NAME}: {{}}}}", links]
    with tempfile.TemporaryDirectory() as folder:
        times = Path(folder) / "times.npz"

        def client(simulation: str, radio: str) -> list[list[str]]:
            options = ["--name", NAME, "--connect", radio, "--rate", str(OFFERED_HZ), "--seconds", str(seconds)]
            return [["-m", "bench.echo_client", *options, "--times", str(times)]]

        watch("realtime", seconds + MARGIN_S, sets, 1.0, client)
        return _throughput(times)


def _throughput(path: Path) -> Throughput:
    with np.load(path) as content:
        sources, received_ns = content["source"], content["received_ns"]
    if len(received_ns) == 0:
        raise BenchError("nothing came out of the links")
    first_ns, last_ns = int(received_ns.min()) + WARM_NS, int(received_ns.max()) - WARM_NS
    counted = sources[(received_ns >= first_ns) & (received_ns < last_ns)]
    names, counts = np.unique(counted, return_counts=True)
    bps = [int(count) * PACKET_BYTES * 8e9 / (last_ns - first_ns) for count in counts]
    return Throughput(len(counted), sum(bps) / len(names), min(bps), max(bps))
