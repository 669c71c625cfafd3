"""The command `foosim-console`: a page in the browser to see and touch a run that is live."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from foosim.capture.mcap.checks import CaptureError
from foosim.client.control import Control, connect
from foosim.common.addresses import LOOPBACK
from foosim.common.errors import BadValue
from foosim.console.clock.leading import Leader
from foosim.console.live.live_source import LiveSource
from foosim.console.live.presence import how_ended
from foosim.console.recorded.second import OffsetOption, SecondOption, compared_text, open_follower, read_offset
from foosim.console.server.serving import ServeOptions, serve_sources
from foosim.console.shown.source import Source
from foosim.deployment.loader import load_deployment
from foosim.runtime.command import VersionOption, new_app, run_app
from foosim.runtime.process import die_with_parent
from foosim.runtime.run_folder import find_run, open_run

app = new_app()


@app.command(no_args_is_help=False)
def foosim_console(  # noqa: PLR0913, PLR0917  # a command's options
    run: Annotated[
        str | None, typer.Argument(metavar="[RUN]", help="Name of the run; by default the newest live one.")
    ] = None,
    listen: Annotated[str, typer.Option(help="Serve the page at this HOST[:PORT].")] = LOOPBACK,
    certificate: Annotated[
        Path | None, typer.Option(help="A PEM certificate for HTTPS; required except at loopback.")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="The private key of that certificate, PEM.")] = None,
    view_only: Annotated[bool, typer.Option("--view-only", help="Permit viewing only.")] = False,
    open_browser: Annotated[bool, typer.Option("--open", help="Open the page in this machine's browser.")] = False,
    second: SecondOption = None,
    offset: OffsetOption = None,
    announce: Annotated[Path | None, typer.Option(hidden=True)] = None,
    version: VersionOption = False,
) -> None:
    """Serve the console of a live run, a page that shows and controls it.

    Prints one address for operators and one for viewers; the token in an address grants access. With --second a
    recording is shown beside the run or as a ghost in it, on the run's clock, and the distance between their entities
    is plotted. While no browser is connected, the console requests the run's status once a second. Ctrl-C ends the
    console; the run continues.

    Exit codes: 0 ended, 1 no run is live or the address is not available, 2 bad input, 3 refused.
    """
    die_with_parent()
    offset_ns = read_offset(second, offset)
    name = find_run(run).name

    def viewing(give_up: Callable[[], bool]) -> Control:
        return connect(name, "viewer", give_up)

    def operating(give_up: Callable[[], bool]) -> Control:
        return connect(name, "operator", give_up)

    options = ServeOptions(listen, certificate, key, view_only, open_browser, announce)
    ended = partial(how_ended, open_run(name))
    live = LiveSource(name, viewing, None if view_only else operating, ended)
    sources = [live] if second is None else _followed(live, name, second, offset_ns)
    serve_sources(lambda: (sources, ()), options)


def _followed(live: LiveSource, name: str, second: Path, offset_ns: int) -> list[Source]:
    """Return a run and the recording that follows it. Raises BadValue, BadPoses, and what asking the run raises."""
    with connect(name, "viewer") as control:
        what = control.describe()
        deployment = load_deployment(what["deployment"], what["deployment_name"])
        if deployment.files():
            deployment = deployment.with_assets(control.files(deployment))
    leader = Leader(live, deployment.tick_ns, time.monotonic_ns)
    added = [(added, model) for added, model in what["added"]]
    try:
        follower, both = open_follower(second, leader, deployment, offset_ns, added=added)
    except CaptureError as error:
        raise BadValue(f"--second: {error}") from None
    print(compared_text(second, both), file=sys.stderr)
    return [leader, follower]


def main() -> None:
    """Run the command."""
    run_app(app, "foosim-console")
