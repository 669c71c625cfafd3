"""Faults of a whole run as `foosim up` starts it: what its launcher leaves behind, and how it ends."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from foosim.client import control
from foosim.common.errors import Refused
from foosim.runtime.process import script
from foosim.simulation.run import rehearse
from tests.faults.cluster import LIMIT_S, POLL_S, TABLE, FaultError
from tests.faults.kinds import CALM_S, Figures

END_MS: Final = 5000.0
GONE_MS: Final = 1000.0
STARVED_S: Final = 60.0
PERIOD_US: Final = 100_000
CGROUPS: Final = Path("/sys/fs/cgroup")
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


PATIENT: Final = ("deadlines.lockstep_realtime=120 s", "deadlines.client_back=120 s")


@contextmanager
def started(folder: Path, run: str, *sets: str) -> Iterator[subprocess.Popen[str]]:
    """Start the table, with settings, and wait for its first tick; whatever is left at the end is killed with it."""
    words = [script("foosim"), "up", str(TABLE), "--processes", "each", "--run", run, "--json"]
    words += [word for text in sets for word in ("--set", text)]
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


def children_of(launcher: subprocess.Popen[str]) -> list[int]:
    """Return the processes of a run that `up` has started."""
    return [int(pid) for pid in Path(f"/proc/{launcher.pid}/task/{launcher.pid}/children").read_text().split()]


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
        _end_as_undisturbed(launcher)
        took_s = time.monotonic() - begun_s
    return {"end": 1e3 * took_s}


def _end_as_undisturbed(launcher: subprocess.Popen[str]) -> None:
    """Wait for the end of a run that was requested, and compare it with an undisturbed one."""
    out, _ = launcher.communicate(timeout=LIMIT_S)
    if launcher.returncode != 0:
        raise FaultError(f"the launcher ended with exit code {launcher.returncode}")
    result = json.loads(out.splitlines()[-1])
    again = rehearse(TABLE.read_text(), "table.yaml", result["ticks"], None).json
    if result["reason"] != "stopped" or not result["capture"] or result["digest"] != again["digest"]:
        raise FaultError(f"the run ended as {result['reason']}, {result['digest']}; undisturbed {again['digest']}")


def launcher_killed(folder: Path, run: str, dice: random.Random) -> Figures:
    """`kill -9` of the launcher: nothing that it started lives on."""
    with started(folder, run) as launcher:
        children = children_of(launcher)
        if len(children) != PROCESSES:
            raise FaultError(f"{len(children)} processes were started, not {PROCESSES}")
        time.sleep(dice.uniform(*CALM_S))
        begun_s = time.monotonic()
        launcher.kill()
        _await("the end of all children", lambda: not any(Path(f"/proc/{pid}/exe").exists() for pid in children))
        return {"gone": 1e3 * (time.monotonic() - begun_s)}


@contextmanager
def quota(percent: float, pids: Sequence[int]) -> Iterator[None]:
    """Give processes together so much of one core, by a cgroup of version 1 or 2, which needs root."""
    is_first = (CGROUPS / "cpu").is_dir()
    group = (CGROUPS / "cpu" if is_first else CGROUPS) / f"foosim-faults-{os.getpid()}"
    try:
        group.mkdir()
        if is_first:
            (group / "cpu.cfs_period_us").write_text(f"{PERIOD_US}")
            (group / "cpu.cfs_quota_us").write_text(f"{PERIOD_US * percent / 100:.0f}")
        else:
            (group / "cpu.max").write_text(f"{PERIOD_US * percent / 100:.0f} {PERIOD_US}")
    except OSError as error:
        raise FaultError(f"{group} cannot be made, or has no quota: {error.strerror}") from None
    try:
        for pid in pids:
            (group / "cgroup.procs").write_text(f"{pid}")
        yield
    finally:
        for member in (group / "cgroup.procs").read_text().split():
            with suppress(OSError):  # it has ended
                (group.parent / "cgroup.procs").write_text(member)
        group.rmdir()


def starved(percent: float, folder: Path, run: str, dice: random.Random) -> Figures:
    """A minute of a small part of a core for all processes but the launcher: none is killed, and the world is equal.

    In real time the vHub would go on without players that are late, which is an input of the world: it waits for them.
    """
    with started(folder, run, *PATIENT) as launcher:
        children = children_of(launcher)
        time.sleep(dice.uniform(*CALM_S))
        with quota(percent, children):
            time.sleep(STARVED_S)
        begun_s, ticks = time.monotonic(), _ticks(run)
        _await("ticks after it", lambda: _ticks(run) > ticks + 100)
        took_s = time.monotonic() - begun_s
        lived = children_of(launcher)
        launcher.send_signal(signal.SIGINT)
        _end_as_undisturbed(launcher)
    if lived != children:
        raise FaultError(f"processes {children} were {lived} afterwards")
    return {"again": 1e3 * took_s}


LAUNCHED: Final = (
    Launched("interrupted", "Ctrl-C or SIGTERM to the launcher", interrupted, {"end": END_MS}),
    Launched("launcher_killed", "kill -9 of the launcher", launcher_killed, {"gone": GONE_MS}),
    Launched("starved_10", "a minute of 10 % of a core", partial(starved, 10), {}, costs=20),
    Launched("starved_4", "a minute of 4 % of a core", partial(starved, 4), {}, costs=20),
)
