"""Which roles share a process, and what that costs: by turns with another checkout of foosim, in units of b.

Each round measures b, then runs each row once with every checkout, as the commands that users type; medians of the
rounds are shown. Processor time and memory are those of all processes of a command, looked at in the middle of its run.
`--before` names the other checkout, which has an environment as this one; its deployments say its shapes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, Final

from bench.bare_tick import bare_tick_us
from bench.machine import children, free_ports, pss_mb, use_of
from bench.runs import ROOT, BenchError

LOOK_S: Final = 0.5
MIDDLE: Final = (0.4, 0.8)
"""The part of a command's duration in which its processes are looked at: they run, and none starts or ends."""
LOOKS_MIN: Final = 4
MEMORY_LOOK: Final = 8
"""At which look memory is read: once, since that holds the processes up for some milliseconds."""
SEEDS: Final = 30
HERE: Final = Path(sys.executable).parent
TABLE: Final = "deploy/table.yaml"
WAREHOUSE: Final = "deploy/warehouse.yaml"
COMMAND_S: Final = 600.0


@dataclass(frozen=True, slots=True)
class Ran:
    """One command: its result, how long it took, cores used and memory (PSS, MB) in the middle of it."""

    result: dict[str, Any]
    wall_s: float
    cores: float
    memory_mb: float

    @property
    def tick_us(self) -> float:
        """Wall time of a tick, without the start."""
        return float(self.result["tick_ns"]) / 1e3 / float(self.result["rtf"])

    @property
    def cpu_us(self) -> float:
        """Processor time of a tick, of all processes."""
        return self.cores * self.tick_us


@dataclass(frozen=True, slots=True)
class Row:
    """A command and what is shown of it. `is_ours`: the other checkout does not have it."""

    name: str
    command: tuple[str, ...]
    figures: tuple[str, ...]
    is_ours: bool = False


@dataclass(slots=True)
class Found:
    """The figures of one row and one checkout: by name, one value a round."""

    values: dict[str, list[float]] = field(default_factory=dict)

    def add(self, figures: dict[str, float]) -> None:
        """Add those of a round."""
        for name, value in figures.items():
            self.values.setdefault(name, []).append(value)


def rows(seconds: float, realtime_s: float) -> list[Row]:
    """Return the commands."""

    def up(pace: str, lasts_s: float, deployment: str = TABLE, *options: str) -> tuple[str, ...]:
        return "foosim-supervisor", "up", deployment, "--pace", pace, "--for", f"{lasts_s:g}s", *options

    speed, real = ("tick b", "cpu b", "PSS MB"), ("rtf", "lag p50 ms", "lag p99 ms", "lag max ms", "cpu b", "PSS MB")
    shown = ("wall s", "cpu s")
    return [
        Row("table, fast", up("fast", seconds), speed),
        Row("table, fast, one", up("fast", seconds, TABLE, "--processes", "one"), speed, is_ours=True),
        Row("table, fast, each", up("fast", seconds, TABLE, "--processes", "each"), speed, is_ours=True),
        Row("table, realtime", up("realtime", realtime_s), real),
        Row("table, realtime, one", up("realtime", realtime_s, TABLE, "--processes", "one"), real, is_ours=True),
        Row("warehouse, fast", up("fast", seconds * 5, WAREHOUSE), speed),
        Row("warehouse, fast, one", up("fast", seconds * 5, WAREHOUSE, "--processes", "one"), speed, is_ours=True),
        Row("rehearsal", ("foosim-rehearse", TABLE, "--for", f"{seconds:g}s"), ("tick b", "PSS MB")),
        Row("swarm", ("foosim-rehearse", TABLE, "--swarm", "--seeds", str(SEEDS)), ("seeds/s",)),
        Row("--help", ("foosim-supervisor", "--help"), shown),
        Row("validate", ("foosim-supervisor", "validate", TABLE), shown),
        Row("up, one tick", (*up("fast", 0.002), "--no-capture"), shown),
    ]


def processes_below(parent: int) -> list[int]:
    """Return a process and all that it has started, as far as they run."""
    try:
        started = children(parent)
    except FileNotFoundError:
        return []
    return [parent, *(pid for child in started for pid in processes_below(child))]


def commands_of(checkout: Path) -> Path:
    """Return the folder of the commands of a checkout, compiled or not as ours are."""
    return checkout / HERE.parent.name / "bin"


def run(checkout: Path, command: Sequence[str]) -> Ran:
    """Run a command in a checkout. Raises BenchError when it fails."""
    with tempfile.TemporaryDirectory() as place:
        return _run_in(place, checkout, [str(commands_of(checkout) / command[0]), *command[1:]])


def _run_in(place: str, checkout: Path, command: list[str]) -> Ran:
    if "up" in command[:2]:
        command += ["--listen", f"127.0.0.1:{free_ports()}"]
        command += [] if "--no-capture" in command else ["--capture", f"{place}/run.mcap"]
    is_run = "--for" in command or "--seeds" in command
    command += ["--json"] if is_run else []
    used_before_s = _used_by_ended_s()
    begun_s = time.monotonic()
    looks: list[tuple[float, float]] = []  # when, and processor time
    memory_mb = 0.0
    environment = {**os.environ, "XDG_STATE_HOME": place, "PYTHONDONTWRITEBYTECODE": ""}  # "": bytecode is kept
    with (
        open(f"{place}/errors", "w+") as errors,  # a full pipe would hold the command
        subprocess.Popen(command, cwd=checkout, env=environment, stdout=subprocess.PIPE, stderr=errors) as ran,
    ):
        while "--for" in command:
            try:
                ran.wait(LOOK_S)
                break
            except subprocess.TimeoutExpired:
                looks.append(_look(ran.pid, begun_s))
                if len(looks) == MEMORY_LOOK:
                    memory_mb = sum(map(pss_mb, processes_below(ran.pid)))
        output, _ = ran.communicate(timeout=COMMAND_S)
        wall_s = time.monotonic() - begun_s
        errors.seek(0)
        if ran.returncode != 0:
            raise BenchError(f"{' '.join(command)}: exit code {ran.returncode}\n{errors.read()[-2000:]}")
    result = json.loads(output.splitlines()[-1]) if is_run else {}
    first, last = (round(len(looks) * share) for share in MIDDLE)
    cores = (_used_by_ended_s() - used_before_s) / wall_s
    if last - first >= LOOKS_MIN:  # else of the whole command
        cores = (looks[last][1] - looks[first][1]) / (looks[last][0] - looks[first][0])
    return Ran(result, wall_s, cores, memory_mb)


def _look(pid: int, begun_s: float) -> tuple[float, float]:
    """Return when a command was looked at, and the processor time of its processes until then."""
    pids = processes_below(pid)
    now_s = time.monotonic() - begun_s
    used_s = sum(use.cpu_s for use in map(use_of, pids) if use is not None)
    return now_s, used_s


def _used_by_ended_s() -> float:
    """Return the processor time of all processes that this one has started and that have ended."""
    times = os.times()
    return times.children_user + times.children_system


def figures_of(row: Row, ran: Ran, b_us: float) -> dict[str, float]:
    """Return the figures of a row."""
    lag: Callable[[str], float] = lambda which: float(ran.result["lag_ms"][which])  # noqa: E731
    known: dict[str, Callable[[], float]] = {
        "tick b": lambda: ran.tick_us / b_us,
        "cpu b": lambda: ran.cpu_us / b_us,
        "PSS MB": lambda: ran.memory_mb,
        "rtf": lambda: float(ran.result["rtf"]),
        "lag p50 ms": lambda: lag("p50"),
        "lag p99 ms": lambda: lag("p99"),
        "lag max ms": lambda: lag("max"),
        "seeds/s": lambda: SEEDS / ran.wall_s,
        "wall s": lambda: ran.wall_s,
        "cpu s": lambda: ran.cores * ran.wall_s,
    }
    return {name: known[name]() for name in row.figures}


def shapes(
    seconds: float = 8.0,
    before: Path | None = None,
    rounds: int = 5,
    realtime_s: float = 60.0,
    only: Sequence[str] = (),
) -> dict[str, Any]:
    """Measure; return b, and by row and checkout the median, least and greatest of each figure, and of pairs."""
    found: dict[str, dict[str, Found]] = {}
    units = []
    for number in range(rounds):
        for row in rows(seconds, realtime_s):
            if only and row.name not in only:
                continue
            b_us = bare_tick_us()
            units.append(b_us)
            checkouts = {"now": ROOT} | ({} if before is None or row.is_ours else {"before": before})
            for which, folder in checkouts.items():
                print(f"    round {number + 1} of {rounds}: {row.name}, {which}", file=sys.stderr, flush=True)
                figures = figures_of(row, run(folder, row.command), b_us)
                found.setdefault(row.name, {}).setdefault(which, Found()).add(figures)
    return {
        "b_us": round(median(units), 1),
        "b_us_least": round(min(units), 1),
        "b_us_most": round(max(units), 1),
        "rows": {
            row: {
                which: {name: spread(values) for name, values in its.items()} for which, its in with_ratio(by).items()
            }
            for row, by in found.items()
        },
    }


def with_ratio(by: dict[str, Found]) -> dict[str, dict[str, list[float]]]:
    """Return the values of each checkout, and where there are two the ratios of the rounds' pairs."""
    values = {which: its.values for which, its in by.items()}
    if "before" in values:
        pairs = {name: zip(values["now"][name], values["before"][name], strict=True) for name in values["now"]}
        values["ratio"] = {name: [ours / theirs for ours, theirs in two if theirs] for name, two in pairs.items()}
    return values


def spread(values: Sequence[float]) -> list[float]:
    """Return the median, the least and the greatest; of no values none."""
    return [median(values), min(values), max(values)] if values else []


def lines(found: dict[str, Any]) -> list[str]:
    """Return the figures for people."""
    shown = [f"b {found['b_us']:g} us ({found['b_us_least']:g} to {found['b_us_most']:g}); median (least to most)"]
    for row, by in found["rows"].items():
        for which, figures in by.items():
            texts = ["{} {:.2f} ({:.2f} to {:.2f})".format(name, *three) for name, three in figures.items() if three]
            shown.append(f"{row:22}{which:8}" + "  ".join(texts))
    return shown


def main() -> None:
    """Run with another checkout beside this one."""
    parser = argparse.ArgumentParser(description="Processes of a run: their time and memory, in units of b.")
    parser.add_argument("--before", type=Path, metavar="FOLDER", help="another checkout with its environment")
    parser.add_argument("--seconds", type=float, default=8.0, help="simulated time of each run of the table")
    parser.add_argument("--realtime", type=float, default=60.0, metavar="SECONDS", help="the same in real time")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", action="append", default=[], metavar="ROW", help="may be repeated")
    parser.add_argument("--json", action="store_true", help="JSON only")
    chosen = parser.parse_args()
    names = [row.name for row in rows(1.0, 1.0)]
    unknown = sorted(set(chosen.only) - set(names))
    if unknown:
        parser.error(f"no row {', '.join(unknown)}; there are {', '.join(names)}")
    if chosen.before is not None and not (commands_of(chosen.before) / "foosim-supervisor").exists():
        parser.error(f"no foosim-supervisor in {commands_of(chosen.before)}: make environment, or make compiled, there")
    before = None if chosen.before is None else chosen.before.absolute()
    found = shapes(chosen.seconds, before, chosen.rounds, chosen.realtime, chosen.only)
    print(json.dumps(found) if chosen.json else "\n".join(lines(found)))


if __name__ == "__main__":
    main()
