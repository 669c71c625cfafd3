"""How a process of a run ended, in words, and whether another one may take its place. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from foosim.runtime.children import BY_SIGNAL
from foosim.runtime.command import REFUSED

NO_MEMORY: Final = (
    *("MemoryError", "can't start new thread", "Cannot allocate memory", "failed to map segment"),
    *("std::bad_alloc", "memory allocation of", "Memory allocation still failed"),
)
"""What Python, the system and its loader, C++, Rust and OpenBLAS say when they get no memory."""
WORDS_MAX: Final = 300


@dataclass(frozen=True, slots=True)
class Ending:
    """How a process ended: its exit code (-N: signal N), the end of its log, and what else is known.

    `killed_by_us` is why its launcher killed it, empty when it did not; `oom_killed` says where the kernel has killed
    processes for want of memory while this one lived, which may have been others; empty for nowhere.
    """

    code: int
    signal: str = ""
    """The name of the signal that ended it."""
    log: Sequence[str] = ()
    killed_by_us: str = ""
    oom_killed: str = ""
    is_remote: bool = False

    @property
    def is_by_signal(self) -> bool:
        """Whether a signal ended it: of itself it would not have."""
        return self.code < 0 or (self.is_remote and self.code > BY_SIGNAL)

    @property
    def text(self) -> str:
        """`was killed by SIGKILL, not by foosim`: to stand behind the name of the process."""
        if self.killed_by_us:
            return f"was killed by up: {self.killed_by_us}"
        if self.code < 0:
            if self._lacked_memory:
                return f"was killed by {self.signal}: too little memory"
            meanwhile = f"; too little memory: the kernel has killed for that {self.oom_killed} while it ran"
            return f"was killed by {self.signal}, not by foosim{meanwhile * bool(self.oom_killed)}"
        if self._lacked_memory:
            return f"ended with exit code {self.code}: too little memory"
        if self.code == REFUSED and self.last_words:
            return f"ended with exit code {self.code}, refused: {self.last_words}"
        return f"ended with exit code {self.code}"

    @property
    def last_words(self) -> str:
        """The last line of its log, without time and name; it may say why it ended."""
        line = self.log[-1].strip() if self.log else ""
        head, found, words = line.partition(": ")
        return (words if found and head[:4].isdigit() and "Z " in head else line)[:WORDS_MAX]

    @property
    def _lacked_memory(self) -> bool:
        return any(said in line for line in self.log for said in NO_MEMORY)
