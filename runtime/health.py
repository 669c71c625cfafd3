"""The progress file shows that a process's main loop advances, and the command `foosim probe` reads its age.

A process whose interpreter hangs keeps its links, its presence and its threads. Therefore the main loop writes this
file, for a container's health check or a Kubernetes probe. Writer and reader use the machine's monotonic clock, which
changes of the wall time do not affect; a time from before the last boot is invalid. A time has a fixed length and is
overwritten in place by one call, so a reader never sees a partial one.
"""

from __future__ import annotations

import os
import re
import time
from pathlib import Path
from typing import Annotated, Final

import typer

from foosim.common.errors import BadValue, Failed
from foosim.common.units import parse_ns
from foosim.runtime.command import new_app

EVERY_NS: Final = 500_000_000
"""Period of the writes."""
_SIGN: Final = re.compile(rb"[0-9]{20}\n")


class NoProgress(Failed):
    """A process shows no progress, or none that is recent enough."""


class ProgressFile:
    """The writer of one process's progress file."""

    def __init__(self, path: Path) -> None:
        """Write the current time; raises Failed when that is impossible."""
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o644)
            os.ftruncate(self._file, 0)
            self.write(time.monotonic_ns())
        except OSError as error:
            raise Failed(f"--progress-file {path}: cannot be written, {error.strerror}") from None

    def write(self, now_ns: int) -> None:
        """Write `now_ns` of the monotonic clock. Raises OSError."""
        os.pwrite(self._file, b"%020d\n" % now_ns, 0)


def age_ns(path: Path, now_ns: int) -> int:
    """Return the age (ns) at `now_ns` of the time in this file; raises NoProgress without one."""
    try:
        sign = path.read_bytes()
    except OSError as error:
        raise NoProgress(f"{path}: no progress file, {error.strerror}") from None
    if _SIGN.fullmatch(sign) is None:
        raise NoProgress(f"{path}: not a progress file")
    age = now_ns - int(sign)
    if age < 0:
        raise NoProgress(f"{path}: written before this machine was booted")
    return age


ProgressOption = Annotated[
    Path | None,
    typer.Option("--progress-file", help="File that shows progress, read by foosim probe."),
]
"""The option of a process with a progress file."""

app = new_app()


def probe_file(path: Path, within: str) -> int:
    """Return the age (ns) of the last progress; raises NoProgress where it is too old or absent, or BadValue."""
    within_ns = parse_ns(within)
    if within_ns <= 0:
        raise BadValue("--within: not above 0", within)
    age = age_ns(path, time.monotonic_ns())
    if age > within_ns:
        raise NoProgress(f"{path}: the last progress is {age / 1e9:.1f} s old, more than {within}")
    return age


@app.command()
def probe(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="The process's --progress-file.")],
    within: Annotated[str, typer.Option(help="Maximum age of the last progress.")] = "5s",
) -> None:
    """Check whether the main loop of a process advances, as a health check on its machine or in its container.

    Exit codes: 0 the last progress is recent, 1 it is too old or absent.
    """
    print(f"alive, {probe_file(path, within) / 1e9:.1f} s ago")
