"""The command `foosim rehearse`: a deployment in one process on virtual time. A shell over `rehearse`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import Annotated, Any, Final

import typer

from foosim.cli.run_command import with_options
from foosim.common import limits
from foosim.common.addresses import LOOPBACK
from foosim.common.errors import BadValue
from foosim.common.json_text import decode_json
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.launcher.plan import Plan, check_models_here, check_players_here, check_rooms, make_plan
from foosim.launcher.run_options import RunOptions
from foosim.protocol.run_status import reported_text
from foosim.runtime.command import DONE, FAILED, JsonOption, new_app, print_json
from foosim.simulation.attendant import Interrupts
from foosim.simulation.check.component_check import ComponentCheck, used_component_type
from foosim.simulation.run import check_lockstep, rehearse
from foosim.simulation.system import Settings
from foosim.vhub.links.summary import summaries
from foosim.vhub.links.summary_text import start_lines

app = new_app()


@app.command()
@with_options("file", "duration", "seed", "branch", "sets", "engine")
def rehearse_command(
    options: RunOptions,
    nodes: Annotated[int, typer.Option(help="Number of nodes, n1 to nN, each with its own engine.")] = 1,
    capture: Annotated[Path | None, typer.Option(help="Write a capture here; an existing one is refused.")] = None,
    json: JsonOption = False,
) -> None:
    """Simulate a deployment in one process on virtual time, as fast as possible.

    The supervisor, the vHub, the nodes and the lockstep players are the same code and exchange the same bytes as the
    processes of `foosim up`. The digests are those of `up`, with any number of nodes.

    A line of progress a second goes to standard error: simulated time, its speed, the score, and the process that the
    run waited for the longest. Ctrl-C ends the rehearsal in order, a second Ctrl-C at once; the last line has the last
    tick and the capture's path. A player that does not answer within `deadlines.lockstep_fast` ends the run.

    Exit codes: 0 done, 1 failed or something is in quarantine at the end, 2 bad input, 3 the capture exists or cannot
    be created, or its disk is full, 130 second Ctrl-C.
    """
    if options.duration is None:
        raise BadValue("--for is missing: the simulated time, e.g. --for 20s")
    if not 1 <= nodes <= limits.NODES_MAX:
        raise BadValue(f"--nodes: out of range 1 to {limits.NODES_MAX}", nodes)
    plan = make_plan(replace(options, pace="fast", listen=LOOPBACK))
    check_models_here(plan)
    check_lockstep(plan.deployment)
    check_players_here(plan)
    for warning in check_rooms(plan.deployment.capture, capture, None):
        _note(f"warning: {warning}")
    if not json:
        for line in (
            *([plan.branch.text] if plan.branch else []),
            *start_lines(summaries(plan.deployment), str(options.file)),
        ):
            typer.echo(line)
    raise typer.Exit(_rehearse(plan, nodes, capture, json))


def _rehearse(plan: Plan, nodes: int, capture: Path | None, json: bool) -> int:
    """Rehearse the plan and show the result; return the exit code."""
    output, file = sys.stdout, plan.options.file

    def show(result: dict[str, Any]) -> int:
        if json:
            print_json(result, file=output)
        else:
            print(_text(result), file=output, flush=True)
        return FAILED if result["failed"] or result["quarantined"] else DONE

    def stuck(result: dict[str, Any]) -> None:
        _note(result["reason"])
        os._exit(show(result))

    inputs: dict[str, Any] = {"capture": capture, "start": plan.start, "folder": file.parent}
    # Players print to standard error: standard output has the result and nothing else.
    with redirect_stdout(sys.stderr), Interrupts(_note) as interrupts:
        settings = Settings(on_log=_show)
        looks: dict[str, Any] = {"prepare": interrupts.attend, "progress": _note, "on_stuck": stuck}
        try:
            result = rehearse(plan.text, str(file), plan.ticks, nodes, settings=settings, **inputs, **looks).json
        except KeyboardInterrupt:
            _note(interrupts.last_line(capture, is_finished=False))
            raise
    code = show(result)
    if interrupts.count:
        _note(interrupts.last_line(capture, is_finished=True))
    return code


def _note(line: str) -> None:
    """Log something beside the result."""
    typer.echo(line, err=True)


def _show(process: str, level: str, text: str) -> None:
    if level != "info":
        typer.echo(f"{process}: {level}: {text}", err=True)


def _text(result: dict[str, Any]) -> str:
    """Return a result for people."""
    seconds = (result["ticks"] - result["first_tick"]) * result["tick_ns"] / 1e9
    summary = "".join(f", {text}" for text in result["summary"])
    counts = dict(result["packets"])
    refused = counts.pop("refused")
    packets = ", ".join(f"{count} {fate.replace('_', ' ')}" for fate, count in counts.items())
    handovers = f"{result['handovers']} hand-overs, " if result["solvers"] else ""
    return (
        f"{seconds:.2f} s simulated at {result['rtf']}x{summary}\n"
        f"{handovers}packets {packets}; packets refused {refused}\n"
        + "".join(f"{line}\n" for line in reported_text(result["metrics"]))
        + f"digest of all ticks {result['digest']['chain']}"
        + (f"\nthe rehearsal has failed: {result['reason']}" if result["failed"] else "")
        + (f"\ncapture {result['capture']}" if result["capture"] else "")
    )


# --- for check-component ---------------------------------------------------------------------------------------------

REHEARSE: Final = "from foosim.cli import main; main()"
HASH_SEED: Final = "4711"
"""Of the other process: sets of texts have another order there."""


LAST_LINES: Final = 10
"""Lines of another process's log that are shown when it fails."""


def check_component(text: str, file: Path, name: str, ticks: int, seed: int) -> int:
    """Check a component in a deployment that uses it, and print what was found; return the exit code."""
    component_type = used_component_type(text, str(file), name)
    label, folder = f"{component_type.type_name} {component_type.name}", file.parent
    text, files = pin_assets(text, str(file), folder)
    check = ComponentCheck(text, str(file), ticks, seed, files, partial(rehearse, folder=folder))
    shows, is_broken = sys.stderr.isatty(), False
    with _noted_interrupts() as noted:

        def begun(line: str) -> None:
            if noted:
                raise KeyboardInterrupt
            if shows:
                _write_step(line)

        check.on_step = begun
        try:
            for line in _all_broken(check, folder):
                is_broken = True
                print(f"{label}: {line}", flush=True)
            if noted:
                raise KeyboardInterrupt
        except KeyboardInterrupt:
            _write_step(f"{label}: interrupted, {check.now}")
            raise
    if not is_broken:
        print(f"{label}: the same world on 1, 2 and 3 nodes, in any order and company, in {ticks} ticks")
    for note in check.notes:
        print(f"{label}: {note}")
    if not check.has_failed:
        print(
            f"{check.compared} of {check.sensors} sensors of {file} measured, and were compared alone and with others"
        )
    return FAILED if is_broken else DONE


@contextmanager
def _noted_interrupts() -> Iterator[list[int]]:
    """Raise earlier interrupts: Python drops one that is raised while an object is destroyed."""
    noted: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        noted.append(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, note)
    try:
        yield noted
    finally:
        signal.signal(signal.SIGINT, before)


def _all_broken(check: ComponentCheck, folder: Path) -> Iterator[str]:
    yield from check.broken()
    if not check.has_failed:
        check.begin("in another process")
        yield from elsewhere(check.text, check.name, check.ticks, check.first, folder)


def _write_step(line: str) -> None:
    """Write a line beside the result, in one piece: an interrupt may come at any time."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


def elsewhere(text: str, name: str, ticks: int, here: Mapping[str, Any], folder: Path | None = None) -> Iterator[str]:
    """Yield that a process with another seed of Python's hashes computes another world than this one.

    `here` is the result of a rehearsal by this one, on one node. `folder` is the base of the relative paths of the
    deployment's files (None: the current folder).
    """
    with TemporaryDirectory() as temporary:
        file = Path(temporary) / Path(name).name
        file.write_text(text)
        assets = load_deployment(text, name).assets
        for path, content in pin_assets(text, name, folder or Path())[1].items():
            asset = Path(temporary, assets, path)
            asset.parent.mkdir(parents=True, exist_ok=True)
            asset.write_bytes(content)
        span = f"{ticks * here['tick_ns']}ns"
        command = [sys.executable, "-c", REHEARSE, "rehearse", str(file), "--for", span, "--nodes", "1", "--json"]
        environment = {**os.environ, "PYTHONHASHSEED": HASH_SEED}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        last = [line for line in done.stderr.splitlines() if line.strip()][-LAST_LINES:]
        yield "\n  ".join([f"in another process it fails, with exit code {done.returncode}:", *last])
        return
    there = decode_json(done.stdout.splitlines()[-1].encode())  # before it is what modules print
    assert isinstance(there, dict), there
    if there["digest"] != here["digest"]:
        yield "another process computes another world"
