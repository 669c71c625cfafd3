"""The command `foosim-replay view`: the console over a capture, beside or under another one or a table of poses."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated, Final

import typer

from foosim.capture.reader import read_about
from foosim.cli.options import reading
from foosim.client.replay_listener import hear_replay
from foosim.common.addresses import LOOPBACK
from foosim.common.errors import BadValue, Refused
from foosim.console.clock.leading import Leader
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
from foosim.replay.between import Between
from foosim.runtime.command import PkiOption

ADDRESSES: Final = ("tcp/", "tls/")
"""How the address of a replay begins."""


def view(  # a command's options
    file: Annotated[
        Path,
        typer.Argument(
            metavar="CAPTURE|CSV|ADDRESS",
            help="A capture, a table of poses (.csv), or tcp/HOST:PORT of a running replay.",
            show_default=False,
        ),
    ],
    second: SecondOption = None,
    offset: OffsetOption = None,
    listen: Annotated[str, typer.Option(help="Serve the page at this HOST[:PORT].")] = LOOPBACK,
    certificate: Annotated[
        Path | None, typer.Option(help="A PEM certificate for HTTPS; required except at loopback.")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="The private key of that certificate, PEM.")] = None,
    pki: PkiOption = None,
    open_browser: Annotated[bool, typer.Option("--open", help="Open the page in this machine's browser.")] = False,
) -> None:
    """Serve the console for a capture: play, seek, step to the tick, with events marked on the time line.

    Prints an address with a token, which grants access. A tick without a captured frame is simulated again, and shown
    if its digest is the captured one. The capture may be unfinished, still being written, or split into files. With
    --second the distance between the entities of two recordings is plotted: of two captures, a run and its what-if, a
    simulation and recorded poses. Ctrl-C ends the command.

    Exit codes: 0 ended, 1 the address is not available, 2 bad input, 3 refused.
    """
    offset_ns = read_offset(second, offset)
    with reading():
        sources = open_sources(file, second, offset_ns, pki)
    options = ServeOptions(listen, certificate, key, open=open_browser)
    serve_sources(lambda: (sources, ()), options)


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
