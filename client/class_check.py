"""Imports the classes of players before a run begins.

A user's module may print, raise, exit, crash or hang when it is imported. What it prints goes to standard error. One
that crashes ends this process, and so does one that hangs, at a limit: its stack is written to standard error first.
"""

from __future__ import annotations

import faulthandler
import sys
from collections.abc import Iterable
from contextlib import redirect_stdout

from foosim.client.loading import ClassPathError, load_player
from foosim.common.finding import Finding
from foosim.common.names import quoted
from foosim.deployment.schema import Deployment


def player_findings(deployment: Deployment, names: Iterable[str]) -> list[Finding]:
    """Return the problems of these players' classes, each at its place in the deployment.

    All modules together may take as long as `deadlines.start`.
    """
    paths = {name: deployment.players[name].class_ for name in sorted(names)}
    faults = class_faults(paths.values(), deployment.deadlines.start_ns / 1e9)
    return [
        Finding(("players", name, "class"), faults[path].problem, path, quoted(faults[path].nearest))
        for name, path in paths.items()
        if path in faults
    ]


def class_faults(paths: Iterable[str], limit_s: float) -> dict[str, ClassPathError]:
    """Return the problems of class paths, by path; valid paths are left out."""
    found: dict[str, ClassPathError] = {}
    if not faulthandler.is_enabled():
        faulthandler.enable(2)
    faulthandler.dump_traceback_later(limit_s, exit=True, file=2)
    try:
        with redirect_stdout(sys.stderr):
            for path in sorted(set(paths)):
                try:
                    load_player(path)
                except ClassPathError as error:
                    found[path] = error
    finally:
        faulthandler.cancel_dump_traceback_later()
    return found
