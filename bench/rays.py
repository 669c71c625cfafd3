"""Scans of a fleet: 100 robots in a square, each with a laser scanner of 360 rays at 10 Hz, in one process.

The kernel and its twin in numpy compute the same ticks by turns. Figures are processor time in ms, medians over ticks:
of all rays of a frame, and of a whole tick in which all scan.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from statistics import median
from typing import Any, Final
from unittest.mock import patch

import numpy as np
import yaml

from foosim.deployment.loader import load_deployment
from foosim.simulation.simulation import Simulation
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.beams import BeamsTogether
from foosim.world.components.fitted import sensors_of
from foosim.world.components.view import SensingView
from foosim.world.layout import build_layout
from foosim.world.rays import casting

SIDE: Final = 10
APART_M: Final = 2.0
TURNS: Final = 40
TICKS_OF_SCAN: Final = 10
SCAN: Final = {"kind": "laser_scanner", "rate": "10 Hz", "rays": 360, "range": "10 m", "at": {"z": "20 cm"}}


@dataclass(frozen=True, slots=True)
class Rays:
    """Processor time (ms) of what was cast, by the kernel and by numpy, and how many times as long numpy takes."""

    what: str
    kernel: float
    numpy: float
    ratio: float


def scans_text() -> str:
    """Return the deployment."""
    places = {
        f"r{n:02}": {"like": "one", "at": {"x": f"{APART_M * (n % SIDE)} m", "y": f"{APART_M * (n // SIDE)} m"}}
        for n in range(SIDE * SIDE)
    }
    data: dict[str, Any] = {
        "format": 2,
        "world": "scans",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 1,
        "engine": "pure",
        "pace": "fast",
        "scene": {"kind": "empty", "length": "1 km", "width": "1 km"},
        "templates": {"one": {"model": "differential_drive", "sensors": {"scan": SCAN}}},
        "robots": places,
        "nodes": {"n": {"robots": ["*"]}},
        "network": {"links": [{"id": "all", "from": "*", "to": "*"}]},
    }
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=200)


def rays() -> list[Rays]:
    """Measure rays alone, and ticks with scans."""
    deployment = load_deployment(scans_text(), "scans.yaml")
    layout = build_layout(deployment)
    numbers = initial_numbers(deployment, layout)
    scanners: list[Any] = [
        one.sensor for robot in layout.of("differential_drive") for one in sensors_of(deployment, layout, robot)
    ]
    beams, view = BeamsTogether([one.beams for one in scanners]), SensingView(0, numbers, np.array(numbers))

    def cast() -> None:
        beams.distances(view)

    found = [_measured("36,000 rays", cast, 1)]
    with Simulation(deployment, agents=[], network=True) as simulation:
        found.append(_measured("a tick with all scans", simulation.step, TICKS_OF_SCAN))
    return found


def _measured(what: str, run: Any, every: int) -> Rays:
    """Return the time of each `every`-th call, which is the longest of so many."""

    def longest() -> float:
        taken = []
        for _ in range(every):
            begun_ns = time.process_time_ns()
            run()
            taken.append((time.process_time_ns() - begun_ns) / 1e6)
        return max(taken)

    kernel, twin = [], []
    for _ in range(TURNS):
        kernel.append(longest())
        with patch.object(casting, "C", None):
            twin.append(longest())
    return Rays(what, median(kernel), median(twin), median(twin) / median(kernel))


def lines(found: list[Rays]) -> list[str]:
    """Return the figures in lines."""
    return [f"{one.what}: kernel {one.kernel:.2f} ms, numpy {one.numpy:.1f} ms, {one.ratio:.1f} times" for one in found]
