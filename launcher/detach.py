"""A run in the background: `up --detach` starts a launcher in a session of its own, and waits until it is up."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from foosim.common.errors import Failed
from foosim.launcher.plan import Plan
from foosim.runtime.children import FOOSIM, script
from foosim.runtime.command import DONE
from foosim.runtime.run_folder import RunFolder, create_run

POLL_S: Final = 0.05
LINES: Final = 20
"""Size of the log excerpt that is shown for a launcher that has ended."""


def launcher_command(plan: Plan, capture: Path | None, run: str) -> list[str]:
    """Return the command that launches a plan as a run that has a folder already."""
    command = [FOOSIM, "up", *plan.options.arguments(), "--run", run]
    return [*command, "--no-capture"] if capture is None else [*command, "--capture", str(capture)]


def detach(plan: Plan, capture: Path | None, run: str | None) -> RunFolder:
    """Launch a run in the background; return its folder when clients can find it. Raises Failed if it ends before."""
    folder = create_run(plan.deployment.world, run, plan.stamp)
    path = folder.log("up")
    process = _launch(launcher_command(plan, capture, folder.name), path)
    while True:
        code = process.poll()
        info = folder.info()
        if code is None and (info is None or not info.radio):
            try:
                time.sleep(POLL_S)
            except KeyboardInterrupt:  # then the command says that the run has not begun
                process.terminate()
                process.wait()
                raise
            continue
        if code not in (None, DONE):
            raise Failed(f"run {folder.name} has ended with exit code {code}; the end of {path}:\n{_end_of(path)}")
        return folder


def _launch(command: Sequence[str], log: Path) -> subprocess.Popen[bytes]:
    """Start a command in a session of its own, which outlives the terminal."""
    with log.open("ab") as file:
        return subprocess.Popen(
            [script(command[0]), *command[1:]],
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )


def _end_of(path: Path) -> str:
    lines = path.read_text("utf-8", "replace").splitlines()[-LINES:]
    return "\n".join(f"    {line}" for line in lines)
