"""Runs of real processes, as `foosim up` makes them, watched from here.

The watch works as the display does: it sees each status, and at the same time reads what every child has used.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from bench.machine import Use, children, free_ports, use_of
from foosim.launcher.display import Display
from foosim.launcher.plan import make_plan
from foosim.launcher.run_options import RunOptions
from foosim.launcher.up import Up
from foosim.protocol.channels import SUPERVISOR
from foosim.runtime.process import FOOSIM

ROOT: Final = Path(__file__).resolve().parents[1]
TABLE: Final = ROOT / "deploy" / "table.yaml"
LAUNCHER: Final = "launcher"
ANSWER_S: Final = 30.0
EAGER_S: Final = 0.02
"""How often the status is requested until the first tick is there."""

Helpers = Callable[[str, str], Sequence[list[str]]]
"""Gives the command lines of processes that the bench adds, from the addresses of both planes."""


class BenchError(Exception):
    """A run that was to be measured went wrong."""


@dataclass(frozen=True, slots=True)
class Look:
    """One look at a running system: when, how far it was, and what its processes had used."""

    wall_s: float
    ticks: int
    uses: dict[str, Use]


@dataclass(frozen=True, slots=True)
class ProcessCost:
    """What one process cost between the first look and the last."""

    name: str
    cpu_us_per_tick: float
    rss_mb_start: float
    rss_mb_end: float


@dataclass(slots=True)
class Watched:
    """A run that is over: its result, the looks at it, when it had its first tick, what the helpers printed, and what
    was read from its capture."""

    result: dict[str, Any]
    looks: list[Look]
    first_tick_s: float
    capture_mb: float
    printed: list[str] = field(default_factory=list)
    found: Any = None

    @property
    def tick_s(self) -> float:
        return float(self.result["tick_ns"]) / 1e9

    def costs(self) -> list[ProcessCost]:
        """Return what each process cost, in the order of their names."""
        first, last = self.looks[0], self.looks[-1]
        ticks = last.ticks - first.ticks
        if ticks <= 0:
            raise BenchError("too short a run: fewer than two looks at it")
        return [
            ProcessCost(
                name,
                round((last.uses[name].cpu_s - first.uses[name].cpu_s) / ticks * 1e6, 1),
                round(first.uses[name].rss_mb, 1),
                round(last.uses[name].rss_mb, 1),
            )
            for name in sorted(first.uses.keys() & last.uses.keys())
        ]


class Watch(Display):
    """A display that shows nothing and remembers."""

    def __init__(self, every_s: float) -> None:
        super().__init__(io.StringIO())
        self.looks: list[Look] = []
        self.first_tick_s = 0.0
        self.every_s = EAGER_S
        self._later_every_s = every_s

    def show(self, status: dict[str, Any], now_s: float) -> None:
        if status["state"] != "running" or status["ticks"] < 1:
            return
        seen_s = time.monotonic()
        if not self.looks:
            computed_s = 0.0 if status["pace"] != "realtime" else status["ticks"] * status["tick_ns"] / 1e9
            self.first_tick_s = seen_s - computed_s
            self.every_s = self._later_every_s
        self.looks.append(Look(seen_s, status["ticks"], uses_of_run()))


def uses_of_run() -> dict[str, Use]:
    """Return what the processes of the run have used, by their names in the run; this one is its launcher."""
    own = use_of(os.getpid())
    assert own is not None, "this process is there"
    found = {LAUNCHER: own}
    for pid, command in children().items():
        name, use = name_of(command), use_of(pid)
        if name and use is not None:
            found[name] = use
    return found


def name_of(command: Sequence[str]) -> str:
    """Return the name of a process in its run, by its command line; empty for any other process."""
    if "--name" in command[:-1]:
        return command[command.index("--name") + 1]
    if [Path(word).name for word in command[1:2]] != [FOOSIM]:
        return ""
    match command[2:]:
        case ["run", *_]:
            return SUPERVISOR
        case ["role", "roles", process, *_]:
            return process
        case ["role", role, *_]:
            return role
    return ""


def watch(  # parameters of a run, by keyword
    pace: str,
    duration_s: float,
    sets: Sequence[str] = (),
    every_s: float = 0.25,
    helpers: Helpers | None = None,
    *,
    read: Callable[[Path], Any] | None = None,
    deployment: Path = TABLE,
) -> Watched:
    """Run a deployment with a capture, with the helpers beside it.

    `read` is given the finished capture. A line on standard error names the run and its speed: starting
    its processes alone takes a busy machine half a minute.

    Raises BenchError when it did not end in order.
    """
    port = free_ports()
    lasts, listen = f"{round(duration_s * 1000)} ms", f"127.0.0.1:{port}"
    options = RunOptions(deployment, pace, lasts, sets=tuple(sets), listen=listen)
    begun_s = time.monotonic()
    plan = make_plan(options)
    commands = [] if helpers is None else helpers(f"tcp/127.0.0.1:{port}", f"tcp/127.0.0.1:{port + 1}")
    with tempfile.TemporaryDirectory() as folder:
        capture = Path(folder) / "run.mcap"
        watching = Watch(every_s)
        print(f"    {deployment.stem}, {pace}, {duration_s:g} s: ", end="", file=sys.stderr, flush=True)
        beside = [
            subprocess.Popen([sys.executable, *command], cwd=ROOT, stdout=subprocess.PIPE, text=True)
            for command in commands
        ]
        try:
            outcome = Up(plan, capture, watching).run()
            if outcome.failed or outcome.result is None:
                raise BenchError("\n".join(outcome.lines))
            if outcome.result["ticks"] != plan.ticks:
                raise BenchError(f"{outcome.lines[0]}, at {outcome.result['ticks']} of {plan.ticks} ticks")
            print(f"{outcome.result['rtf']:.2f}x real time", file=sys.stderr, flush=True)
            printed = [process.communicate(timeout=ANSWER_S)[0] for process in beside]
        finally:
            for process in beside:
                process.kill()
                process.wait()
        if not watching.looks:
            raise BenchError("the run was over before it was seen running")
        size_mb = capture.stat().st_size / 1e6
        found = None if read is None else read(capture)
    return Watched(outcome.result, watching.looks, watching.first_tick_s - begun_s, size_mb, printed, found)
