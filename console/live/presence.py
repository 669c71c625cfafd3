"""Presence of a run as pages show it: here, away (its supervisor is searched), or ended, with reason and capture.

The result is in the run's folder, written by the supervisor and completed by `up`.
"""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

from foosim.capture.parts import is_complete
from foosim.launcher.outcome import ended_outcome
from foosim.runtime.run_folder import RunFolder

HERE = {"type": "presence", "state": "here", "text": ""}


def away(text: str) -> dict[str, Any]:
    """Return the message about a run whose supervisor is not reached; the console tries again."""
    return {"type": "presence", "state": "away", "text": text}


def how_ended(folder: RunFolder, stopped_by: str) -> dict[str, Any] | None:
    """Return the message about a run that has a result; None for a run that continues or may be resumed.

    `stopped_by` is the requester of the end, if known.
    """
    if folder.result() is None:
        return None
    result = ended_outcome(folder).result
    reason, failed, capture = result["reason"], bool(result["failed"]), result["capture"]
    if stopped_by and reason == "stopped":
        reason = f"stopped by {stopped_by}"
    command = "" if capture is None else f"foosim view {shlex.quote(capture)}"
    text = f"The run has {'failed' if failed else 'ended'} at tick {result['ticks']}: {reason}. "
    if capture is None:
        text += "It has no capture."
    else:
        state = "" if is_complete(Path(capture)) else " (unfinished)"
        text += f"Its capture is {capture}{state}; this shows it: {command}"
    return {
        "type": "presence", "state": "ended", "failed": failed, "reason": reason, "capture": capture,
        "command": command, "text": text,
    }  # fmt: skip
