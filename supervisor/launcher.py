"""Starts the processes of a run on this machine, and ends them.

Each child stands in a process group of its own, so that a Ctrl-C in the terminal reaches the launcher alone, has a log
file, and dies with the launcher (`protocol.process` is the child's side of that). Children are started from the main
thread: the kernel's signal at the parent's end is tied to the thread that forked. Neighbours: `up`.
"""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import subprocess
import sysconfig
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from foosim.protocol.process import PARENT_VARIABLE

GRACE_S: Final = 5.0
"""How long a child has after SIGTERM before it is killed."""
POLL_S: Final = 0.02


@dataclass(slots=True)
class Child:
    """One process of the run."""

    name: str
    command: tuple[str, ...]
    log: Path
    process: subprocess.Popen[bytes] = field(repr=False)

    @property
    def exit_code(self) -> int | None:
        """Its exit code, -N when signal N ended it, None while it lives."""
        return self.process.poll()

    @property
    def ending(self) -> str:
        """How it ended, for people."""
        code = self.exit_code
        if code is None:
            return "is alive"
        return f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"

    def last_lines(self, count: int = 3) -> list[str]:
        """Return the end of its log, when it ended by itself: it may say why there."""
        if (self.exit_code or 0) <= 0:
            return []
        try:
            with self.log.open("rb") as file:
                file.seek(max(0, self.log.stat().st_size - 8192))
                lines = file.read().decode("utf-8", "replace").splitlines()
        except OSError:
            return []
        return [line for line in lines if line.strip()][-count:]


def script(name: str) -> str:
    """Return the path of one of foosim's commands: beside this Python, else on PATH."""
    beside = Path(sysconfig.get_path("scripts")) / name
    return str(beside) if beside.is_file() else shutil.which(name) or name


class Launcher:
    """All children of this process, in the order in which they were started."""

    def __init__(self) -> None:
        self.children: dict[str, Child] = {}
        self._end, self._hold = os.pipe()
        """The pipe's two ends: children read the first; only this process has the second, and never writes."""

    def start(self, name: str, command: Sequence[str], log: Path) -> Child:
        """Start `command`, whose first word is one of foosim's commands."""
        arguments = (script(command[0]), *command[1:])
        environment = {
            **os.environ,
            PARENT_VARIABLE: f"{os.getpid()}:{self._end}",
            "OPENBLAS_NUM_THREADS": "1",  # nothing here uses BLAS; its threads only take memory
            "PYTHONUNBUFFERED": "1",
        }
        with log.open("ab") as file:
            process = subprocess.Popen(
                arguments,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                env=environment,
                pass_fds=(self._end,),
                process_group=0,
            )
        child = self.children[name] = Child(name, tuple(command), log, process)
        return child

    def ended(self) -> list[Child]:
        """Return the children that have ended."""
        return [child for child in self.children.values() if child.exit_code is not None]

    def alive(self) -> list[Child]:
        """Return the children that live."""
        return [child for child in self.children.values() if child.exit_code is None]

    def wait(self, seconds: float) -> bool:
        """Wait until no child lives; False when the time is over before."""
        deadline = time.monotonic() + seconds
        while self.alive():
            if time.monotonic() >= deadline:
                return False
            time.sleep(POLL_S)
        return True

    def stop(self, grace_s: float = GRACE_S) -> None:
        """End what lives: SIGTERM, then, after the grace, SIGKILL."""
        self._signal(signal.SIGTERM)
        if not self.wait(grace_s):
            self.kill()

    def kill(self) -> None:
        """End what lives at once."""
        self._signal(signal.SIGKILL)
        self.wait(GRACE_S)

    def close(self) -> None:
        """Give the pipe back; whoever should still live ends by it."""
        os.close(self._hold)
        os.close(self._end)

    def _signal(self, number: signal.Signals) -> None:
        for child in reversed(self.alive()):
            try:
                os.killpg(child.process.pid, number)
            except ProcessLookupError:
                continue


def command_line(command: Sequence[str]) -> str:
    """Return a command as a person types it."""
    return shlex.join(command)
