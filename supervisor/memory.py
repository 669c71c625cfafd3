"""Whether the kernel killed processes for want of memory: its counters, and what a process says that got none.

A process that the kernel kills says nothing, and ends as by anybody's SIGKILL; only the counters of the control group
and of the machine tell. Neighbours: `launcher` compares them, `ending` has the words.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

_VMSTAT: Final = Path("/proc/vmstat")
_OWN_GROUP: Final = Path("/proc/self/cgroup")
_GROUPS: Final = Path("/sys/fs/cgroup")
COUNTER: Final = "oom_kill"


def oom_kills() -> int:
    """Return how many processes the kernel has killed for want of memory, in this control group and on this machine.

    0 where the kernel does not say.
    """
    return _count(_VMSTAT) + _count(_group() / "memory.events")


def _group() -> Path:
    """Return the folder of this process's control group (version 2)."""
    for line in _lines(_OWN_GROUP):
        number, _, place = line.partition("::")
        if number == "0":
            return _GROUPS / place.strip("/")
    return _GROUPS


def _count(path: Path) -> int:
    for line in _lines(path):
        name, _, count = line.partition(" ")
        if name == COUNTER and count.isdigit():
            return int(count)
    return 0


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return []
