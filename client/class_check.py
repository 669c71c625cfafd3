"""Imports the classes of players before a run begins, in a process that may fail.

A user's module may print, raise, exit, crash or hang when it is imported. So a fork of this process imports it: the
fork inherits the imported modules, costs milliseconds, and isolates failures. Its output goes to standard error.
Classes of foosim are imported here.
"""

from __future__ import annotations

import json
import os
import select
import signal
import sys
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from math import inf
from typing import Final, NamedTuple

from foosim.client.loading import ClassPathError, load_player
from foosim.common.finding import Finding
from foosim.common.plain_data import quoted
from foosim.deployment.schema import Deployment
from foosim.runtime.process import STACK_SIGNAL, end_with, end_with_stack

OURS: Final = "foosim."
LOOK_S: Final = 0.02
"""How often it is looked whether the fork still lives."""
SHOWS_S: Final = 2.0
"""How long the fork may take to show where it hangs."""
BLOCK_BYTES: Final = 1 << 16


class Fault(NamedTuple):
    """A problem of a class path, and the path that might be meant."""

    problem: str
    nearest: str | None = None


def player_findings(deployment: Deployment, names: Iterable[str], limit_s: float = inf) -> list[Finding]:
    """Return the problems of these players' classes, each at its place in the deployment.

    All modules together may take as long as `deadlines.start`, and no longer than a limit.
    """
    paths = {name: deployment.players[name].class_ for name in sorted(names)}
    start_s = deployment.deadlines.start_ns / 1e9
    which = " (deadlines.start)" if start_s <= limit_s else ""
    faults = class_faults(paths.values(), min(start_s, limit_s), which)
    return [
        Finding(("players", name, "class"), faults[path].problem, path, quoted(faults[path].nearest))
        for name, path in paths.items()
        if path in faults
    ]


def class_faults(paths: Iterable[str], limit_s: float, which: str = "") -> dict[str, Fault]:
    """Return the problems of class paths, by path; valid paths are left out. `which` names the limit."""
    each = sorted(set(paths))
    found = {path: _look(path) for path in each if path.startswith(OURS)}
    waiting = [path for path in each if path not in found]
    until_s = time.monotonic() + limit_s
    while waiting:
        told, end = _forked(waiting, until_s)
        found |= zip(waiting, told, strict=False)
        waiting = waiting[len(told) :]
        if waiting:  # the first of them ended the fork, or it hangs
            late = f"has not ended for {limit_s:g} s{which}; where it hangs is on standard error"
            found[waiting.pop(0)] = Fault(f"importing it {end or late}")
        if not end:
            break  # the time of all of them is over
    return {path: fault for path, fault in found.items() if fault is not None}


def _look(path: str) -> Fault | None:
    try:
        load_player(path)
    except ClassPathError as error:
        return Fault(error.problem, error.nearest)
    return None


def _forked(paths: Sequence[str], until_s: float) -> tuple[list[Fault | None], str]:
    """Check paths in a fork; return its results and how it ended: empty when it hung."""
    reading, writing = os.pipe()
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        _tell(paths, writing, parent)
    os.close(writing)
    try:
        lines, is_late = _read(reading, child, len(paths), until_s)
        if is_late:
            _show_stack(child)
        end = "" if is_late else _how(os.waitpid(child, 0)[1])
    except BaseException:
        _kill(child)
        raise
    finally:
        os.close(reading)
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)  # whatever it has started
    return [None if told is None else Fault(*told) for told in map(json.loads, lines)], end


def _read(reading: int, child: int, count: int, until_s: float) -> tuple[list[bytes], bool]:
    """Return the lines that the fork writes, and whether it was given up before it had ended."""
    data = b""
    while True:
        ended = os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
        while select.select([reading], [], [], 0 if ended else LOOK_S)[0]:
            block = os.read(reading, BLOCK_BYTES)
            data += block
            if not block:
                break
        *lines, _ = data.split(b"\n")
        if ended or len(lines) == count:
            return lines, False
        if time.monotonic() > until_s:
            return lines, True


def _show_stack(child: int) -> None:
    """Have the fork show where it hangs, which ends it; kill it where that does not."""
    os.kill(child, STACK_SIGNAL)
    until_s = time.monotonic() + SHOWS_S
    while time.monotonic() < until_s:
        if os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None:
            break
        time.sleep(LOOK_S)
    _kill(child)


def _kill(child: int) -> None:
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def _how(status: int) -> str:
    code = os.waitstatus_to_exitcode(status)
    return (
        f"ends the interpreter with {signal.Signals(-code).name}" if code < 0 else f"ends the interpreter, code {code}"
    )


# --- in the fork ------------------------------------------------------------------------------------------------------


def _tell(paths: Sequence[str], writing: int, parent: int) -> None:
    """Check each path and write a line for it; never return."""
    code = 1
    try:
        os.setpgid(0, 0)
        end_with(parent)
        nothing = os.open(os.devnull, os.O_RDWR)
        os.dup2(nothing, 0)
        os.dup2(2, 1)
        sys.stdout = sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
        end_with_stack()
        for path in paths:
            os.write(writing, json.dumps(_look(path)).encode() + b"\n")
        code = 0
    finally:
        os._exit(code)
