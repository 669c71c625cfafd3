"""The verb `view`: the console of a live run, of a capture, of a table of poses, or of a replay."""

from __future__ import annotations

import sys
import time
from functools import partial
from pathlib import Path
from typing import Annotated, Final

import typer

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import read_about
from foosim.cli.capture.options import reading
from foosim.client.client import Client
from foosim.client.client import connect as join
from foosim.client.control import connect, pki_of
from foosim.client.replay_listener import hear_replay
from foosim.common.addresses import LOOPBACK
from foosim.common.errors import BadValue, Refused
from foosim.console.clock.leading import Leader
from foosim.console.live.live_source import LiveSource, how_ended
from foosim.console.recorded.capture_source import FileSource
from foosim.console.recorded.poses_source import PosesSource
from foosim.console.recorded.replay_source import PlayedSource
from foosim.console.recorded.second import (
    OffsetOption,
    SecondOption,
    compared_text,
    is_table,
    open_follower,
    read_offset,
)
from foosim.console.server.serving import ServeOptions, serve_sources
from foosim.console.shown.source import Source
from foosim.deployment.loader import load_deployment
from foosim.runtime.command import PkiOption, new_app
from foosim.runtime.process import die_with_parent
from foosim.runtime.run_folder import find_run, open_run
from foosim.simulation.verify import Between

ADDRESSES: Final = ("tcp/", "tls/")
"""How the address of a replay begins."""
JOIN_S: Final = 3.0
"""How long the console waits for the vHub when it connects to give jobs."""

app = new_app()


@app.command(no_args_is_help=False)
def view(  # noqa: PLR0913, PLR0917  # a command's options
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="RUN|CAPTURE|CSV|ADDRESS",
            help="A live run (by default the newest), a capture, a table of poses (.csv), tcp/HOST:PORT of a replay.",
        ),
    ] = None,
    second: SecondOption = None,
    offset: OffsetOption = None,
    listen: Annotated[str, typer.Option(help="Serve the page at this HOST[:PORT].")] = LOOPBACK,
    certificate: Annotated[
        Path | None, typer.Option(help="A PEM certificate for HTTPS; required except at loopback.")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="The private key of that certificate, PEM.")] = None,
    view_only: Annotated[bool, typer.Option("--view-only", help="Permit viewing only (a live run).")] = False,
    pki: PkiOption = None,
    open_browser: Annotated[bool, typer.Option("--open", help="Open the page in this machine's browser.")] = False,
    announce: Annotated[Path | None, typer.Option(hidden=True)] = None,
) -> None:
    """Serve the console: a page that shows and controls a live run, or plays a capture.

    Prints an address for operators and one for viewers of a live run, or the one of a recording; the token in an
    address grants access. While no browser is connected, the console requests a run's status once a second. Ctrl-C
    ends the console; the run continues.

    A capture is played, sought, and stepped to the tick, with events marked on the time line. A tick without a captured
    frame is simulated again, and shown if its digest is the captured one. The capture may be unfinished, still being
    written, or split into files.

    With --second a recording is shown beside the first one or as a ghost in it, on the same clock, and the distance
    between their entities is plotted: a run and an earlier one, a capture and its what-if, a simulation and recorded
    poses.

    Exit codes: 0 ended, 1 no run is live or the address is not available, 2 bad input, 3 refused.
    """
    offset_ns = read_offset(second, offset)
    options = ServeOptions(listen, certificate, key, view_only, open_browser, announce)
    if what and ("/" in what or Path(what).suffix or Path(what).exists()):  # else it is the name of a run
        if view_only:
            raise BadValue("--view-only is valid for a live run only; a recording cannot be changed", what)
        with reading():
            sources = open_sources(Path(what), second, offset_ns, pki)
    else:
        die_with_parent()
        sources = open_run_sources(what, second, offset_ns, view_only=view_only)
    serve_sources(sources, options)


def open_run_sources(
    run: str | None, second: Path | None = None, offset_ns: int = 0, *, view_only: bool = False
) -> list[Source]:
    """Return the source of a live run, and of the recording that follows it.

    Raises NoRun, BadValue, BadPoses, and what a request to the run raises.
    """
    name = find_run(run).name
    viewing, operating = partial(connect, name, "viewer"), partial(connect, name, "operator")

    def joining(endpoint: str) -> Client:
        info = find_run(name).info()
        assert info is not None, "a run that was found has a run file"
        return join(f"run:{name}", endpoint, timeout_s=JOIN_S, pki=pki_of(info))

    folder = open_run(name)
    operate, giving = (None, None) if view_only else (operating, joining)
    live = LiveSource(name, viewing, operate, partial(how_ended, folder), giving, folder.gateways)
    return [live] if second is None else _followed_live(live, name, second, offset_ns)


def _followed_live(live: LiveSource, name: str, second: Path, offset_ns: int) -> list[Source]:
    """Return a run and the recording that follows it. Raises BadValue, BadPoses, and errors of the request."""
    with connect(name, "viewer") as control:
        what = control.describe()
        deployment = load_deployment(what["deployment"], what["deployment_name"])
        if deployment.files():
            deployment = deployment.with_assets(control.files(deployment))
    leader = Leader(live, deployment.tick_ns, time.monotonic_ns)
    try:
        follower, both = open_follower(second, leader, deployment, offset_ns)
    except CaptureError as error:
        raise BadValue(f"--second: {error}") from None
    print(compared_text(second, both), file=sys.stderr)
    return [leader, follower]


def open_sources(file: Path, second: Path | None = None, offset_ns: int = 0, pki: Path | None = None) -> list[Source]:
    """Return the source of a file or a replay, and the one that follows it.

    Raises CaptureError, BadPoses, BadValue, and what `hear_replay` raises.
    """
    if str(file).startswith(ADDRESSES):
        played = PlayedSource(lambda streams: hear_replay(str(file), streams, pki=pki))
        return [played] if second is None else _followed(played, second, offset_ns)
    if is_table(file):
        table = PosesSource(file)
        if second is None:
            return [table]
        if not is_table(second):
            raise BadValue("a table of poses comes second: give the capture first", str(second))
        return [table, PosesSource(second, table.clock, offset_ns, compare=lambda: table.where)]
    first = _capture(file)
    if second is None:
        return [first]
    if is_table(second):
        deployment = first.recording.deployment
        return [first, PosesSource(second, first.clock, offset_ns, deployment, first.opened(links=True))]
    return [first, FileSource(second, first.clock, offset_ns, _between(second), first.opened())]


def _followed(played: PlayedSource, second: Path, offset_ns: int) -> list[Source]:
    """Return a replay and what follows it. Its connection is closed where that cannot be."""
    leader = Leader(played, played.tick_ns, time.monotonic_ns)
    try:
        other, both = open_follower(second, leader, played.deployment, offset_ns, _between)
    except Refused:
        played.close()
        raise
    print(compared_text(second, both), file=sys.stderr)
    return [leader, other]


def _capture(file: Path) -> FileSource:
    return FileSource(file, recompute=_between(file))


def _between(file: Path) -> Between:
    return Between(read_about(file))
