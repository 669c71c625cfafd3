"""The verbs of `foosim capture`; here are `info`, `verify` and `recover`, shells over reader, `verify` and recovery."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final

import msgspec
import typer

from foosim.capture.info import CaptureInfo, capture_info
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Damaged
from foosim.capture.parts import FAILED_RUN, NEXT, whole_path
from foosim.capture.reader import read_about
from foosim.cli.capture.export import cut, diff, export
from foosim.cli.capture.options import BadCapture, Capture, reading
from foosim.cli.capture.play import control, play
from foosim.cli.capture.report import report
from foosim.cli.capture.what_if import what_if
from foosim.common import limits
from foosim.common.errors import BadValue, Failed
from foosim.protocol.run_status import reported_text
from foosim.runtime.command import DONE, FAILED, JsonOption, new_app, print_json
from foosim.runtime.journal import JournalError
from foosim.simulation.verify import Verified, verify_capture
from foosim.vhub.recording.recovery import check_finished, recover_capture

app = new_app()


@app.callback()
def capture_group() -> None:
    """Look into a capture, play it, compare it, take parts of it, and simulate it again.

    Exit codes: 0 done, 1 differs or failed, 2 bad input (no capture, a damaged one), 3 refused, or recovered with loss,
    4 equal up to where an unfinished capture ends.
    """


@app.command()
def info(capture: Capture, json: JsonOption = False) -> None:
    """Show the content of a capture: run, duration, digests, nodes and their arithmetic, packets by fate, cause and
    channel, recoveries, topics, files and versions.
    """
    with reading():
        found = capture_info(capture)
    if json:
        print_json(msgspec.to_builtins(found))
    else:
        print(_describe(found))


def _describe(found: CaptureInfo) -> str:
    if NEXT in found.end:
        state = f"continues in {found.end[NEXT]}, which is missing"
    elif found.finished:
        state = "whole, of a run that failed" if FAILED_RUN in found.end else "finished"
    else:
        state = f"not finished, {found.unfinished_bytes} bytes after the last whole chunk"
    lines = [
        f"{found.path}: {found.bytes / 1e6:.1f} MB, {state}",
        *([f"  {len(found.parts)} files: {found.parts[0]} to {found.parts[-1]}"] if len(found.parts) > 1 else []),
        *(f"  {key}: {value}" for key, value in sorted({**found.metadata, **found.end}.items())),
        f"  {_span(found)} of {found.tick_ns / 1e6:g} ms, {found.duration_ns / 1e9:.2f} s simulated",
        f"  digest of the last frame {found.digest}",
        f"  digest of all ticks {found.chain}",
        f"  nodes {', '.join(found.nodes) or 'unknown'}",
        f"  arithmetic {', '.join(found.arithmetic) or 'unknown'}",
        f"  clients {', '.join(found.clients) or 'none'}",
        f"  packets {_counted(found.packets)}",
        *([f"  dropped by {_counted(found.causes)}"] if found.causes else []),
        *([f"  {_commands(found.commands)}"] if found.commands else []),
        *([f"  on channels {_counted(found.channels)}"] if found.channels else []),
        f"  payloads {found.payload_bytes / 1e6:.1f} MB",
        *(f"  {line}" for line in reported_text(found.metrics)),
        f"  recoveries {found.recoveries}",
        "  topics",
        *(f"    {topic}: {count}" for topic, count in found.topics.items()),
        *(["  files of the deployment"] if found.files else []),
        *(f"    {name}: {size} bytes" for name, size in found.files.items()),
        "  versions",
        *(f"    {name}: {number}" for name, number in sorted(found.versions.items())),
    ]
    return "\n".join(lines)


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items())


def _commands(counts: Mapping[str, int]) -> str:
    return ", ".join(f"commands {fate} {count}" for fate, count in counts.items())


def _span(found: CaptureInfo) -> str:
    return f"{found.ticks} ticks" if not found.first_tick else f"ticks {found.first_tick} to {found.ticks}"


@app.command()
def verify(
    capture: Capture,
    nodes: Annotated[int, typer.Option(help="Number of nodes to simulate on.")] = 1,
    from_first_frame: Annotated[
        bool, typer.Option("--from-first-frame", help="Verify a cut: the ticks after its first frame.")
    ] = False,
    json: JsonOption = False,
) -> None:
    """Simulate a capture again from its orders and deliveries, and compare the digest of every tick.

    Prints the first tick and the entities that differ. Any number of nodes gives the same result. A difference is
    explained on standard error when the capture's nodes had another arithmetic than this machine.

    An unfinished capture, cut off or still being written, is compared up to its last whole tick, which is printed.

    A cut, and a later file of a split capture, is refused, since the ticks before its first frame are missing. With
    --from-first-frame the ticks after that frame are verified.

    Exit codes: 0 equal, 1 a tick differs or is missing, 2 bad input (no capture, a damaged one), 4 equal up to where an
    unfinished capture ends.
    """
    if not 1 <= nodes <= limits.NODES_MAX:
        raise BadValue(f"--nodes: out of range 1 to {limits.NODES_MAX}", nodes)
    with reading():
        found = verify_capture(capture, nodes, from_first_frame=from_first_frame)
    if json:
        print_json(_as_json(found))
    else:
        print(_verdict(found))
    if found.tick >= 0 and found.other_arithmetic:
        typer.echo(
            f"the capture's arithmetic is {', '.join(found.other_arithmetic)}, this machine's is {found.arithmetic}: "
            "they compute different worlds",
            err=True,
        )
    if found.tick >= 0 and found.other_versions:
        typer.echo(f"the capture was made with {'; '.join(found.other_versions)}", err=True)
    raise typer.Exit(FAILED if not found.equal else DONE if found.finished else UNFINISHED)


def _as_json(found: Verified) -> dict[str, Any]:
    return {
        "equal": found.equal,
        "finished": found.finished,
        "first_tick": found.first_tick,
        "ticks": found.ticks,
        "nodes": found.nodes,
        "chain": found.chain.hex(),
        "tick": found.tick if found.tick >= 0 else None,
        "entities": list(found.entities),
        "missing_tick": found.missing_tick if found.missing_tick >= 0 else None,
    }


def _verdict(found: Verified) -> str:
    on = f"on {found.nodes} node{'s' if found.nodes > 1 else ''}"
    if found.equal:
        count = found.ticks - found.first_tick
        since = f" after frame {found.first_tick}" if found.first_tick else ""
        end = "" if found.finished else f"; the capture is unfinished, it ends at tick {found.ticks}"
        return f"equal: {count} ticks{since} simulated again {on}, digest of all ticks {found.chain.hex()}{end}"
    if found.missing_tick >= 0:
        return f"tick {found.missing_tick} is missing; {found.ticks - found.first_tick} ticks before it are equal {on}"
    return f"differs at tick {found.tick} in {', '.join(found.entities)}; the ticks before it are equal {on}"


@app.command()
def recover(
    capture: Capture,
    journals: Annotated[
        Path | None, typer.Option(help="The folder with its vHub's journal, e.g. RUN/journals.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="The capture to write; by default CAPTURE's name with .recovered."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Write a valid capture from an unfinished one and the vHub's journal.

    The new file has everything up to the last whole chunk, or up to the first damage, and the ticks that the journal
    adds. CAPTURE is not changed. `foosim up` recovers the captures that earlier runs of the same user left
    unfinished. A finished capture is read to its end: the first damage is printed, and the command that cuts out what
    precedes it.

    Exit codes: 0 everything that was recorded is in the new capture, or CAPTURE is finished, 1 CAPTURE is damaged or
    cannot be recovered, 2 CAPTURE is no capture, or is cut off before its first row, 3 ticks that were in no journal
    are missing in the new capture.
    """
    try:
        found = recover_capture(capture, journals, out)
        if found is None:
            check_finished(capture)
    except (CaptureError, JournalError) as error:
        is_capture = isinstance(error, Damaged) or _is_capture(capture)
        raise (Failed if is_capture else BadCapture)(str(error)) from None
    if json:
        content = {
            "finished_before": found is None,
            "whole": found is None or found.is_whole,
            "path": None if found is None else str(found.path),
            "tick": None if found is None else found.tick,
            "torn_bytes": 0 if found is None else found.torn_bytes,
            "added_ticks": 0 if found is None else found.added_ticks,
            "problem": "" if found is None else found.problem,
        }
        print_json(content)
    else:
        typer.echo(f"capture {capture} is finished already" if found is None else str(found))
    raise typer.Exit(DONE if found is None or found.is_whole else WITH_LOSS)


def _is_capture(path: Path) -> bool:
    try:
        read_about(whole_path(path))
    except CaptureError:
        return False
    return True


WITH_LOSS: Final = 3
"""Exit code of `recover`."""
UNFINISHED: Final = 4
"""Exit code of `verify`."""

for command in (export, cut, diff, play, control, what_if, report):
    app.command()(command)
