"""The command `foosim probe`: checks whether the loop of a process advances, for health checks and probes."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from foosim.common.errors import BadValue
from foosim.common.units import parse_ns
from foosim.runtime.command import new_app
from foosim.runtime.progress import NoProgress, age_ns

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
    path: Annotated[Path, typer.Argument(metavar="PATH", help="The process's --progress-file.", show_default=False)],
    within: Annotated[str, typer.Option(help="Maximum age of the last progress.")] = "5s",
) -> None:
    """Check whether the main loop of a process advances, as a health check on its machine or in its container.

    Exit codes: 0 the last progress is recent, 1 it is too old or absent.
    """
    print(f"alive, {probe_file(path, within) / 1e9:.1f} s ago")
