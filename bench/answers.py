"""How soon a free-running client knows that its job was taken, in ticks of a run in real time on an ideal link.

The client is a process of its own, this module. It hears where the robot is at each tick, calls at any time of a tick,
and counts from the newest one that it knows then.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from bench.runs import watch
from foosim.client.client import connect
from foosim.client.errors import RunEnded
from foosim.world.component_types.jobs import JobState

NAME, ROBOT, ACTUATOR, CHANNELS = "hand", "scout", "drive", ("jobs", "pose")
TEXT: Final = f"""
format: 2
world: answers
seed: 1
tick: 10 ms
substeps: 1
pace: realtime
scene: {{kind: empty}}
robots:
  {ROBOT}:
    model: differential_drive
    actuators: {{{ACTUATOR}: {{kind: go_to, patience: 1000 s}}}}
    sensors: {{jobs: {{kind: job, actuator: {ACTUATOR}, rate: 5 Hz}}, pose: {{kind: pose, rate: 100 Hz}}}}
nodes: {{one: {{robots: ["*"]}}}}
clients: {{{NAME}: {{}}}}
network: {{links: [{{id: all, from: "*", to: "*"}}]}}
"""
FIRST_S: Final = 60.0


@dataclass(frozen=True, slots=True)
class Answers:
    """How many calls were answered after how many ticks, and the wall time till then by p50, p99, max (ms)."""

    ticks: dict[int, int]
    wall_ms: list[float]


def answers(seconds: float = 20.0) -> Answers:
    """Run for some seconds."""
    beside = ["-m", "bench.answers", "--connect"]
    with TemporaryDirectory() as folder:
        file = Path(folder) / "answers.yaml"
        file.write_text(TEXT)
        run = watch("realtime", seconds, helpers=lambda _, radio: [[*beside, radio]], deployment=file)
    found = json.loads(run.printed[0])
    ticks = Counter(int(one) for one, _ in found)
    walls = np.percentile([wall_ms for _, wall_ms in found], (50, 99, 100))
    return Answers(dict(sorted(ticks.items())), [round(float(one), 1) for one in walls])


def lines(row: Answers) -> list[str]:
    """Return the figures for people."""
    shown = ", ".join(f"{count} of {sum(row.ticks.values())} after {ticks}" for ticks, count in row.ticks.items())
    p50, p99, most = row.wall_ms
    return [f"ticks until a job is known to be taken: {shown}; wall p50 {p50:.1f}, p99 {p99:.1f}, max {most:.1f} ms"]


def main() -> None:
    """Run as a process of the bench: print ticks and wall time (ms) of each call."""
    parser = argparse.ArgumentParser(description="A client that gives jobs, and times the answers.")
    parser.add_argument("--connect", required=True)
    draw, found = Random(1), []
    with connect(parser.parse_args().connect, NAME, timeout_s=FIRST_S) as client, suppress(RunEnded):
        client.listen([(ROBOT, channel) for channel in CHANNELS])
        client.receive(FIRST_S)
        drive = client.robots[ROBOT].actuators[ACTUATOR]
        while True:
            time.sleep(0.02 + 0.02 * draw.random())
            client.receive(0.0)
            tick, begun_s = client.tick, time.monotonic()
            job = drive.call(x=2.0 + draw.random(), y=1.0)
            while job.state == JobState.NONE:
                client.receive(1.0)
            found.append((client.tick - tick, (time.monotonic() - begun_s) * 1e3))
    print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
