"""Starting processes on another machine: the command line of the system's ssh, and the meaning of its exit code.

`ssh` is the user's own: keys, agents, jump hosts and ~/.ssh/config are as they are; it never prompts. On the
other side `foosim guard` (`guard`) starts the process and ends it when the connection does. Pure: `launcher` runs
the commands, `prepare` fetches what a run left on a machine.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Final

from foosim.deployment.hosts import Host
from foosim.deployment.schema import Deployment, places
from foosim.runtime.children import BY_SIGNAL, FOOSIM, GUARD, OTHER_VERSION

SSH_FAILED: Final = 255
NOT_FOUND: Final = 127
NOT_RUNNABLE: Final = 126
OWN_BUS: Final = "export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-/run/user/$(id -u)}"
"""Finds the user's own systemd; a login by ssh does not always set it."""
CAPTURE: Final = "capture.mcap"
"""Name of the capture of a vHub on another machine, in the run's folder there."""

# A user's option of the same name precedes these and is used; BatchMode always applies.
_ALWAYS: Final = ("-T", "-o", "BatchMode=yes")
_DEFAULTS: Final = ("ConnectTimeout=10", "ServerAliveInterval=5", "ServerAliveCountMax=3")

# Messages of OpenSSH: of a connection that is refused, and of a machine that cannot be reached.
_REFUSED: Final = (
    "Permission denied", "Host key verification failed", "REMOTE HOST IDENTIFICATION HAS CHANGED",
    "Could not resolve hostname", "Bad configuration option", "unknown option",
)  # fmt: skip
_AWAY: Final = (
    "Connection refused", "No route to host", "Network is unreachable", "timed out", "Connection closed",
    "closed by remote host", "Connection reset", "Broken pipe", "not responding", "Invalid argument",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Remote:
    """A machine by its name in the deployment, with its settings there."""

    name: str
    host: Host

    def ssh(self, words: Sequence[str]) -> list[str]:
        """Return the command line that has the machine's login shell run these words."""
        defaults = [part for option in _DEFAULTS for part in ("-o", option)]
        return ["ssh", *_ALWAYS, *self.host.ssh_options, *defaults, self.host.destination, shlex.join(words)]

    @property
    def typed(self) -> str:
        """How a person connects to the machine."""
        return shlex.join(["ssh", *self.host.ssh_options, self.host.destination])

    @property
    def foosim(self) -> str:
        """The command as it is called there."""
        return FOOSIM if self.host.commands is None else f"{self.host.commands.rstrip('/')}/{FOOSIM}"

    def pki_arguments(self) -> list[str]:
        """Return the folder of the certificates there, as an argument for a process of a run with certificates."""
        return [] if self.host.pki is None else ["--pki", self.host.pki]

    def guarded(self, run: str, name: str, command: Sequence[str]) -> list[str]:
        """Return the command line that starts a process of a run there, and ends it when the connection ends."""
        guard = [self.foosim, "guard", "run", "--version-of-launcher", version("foosim"), run, name, *command]
        return self.ssh(guard)

    def unit_started(self, name: str) -> list[str]:
        """Return the command line that starts a node's unit (deploy/systemd): root's is the system's."""
        script = f'if [ "$(id -u)" = 0 ]; then user=; else user=--user; {OWN_BUS}; fi'
        return self.ssh(["sh", "-c", f"{script}; exec systemctl $user --no-block start foosim-node@{name}.service"])

    def why(self, code: int, lines: Sequence[str]) -> str:
        """Return why ssh, or its command, ended with this code; `lines` are the last ones of its log."""
        if code == NOT_FOUND:
            text = f"there is no {self.foosim} on host {self.name}"
            return f"{text}: install foosim there, and set hosts.{self.name}.commands to its folder"
        if code == NOT_RUNNABLE:
            return f"{self.foosim} cannot be run on host {self.name}"
        if code == OTHER_VERSION:
            found = next((line for line in reversed(lines) if line.startswith(GUARD)), "another version of foosim")
            return f"host {self.name}: {found.removeprefix(GUARD + ': ')}; install {version('foosim')} there"
        if code > BY_SIGNAL and code != SSH_FAILED:
            return f"was killed by signal {code - BY_SIGNAL} on host {self.name}"
        if code != SSH_FAILED:
            return f"ended with exit code {code} on host {self.name}"
        where = f"host {self.name} ({self.host.destination})"
        for messages, what in ((_REFUSED, ""), (_AWAY, " cannot be reached")):
            last = [line.strip() for line in lines if any(said in line for said in messages)][-1:]
            if last:
                return f"{where}{what}: {last[0]}"
        return f"{where}: the connection ended, or the guard there was killed"

    @staticmethod
    def is_away(code: int, lines: Sequence[str]) -> bool:
        """Whether it was the network: the machine may come back by itself."""
        return code == SSH_FAILED and any(said in line for line in lines for said in _AWAY)


def remotes(deployment: Deployment) -> dict[str, Remote]:
    """Return the machine of each process that runs on one of the deployment's hosts, by the process's name."""
    return {name: Remote(host, deployment.hosts[host]) for name, host in places(deployment).items()}
