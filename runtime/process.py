"""Around the loop of every process: it dies with its parent, logs lines, and ends in order on a signal.

Launcher and guard have from here how a child is started: the path of its command and its environment.

The environment names the launcher of a child. The kernel signals the end of the launcher to the child, and a thread
reads a pipe that only the launcher can write: its end has the same meaning where the kernel has no such signal.
"""

from __future__ import annotations

import ctypes
import faulthandler
import logging
import os
import shutil
import signal
import sys
import sysconfig
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

PARENT_VARIABLE: Final = "FOOSIM_PARENT"
"""Process id of the launcher and the number of the pipe's reading end, as `PID:FD`."""
STACK_SIGNAL: Final = signal.SIGUSR1
STDERR: Final = 2
_PR_SET_PDEATHSIG: Final = 1
GRACE_S: Final = 5.0
"""How long a child has after SIGTERM before it is killed."""
FOOSIM: Final = "foosim"
"""The command, whose verbs are the processes of a run, too."""
ROLE: Final = (FOOSIM, "role")
GUARD: Final = "foosim guard"
"""How lines of a guard begin."""
BY_SIGNAL: Final = 128
"""The exit code of a guard is this plus the number of the signal that ended its process."""
OTHER_VERSION: Final = 125
"""The exit code of a guard of another version than the launcher."""


def die_with_parent() -> None:
    """Tie this process to the launcher that started it, if one did, and have STACK_SIGNAL show its stack."""
    end_with_stack()
    parent, _, pipe = os.environ.pop(PARENT_VARIABLE, "").partition(":")
    if not parent:
        return
    end_with(int(parent))
    threading.Thread(target=_watch, args=(int(pipe),), name="parent", daemon=True).start()


def has_launcher() -> bool:
    """True in a process that a launcher has started, until it is tied to it."""
    return bool(os.environ.get(PARENT_VARIABLE))


def end_with(parent: int) -> None:
    """Have the kernel kill this process when its parent ends, where the kernel can do that."""
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # it ended before the request to the kernel
        os._exit(1)


def end_with_stack() -> None:
    """Have STACK_SIGNAL write the stacks of all threads to standard error and end this process, for one that hangs."""
    signal.signal(STACK_SIGNAL, signal.SIG_DFL)
    faulthandler.register(STACK_SIGNAL, STDERR, all_threads=True, chain=True)


def _watch(pipe: int) -> None:
    """Wait for the end of a pipe to which nothing is written."""
    os.read(pipe, 1)
    os._exit(1)


def script(name: str = FOOSIM) -> str:
    """Return the path of a command, by default foosim: beside this Python, else on PATH."""
    beside = Path(sysconfig.get_path("scripts")) / name
    return str(beside) if beside.is_file() else shutil.which(name) or name


def child_environment(pipe: int) -> dict[str, str]:
    """Return the environment of a child of this process that is to die with it; `pipe` ends when this process does."""
    return {
        **os.environ,
        PARENT_VARIABLE: f"{os.getpid()}:{pipe}",
        "OPENBLAS_NUM_THREADS": "1",  # nothing here uses BLAS; its threads only take memory
        "PYTHONUNBUFFERED": "1",
    }


def start_log(name: str) -> logging.Logger:
    """Return the log of this process: lines with UTC time on standard error, which a launcher sends to a file."""
    handler = logging.StreamHandler()
    formatter = logging.Formatter("%(asctime)s.%(msecs)03dZ %(levelname)-7s %(name)s: %(message)s", "%Y-%m-%dT%H:%M:%S")
    formatter.converter = time.gmtime
    handler.setFormatter(formatter)
    logger = logging.getLogger(name)
    logger.setLevel(logging.INFO)
    logger.handlers = [handler]
    logger.propagate = False
    return logger


def machine_start() -> str:
    """Return the name of this boot of the machine; empty where there is none."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return ""


def clock_name() -> str:
    """Return the name of the clock of `time.monotonic_ns`, which counts from the boot of the machine."""
    return machine_start() or f"process {os.getpid()}"  # then no other process's times are comparable


def new_boot() -> str:
    """Return a random name for this start of this process."""
    return f"b{os.urandom(8).hex()}"


class Stop:
    """Whether SIGTERM, SIGINT or SIGHUP has requested the end of this process. A second SIGINT ends it at once."""

    def __init__(self) -> None:
        """Handle the signals; only the main thread can."""
        self._is_set = False
        self._then: Callable[[], None] = lambda: None
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            signal.signal(number, self._take)

    def is_set(self) -> bool:
        return self._is_set

    def then(self, call: Callable[[], None]) -> None:
        """Call this when the end is requested, or at once if it was."""
        self._then = call
        if self._is_set:
            call()

    def _take(self, number: int, frame: object) -> None:
        if self._is_set and number == signal.SIGINT:
            os._exit(130)
        if not self._is_set:
            self._is_set = True
            self._then()
