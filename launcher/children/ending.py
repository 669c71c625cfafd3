"""How a process ended, in words: who killed it, whether memory was short, what it logged last.

An out-of-memory kill looks like any SIGKILL. Only the kernel's counters show it: those of the control group (version
2), and those of the machine, which include other processes. Its log names processes, but only administrators can read
it.
"""

from __future__ import annotations

import signal
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from foosim.runtime.children import BY_SIGNAL
from foosim.runtime.command import REFUSED

_VMSTAT: Final = Path("/proc/vmstat")
_OWN_GROUP: Final = Path("/proc/self/cgroup")
_GROUPS: Final = Path("/sys/fs/cgroup")
NO_MEMORY: Final = (
    *("MemoryError", "can't start new thread", "Cannot allocate memory", "failed to map segment"),
    *("std::bad_alloc", "memory allocation of", "Memory allocation still failed"),
)
"""Messages of Python, the system and its loader, C++, Rust and OpenBLAS on a failed allocation."""
WORDS_MAX: Final = 4_000


@dataclass(frozen=True, slots=True)
class Ending:
    """How a process ended: its exit code (-N: signal N), the end of its log, and what else is known.

    `killed_by_us` is why its launcher killed it, empty when it did not; `oom_killed` is where the kernel has killed
    processes for want of memory while this one lived, which may have been others; empty for nowhere.
    """

    code: int
    log: Sequence[str] = ()
    killed_by_us: str = ""
    oom_killed: str = ""
    is_remote: bool = False

    @property
    def is_by_signal(self) -> bool:
        """Whether a signal ended it, and not the process itself."""
        return self.code < 0 or (self.is_remote and self.code > BY_SIGNAL)

    @property
    def text(self) -> str:
        """`was killed by SIGKILL, not by foosim`: follows the name of the process."""
        if self.killed_by_us and self.is_by_signal:
            return f"was killed by up: {self.killed_by_us}"
        is_signal = self.code < 0
        how = f"was killed by {signal.Signals(-self.code).name}" if is_signal else f"ended with exit code {self.code}"
        if any(said in line for line in self.log for said in NO_MEMORY):
            return f"{how}: too little memory"
        if is_signal and self.oom_killed:
            why = f"too little memory: the kernel has killed for that {self.oom_killed} while it ran"
            return f"{how}, not by foosim; {why}"
        if is_signal:
            return f"{how}, not by foosim"
        return f"{how}, refused: {self.last_words}" if self.code == REFUSED and self.last_words else how

    @property
    def last_words(self) -> str:
        """The last error in its log, without time and name, or the last line; it may have the reason."""
        last = ""
        for line in reversed(self.log):
            head, found, text = line.strip().partition(": ")
            is_dated = bool(found) and head[:4].isdigit() and "Z " in head
            words = (text if is_dated else line.strip())[:WORDS_MAX]
            if not is_dated or " ERROR " in head:  # roles that share the process may log warnings as they leave
                return words
            last = last or words
        return last


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
    group = _GROUPS / _field(_OWN_GROUP, "0::").strip("/")
    local = group / "memory.events.local"
    counts = (_field(path, "oom_kill ") for path in (local if local.exists() else group / "memory.events", _VMSTAT))
    return OomKills(*(int(count) if count.isdigit() else 0 for count in counts))


def _field(path: Path, head: str) -> str:
    """Return the rest of the line that begins with `head`; empty without one."""
    try:
        lines = path.read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return ""
    return next((line.removeprefix(head) for line in lines if line.startswith(head)), "")
