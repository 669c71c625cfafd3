"""The command `foosim role roles`: a process with several roles of a run, which `foosim up` starts."""

from __future__ import annotations

from typing import Annotated

import typer

from foosim.cli.run import run_roles
from foosim.client.loading import look_in
from foosim.common.addresses import check_listen
from foosim.common.errors import BadValue
from foosim.launcher.plan import make_plan
from foosim.launcher.run_options import launched_options
from foosim.runtime.command import PathOption, PkiOption, new_app
from foosim.runtime.health import ProgressOption
from foosim.runtime.run_folder import open_run
from foosim.vhub.main import CaptureOption, InsecureOption, NoCaptureOption, RunFolderOption, read_options

app = new_app()


@app.command()
def process(  # noqa: PLR0913, PLR0917  # a command's options
    name: Annotated[str, typer.Argument(help="Name of the process, for its log.")],
    run: Annotated[
        str | None, typer.Option("--run", help="Run the supervisor of this run, as it was launched.")
    ] = None,
    connect: Annotated[str, typer.Option(help="Address of the supervisor elsewhere: tcp/HOST:PORT or run:NAME.")] = "",
    vhub_listen: Annotated[
        str | None, typer.Option(help="Run the vHub, and listen for clients at this HOST:PORT.")
    ] = None,
    insecure: InsecureOption = False,
    capture: CaptureOption = None,
    no_capture: NoCaptureOption = False,
    run_folder: RunFolderOption = None,
    node: Annotated[list[str] | None, typer.Option(help="Run this node; may be repeated.")] = None,
    player: Annotated[list[str] | None, typer.Option(help="Run this player; may be repeated.")] = None,
    radio: Annotated[str, typer.Option(help="Address of the vHub's radio plane elsewhere, or run:NAME.")] = "",
    path: PathOption = None,
    pki: PkiOption = None,
    progress_file: ProgressOption = None,
) -> None:
    """Run several roles of a run in one process: supervisor, vHub, nodes, players.

    `foosim up` starts such processes where the deployment, or its option --processes, says that roles share
    one. The process ends with the run; killed and started again with the same options, it resumes from its journals.

    Exit codes: 0 the run ended, 1 it failed, 3 refused.
    """
    if not (run or vhub_listen or node or player):
        raise BadValue("a role is missing: --run, --vhub-listen, --node or --player", name)
    if path is not None:
        look_in(str(path.absolute()))
    supervisor = None
    if run is not None:
        folder = open_run(run)
        supervisor = make_plan(launched_options(folder)), folder
        pki, insecure = supervisor[0].options.pki, supervisor[0].options.insecure
    if (supervisor is None) == (not connect) and (run is not None or vhub_listen is not None or node):
        raise BadValue("one of --run and --connect is needed: where the supervisor is")
    if player and vhub_listen is None and not radio:
        raise BadValue("--radio is missing: the address of the vHub, which players need", ", ".join(player))
    hub = None
    if vhub_listen is not None:
        address = check_listen(vhub_listen, insecure, secured=pki is not None)
        hub = read_options(capture, no_capture, run_folder), address
    given = supervisor, hub, node or (), player or ()
    code = run_roles(name, *given, connect=connect, radio=radio, pki=pki, progress=progress_file)
    raise typer.Exit(code)
