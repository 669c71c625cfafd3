"""A fleet of robots that move by kinematics, in one process without a capture.

Each has a sensor of its pose at 50 Hz, and a scanner of 24 rays at 10 Hz.

They start in rows on an empty floor and all drive in circles from the first tick on, side by side with neighbours that
they have to look out for. Each fleet runs by itself, and with one client that hears all of it. Figures are processor
time of a rehearsal on one node, in us a tick and in b.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import median
from typing import Any, Final

import yaml

from bench.bare_tick import bare_tick_us
from bench.meter import Meter
from foosim.client.player import Player, Samples
from foosim.deployment.schema import Deployment
from foosim.library.mobile.v_w import Motion
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.world.frame import Frame

SIZES: Final = (200, 1000)
WARM_TICKS: Final = 100
TICKS_PER_S: Final = 100
APART_M: Final = 2.0
SENSORS: Final = {
    "pose": {"kind": "pose", "rate": "50 Hz"},
    "scan": {"kind": "laser_scanner", "rate": "10 Hz", "rays": 24, "range": "4 m", "at": {"z": "20 cm"}},
}


class Rounds(Player):
    """Sends each robot round a circle of its own, once; it may hear of them, and does nothing with that."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self._robots = sorted(deployment.robots)
        self._has_sent = False

    def act(self, tick: int, samples: Samples) -> dict[str, Motion]:
        """Return the commands, in the first turn."""
        if self._has_sent:
            return {}
        self._has_sent = True
        return {robot: Motion(0.4 + 0.05 * (number % 7), 1.0) for number, robot in enumerate(self._robots)}


@dataclass(frozen=True, slots=True)
class Fleet:
    """One fleet: processor time of a tick, the median of some runs, in us and in b."""

    robots: int
    is_heard: bool
    us_per_tick: float
    us_of_runs: list[float]
    ratio: float


def fleet_text(robots: int, *, is_heard: bool) -> str:
    """Return the deployment of a fleet."""
    row = int(robots**0.5) + 1
    heard = list(SENSORS) if is_heard else []
    places = {
        f"r{number:04}": {
            "like": "one",
            "at": {"x": f"{APART_M * (number % row)} m", "y": f"{APART_M * (number // row)} m"},
        }
        for number in range(robots)
    }
    data = {
        "format": 2,
        "world": "fleet",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 1,
        "engine": "pure",
        "pace": "fast",
        "scene": {"kind": "empty", "length": "1 km", "width": "1 km"},
        "templates": {"one": {"model": "differential_drive", "sensors": SENSORS}},
        "robots": places,
        "nodes": {"n": {"robots": ["*"]}},
        "players": {
            "rounds": {
                "class": f"{Rounds.__module__}:{Rounds.__qualname__}",
                "rate": "50 Hz" if is_heard else "100 mHz",
                "lockstep": True,
                "robots": {"*": heard},
            }
        },
        "network": {"links": [{"id": "all", "from": "*", "to": "*"}]},
    }
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=200)


def fleet(seconds: float = 10.0, repeats: int = 3) -> list[Fleet]:
    """Measure both fleets, by themselves and heard; `seconds` is the simulated time of each run."""
    found = []
    for robots in SIZES:
        for is_heard in (False, True):
            runs = [_run(robots, is_heard, seconds) for _ in range(repeats)]
            us = median(us for us, _ in runs)
            found.append(
                Fleet(robots, is_heard, us, [us for us, _ in runs], round(median(us / b for us, b in runs), 1))
            )
    return found


def _run(robots: int, is_heard: bool, seconds: float) -> tuple[float, float]:
    """Return the processor time of a tick, and b beside it (us)."""
    meter, ticks = Meter(), WARM_TICKS + max(10, round(seconds * TICKS_PER_S))

    def committed(frame: Frame) -> None:
        if frame.tick == WARM_TICKS:
            meter.begin(frame.tick)
        elif frame.tick == ticks:
            meter.mark(frame.tick)

    b = bare_tick_us()
    text = fleet_text(robots, is_heard=is_heard)
    rehearse(text, "fleet.yaml", ticks, 1, settings=Settings(on_commit=committed))
    return meter.us_per_tick()["cpu"], b


def lines(rows: list[Fleet]) -> list[str]:
    """Return the figures for people."""
    return [
        f"{row.robots:5} robots, {'one client hears all' if row.is_heard else 'without subscribers':21}"
        f"{row.us_per_tick:8.0f} us a tick (runs {' '.join(f'{us:.0f}' for us in row.us_of_runs)}), {row.ratio:5.1f} b"
        for row in rows
    ]
