"""The table of roles, and the command lines of the processes of a run.

A process with one role runs that role's command, one with several runs `foosim role roles`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Final, Literal, NamedTuple

from foosim.common.addresses import parse_address
from foosim.deployment.processes import Process
from foosim.deployment.schema import Deployment
from foosim.launcher.hosts import CAPTURE, Remote
from foosim.launcher.plan import Plan
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.runtime.process import FOOSIM, ROLE
from foosim.runtime.roles.shell import RUN
from foosim.runtime.run_folder import RunFolder, RunInfo


class Kind(NamedTuple):
    """A kind of role."""

    command: tuple[str, ...]
    """Of a process that has this role alone."""
    restart: Literal["always", "unless refused", "after a signal"]
    """When a process with this role is started again before the run has ended."""
    is_awaited: bool
    """Whether no tick is computed without it: its first two restarts have no back-off."""
    liveness: str
    """The detection of a process that hangs."""


KINDS: Final = {
    SUPERVISOR: Kind((FOOSIM, "run"), "always", True, "five status requests of the launcher without an answer"),
    VHUB: Kind((*ROLE, "vhub"), "unless refused", True, "lost by deadlines of the supervisor, and alive"),
    "node": Kind((*ROLE, "node"), "always", False, "lost by deadlines of the supervisor, and alive"),
    "player": Kind((*ROLE, "player"), "after a signal", False, "deadlines of the vHub, which end the run"),
    "gateway": Kind((*ROLE, "gateway"), "unless refused", True, "none: the run continues without it"),
}
"""By role: supervisor, vHub, any node, any player, any gateway."""


def kinds_of(roles: Iterable[str], deployment: Deployment) -> list[Kind]:
    """Return the kinds of some roles of a run."""
    return [KINDS.get(role) or KINDS[_kind_of(role, deployment)] for role in roles]


def _kind_of(role: str, deployment: Deployment) -> str:
    return "node" if role in deployment.nodes else "gateway" if role in deployment.gateways else "player"


class Commands:
    """The command line of each process of one run."""

    def __init__(self, plan: Plan, folder: RunFolder, capture: Path | None) -> None:
        self._plan = plan
        self._folder = folder
        self._capture = capture

    def needs_radio(self, process: Process) -> bool:
        """Whether a process connects to the radio plane of another one: it has players or a gateway, and no vHub."""
        deployment = self._plan.deployment
        clients = {*deployment.players, *deployment.gateways}
        return VHUB not in process.roles and not clients.isdisjoint(process.roles)

    def of(self, process: Process, info: RunInfo | None, remote: Remote | None = None) -> list[str]:
        """Return the command line of a process.

        Without `info`, the run's addresses, a process on this machine waits for them (`run:NAME`). The folder of
        certificates is that of the machine that the process runs on. Players' modules are found in the deployment's
        folder, too, which another machine has not.
        """
        options, deployment, roles = self._plan.options, self._plan.deployment, process.roles
        run = RUN + self._folder.name
        simulation, radio = (run, run) if info is None else (info.simulation, info.radio)
        pki = options.pki_arguments()
        pki = remote.pki_arguments() if pki and remote is not None else pki
        nodes = [role for role in roles if role in deployment.nodes]
        players = [role for role in roles if role in deployment.players]
        path = ["--path", str(options.file.parent.absolute())] if players and remote is None else []
        insecure = ["--insecure"] if options.insecure else []
        if players == [*roles]:
            return [*KINDS["player"].command, *_each("--name", players), "--connect", radio, *path, *pki]
        if roles[0] in deployment.gateways:
            return [*KINDS["gateway"].command, "--name", *roles, "--connect", radio, "--supervisor", simulation, *pki]
        if not process.is_shared:
            (kind,) = kinds_of(roles, deployment)
            if SUPERVISOR in roles:
                return [*kind.command, *options.arguments(), "--run", self._folder.name]
            if nodes:
                return [*kind.command, *_each("--name", nodes), "--connect", simulation, *pki]
            listen = ["--listen", self._radio_address(info, remote)]
            return [*kind.command, "--connect", simulation, *listen, *insecure, *pki, *self._records(remote)]
        command = [*ROLE, "roles", process.name]
        if SUPERVISOR in roles:
            command += ["--run", self._folder.name]
        else:
            command += ["--connect", simulation, *pki, *(["--radio", radio] if self.needs_radio(process) else [])]
        if VHUB in roles:
            command += ["--vhub-listen", self._radio_address(info, remote), *self._records(remote), *insecure]
        return [*command, *_each("--node", nodes), *_each("--player", players), *path]

    def _radio_address(self, info: RunInfo | None, remote: Remote | None) -> str:
        """Return the address where the vHub listens: that of the first time, which clients have."""
        address = self._plan.address
        known = info is not None and info.radio
        listen = replace(address, port=parse_address(info.radio).port) if known and info else address.next_port()
        return str(listen if remote is None else replace(listen, host=remote.host.address))

    def _records(self, remote: Remote | None) -> list[str]:
        """Return where the vHub writes journal and capture; on a remote machine into the guard's folder of the run."""
        folder, capture = (self._folder.path, self._capture) if remote is None else (Path(), Path(CAPTURE))
        written = ["--no-capture"] if self._capture is None else ["--capture", str(capture)]
        return ["--run-folder", str(folder), *written]


def _each(option: str, names: Iterable[str]) -> list[str]:
    """Return an option for each name."""
    return [word for name in names for word in (option, name)]
