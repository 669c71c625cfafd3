"""The command that begins a new run with the last frame of a run that cannot continue."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Final

NEW_RUN: Final = "A new run begins with the last captured frame"


def new_run_text(arguments: Sequence[str], capture: str) -> str:
    """Return in words how a run begins with the last frame of a capture; `arguments` are those of the run before."""
    if not capture:
        return "The run has no capture to begin a new one with"
    command = ["foosim", "up", *arguments, "--from", f"{capture}@last"]
    return f"{NEW_RUN}: {shlex.join(command)}"
