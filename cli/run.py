"""The verb `run`, the supervisor alone, and `run_roles`: one or several roles in a process, each with its own core.

Roles of a process hand each other messages over the in-memory bus, and all others over the planes' sessions, of which
the process has one each. They take their turns in a fixed order: vHub, supervisor, nodes, players, by name. So after a
crash the vHub has folded its journal before the supervisor requests it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from foosim.cli.run_command import with_options
from foosim.client.errors import PlayerError
from foosim.launcher.run_options import RunOptions
from foosim.runtime.command import DONE, FAILED, NewRunOption, new_app
from foosim.runtime.health import ProgressOption

if TYPE_CHECKING:
    from foosim.common.addresses import Address
    from foosim.launcher.plan import Plan
    from foosim.runtime.roles.shell import Process
    from foosim.runtime.run_folder import RunFolder
    from foosim.runtime.transport.session import Session
    from foosim.supervisor.main import SupervisorShell
    from foosim.vhub.main import HubOptions, HubShell

app = new_app()


@app.command()
@with_options()
def run_supervisor(
    options: RunOptions,
    run: NewRunOption = None,
    progress_file: ProgressOption = None,
) -> None:
    """Run a supervisor only.

    The vHub, nodes and players are started separately. The run's folder has the run file, logs and journals.
    """
    from foosim.launcher.plan import make_plan
    from foosim.protocol.channels import SUPERVISOR
    from foosim.runtime.process import has_launcher
    from foosim.runtime.run_folder import create_run, open_run, run_exists, runs_folder

    plan = make_plan(options)
    if not has_launcher():  # a launcher has checked, and watches the disks
        from foosim.launcher.begin import check_room

        for warning in check_room(plan, None, runs_folder()):
            print(warning, file=sys.stderr)
    folder = open_run(run) if run is not None and run_exists(run) else create_run(plan.deployment.world, run)
    raise typer.Exit(run_roles(SUPERVISOR, (plan, folder), pki=plan.options.pki, progress=progress_file))


def run_roles(  # noqa: PLR0913  # what the command was given
    name: str,
    supervisor: tuple[Plan, RunFolder] | None = None,
    vhub: tuple[HubOptions, Address] | None = None,
    nodes: Sequence[str] = (),
    players: Sequence[str] = (),
    *,
    connect: str = "",
    radio: str = "",
    pki: Path | None = None,
    progress: Path | None = None,
) -> int:
    """Run the roles of the process `name` until their run ends; return the exit code. Raises Refused.

    `vhub` has the address of the radio plane. `connect` is the address of the supervisor where it is in another
    process, `radio` that of the vHub's radio plane, which only players need. What only some roles need is imported
    with them.
    """
    from foosim.protocol.channels import SUPERVISOR, VHUB, Plane
    from foosim.runtime.journal import remove_journal
    from foosim.runtime.process import Stop, die_with_parent, has_launcher
    from foosim.runtime.roles.shell import Process, client_session

    is_launched = has_launcher()
    die_with_parent()
    stop = Stop()
    count = (supervisor is not None) + (vhub is not None) + len(nodes) + len(players)
    process = Process(name, progress, is_shared=count > 1)
    with ExitStack() as opened:

        def add_players(session: Session | None) -> None:
            """Add the players: on the vHub's session, else on one of theirs, or with certificates on one each."""
            from foosim.client.main import ClientShell

            credentials = None
            for player in players:
                if session is None or credentials is not None:  # a session has one certificate
                    link = client_session(radio, f"client.{player}", pki, stop, Plane.RADIO)
                    session, credentials = opened.enter_context(link)
                process.add(ClientShell(process, player, session, credentials=credentials))

        shell, simulation, credentials = None, None, None
        here = ([VHUB] if vhub is not None else []) + [f"node.{node}" for node in nodes]
        if supervisor is not None:
            shell = opened.enter_context(_supervisor(process, *supervisor, pki, is_launched or count > 1))
            simulation = shell.session
        elif here:
            own_name = f"process.{name}" if len(here) > 1 else here[0]
            simulation, credentials = opened.enter_context(client_session(connect, own_name, pki, stop))
        if vhub is not None:
            assert simulation is not None
            process.add(opened.enter_context(_vhub(process, simulation, *vhub, pki, add_players)))
        if shell is not None:
            process.add(shell)
        for node in nodes:
            from foosim.node.main import NodeShell

            assert simulation is not None
            process.add(NodeShell(process, node, simulation, credentials=credentials))
        if vhub is None and players:
            add_players(None)
        stop.then(process.stop)
        try:
            code = process.run()
        except PlayerError:  # its text is in the log
            code = FAILED
    if code == DONE and supervisor is not None:
        remove_journal(supervisor[1].journals, SUPERVISOR)
    return code


def _vhub(
    process: Process,
    simulation: Session,
    options: HubOptions,
    address: Address,
    pki: Path | None,
    on_radio: Callable[[Session | None], None],
) -> AbstractContextManager[HubShell]:
    from foosim.runtime.transport.certificates import load_credentials
    from foosim.vhub.main import open_vhub

    return open_vhub(process, simulation, address, options, load_credentials(pki, "vhub"), on_radio)


def _supervisor(
    process: Process, plan: Plan, folder: RunFolder, pki: Path | None, is_launched: bool
) -> AbstractContextManager[SupervisorShell]:
    from foosim.launcher.resume import supervisor_records
    from foosim.supervisor.main import open_supervisor

    settings, records = plan.settings(folder.name, is_launched=is_launched), supervisor_records
    return open_supervisor(process, settings, plan.address, pki, folder, partial(records, folder, plan.options))
