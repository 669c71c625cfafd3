"""The command lines of the processes of a run.

A process with one role runs that role's command, one with several runs `foosim role roles`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from foosim.common.addresses import parse_address
from foosim.deployment.processes import Process
from foosim.launcher.hosts.ssh import CAPTURE, Remote
from foosim.launcher.plan import Plan
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.runtime.children import FOOSIM, ROLE
from foosim.runtime.roles.shell import RUN
from foosim.runtime.run_folder import RunFolder, RunInfo


class Commands:
    """The command line of each process of one run."""

    def __init__(self, plan: Plan, folder: RunFolder, capture: Path | None) -> None:
        self._plan = plan
        self._folder = folder
        self._capture = capture

    def needs_radio(self, process: Process) -> bool:
        """Whether a process connects to the radio plane of another one: it has players and no vHub."""
        return VHUB not in process.roles and any(role in self._plan.deployment.players for role in process.roles)

    def of(self, process: Process, info: RunInfo | None, remote: Remote | None = None) -> list[str]:
        """Return the command line of a process.

        Without `info`, the run's addresses, a process on this machine waits for them (`run:NAME`).
        """
        if process.is_shared:
            return self._shared(process, info, remote)
        role, pki = process.name, self._pki(remote)
        if role == SUPERVISOR:
            return [FOOSIM, "run", *self._plan.options.arguments(), "--run", self._folder.name]
        simulation, radio = self._addresses(info)
        if role == VHUB:
            insecure = ["--insecure"] if self._plan.options.insecure else []
            address = ["--listen", self._radio_address(info, remote)]
            return [*ROLE, "vhub", "--connect", simulation, *address, *insecure, *pki, *self._records(remote)]
        if role in self._plan.deployment.nodes:
            return [*ROLE, "node", "--name", role, "--connect", simulation, *pki]
        return [*ROLE, "player", "--name", role, "--connect", radio, *self._path(remote), *pki]

    def _shared(self, process: Process, info: RunInfo | None, remote: Remote | None) -> list[str]:
        deployment, roles = self._plan.deployment, process.roles
        simulation, radio = self._addresses(info)
        if all(role in deployment.players for role in roles):
            words = [word for role in roles for word in ("--name", role)]
            return [*ROLE, "player", *words, "--connect", radio, *self._path(remote), *self._pki(remote)]
        command = [*ROLE, "roles", process.name]
        if SUPERVISOR in roles:
            command += ["--run", self._folder.name]
        else:
            command += ["--connect", simulation, *self._pki(remote)]
            command += ["--radio", radio] if self.needs_radio(process) else []
        if VHUB in roles:
            command += ["--vhub-listen", self._radio_address(info, remote), *self._records(remote)]
            command += ["--insecure"] if self._plan.options.insecure else []
        for option, declared in (("--node", set(deployment.nodes)), ("--player", set(deployment.players))):
            command += [word for role in roles if role in declared for word in (option, role)]
        has_players = any(role in deployment.players for role in roles)
        return command + self._path(remote) if has_players else command

    def _path(self, remote: Remote | None) -> list[str]:
        """Return where players' modules are found, too: in the deployment's folder, which another machine has not."""
        return ["--path", str(self._plan.options.file.parent.absolute())] if remote is None else []

    def _addresses(self, info: RunInfo | None) -> tuple[str, str]:
        """Return where the routers of both planes listen."""
        return (RUN + self._folder.name,) * 2 if info is None else (info.simulation, info.radio)

    def _radio_address(self, info: RunInfo | None, remote: Remote | None) -> str:
        """Return where the vHub listens: at the address that clients know, once it has listened."""
        address = self._plan.address
        known = info is not None and info.radio
        listen = replace(address, port=parse_address(info.radio).port) if known and info else address.next_port()
        return str(listen if remote is None else replace(listen, host=remote.host.address))

    def _records(self, remote: Remote | None) -> list[str]:
        """Return where the vHub writes journal and capture; on a remote machine into the guard's folder of the run."""
        folder, capture = (self._folder.path, self._capture) if remote is None else (Path(), Path(CAPTURE))
        written = ["--no-capture"] if self._capture is None else ["--capture", str(capture)]
        return ["--run-folder", str(folder), *written]

    def _pki(self, remote: Remote | None) -> list[str]:
        """Return the folder of a process's certificate: of this machine, or of the one that it runs on."""
        given = self._plan.options.pki_arguments()
        return remote.pki_arguments() if given and remote is not None else given
