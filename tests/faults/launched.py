"""Faults of a whole run as `foosim-supervisor up` starts it: what its launcher leaves behind, and how it ends."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from foosim.client import control
from foosim.common.errors import Refused
from foosim.rehearsal.run import rehearse
from foosim.runtime.children import script
from tests.faults.cluster import LIMIT_S, POLL_S, TABLE, FaultError
from tests.faults.kinds import CALM_S, Figures

END_MS: Final = 5000.0
GONE_MS: Final = 1000.0
PROCESSES: Final = 6
"""Supervisor, vHub, two nodes, two players."""


@dataclass(frozen=True, slots=True)
class Launched:
    """A row of the table: what is done to a launcher, in a folder, under the name of a run."""

    name: str
    title: str
    trial: Callable[[Path, str, random.Random], Figures]
    limits: Mapping[str, float]
    costs: int = 2


@contextmanager
def started(folder: Path, run: str) -> Iterator[subprocess.Popen[str]]:
    """Start the table and wait for its first tick; whatever is left at the end is killed with it."""
    words = [script("foosim-supervisor"), "up", str(TABLE), "--run", run, "--json"]
    with subprocess.Popen(
        [*words, "--capture", str(folder / f"{run}.mcap")],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        process_group=0,
    ) as launcher:
        try:
            _await(f"the first tick of {run}", lambda: _ticks(run) > 0)
            yield launcher
        finally:
            launcher.kill()


def _ticks(run: str) -> int:
    with suppress(Refused):
        return int(control.status(run)["ticks"])
    return 0


def _await(what: str, holds: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + LIMIT_S
    while not holds():
        if time.monotonic() > deadline_s:
            raise FaultError(f"waited {LIMIT_S:g} s for {what}")
        time.sleep(POLL_S)


def interrupted(folder: Path, run: str, dice: random.Random) -> Figures:
    """Ctrl-C, or SIGTERM: the run ends in order, and its capture is finished."""
    with started(folder, run) as launcher:
        time.sleep(dice.uniform(*CALM_S))
        begun_s = time.monotonic()
        launcher.send_signal(dice.choice([signal.SIGINT, signal.SIGTERM]))
        out, _ = launcher.communicate(timeout=LIMIT_S)
        took_s = time.monotonic() - begun_s
    if launcher.returncode != 0:
        raise FaultError(f"the launcher ended with exit code {launcher.returncode}")
    result = json.loads(out.splitlines()[-1])
    again = rehearse(TABLE.read_text(), "table.yaml", result["ticks"], None).json
    if result["reason"] != "stopped" or not result["capture"] or result["digest"] != again["digest"]:
        raise FaultError(f"the run ended as {result['reason']}, {result['digest']}; undisturbed {again['digest']}")
    return {"end": 1e3 * took_s}


def launcher_killed(folder: Path, run: str, dice: random.Random) -> Figures:
    """`kill -9` of the launcher: nothing that it started lives on."""
    with started(folder, run) as launcher:
        children = [int(pid) for pid in Path(f"/proc/{launcher.pid}/task/{launcher.pid}/children").read_text().split()]
        if len(children) != PROCESSES:
            raise FaultError(f"{len(children)} processes were started, not {PROCESSES}")
        time.sleep(dice.uniform(*CALM_S))
        begun_s = time.monotonic()
        launcher.kill()
        _await("the end of all children", lambda: not any(Path(f"/proc/{pid}/exe").exists() for pid in children))
        return {"gone": 1e3 * (time.monotonic() - begun_s)}


LAUNCHED: Final = (
    Launched("interrupted", "Ctrl-C or SIGTERM to the launcher", interrupted, {"end": END_MS}),
    Launched("launcher_killed", "kill -9 of the launcher", launcher_killed, {"gone": GONE_MS}),
)
