"""`python -m bench.against REVISION [--pairs N] [--compiled]`: this tree against an earlier one.

Both trees are used as they are checked out, or compiled as an install is, with the packages of this Python. A pair
measures one after the other, in an order that changes from pair to pair, so that other load of the machine is the same
for both; the figures are the ratios of the pairs' processor times. Ticks are of a rehearsal without its start,
which is run several times: a tick computes the same in each, so it takes the least of its times, whatever
the other load. Garbage is collected seldom, as in the processes of a run. The start is the time of a command that
rehearses one tick, and of the command's help.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import Final

from bench import bodies
from bench.bare_tick import bare_tick_us
from bench.runs import ROOT, BenchError

TICKS: Final = {"table": 500, "warehouse": 150, "yard": 150, "fleet": 60, "rigid fleet": 60}
"""Of each deployment in deploy/ and of the fleet of `bench.fleet`, for each seed."""
STARTS: Final = ("table", "warehouse")
SEEDS: Final = 3
"""What happens in a world differs where draws do, and so does what it costs: it is averaged over some."""
RUNS: Final = 5
OF_TICKS: Final = """
import gc, sys, time
from pathlib import Path
try:  # an earlier commit
    from foosim.rehearsal.run import rehearse
    from foosim.rehearsal.settings import Settings
except ModuleNotFoundError:
    from foosim.simulation.run import rehearse
    from foosim.simulation.settings import Settings
file, ticks, seeds, runs, skipped = Path(sys.argv[1]), *map(int, sys.argv[2:])
if file.exists():
    text = file.read_text()
else:
    from bench.fleet import SIZES, fleet_text
    text = fleet_text(SIZES[0], is_heard=True)

def spent(seed):
    ends = []
    settings = Settings(on_commit=lambda *_: ends.append(time.thread_time()))
    rehearse(text, file.name, ticks + skipped, 1, [f"seed={seed}"], settings=settings, folder=file.parent)
    return [last - first for first, last in zip(ends, ends[1:])][skipped:]

spent(1)
gc.collect()
gc.freeze()
gc.set_threshold(20_000, 20, 100)
least = [list(map(min, zip(*[spent(seed) for _ in range(runs)]))) for seed in range(1, seeds + 1)]
print(sum(map(sum, least)) / sum(map(len, least)))
"""
START_TICKS: Final = 60
"""Ticks at the beginning that do not count: they construct what is constructed once."""
COMMAND: Final = "import sys; from foosim.cli import main; main()"


@dataclass(frozen=True, slots=True)
class Ratio:
    """What this tree takes, as a multiple of what the other does: quartiles and extremes of the pairs; its seconds."""

    name: str
    pairs: int
    least: float
    quarter: float
    median: float
    three_quarters: float
    most: float
    seconds: float

    def line(self) -> str:
        """Return it for people."""
        spread = f"half of the pairs {self.quarter:.3f} to {self.three_quarters:.3f}"
        extremes = f"all {self.least:.3f} to {self.most:.3f}"
        return f"{self.name:26} {self.median:.3f}  ({spread}, {extremes}) of {self.seconds:.3g} s"


Measure = Callable[[Path], float]
"""Measures a tree: seconds of processor time."""


def _environment(tree: Path) -> dict[str, str]:
    """Return the environment in which `foosim` is that of a tree: as it is installed beside it, if it is.

    Else it is a folder with a link for each of its packages, and for each file of the door, which is `foosim` itself.
    """
    installed = tree.parent / f"{tree.name}-installed"
    if installed.exists():
        return {**os.environ, "PYTHONPATH": str(installed)}
    folder = tree.parent / f"{tree.name}-path"
    packages = folder / "foosim"
    if not packages.exists():
        packages.mkdir(parents=True)
        for package in tree.glob("*/__init__.py"):
            if package.parent.name not in ("tests", "bench", "door"):
                (packages / package.parent.name).symlink_to(package.parent)
        for file in tree.glob("door/*.*"):
            (packages / file.name).symlink_to(file)
    return {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": ""}


def run_in(tree: Path, command: Sequence[str]) -> str:
    """Return the output of a command with the foosim of a tree. Raises BenchError."""
    done = subprocess.run(command, cwd=tree, env=_environment(tree), capture_output=True, text=True, check=False)
    if done.returncode:
        raise BenchError(f"{tree.name}: {' '.join(command[-4:])} failed: {done.stderr.strip()[-600:]}")
    return done.stdout


def tick_s(tree: Path, world: str) -> float:
    """Return the processor time of a tick of a world's rehearsal, in seconds."""
    file = tree / "deploy" / f"{world}.yaml"
    if world == "rigid fleet":
        file = tree.parent / f"{tree.name}-fleet.yaml"
        has_mujoco = (tree / "node" / "physics" / "mujoco_islands.py").exists()
        file.write_text(bodies.fleet_text("mujoco" if has_mujoco else "bullet"))
    numbers = [str(number) for number in (TICKS[world], SEEDS, RUNS, START_TICKS)]
    return float(run_in(tree, [sys.executable, "-c", OF_TICKS, str(file), *numbers]))


def _children_s() -> float:
    times = os.times()
    return times.children_user + times.children_system


def start_s(tree: Path, world: str) -> float:
    """Return the processor time of a command that rehearses one tick, in seconds."""
    return _command_s(tree, "rehearse", str(tree / "deploy" / f"{world}.yaml"), "--for", "20ms", "--json")


def help_s(tree: Path) -> float:
    """Return the processor time of a command's help, in seconds."""
    return _command_s(tree, "--help")


def _command_s(tree: Path, *arguments: str) -> float:
    before = os.times()
    run_in(tree, [sys.executable, "-c", COMMAND, *arguments])
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def _install(tree: Path, folder: Path) -> None:
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--target", str(folder)]
    run_in(tree, [*pip, str(tree)])


def ratio(name: str, measure: Measure, trees: tuple[Path, Path], pairs: int) -> Ratio:
    """Measure `pairs` pairs of (this tree, the other one), after one that warms both."""
    for tree in trees:
        measure(tree)
    found: list[float] = []
    seconds: list[float] = []
    for pair in range(pairs):
        here, there = trees
        took = {tree: measure(tree) for tree in ((here, there) if pair % 2 else (there, here))}
        found.append(took[here] / took[there])
        seconds.append(took[here])
    found.sort()
    at = [found[round((pairs - 1) * share)] for share in (0.0, 0.25, 0.75, 1.0)]
    return Ratio(name, pairs, at[0], at[1], median(found), at[2], at[3], median(seconds))


@contextmanager
def checked_out(revision: str) -> Iterator[tuple[Path, Path]]:
    """Give this tree and a checkout of the revision, both in folders of their own."""
    with tempfile.TemporaryDirectory() as name:
        here, there = Path(name) / "here", Path(name) / "there"
        here.symlink_to(ROOT)
        _git("worktree", "add", "--detach", str(there), revision)
        try:
            yield here, there
        finally:
            _git("worktree", "remove", "--force", str(there))


def _git(*arguments: str) -> None:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BenchError(done.stderr.strip())


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m bench.against", description="This tree against an earlier one.")
    parser.add_argument("revision", help="a commit, as git names it")
    parser.add_argument("--pairs", type=int, default=15, help="of each figure (default 15)")
    parser.add_argument("--compiled", action="store_true", help="install both trees first, which takes minutes")
    chosen = parser.parse_args(arguments)
    if chosen.pairs < 1:
        parser.error(f"--pairs: at least 1, not {chosen.pairs}")
    figures: list[Ratio] = []
    b_us = bare_tick_us()
    print(f"b (a bare tick of the table in Bullet) {b_us:.0f} us; processor time, this tree to {chosen.revision}")
    try:
        with checked_out(chosen.revision) as trees:
            if chosen.compiled:
                for tree in trees:
                    _install(tree, tree.parent / f"{tree.name}-installed")
            for name, measure, pairs in _measures(chosen.pairs):
                figures.append(ratio(name, measure, trees, pairs))
                print(figures[-1].line(), flush=True)
    except BenchError as error:
        print(error, file=sys.stderr)
        return 1
    print(json.dumps({"bare_tick_us": b_us, "ratios": [asdict(figure) for figure in figures]}))
    return 0


def _measures(pairs: int) -> Iterator[tuple[str, Measure, int]]:
    for world in TICKS:
        yield f"a tick of the {world}", lambda tree, world=world: tick_s(tree, world), pairs  # type: ignore[misc]
    for world in STARTS:
        yield f"the start of the {world}", lambda tree, world=world: start_s(tree, world), pairs  # type: ignore[misc]
    yield "the command's help", help_s, pairs


if __name__ == "__main__":
    sys.exit(main())
