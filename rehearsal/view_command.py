"""The command `foosim-replay view`: the console over a capture, beside or under another one or a table of poses.

Neighbours: `console.recorded` (the sources), `console.server.serving`, `between` (computes ticks in between).
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Final

import typer

from foosim.client.replay import hear_replay
from foosim.console.recorded.capture_source import FileSource
from foosim.console.recorded.leading import Leader
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
from foosim.protocol.addresses import LOOPBACK
from foosim.protocol.command import PkiOption
from foosim.protocol.errors import BadValue, Refused
from foosim.rehearsal.between import Between
from foosim.rehearsal.capture_arguments import reading
from foosim.vhub.capture_reader import read_about

ADDRESSES: Final = ("tcp/", "tls/")
"""How the address of a replay begins."""


def view(  # a command's options
    file: Annotated[
        Path,
        typer.Argument(
            metavar="CAPTURE|CSV|ADDRESS",
            help="A capture, a table of poses (.csv), or the tcp/HOST:PORT of a replay that is played.",
            show_default=False,
        ),
    ],
    second: SecondOption = None,
    offset: OffsetOption = None,
    listen: Annotated[str, typer.Option(help="HOST[:PORT] to serve the page at.")] = LOOPBACK,
    certificate: Annotated[
        Path | None, typer.Option(help="A PEM certificate for HTTPS, which another address than loopback takes.")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="The key of that certificate, PEM.")] = None,
    pki: PkiOption = None,
    open_browser: Annotated[bool, typer.Option("--open", help="Show the page in the browser of this machine.")] = False,
) -> None:
    """Serve a page that shows a capture: played, sought, stepped to the tick, with all that happened marked.

    Prints an address; the token in it is the permission. A tick without a captured frame is computed again, and shown
    when its digest is the captured one. A capture that is still being written, one without an end and
    one of several files are shown as well. With --second the distance between the two is plotted, entity by entity: two
    captures, a run and its what-if, a simulation and recorded poses. Ctrl-C ends it. Exit codes: 0 ended, 1 nobody can
    listen, 2 bad input, 3 refused.
    """
    offset_ns = read_offset(second, offset)
    with reading():
        sources = open_sources(file, second, offset_ns, pki)
    options = ServeOptions(listen, certificate, key, open=open_browser)
    serve_sources(lambda: (sources, ()), options, lambda text: print(text, flush=True))


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
    print(compared_text(second, both), flush=True)
    return [leader, other]


def _capture(file: Path) -> FileSource:
    return FileSource(file, recompute=_between(file))


def _between(file: Path) -> Between:
    return Between(read_about(file))
