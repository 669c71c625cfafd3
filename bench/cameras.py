"""Cameras: what a picture costs its node and its capture on the table, and twenty robots with eyes in real time.

A picture's node measures and encodes the poses in view: processor time, the least and the median of equal turns.
What it adds to a capture is the difference of two captures of a rehearsal, with the camera and without,
over the count of its packets. The run in real time is `deploy/eyes.yaml` as `up` runs it: its players look at each
picture, and draw it.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Final

from bench.bare_tick import bare_tick_us
from bench.runs import ROOT, TABLE, ProcessCost, watch
from foosim.capture.reader import open_capture
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.simulation.run import rehearse
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.fitted import sensors_of
from foosim.world.components.view import SensingView
from foosim.world.layout import build_layout

EYES: Final = ROOT / "deploy" / "eyes.yaml"
EYE: Final = "robots.camera.sensors.eye={kind: camera, rate: 50 Hz, at: {z: 1.2 m, pitch: 90 deg}}"
LOOKER: Final = (
    "players.looker={class: foosim.client.player:Player, rate: 50 Hz, process: main, robots: {camera: [eye]}}"
)
"""Hears the pictures of the camera: only packets that somebody hears are in a capture."""
TURNS: Final = 41
SAMPLES: Final = 200
"""Samples of a turn."""


@dataclass(frozen=True, slots=True)
class Cameras:
    """Least processor time of a picture at its node, bytes of it in a capture, and the run of `deploy/eyes.yaml`.

    `shares` are seconds of processor a second of wall, by process; `ratio` is simulated time over wall time;
    `bare_tick_us` is b beside the run.
    """

    node_us: float
    node_us_median: float
    capture_bytes: float
    bare_tick_us: float
    ratio: float
    lag_p50_ms: float
    lag_p99_ms: float
    lag_max_ms: float
    shares: dict[str, float]
    pictures_per_s: float
    processes: list[ProcessCost]


def cameras(seconds: float = 10.0) -> Cameras:
    """Measure; `seconds` is the simulated time of each run."""
    node_us, capture_bytes = _node_us(), _capture_bytes(seconds)
    b = bare_tick_us()
    run = watch("realtime", seconds, deployment=EYES, read=_looked_at)
    first, last = run.looks[0], run.looks[-1]
    costs, lag = run.costs(), run.result["lag_ms"]
    per_s = (last.ticks - first.ticks) / (last.wall_s - first.wall_s) / 1e6
    shares = {cost.name: round(cost.cpu_us_per_tick * per_s, 2) for cost in costs}
    pictures_per_s = run.found / (run.result["ticks"] * run.tick_s)
    return Cameras(
        round(min(node_us), 1),
        round(median(node_us), 1),
        round(capture_bytes),
        round(b, 1),
        float(run.result["rtf"]),
        lag["p50"],
        lag["p99"],
        lag["max"],
        shares,
        round(pictures_per_s, 1),
        costs,
    )


def _node_us() -> list[float]:
    """Return the processor time of a sample and its encoding (us), of equal turns."""
    deployment = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, [EYE]), TABLE.name)
    layout = build_layout(deployment)
    numbers = initial_numbers(deployment, layout)
    (eye,) = [one for one in sensors_of(deployment, layout, layout["camera"]) if one.channel == "eye"]
    spent = []
    for turn in range(TURNS):
        begun_ns = time.process_time_ns()
        for tick in range(SAMPLES):
            eye.codec.encode_checked(eye.sample(SensingView(turn * SAMPLES + tick, numbers)))
        spent.append((time.process_time_ns() - begun_ns) / SAMPLES / 1e3)
    return spent


def _capture_bytes(seconds: float) -> float:
    """Return what a picture adds to a capture of the table in play (bytes)."""
    text = TABLE.read_text()
    ticks = round(seconds * 1e9 / load_deployment(text, TABLE.name).tick_ns)
    with tempfile.TemporaryDirectory() as folder:
        plain, seen = Path(folder, "plain.mcap"), Path(folder, "seen.mcap")
        rehearse(text, TABLE.name, ticks, 1, capture=plain)
        rehearse(text, TABLE.name, ticks, 1, (EYE, LOOKER), capture=seen)
        more = seen.stat().st_size - plain.stat().st_size
        return more / int((open_capture(seen).packets.channel == "eye").sum())


def _looked_at(capture: Path) -> int:
    """Return the count of pictures that reached the players, which look at each."""
    packets = open_capture(capture).packets
    return int(((packets.channel == "eye") & (packets.fate == "delivered")).sum())


def lines(row: Cameras) -> list[str]:
    """Return the figures for people."""
    shares = "  ".join(f"{name} {share:.2f}" for name, share in row.shares.items())
    return [
        f"on the table a picture costs its node {row.node_us:.1f} us (asked: at most 20; median "
        f"{row.node_us_median:.1f}), its capture {row.capture_bytes:.0f} bytes (asked: at most 1,500)",
        f"eyes: {row.ratio:.2f}x real time (asked: 1 where b is at most 200 us; b {row.bare_tick_us:.0f} us), "
        f"lag p50 {row.lag_p50_ms:.2f}, p99 {row.lag_p99_ms:.2f}, max {row.lag_max_ms:.2f} ms; "
        f"{row.pictures_per_s:.1f} pictures a second",
        f"    cores used: {shares}  all {sum(row.shares.values()):.2f}",
    ]
