"""Shared by launcher and guard: the paths of foosim's commands, and the tie of a child to its parent."""

from __future__ import annotations

import os
import shutil
import sysconfig
from pathlib import Path
from typing import Final

from foosim.runtime.process import PARENT_VARIABLE

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
