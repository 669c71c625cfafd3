"""How late packets leave the vHub in real time, and where that comes from: 5,000 a second to a client.

A client sends at this rate to robots that answer; the answers come over a link whose delay is spread over several
ticks. A packet that is due within a tick reaches a client at that tick's end: fates know ticks. So a packet is late by
the time from the end of the tick at which it arrives to its release, by the wall clock; after its own due time
it is half a tick more in the mean. Wall time 0 of the run is that of its promptest tick within half a second around: a
run that lags for longer has another time 0, as its pacing has after a lag of 100 ms, and its lags are listed beside.

The run is the table without players, at ticks of 5 ms, its physics by the engine `pure`, one substep each: light
enough for two cores to keep the pace beside the packets, since a run that lags measures nothing of the vHub. The
lag of the commits shows whether it did.

The lateness has two parts: when the vHub had all inputs of the tick's closing (commit and samples; then the run itself
is late), and the time from its closing up to the release: verdicts, journal, deliveries. After it come message and
network until the client has it. All times are of one machine's monotonic clock.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bench.distributed import cost_text
from bench.runs import BenchError, ProcessCost, Watched, watch
from foosim.capture.columns import Packets
from foosim.capture.reader import open_capture
from foosim.capture.rows import TICK, TickRow

RATE_HZ: Final = 5_000
TICK_MS: Final = 5
TICK_NS: Final = TICK_MS * 1_000_000
WORLD: Final = (f"tick={TICK_MS} ms", "substeps=1", "engine=pure", "players={}")
NAME: Final = "probe"
MARGIN_S: Final = 5.0
"""Simulated time for the client to start in, and for the last packets to come back."""
WARM_NS: Final = 1_000_000_000
"""Of the packets' time, left out: everything runs for the first time."""
HALF_WINDOW: Final = 500_000_000 // TICK_NS
"""In ticks: the window of the promptest one."""
P50_MS: Final = 0.5
P99_MS: Final = 2.0

Times = NDArray[np.int64]
Quantiles = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Lateness:
    """Release less the end of the tick of arrival, in ms, over all packets that were released to the client.

    Its parts and the time after it as p50, p99 and the greatest: `run_ms` until the vHub had all inputs of the tick's
    closing, `closing_ms` from there to the release, `way_ms` from there to the client. `lag_ms` is the lag of the run's
    commits after its own pacing, as the supervisor counts it.
    """

    packets: int
    p50_ms: float
    p99_ms: float
    max_ms: float
    beyond_due_p50_ms: float
    run_ms: Quantiles
    closing_ms: Quantiles
    way_ms: Quantiles
    lag_ms: Quantiles
    processes: list[ProcessCost]

    @property
    def kept_pace(self) -> bool:
        """Whether all but one of a hundred commits came before the next one was due."""
        return self.lag_ms[1] < TICK_MS


def lateness(seconds: float = 10.0) -> Lateness:
    """Measure for some seconds, in real time. Raises BenchError when nothing was released."""
    jitter = "{shape: uniform, width: 15 ms}"
    spread = f"{{id: spread, from: '*', to: {NAME}, delay: 5 ms, jitter: {jitter}, order: free}}"
    sets = [*WORLD, f"clients={{{NAME}: {{}}}}", f"network.links=[{spread}]"]
    with tempfile.TemporaryDirectory() as folder:
        times = Path(folder) / "times.npz"

        def client(simulation: str, radio: str) -> list[list[str]]:
            options = ["--name", NAME, "--connect", radio, "--rate", str(RATE_HZ), "--seconds", str(seconds)]
            return [["-m", "bench.echo_client", *options, "--times", str(times)]]

        run = watch("realtime", seconds + MARGIN_S, sets, 1.0, client, read=_captured)
        return _lateness(run, _received(times))


def _captured(path: Path) -> tuple[Packets, Times, Times]:
    """Return what was released to the client; and, by tick, when the vHub had all that closes it, and the wall time of
    simulated time 0 around it."""
    capture = open_capture(path)
    packets = capture.packets
    rows = [row for row in capture.rows(TICK) if isinstance(row, TickRow)]
    known_ns = np.array([row.wall_closed_ns for row in rows], dtype=np.int64)
    behind_ns = known_ns - np.array([row.tick for row in rows]) * TICK_NS
    places = range(len(rows))
    zero_ns = np.array([behind_ns[max(0, at - HALF_WINDOW) : at + HALF_WINDOW + 1].min() for at in places])
    return packets.where((packets.destination == NAME) & (packets.wall_released_ns > 0)), known_ns, zero_ns


def _lateness(run: Watched, received_ns: dict[tuple[str, int], int]) -> Lateness:
    packets, known_ns, zero_ns = run.found
    if len(packets) == 0:
        raise BenchError("nothing was released to the client")
    packets = packets.where(packets.arrival_tick * TICK_NS >= packets.arrival_tick.min() * TICK_NS + WARM_NS)
    released_ns, zero_ns = packets.wall_released_ns, zero_ns[packets.arrival_tick]
    known_ns, end_ns = known_ns[packets.arrival_tick], zero_ns + packets.arrival_tick * TICK_NS
    keys = zip(packets.source.tolist(), packets.sequence.tolist(), strict=True)
    way_ns = [
        received_ns[key] - at_ns for key, at_ns in zip(keys, released_ns.tolist(), strict=True) if key in received_ns
    ]
    if not way_ns:
        raise BenchError(f"nothing that was released later than {WARM_NS / 1e9:g} s after the first reached the client")
    lag = run.result["lag_ms"]
    return Lateness(
        len(packets),
        *_quantiles(released_ns - end_ns),
        round(float(np.median(released_ns - zero_ns - packets.due_ns)) / 1e6, 3),
        _quantiles(known_ns - end_ns),
        _quantiles(released_ns - known_ns),
        _quantiles(way_ns),
        (lag["p50"], lag["p99"], lag["max"]),
        run.costs(),
    )


def _received(path: Path) -> dict[tuple[str, int], int]:
    """Return when the client had each packet, by source and number."""
    with np.load(path) as content:
        names, sequences, received = (content[name].tolist() for name in ("source", "sequence", "received_ns"))
    return {(name, sequence): at for name, sequence, at in zip(names, sequences, received, strict=True)}


def _quantiles(times_ns: Times | Sequence[int]) -> Quantiles:
    """Return p50, p99 and the greatest in ms."""
    p50, p99, most = np.percentile(times_ns, [50, 99, 100]) / 1e6
    return round(float(p50), 3), round(float(p99), 3), round(float(most), 3)


def lines(row: Lateness) -> list[str]:
    """Return the figures for people."""
    parts = {
        "until the vHub had all that closes the tick": row.run_ms,
        "from there to the release": row.closing_ms,
        "from the release to the client": row.way_ms,
        "lag of the run's commits": row.lag_ms,
    }
    return [
        f"release less arrival: p50 {row.p50_ms:.2f} (to stay below {P50_MS:g}), p99 {row.p99_ms:.2f} (below {P99_MS:g}"
        f"), max {row.max_ms:.2f} ms over {row.packets} packets; less due p50 {row.beyond_due_p50_ms:.2f} ms",
        f"the table with {', '.join(WORLD)}: {'kept' if row.kept_pace else 'did NOT keep'} the pace",
        *(f"    {what:44} p50 {p50:.2f}, p99 {p99:.2f}, max {most:.2f} ms" for what, (p50, p99, most) in parts.items()),
        f"us of processor a tick: {cost_text(row.processes)}",
    ]
