"""The progress file: a sign of life of a process's loop, and what a probe makes of it.

A process whose interpreter hangs keeps its links, its presence and its threads; only its loop says whether it works. So
the loop writes this file, and who watches the process (a container's health check, a probe of Kubernetes) asks for its
age. Both read the machine's monotonic clock, which no change of the wall time moves and which begins anew at boot: a
sign from before a boot has no age that counts. A sign has one length and is written over the last one by one call, so
that no reader sees half of it and no file system has more to do than to change a page.
"""

from __future__ import annotations

import os
import re
import time
from pathlib import Path
from typing import Final

from foosim.common.errors import Failed

EVERY_NS: Final = 500_000_000
"""How often a loop that goes round says so."""
_SIGN: Final = re.compile(rb"[0-9]{20}\n")


class NoProgress(Failed):
    """A process gives no sign of life, or none that is young enough."""


class ProgressFile:
    """Writes the signs of one process, until it ends."""

    def __init__(self, path: Path) -> None:
        """Write the first one; raises Failed when it cannot be written."""
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o644)
            os.ftruncate(self._file, 0)
            self.write(time.monotonic_ns())
        except OSError as error:
            raise Failed(f"--progress-file {path}: cannot be written, {error.strerror}") from None

    def write(self, now_ns: int) -> None:
        """Log that the loop went round at `now_ns`. Raises OSError."""
        os.pwrite(self._file, b"%020d\n" % now_ns, 0)


def age_ns(path: Path, now_ns: int) -> int:
    """Return how old the sign in this file is at `now_ns` of the monotonic clock; raises NoProgress without one."""
    try:
        sign = path.read_bytes()
    except OSError as error:
        raise NoProgress(f"{path}: no sign of life, {error.strerror}") from None
    if _SIGN.fullmatch(sign) is None:
        raise NoProgress(f"{path}: not a progress file")
    age = now_ns - int(sign)
    if age < 0:
        raise NoProgress(f"{path}: written before this machine was booted")
    return age
