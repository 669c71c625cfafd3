"""`foosim-supervisor validate` of a fleet of a thousand rovers by template, each with a player, on ten nodes.

The command is measured as a whole, as a user waits for it: with its start, which `--help` shows alone. The fleet stands
in the file by counts (rows of fifty), and with a line for each rover.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, Final

from bench.bare_tick import bare_tick_us
from bench.runs import BenchError
from bench.warehouse import WAREHOUSE
from foosim.deployment.text.yaml import locate_in, plain, read_tree, write_yaml

ROVERS: Final = 1_000
ROW: Final = 50
NODES: Final = 10
TO_REACH_S: Final = 1.0
COMMAND: Final = str(Path(sys.executable).with_name("foosim-supervisor"))


@dataclass(frozen=True, slots=True)
class Command:
    """One command: medians of its runs, in seconds, and the bytes of its file."""

    name: str
    wall_s: float
    cpu_s: float
    file_bytes: int


@dataclass(frozen=True, slots=True)
class Validate:
    """The commands, and b: a bare tick of the table in Bullet, beside them."""

    commands: list[Command]
    bare_tick_us: float


def fleet_text(*, by_line: bool) -> str:
    """Return a deployment with the fleet: the warehouse's templates, radios and rules, in a larger and empty hall."""
    tree, _ = read_tree(WAREHOUSE.read_text(), locate_in(WAREHOUSE.name))
    assert tree is not None
    data: dict[str, Any] = plain(tree)
    data["hall"] |= {"length": "400 m", "width": "250 m"}
    del data["scenery"]
    base, rows = data["robots"]["base"], range(ROVERS // ROW)
    places: list[dict[str, Any]] = [{"like": "rover", "x": "-190 m", "y": f"{10 * row - 95} m"} for row in rows]
    if by_line:
        each = [(row, number) for row in rows for number in range(ROW)]
        robots = {f"rover{row:02}-{n + 1}": places[row] | {"x": f"{7.5 * n - 190:g} m"} for row, n in each}
    else:
        robots = {f"rover{row:02}": places[row] | {"count": ROW, "spacing": {"x": "7.5 m"}} for row in rows}
    data["robots"] = {"base": base, **robots}
    lists = [[f"rover{row:02}-*" for row in rows[node::NODES]] for node in range(NODES)]
    data["nodes"] = {f"n{node}": {"robots": selectors} for node, selectors in enumerate(lists)}
    data["nodes"]["n0"]["robots"].append("base")
    pilot = data["players"].pop("pilot$1")
    data["players"]["dispatch"]["process"] = "fleet-n0"
    data["players"]["pilot$1"] = pilot
    return write_yaml(data)


def measured(name: str, arguments: Sequence[str], repeats: int, file_bytes: int = 0) -> Command:
    """Run a command some times; raises BenchError for one that fails."""
    walls, cpus = [], []
    for _ in range(repeats):
        before, begun_s = _cpu_s(), time.monotonic()
        done = subprocess.run([COMMAND, *arguments], capture_output=True, text=True, check=False)
        walls.append(time.monotonic() - begun_s)
        cpus.append(_cpu_s() - before)
        if done.returncode:
            raise BenchError(f"{name}: {done.stderr.strip()[:2000]}")
    return Command(name, round(median(walls), 3), round(median(cpus), 3), file_bytes)


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def validate(seconds: float | None = None, repeats: int = 7) -> Validate:
    """Measure. Nothing is simulated: `seconds` is not used."""
    commands = [measured("--help", ["--help"], repeats)]
    with tempfile.TemporaryDirectory() as folder:
        for name, by_line in (("by counts", False), ("by lines", True)):
            file = Path(folder) / "fleet.yaml"
            file.write_text(fleet_text(by_line=by_line))
            commands.append(measured(name, ["validate", str(file)], repeats, file.stat().st_size))
    return Validate(commands, round(bare_tick_us(), 1))


def lines(row: Validate) -> list[str]:
    """Return the figures for people."""
    return [
        f"{command.name:10} {command.wall_s:6.2f} s, of processor {command.cpu_s:5.2f} s"
        + (f", a file of {command.file_bytes} bytes, below {TO_REACH_S:g} s wanted" if command.file_bytes else "")
        for command in row.commands
    ] + [f"b {row.bare_tick_us:g} us"]
