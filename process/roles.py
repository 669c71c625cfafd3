"""Runs several roles of a run in one process: supervisor, vHub, nodes and players, each with its own core.

Roles hand each other messages over the in-memory bus, and all others over the planes' sessions, of which the process
has one each. They take their turns in a fixed order: vHub, supervisor, nodes, players, by name. So after a crash the
vHub has folded its journal before the supervisor asks for it.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
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
from foosim.runtime.transport.certificates import Credentials, load_credentials
from foosim.runtime.transport.session import Session
from foosim.supervisor.main import open_supervisor
from foosim.vhub.main import HubOptions, open_vhub


@dataclass(frozen=True, slots=True)
class Roles:
    """The roles of one process, and where it finds the others."""

    name: str
    """The process's name."""
    supervisor: tuple[Plan, RunFolder] | None = None
    vhub: tuple[HubOptions, Address] | None = None
    """With the address of the radio plane."""
    nodes: tuple[str, ...] = ()
    players: tuple[str, ...] = ()
    connect: str = ""
    """Address of the supervisor, where it is in another process."""
    radio: str = ""
    """Address of the vHub's radio plane, where it is in another process; only players need it."""
    pki: Path | None = None
    progress: Path | None = None

    @property
    def identity(self) -> str:
        """Its identity on the simulation plane; empty where it has no role there."""
        here = ([VHUB] if self.vhub is not None else []) + [identity.node(name) for name in self.nodes]
        return identity.process(self.name) if len(here) > 1 else "".join(here)


def run_roles(roles: Roles) -> int:
    """Run the roles until their run ends; return the exit code. Raises Refused."""
    stop = Stop()
    process = Process(roles.name, roles.progress, is_shared=True)
    with ExitStack() as opened:

        def add_players(radio: Session | None) -> None:
            """Add the players: on the vHub's session, else on one of theirs, or with certificates on one each."""
            credentials = None
            for name in roles.players:
                if radio is None or credentials is not None:  # a session has one certificate
                    radio, credentials = opened.enter_context(radio_link(name))
                process.add(PlayerShell(process, name, radio, credentials=credentials))

        def radio_link(name: str) -> AbstractContextManager[tuple[Session, Credentials | None]]:
            return client_session(roles.radio, identity.client(name), roles.pki, stop, Plane.RADIO)

        supervisor, simulation, credentials = None, None, None
        if roles.supervisor is not None:
            plan, folder = roles.supervisor
            settings = plan.settings(folder.name, is_launched=True)
            records = partial(supervisor_records, folder, plan.options)
            supervised = open_supervisor(process, settings, plan.address, roles.pki, folder, records)
            supervisor = opened.enter_context(supervised)
            simulation = supervisor.session
        elif roles.identity:
            link = client_session(roles.connect, roles.identity, roles.pki, stop)
            simulation, credentials = opened.enter_context(link)
        if roles.vhub is not None:
            assert simulation is not None
            options, address = roles.vhub
            own = load_credentials(roles.pki, VHUB)
            hub = open_vhub(process, simulation, address, options, own, add_players)
            process.add(opened.enter_context(hub))
        if supervisor is not None:
            process.add(supervisor)
        for name in roles.nodes:
            assert simulation is not None
            process.add(NodeShell(process, name, simulation, credentials=credentials))
        if roles.vhub is None:
            add_players(None)
        stop.then(process.stop)
        code = run_to_end(process)
    if code == DONE and roles.supervisor is not None:
        remove_journal(roles.supervisor[1].journals, SUPERVISOR)
    return code
