"""Starts the processes of a run, on this machine and through ssh on others, ends them, and reports how they ended.

Each child has a process group of its own, so that a Ctrl-C in the terminal reaches the launcher alone, has a log
file, and dies with the launcher (`runtime.process` is the child's side of that). Children are started from the main
thread: the kernel's signal at the parent's end is tied to the thread that forked. Of a process on another machine the
child here is ssh, which writes its output to the log; it ends when the launcher closes its standard input.

An out-of-memory kill looks like any SIGKILL. Only the kernel's counters show it: those of the control group (version
2), and those of the machine, which include other processes.
"""

from __future__ import annotations

import errno
import os
import re
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

from foosim.common.errors import Failed
from foosim.launcher.hosts import Remote
from foosim.runtime.children import BY_SIGNAL, GRACE_S, ROLE, child_environment, script
from foosim.runtime.command import REFUSED
from foosim.runtime.process import STACK_SIGNAL
from foosim.world.component_types.failures import in_library

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
        if any(text in line for line in self.log for text in NO_MEMORY):
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


POLL_S: Final = 0.02
STACK_S: Final = 1.0
"""Time for a hanging process to log its stack."""
STACK_LINES: Final = 60
_CALL: Final = re.compile(r'File "(.*)", line (\d+) in (\S+)')
LINES: Final = 30
"""Size of the log excerpt that is searched for ssh's error."""


@dataclass(slots=True)
class Child:
    """One process of the run."""

    name: str
    command: tuple[str, ...]
    log: Path
    process: subprocess.Popen[bytes] = field(repr=False)
    remote: Remote | None = None
    """The remote machine that it runs on, if any: `process` is then its ssh."""
    begin: int = 0
    """Offset of its log, after the logs of its predecessors."""
    oom_kills: OomKills = field(default_factory=OomKills)
    """How many processes the kernel had killed for want of memory when it was started."""
    oom_killed: str | None = None
    """Where the kernel had killed processes when its end was noticed; None before."""
    killed: str = ""
    """Why the launcher killed it; empty when it did not."""
    left_early: bool = False
    """Whether it ended with exit code 0 before the run did, as by `os._exit(0)`."""

    @property
    def exit_code(self) -> int | None:
        """Its exit code, -N when signal N ended it, None while it lives."""
        return self.process.poll()

    @property
    def how(self) -> Ending:
        """How it ended; it has."""
        code = self.exit_code
        assert code is not None, f"{self.name} lives"
        if self.oom_killed is None:
            may_be = code == -signal.SIGKILL and self.remote is None
            self.oom_killed = oom_kills().since(self.oom_kills) if may_be else ""
        return Ending(code, self._tail(LINES), self.killed, self.oom_killed, self.remote is not None)

    @property
    def ending(self) -> str:
        """Its end in words."""
        code = self.exit_code
        if code is None:
            return "is alive"
        if self.remote is not None and code > 0:
            return f"ended: {self.remote.why(code, self._tail(LINES))}"
        return self.how.text

    def kill(self, why: str) -> None:
        """Kill it for a reason that is reported; it logs its stack before."""
        self.killed = why
        if self.end_with_stack():
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(STACK_S)
        self.process.kill()

    @property
    def place(self) -> str:
        """` at FILE:LINE in FUNCTION`: where the last stack in its log was outside of libraries; empty without one."""
        stack = "\n".join(self._tail(STACK_LINES)).rpartition("(most recent call first):")[2]
        calls = [call for call in _CALL.findall(stack) if not in_library(call[0])]
        return f" at {Path(calls[0][0]).name}:{calls[0][1]} in {calls[0][2]}" if calls else ""

    def end_with_stack(self) -> bool:
        """Make a role's process on this machine log its stack and end; False for any other process."""
        shows = self.command[:2] == ROLE and self.remote is None
        if shows:
            self.process.send_signal(STACK_SIGNAL)
        return shows

    @property
    def is_away(self) -> bool:
        """Whether it ended because its machine became unreachable."""
        return self.remote is not None and self.remote.is_away(self.exit_code or 0, self._tail(LINES))

    def last_lines(self, count: int = 3) -> list[str]:
        """Return the end of its log if it ended by itself: it may have the reason."""
        return self._tail(count) if (self.exit_code or 0) > 0 else []

    def let_go(self) -> None:
        """Close the standard input of a remote process, which ends its processes there."""
        if self.process.stdin is not None:
            self.process.stdin.close()

    def _tail(self, count: int) -> list[str]:
        try:
            with self.log.open("rb") as file:
                file.seek(max(self.begin, self.log.stat().st_size - 8192))
                lines = file.read().decode("utf-8", "replace").splitlines()
        except OSError:
            return []
        return [line for line in lines if line.strip()][-count:]


class Launcher:
    """All children of this process, in the order in which they were started."""

    def __init__(self, run: str = "", remotes: Mapping[str, Remote] | None = None, units: Sequence[str] = ()) -> None:
        """`remotes` are the machines of the processes of this run on other machines, by name of the process.

        `units` are those among them that systemd runs there.
        """
        self.run = run
        self.remotes: Mapping[str, Remote] = remotes or {}
        self.units = frozenset(units)
        self.children: dict[str, Child] = {}
        self._end, self._hold = os.pipe()
        """The pipe's two ends: children read the first; only this process has the second, and never writes."""

    def start(self, name: str, command: Sequence[str], log: Path) -> Child:
        """Start `command`, whose first word is one of foosim's commands, on this process's machine. Raises Failed.

        For a unit of systemd the child here only requests its start there, and then ends.
        """
        remote, earlier = self.remotes.get(name), self.children.get(name)
        if remote is None:
            line = [script(command[0]), *command[1:]]
            about: dict[str, Any] = {"env": child_environment(self._end), "pass_fds": (self._end,)}
        else:
            line = remote.unit_started(name) if name in self.units else remote.guarded(self.run, name, command)
            about = {}
        if earlier is not None:
            earlier.let_go()
        kills, source = oom_kills(), subprocess.DEVNULL if remote is None else subprocess.PIPE
        try:
            with log.open("ab") as file:
                begin = log.stat().st_size
                process = subprocess.Popen(
                    line, stdin=source, stdout=file, stderr=subprocess.STDOUT, process_group=0, **about
                )
        except OSError as error:
            why = "too little memory" if error.errno == errno.ENOMEM else str(error)
            raise Failed(f"{name} cannot be started: {why}") from None
        child = self.children[name] = Child(name, tuple(command), log, process, remote, begin, kills)
        return child

    def ended(self) -> list[Child]:
        """Return the children that have ended."""
        return [child for child in self.children.values() if child.exit_code is not None]

    def alive(self) -> list[Child]:
        """Return the children that live."""
        return [child for child in self.children.values() if child.exit_code is None]

    def wait(self, seconds: float) -> bool:
        """Wait until no child lives; False on timeout."""
        deadline = time.monotonic() + seconds
        while self.alive():
            if time.monotonic() >= deadline:
                return False
            time.sleep(POLL_S)
        return True

    def stop(self, grace_s: float = GRACE_S) -> None:
        """End all children: SIGTERM, then, after the grace period, SIGKILL; hanging roles log their stacks before."""
        self._signal(signal.SIGTERM)
        if not self.wait(grace_s):
            if [child for child in self.alive() if child.end_with_stack()]:
                self.wait(STACK_S)
            self.kill()

    def kill(self) -> None:
        """Kill all children at once."""
        self._signal(signal.SIGKILL)
        self.wait(GRACE_S)

    def close(self) -> None:
        """Close the pipe, which ends any child that still lives."""
        os.close(self._hold)
        os.close(self._end)
        for child in self.children.values():
            child.let_go()

    def _signal(self, number: signal.Signals) -> None:
        for child in reversed(self.alive()):
            child.killed = child.killed or "the run is over"
            try:
                os.killpg(child.process.pid, number)
            except ProcessLookupError:
                continue
