"""Reads from /proc what the clock of a child needs (`child_time`)."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from foosim.launcher.children.child_time import Observed

PROC: Final = Path("/proc")


def observe(pid: int) -> Observed | None:
    """Return what /proc reports of a process; None where there is no /proc, or no such process."""
    try:
        of_all = _fields(PROC / f"{pid}/stat")
        tasks = os.scandir(PROC / f"{pid}/task")
        with tasks:
            is_runnable = of_all[0] == "R" or any(_is_runnable(task.path) for task in tasks)
    except OSError:
        return None
    return Observed(is_runnable, (int(of_all[11]) + int(of_all[12])) / os.sysconf("SC_CLK_TCK"))


def _is_runnable(task: str) -> bool:
    """Whether a thread runs or waits for a processor; False for one that has ended since."""
    try:
        return _fields(Path(task) / "stat")[0] == "R"
    except OSError:
        return False


def _fields(path: Path) -> list[str]:
    """Return the fields of a stat file after the name, which may have spaces: state, parent, ..."""
    return path.read_text().rpartition(")")[2].split()
