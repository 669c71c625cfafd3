"""Captured packets through another network: opening, reading, judging again and comparing, by the second.

Rehearsals make the captures. That of the table goes through its own network, which has to change nothing, and through
one that loses and delays more. That of the warehouse, over radio, has the frame of every tick once, and every tenth
once: then its world is simulated again.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bench.runs import ROOT, TABLE, BenchError
from foosim.capture.reader import open_capture
from foosim.deployment.loader import load_deployment, with_network
from foosim.rehearsal.run import rehearse
from foosim.replay.what_if import what_if

WAREHOUSE: Final = ROOT / "deploy" / "warehouse.yaml"
WORSE: Final = ("network.links.everything.loss=5 %", "network.links.everything.delay=4 ms")
WOODEN: Final = ("scenery.shelf-north-outer-1.radio=wood",)
ALL_FRAMES: Final = ("capture.frames_every=1 tick",)
LEAST_HZ: Final = 50_000
TURNS: Final = 3
"""How often each is done; the fastest counts."""


@dataclass(frozen=True, slots=True)
class WhatIfRate:
    """One capture through one network."""

    way: str
    packets: int
    changed: int
    packets_per_s: int
    cpu_us_per_packet: float


def whatif(seconds: float = 20.0) -> list[WhatIfRate]:
    """Measure each way with captures of so much simulated time."""
    with tempfile.TemporaryDirectory() as folder:
        table = _captured(TABLE, Path(folder) / "table.mcap", seconds)
        hall = _captured(WAREHOUSE, Path(folder) / "hall.mcap", seconds, ALL_FRAMES)
        hall_without = _captured(WAREHOUSE, Path(folder) / "hall-10.mcap", seconds)
        return [
            _measure("table", table),
            _measure("table, worse links", table, WORSE),
            _measure("warehouse", hall),
            _measure("warehouse, a wooden shelf", hall, WOODEN),
            _measure("warehouse, world simulated again", hall_without),
        ]


def _captured(file: Path, path: Path, seconds: float, sets: Sequence[str] = ()) -> Path:
    text = file.read_text()
    ticks = round(seconds * 1e9 / load_deployment(text, file.name).tick_ns)
    rehearse(text, file.name, ticks, 1, sets, capture=path, folder=file.parent)
    return path


def _measure(way: str, path: Path, sets: Sequence[str] = ()) -> WhatIfRate:
    spent_s = cpu_s = float("inf")
    for _ in range(TURNS):
        begun_s, begun_cpu_s = time.perf_counter(), time.process_time()
        capture = open_capture(path)
        about = capture.about
        text = with_network(about.deployment_text, about.deployment_name, None, sets)
        other = load_deployment(text, about.deployment_name).with_assets(about.files) if sets else None
        found = what_if(capture, other)
        spent_s, cpu_s = min(spent_s, time.perf_counter() - begun_s), min(cpu_s, time.process_time() - begun_cpu_s)
        if not sets and (found.changed or found.inputs_changed):
            raise BenchError(f"{way}: its own network changed {found.changed} packets of {found.packets}")
    per_packet_us = round(cpu_s / found.packets * 1e6, 1)
    return WhatIfRate(way, found.packets, found.changed, round(found.packets / spent_s), per_packet_us)


def lines(rows: list[WhatIfRate]) -> list[str]:
    """Return the figures for people."""
    return [
        f"{row.way:34}{row.packets_per_s:8} packets/s (to reach {LEAST_HZ}) {row.cpu_us_per_packet:6.1f} us of "
        f"processor each, {row.changed} changed of {row.packets}"
        for row in rows
    ]
