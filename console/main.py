"""The command `foosim-console`: a page in the browser to see and touch a run that is live.

Neighbours: `live` (the run as a source), `serving` (serves it), `supervisor.up` (starts this with `--console`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from foosim.console.live.live_source import LiveSource
from foosim.console.live.presence import how_ended
from foosim.console.server.serving import ServeOptions, serve_sources
from foosim.protocol.addresses import LOOPBACK
from foosim.protocol.command import VersionOption, new_app, run_app
from foosim.protocol.process import die_with_parent
from foosim.supervisor.control import Control, connect
from foosim.supervisor.run_folder import find_run, open_run

app = new_app()


@app.command(no_args_is_help=False)
def foosim_console(
    run: Annotated[
        str | None, typer.Argument(metavar="[RUN]", help="The run to look at; by default the newest live one.")
    ] = None,
    listen: Annotated[str, typer.Option(help="HOST[:PORT] to serve the page at.")] = LOOPBACK,
    certificate: Annotated[
        Path | None, typer.Option(help="A PEM certificate for HTTPS, which another address than loopback takes.")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="The key of that certificate, PEM.")] = None,
    view_only: Annotated[bool, typer.Option("--view-only", help="Let nobody operate the run.")] = False,
    open_browser: Annotated[bool, typer.Option("--open", help="Show the page in the browser of this machine.")] = False,
    announce: Annotated[Path | None, typer.Option(hidden=True)] = None,
    version: VersionOption = False,
) -> None:
    """Serve a page that shows a live run, and lets operators do what foosim-supervisor's commands do.

    Prints an address for who operates and one for who only looks; the token in it is the permission. While no browser
    is open it asks the run for nothing. Ctrl-C ends it; the run goes on. Exit codes: 0 ended, 1 no run is live or
    nobody can listen, 2 bad input, 3 refused.
    """
    die_with_parent()
    name = find_run(run).name

    def viewing(give_up: Callable[[], bool]) -> Control:
        return connect(name, "viewer", give_up)

    def operating(give_up: Callable[[], bool]) -> Control:
        return connect(name, "operator", give_up)

    options = ServeOptions(listen, certificate, key, view_only, open_browser, announce)
    operate = None if view_only else operating
    ended = partial(how_ended, open_run(name))
    source = partial(LiveSource, name, viewing, operate, ended)
    serve_sources(lambda: ([source()], ()), options, lambda text: print(text, flush=True))


def main() -> None:
    """Run the command."""
    run_app(app, "foosim-console")
