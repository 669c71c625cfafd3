"""The result of a run as one JSON object.

The supervisor writes the result of a run that it ends. Otherwise the launcher composes it from the last status, the
reason of the end, and the capture's file. Unknown fields are null.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.parts import first_there, has_end, is_complete, parts_at
from foosim.deployment.schema import Deployment
from foosim.launcher.display import recording_text
from foosim.protocol.run_status import NO_COMMANDS, NO_PACKETS, NOT_RECORDED, UNFINISHED
from foosim.runtime.run_folder import RunFolder, open_run, run_exists

_UNKNOWN: Final[Mapping[str, Any]] = {
    **dict.fromkeys(("run", "world", "seed", "ticks", "first_tick", "tick_ns", "rtf", "lag_ms", "lateness_ms")),
    "digest": None,
    "packets": NO_PACKETS,
    "metrics": {},
    "commands": NO_COMMANDS,
    "recording": NOT_RECORDED,
    "from": None,
    "nodes": {},
    "recoveries": [],
    "moves": 0,
    "handovers": 0,
    "summary": [],
    "quarantined": [],
    "solvers": {},
    "capture": None,
    "reason": None,
    "failed": True,
    "failed_component": None,
}


def result_without_supervisor(known: Mapping[str, Any], reason: str) -> dict[str, Any]:
    """Return the result of a run without a supervisor's result; `known` is the last status."""
    seen = {key: known[key] for key in _UNKNOWN if key in known}
    return {**_UNKNOWN, **seen, "reason": reason, "failed": True}


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of a run: its JSON, and its printed messages."""

    result: dict[str, Any]
    lines: tuple[str, ...]
    is_killed: bool = False
    """Whether a second Ctrl-C has killed its processes."""

    @property
    def failed(self) -> bool:
        return bool(self.result["failed"] or self.result["quarantined"])


def ended_outcome(folder: RunFolder) -> Outcome:
    """Return the outcome of a run that has a result."""
    ended, capture = folder.result(), folder.capture()
    assert ended is not None, f"run {folder.name} has not ended"
    result = ended if capture is None else with_capture(ended, capture)
    return Outcome(result, (f"run {folder.name} has ended: {result['reason']}", *capture_lines(capture, result)))


def refused_result(resumed: str | None, run: str | None, reason: str) -> dict[str, Any]:
    """Return the result of a run that did not begin: a resumed one, with its capture, or a new one."""
    capture = open_run(resumed).capture() if resumed is not None and run_exists(resumed) else None
    return with_capture(result_without_supervisor({"run": resumed or run}, reason), capture)


def detached_outcome(folder: RunFolder, deployment: Deployment, capture: Path | None) -> Outcome:
    """Return the outcome of a run that was left running."""
    name, path = folder.name, None if capture is None else str(capture)
    known = {"run": name, **plan_facts(deployment), "capture": path, "failed": False}
    return Outcome(
        {**_UNKNOWN, **known}, (f"run {name} is up; foosim status --run {name} shows it, down --run {name} ends it",)
    )


def capture_lines(capture: Path | None, result: dict[str, Any] | None, journals: Path | None = None) -> list[str]:
    """Report a capture's path, whether it is finished, and its errors from the result.

    Of a run that has ended also how one without an end is completed from `journals`.
    """
    files = {} if capture is None else parts_at(capture)
    if not files:
        return []
    wrong = "" if result is None else recording_text(result)
    count = f", {len(files)} files" if len(files) > 1 else ""
    there, is_finished = [*files.values()], capture is not None and is_complete(capture)
    lines = [f"capture {there[0]}{count}" if is_finished else f"capture {there[0]}{count} (unfinished)"]
    if not is_finished and result is not None and journals is not None:
        lines.append(f"complete it with: foosim capture recover {there[0]} --journals {journals}")
    return [*lines, wrong] if wrong else lines


def plan_facts(deployment: Deployment) -> dict[str, Any]:
    """Return the result of a run before it begins."""
    return {"world": deployment.world, "seed": deployment.seed, "tick_ns": deployment.tick_ns}


def with_capture(result: Mapping[str, Any], capture: Path | None) -> dict[str, Any]:
    """Return a result that names the capture's first file where there is one, with the final count of its rows."""
    files = {} if capture is None else parts_at(capture)
    if capture is None or not files:
        return {**result, "capture": None}
    named = {**result, "capture": str(first_there(capture))}
    if result["recording"]["state"] not in (UNFINISHED, NOT_RECORDED["state"]):
        return named
    from foosim.capture.foxglove import LOG
    from foosim.capture.reader import Scan
    from foosim.capture.rows import EPOCHS, PACKETS, TICK

    try:  # as its writer counts them
        rows = sum(1 for _ in Scan(first_there(capture)).messages(frozenset({TICK, PACKETS, EPOCHS, LOG})))
        state = "on" if has_end(files[max(files)]) else UNFINISHED
    except CaptureError as error:
        return {**named, "recording": {**result["recording"], "state": UNFINISHED, "problem": str(error)}}
    recording = {**result["recording"], "state": state, "written": rows}
    recording["offered"] = max(recording["offered"], rows + recording["refused"])
    return {**named, "recording": recording}
