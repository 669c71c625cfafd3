"""`python -m bench.hot [RUN...] [--least PERCENT] [--json]`: the modules that ticks and packets spend their time in.

Each run is interpreted, and profiled in all its threads after its first ticks; `verdict` is profiled
whole. A module's share is the processor time within its
own functions, of the time within all of foosim's. Compiled libraries (numpy, msgspec, the physics engine) are
left out, since compiling their callers does not shorten them. A star marks what `setup.py` compiles, the last line is
the share of all that it leaves to the interpreter.
"""

from __future__ import annotations

import argparse
import cProfile
import json
import sys
import tempfile
import threading
import time
import tomllib
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import Any, Final

from bench import verdict
from bench.runs import ROOT, TABLE
from foosim.capture.reader import open_capture
from foosim.protocol.fingerprint import is_compiled
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.simulation.what_if import what_if
from foosim.world.frame import Frame
from tests.swarm.campaign import fly

PYPROJECT: Final = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES: Final = tuple(PYPROJECT["tool"]["setuptools"]["package-dir"].values())
LEAST: Final = 0.3
"""Per cent of a run: a module that has less in each of them is not shown."""
WARM_TICKS: Final = 50
SEEDS: Final = range(1, 7)
FAST: Final = ("tick=2 ms", "substeps=4")


class Profile:
    """Processor time by file, of this thread and of threads that begin while it is on."""

    def __init__(self) -> None:
        self._of_threads = [self._new()]

    @staticmethod
    def _new() -> cProfile.Profile:
        return cProfile.Profile(time.thread_time)

    def _begin_thread(self, frame: FrameType, event: str, argument: Any) -> None:
        """Is replaced by the thread's own profile at the first call in it."""
        self._of_threads.append(self._new())
        self._of_threads[-1].enable()

    def begin(self) -> None:
        threading.setprofile(self._begin_thread)
        self._of_threads[0].enable()

    def end(self) -> dict[Path, float]:
        """Return the seconds that each file had in its own functions."""
        self._of_threads[0].disable()
        threading.setprofile(None)
        seconds: defaultdict[Path, float] = defaultdict(float)
        for profile in self._of_threads:
            for entry in profile.getstats():
                if not isinstance(entry.code, str):
                    seconds[Path(entry.code.co_filename)] += entry.inlinetime
        return seconds


def rehearsed(file: Path, ticks: int, *sets: str, captured: bool = False) -> Callable[[Profile], None]:
    """Return a rehearsal on the deployment's nodes."""

    def run(profile: Profile) -> None:
        def committed(frame: Frame) -> None:
            if frame.tick == WARM_TICKS:
                profile.begin()

        with tempfile.TemporaryDirectory() as folder:
            capture = Path(folder) / "run.mcap" if captured else None
            settings = Settings(on_commit=committed)
            rehearse(file.read_text(), file.name, ticks, None, sets, settings, capture=capture, folder=file.parent)

    return run


def judged(profile: Profile) -> None:
    """Judge packets on links of each kind."""
    profile.begin()
    verdict.verdict(0.1)


def flown(profile: Profile) -> None:
    """Fly seeds of the swarm, once others have been flown."""
    text = TABLE.read_text()
    fly(text, TABLE.name, SEEDS[-1] + 1)
    profile.begin()
    for seed in SEEDS:
        fly(text, TABLE.name, seed)


def judged_again(profile: Profile) -> None:
    """Judge a capture's packets once more."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        rehearse(verdict.WAREHOUSE.read_text(), "warehouse.yaml", 100, 1, capture=path, folder=verdict.WAREHOUSE.parent)
        capture = open_capture(path)
        profile.begin()
        what_if(capture, None)


RUNS: Final[dict[str, Callable[[Profile], None]]] = {
    "table": rehearsed(TABLE, 600, *FAST),
    "pure": rehearsed(TABLE, 600, *FAST, "engine=pure"),
    "captured": rehearsed(TABLE, 600, *FAST, captured=True),
    "warehouse": rehearsed(verdict.WAREHOUSE, 130),
    "verdict": judged,
    "yard": rehearsed(ROOT / "deploy" / "yard.yaml", 130),
    "whatif": judged_again,
    "swarm": flown,
}


def shares_of(name: str) -> dict[str, float]:
    """Make a run; return the share of each module in per cent, by its path without the suffix."""
    profile = Profile()
    RUNS[name](profile)
    ours = {
        path.relative_to(ROOT).with_suffix("").as_posix(): seconds
        for path, seconds in profile.end().items()
        if path.is_relative_to(ROOT) and path.relative_to(ROOT).parts[0] in PACKAGES
    }
    whole = sum(ours.values())
    return {module: 100 * seconds / whole for module, seconds in ours.items()}


def compiled() -> set[str]:
    """Return what setup.py compiles."""
    return set(tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["foosim"]["compiled"])


def lines(shares: dict[str, dict[str, float]], least: float, listed: set[str]) -> list[str]:
    """Return the table: modules by their greatest share in any run."""
    greatest = {
        module: max(of_run.get(module, 0.0) for of_run in shares.values()) for module in set().union(*shares.values())
    }
    shown = [f"{'per cent of':34}" + "".join(f"{name:>10}" for name in shares)]
    for module in sorted(greatest, key=lambda module: -greatest[module]):
        if greatest[module] >= least:
            row = "".join(f"{of_run.get(module, 0.0):10.2f}" for of_run in shares.values())
            shown.append(f"{'*' if module in listed else ' '} {module:32}{row}")
    left = (sum(share for module, share in of_run.items() if module not in listed) for of_run in shares.values())
    return [*shown, f"{'  all interpreted modules':34}" + "".join(f"{share:10.2f}" for share in left)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Profile the runs that are named, or all; print the table; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.hot", description="The share of each module in a run's time."
    )
    parser.add_argument("names", nargs="*", metavar="RUN", help=f"of {', '.join(RUNS)}; all by default")
    parser.add_argument("--least", type=float, default=LEAST, help="per cent of a run that a module must have")
    parser.add_argument("--json", action="store_true", help="JSON only")
    chosen = parser.parse_args(arguments)
    unknown = sorted(set(chosen.names) - set(RUNS))
    if unknown:
        parser.error(f"no run {', '.join(unknown)}; there are {', '.join(RUNS)}")
    if is_compiled():
        parser.error("foosim is compiled here, and a profile does not see into that; run it in .venv")
    shares = {name: shares_of(name) for name in chosen.names or RUNS}
    print(json.dumps(shares) if chosen.json else "\n".join(lines(shares, chosen.least, compiled())))
    return 0


if __name__ == "__main__":
    sys.exit(main())
