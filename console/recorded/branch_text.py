"""The command that begins a run with the shown frame: arguments that `foosim up --from` accepts."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

from foosim.capture.rows import FRAME
from foosim.common.errors import BadValue, Refused
from foosim.common.units import format_ns
from foosim.console.recorded.recording import Recording
from foosim.console.shown.source import Answered
from foosim.deployment.loader import load_deployment
from foosim.deployment.text.files import read_source_file


def branch_answer(recording: Recording, tick: int) -> Answered:
    """Return the command that continues from a tick; its tick is that of the captured frame that the run begins with.

    After a `#` it warns that the deployment's file is not the captured one. Raises BadValue for a tick without a frame
    before it, CaptureError.
    """
    number = recording.index.places[FRAME].newest(tick * recording.tick_ns)
    if number < 0:
        first, last = recording.span
        raise BadValue(f"branch: no captured frame at or before this tick; there are ticks {first} to {last}", tick)
    row = recording.row(FRAME, number)
    name = recording.about.deployment_name
    time = format_ns(row.tick * recording.tick_ns).replace(" ", "")
    command = ["foosim", "up", name, "--from", f"{_near(recording.path)}@{time}"]
    return Answered(shlex.join(command) + _remark(recording, Path(name)), row.tick)


def _near(path: Path) -> Path:
    """Return a path for display: relative if it is below this folder."""
    whole = Path(os.path.abspath(path))
    return whole.relative_to(Path.cwd()) if whole.is_relative_to(Path.cwd()) else whole


def _remark(recording: Recording, file: Path) -> str:
    """Return a note about the deployment's file, empty when it is the captured one."""
    try:
        there = load_deployment(read_source_file(file), str(file))
    except Refused:
        return f"  # {file} is not here: name the file that the run was started with"
    if there.model_dump() != recording.deployment.model_dump():
        return f"  # {file} is not what the run had: it was changed, or the run had options (--set)"
    return ""
