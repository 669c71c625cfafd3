"""Whether the kernel killed processes for want of memory: its counters, and what they say of one that was killed.

A process that the kernel kills says nothing, and ends as by anybody's SIGKILL. Only counters tell: of its control group
(version 2), and of the machine, where others may have been killed as well. The kernel's log names processes, and is for
administrators. Neighbours: `launcher` compares them, `restarts` has the words.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final, NamedTuple

_VMSTAT: Final = Path("/proc/vmstat")
_OWN_GROUP: Final = Path("/proc/self/cgroup")
_GROUPS: Final = Path("/sys/fs/cgroup")
COUNTER: Final = "oom_kill"


class OomKills(NamedTuple):
    """How many processes the kernel has killed for want of memory; 0 where it does not say."""

    group: int = 0
    """Of this process's control group, in which its children are, too, without groups below it."""
    machine: int = 0

    def since(self, before: OomKills) -> str:
        """Return what is known of one that lived since `before`: where the kernel killed; empty for nowhere."""
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
