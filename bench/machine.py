"""The machine that a figure belongs to, and what its processes use, read from /proc."""

from __future__ import annotations

import os
import platform
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bench.bare_tick import bare_tick_us
from foosim.protocol.fingerprint import is_compiled

PROC: Final = Path("/proc")
TICKS_PER_S: Final = os.sysconf("SC_CLK_TCK")
PAGE_BYTES: Final = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True, slots=True)
class Machine:
    """What was measured on, and whether the hot path is compiled.

    `load` is the average over the last minute, before the bench began; `bare_tick_us` is b, the unit of figures.
    """

    cores: int
    cpu: str
    python: str
    is_compiled: bool
    system: str
    load: float
    bare_tick_us: float


@dataclass(frozen=True, slots=True)
class Use:
    """What a process has used up to now: processor time of all its threads, and resident memory."""

    cpu_s: float
    rss_mb: float


def this_machine() -> Machine:
    """Return what there is to know of this machine; b is measured."""
    return Machine(
        len(os.sched_getaffinity(0)),
        _cpu_model(),
        platform.python_version(),
        is_compiled(),
        platform.platform(),
        os.getloadavg()[0],
        round(bare_tick_us(), 1),
    )


def _cpu_model() -> str:
    for line in (PROC / "cpuinfo").read_text().splitlines():
        key, _, value = line.partition(":")
        if key.strip() == "model name":
            return value.strip()
    return platform.machine()


def children(parent: int | None = None) -> dict[int, list[str]]:
    """Return the command lines of a process's children by process id; None is this process."""
    found: dict[int, list[str]] = {}
    for task in (PROC / ("self" if parent is None else str(parent)) / "task").iterdir():
        try:
            started = (task / "children").read_text().split()
        except FileNotFoundError:  # a thread that has ended meanwhile
            continue
        for pid in map(int, started):
            try:
                found[pid] = (PROC / str(pid) / "cmdline").read_bytes().decode().split("\0")
            except (FileNotFoundError, ProcessLookupError):
                continue
    return found


def use_of(pid: int) -> Use | None:
    """Return what a process has used, or None when it is gone."""
    try:
        fields = (PROC / str(pid) / "stat").read_text().rpartition(")")[2].split()
        pages = int((PROC / str(pid) / "statm").read_text().split()[1])
    except (FileNotFoundError, ProcessLookupError):
        return None
    return Use((int(fields[11]) + int(fields[12])) / TICKS_PER_S, pages * PAGE_BYTES / 1e6)


def pss_mb(pid: int) -> float:
    """Return the memory of a process; what it shares with others counts in part."""
    try:
        lines = (PROC / str(pid) / "smaps_rollup").read_text().splitlines()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:")) * 1024 / 1e6


def free_ports() -> int:
    """Return a port that was free a moment ago, as the one above it: both planes of a run."""
    while True:
        with socket.socket() as first, socket.socket() as second:
            first.bind(("127.0.0.1", 0))
            port = int(first.getsockname()[1])
            try:
                second.bind(("127.0.0.1", port + 1))
            except (OSError, OverflowError):
                continue
            return port
