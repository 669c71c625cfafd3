"""How late packets leave the vHub in real time: 5,000 a second to a client, due at any time between ticks.

A client sends at this rate to a robot that answers; the answers come over a link whose delay is spread over several
ticks. What is due within a tick reaches a client at that tick's end (fates know ticks), so lateness is that of the
release behind the end of the tick at which the packet arrives; beyond its own due time it is half a tick more in the
mean. The wall time of simulated time 0 is that of the promptest packet of the same tenth of a second, which was not
before its time: a run that lagged far behind the clock does not make up for it.
Neighbours: `runs`, `echo_client`, `foosim.vhub.release`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from bench.runs import watch
from foosim.vhub.capture_reader import open_capture

RATE_HZ: Final = 5_000
TICK_NS: Final = 2_000_000
NAME: Final = "probe"
MARGIN_S: Final = 5.0
"""Simulated time for the client to start in, and for the last packets to come back."""
WARM_S: Final = 1.0
"""Of the packets' time, left out: the anchor is learnt."""
WINDOW_NS: Final = 100_000_000
P50_MS: Final = 0.5
P99_MS: Final = 2.0


@dataclass(frozen=True, slots=True)
class Lateness:
    """Release less arrival, in ms, over all packets that were released to the client; and less due, in the median."""

    packets: int
    p50_ms: float
    p99_ms: float
    max_ms: float
    beyond_due_p50_ms: float


def lateness(seconds: float = 10.0) -> Lateness:
    """Measure for so many seconds, in real time at ticks of 2 ms."""

    def client(simulation: str, radio: str) -> list[list[str]]:
        options = ["--name", NAME, "--connect", radio, "--rate", str(RATE_HZ), "--seconds", str(seconds)]
        return [["-m", "bench.echo_client", *options]]

    spread = f"{{id: spread, from: '*', to: {NAME}, delay: 3 ms, jitter: {{shape: uniform, width: 6 ms}}, order: free}}"
    sets = ["tick=2 ms", "substeps=4", "players={}", f"clients={{{NAME}: {{}}}}", f"network.links=[{spread}]"]
    run = watch("realtime", seconds + MARGIN_S, sets, every_s=1.0, helpers=client, read=read)
    found: Lateness = run.found
    return found


def read(path: Path) -> Lateness:
    """Return the lateness of what a capture's run released to the client."""
    packets = open_capture(path).packets
    ours = packets.where((packets.destination == NAME) & (packets.wall_released_ns > 0))
    arrival_ns, released_ns = ours.arrival_tick * TICK_NS, ours.wall_released_ns
    late_ns = released_ns - arrival_ns
    window = (released_ns - released_ns.min()) // WINDOW_NS
    for n in np.unique(window):
        late_ns[window == n] -= late_ns[window == n].min()
    is_warm = arrival_ns >= arrival_ns.min() + int(WARM_S * 1e9)
    late_ms, due_ms = late_ns[is_warm] / 1e6, (late_ns + arrival_ns - ours.due_ns)[is_warm] / 1e6
    p50, p99 = np.percentile(late_ms, [50, 99])
    figures = float(p50), float(p99), float(late_ms.max()), float(np.median(due_ms))
    return Lateness(len(late_ms), *(round(figure, 3) for figure in figures))


def lines(row: Lateness) -> list[str]:
    """Return the figures for people."""
    return [
        f"release less arrival: p50 {row.p50_ms:.2f} (to stay below {P50_MS:g}), p99 {row.p99_ms:.2f} (below {P99_MS:g}"
        f"), max {row.max_ms:.2f} ms over {row.packets} packets; less due p50 {row.beyond_due_p50_ms:.2f} ms"
    ]
