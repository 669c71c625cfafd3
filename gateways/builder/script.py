"""Runs a MORSE script in a process of its own, and makes a deployment of what it has made."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.gateways.builder.export import MODULE, Builder, Tree, data

LIMIT_S: Final = 20
"""Wall time that a script has."""
RESULT_BYTES_MAX: Final = 8 << 20
GRACE_S: Final = 5
"""What a script that does not heed its end has after that."""


def export(script: Path, nodes: int | None = None, limit_s: int = LIMIT_S) -> str:
    """Return the text of a script's deployment, on `nodes` nodes, by default on those of the script.

    Raises DeploymentError with all problems, each with its place in the script.
    """
    builder = Builder(script.name, record(script, limit_s))
    text = builder.text(nodes)
    if not builder.problems:
        try:
            load_deployment(text, script.name)
        except DeploymentError as error:
            builder.problems += [_in_script(line, text.splitlines()) for line in error.problems]
    if builder.problems:
        raise DeploymentError(sorted(dict.fromkeys(builder.problems), key=_place_of))
    return text


def record(script: Path, limit_s: int) -> Tree:
    """Run a script in a process of its own; return what it made. Its output goes to standard error."""
    classes = {**data("components.yaml")["classes"], "robots": [*data("robots.yaml")["robots"]]}
    with TemporaryDirectory() as folder:
        known, result = Path(folder, "classes.json"), Path(folder, "result.json")
        known.write_text(json.dumps({category: [*morses] for category, morses in classes.items()}))
        command = [sys.executable, "-I", "-m", f"{MODULE}.record", *map(str, (script, known, result, limit_s))]
        with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=2, start_new_session=True) as child:
            with suppress(subprocess.TimeoutExpired):
                child.wait(limit_s + GRACE_S)
            with suppress(ProcessLookupError):  # with what it has forked
                os.killpg(child.pid, signal.SIGKILL)
        if result.exists() and result.stat().st_size > RESULT_BYTES_MAX:
            raise DeploymentError(
                [f"{script.name}: the script has made more than {RESULT_BYTES_MAX >> 20} MiB of things"]
            )
        if not result.exists():
            raise DeploymentError([f"{script.name}: the script has ended without a result, code {child.returncode}"])
        recorded: Tree = json.loads(result.read_text())
    return recorded


def _place_of(problem: str) -> tuple[str, int]:
    match = re.match(r"([^:]*):(\d+)?", problem)
    return (match[1], int(match[2] or 0)) if match else ("", 0)


def _in_script(problem: str, lines: list[str]) -> str:
    """Return a problem of a deployment with the place in the script that is nearest above its own."""
    match = re.match(r".*?:(\d+):\d+: (.*)", problem)
    above = lines[: int(match[1])][::-1] if match else []
    places = [found[1] for line in above if (found := re.search(r" # (\S+:\d+)", line))]
    return f"{places[0]}: {match[2]}" if match and places else problem
