"""The kernel's counters of out-of-memory kills, and whether they explain the death of a process.

An out-of-memory kill looks like any SIGKILL. Only counters show it: those of the control group (version 2), and those
of the machine, which include other processes. The kernel's log names processes, but only administrators can read it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final, NamedTuple

_VMSTAT: Final = Path("/proc/vmstat")
_OWN_GROUP: Final = Path("/proc/self/cgroup")
_GROUPS: Final = Path("/sys/fs/cgroup")
COUNTER: Final = "oom_kill"


class OomKills(NamedTuple):
    """Number of out-of-memory kills; 0 where the kernel does not report it."""

    group: int = 0
    """Of this process's control group, in which its children are, too, without groups below it."""
    machine: int = 0

    def since(self, before: OomKills) -> str:
        """Return where the kernel has killed processes since `before`; empty for nowhere."""
        if self.group > before.group:
            return "in its control group"
        return "on this machine" if self.machine > before.machine else ""


def oom_kills() -> OomKills:
    """Return the counters as they are. Before Linux 5.2 a group's has those of groups below it."""
    group = _group()
    local = group / "memory.events.local"
    return OomKills(_count(local if local.exists() else group / "memory.events"), _count(_VMSTAT))


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
