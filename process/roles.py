"""Runs several roles of a run in one process: supervisor, vHub, nodes and players, each with its own core.

Roles hand each other messages over the in-memory bus, and all others over the planes' sessions, of which the process
has one each. They take their turns in a fixed order: vHub, supervisor, nodes, players, by name. So after a crash the
vHub has folded its journal before the supervisor requests it.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from foosim.client.main import PlayerShell, run_to_end
from foosim.common.addresses import Address
from foosim.launcher.plan import Plan
from foosim.launcher.resume import supervisor_records
from foosim.node.main import NodeShell
from foosim.protocol import identity
from foosim.protocol.channels import SUPERVISOR, VHUB, Plane
from foosim.runtime.command import DONE
from foosim.runtime.journal import remove_journal
from foosim.runtime.process import Stop
from foosim.runtime.roles.shell import Process, client_session
from foosim.runtime.run_folder import RunFolder
from foosim.runtime.transport.certificates import load_credentials
from foosim.runtime.transport.session import Session
from foosim.supervisor.main import open_supervisor
from foosim.vhub.main import HubOptions, open_vhub


def run_roles(  # noqa: PLR0913  # what the command was given
    name: str,
    supervisor: tuple[Plan, RunFolder] | None,
    vhub: tuple[HubOptions, Address] | None,
    nodes: Sequence[str],
    players: Sequence[str],
    *,
    connect: str,
    radio: str,
    pki: Path | None,
    progress: Path | None,
) -> int:
    """Run the roles of the process `name` until their run ends; return the exit code. Raises Refused.

    `vhub` has the address of the radio plane. `connect` is the address of the supervisor where it is in another
    process, `radio` that of the vHub's radio plane, which only players need.
    """
    stop = Stop()
    process = Process(name, progress, is_shared=True)
    with ExitStack() as opened:

        def add_players(session: Session | None) -> None:
            """Add the players: on the vHub's session, else on one of theirs, or with certificates on one each."""
            credentials = None
            for player in players:
                if session is None or credentials is not None:  # a session has one certificate
                    link = client_session(radio, identity.client(player), pki, stop, Plane.RADIO)
                    session, credentials = opened.enter_context(link)
                process.add(PlayerShell(process, player, session, credentials=credentials))

        shell, simulation, credentials = None, None, None
        here = ([VHUB] if vhub is not None else []) + [identity.node(node) for node in nodes]
        if supervisor is not None:
            plan, folder = supervisor
            settings = plan.settings(folder.name, is_launched=True)
            records = partial(supervisor_records, folder, plan.options)
            supervised = open_supervisor(process, settings, plan.address, pki, folder, records)
            shell = opened.enter_context(supervised)
            simulation = shell.session
        elif here:
            own_name = identity.process(name) if len(here) > 1 else here[0]
            simulation, credentials = opened.enter_context(client_session(connect, own_name, pki, stop))
        if vhub is not None:
            assert simulation is not None
            options, address = vhub
            own = load_credentials(pki, VHUB)
            hub = open_vhub(process, simulation, address, options, own, add_players)
            process.add(opened.enter_context(hub))
        if shell is not None:
            process.add(shell)
        for node in nodes:
            assert simulation is not None
            process.add(NodeShell(process, node, simulation, credentials=credentials))
        if vhub is None:
            add_players(None)
        stop.then(process.stop)
        code = run_to_end(process)
    if code == DONE and supervisor is not None:
        remove_journal(supervisor[1].journals, SUPERVISOR)
    return code
