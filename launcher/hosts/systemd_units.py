"""The unit of systemd that runs a node on its host: its text.

While systemd restarts a node, the run continues without it until it rejoins, as with a node that `up` started. Pure.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Final

from foosim.common.addresses import Address
from foosim.common.errors import BadValue, Failed
from foosim.deployment.schema import Deployment, places
from foosim.launcher.hosts.ssh import Remote, remote_of, unit_name
from foosim.protocol import identity
from foosim.runtime.command import BAD_INPUT, REFUSED
from foosim.runtime.transport.certificate_folder import CA_FILE, CERTIFICATE_SUFFIX, KEY_SUFFIX

WATCHDOG_S: Final = 5
MEMORY_MAX: Final = "1G"
"""A node of the table takes a tenth of it."""
TASKS_MAX: Final = 128

_UNIT: Final = """\
# Node {node} of the world {world}, on host {host}.
# Written by `foosim-supervisor install {host}`, which writes it anew when the deployment has changed.
# A run starts it: `foosim-supervisor up`, or `systemctl start {unit}`. It ends with the run.
[Unit]
Description=foosim node {node} of the world {world}
Wants=network-online.target
After=network-online.target
StartLimitIntervalSec=0

[Service]
Type=notify
ExecStart={command}
Environment=OPENBLAS_NUM_THREADS=1 PYTHONUNBUFFERED=1
{credentials}# A node is ready when it has found the supervisor.
TimeoutStartSec=infinity
TimeoutStopSec=10
# The loop sends watchdog notifications; a node that hangs is killed and restarted.
WatchdogSec={watchdog_s}
WatchdogSignal=SIGKILL
Restart=on-failure
RestartSec=1
# Refused by the supervisor, or called wrongly: again would be the same.
RestartPreventExitStatus={prevent}
KillMode=control-group
MemoryMax={memory}
TasksMax={tasks}
NoNewPrivileges=yes
PrivateTmp=yes
{user}
[Install]
WantedBy={wanted_by}
"""
# A system's unit needs no user of its own, and writes nothing but its log; a user's unit runs as that user.
_SYSTEM: Final = """\
DynamicUser=yes
ProtectSystem=strict
ProtectHome=read-only
PrivateDevices=yes
"""


# A system's unit runs as a user that may not read the files: systemd reads them, and shows that user copies in %d.
_CREDENTIALS: Final = """\
# Only this node's: in a folder that others cannot read, which is gone with the process.
LoadCredential={ca}:{folder}/{ca}
LoadCredential={certificate}:{folder}/{certificate}
LoadCredential={key}:{folder}/{key}
"""
_CREDENTIALS_FOLDER: Final = "%d"


def node_command(remote: Remote, node: str, address: Address, world: str) -> list[str]:
    """Return the command of a node's unit, without its certificate's folder."""
    return [remote.path("foosim-node"), "--name", node, "--connect", str(address), "--world", world]


def unit_text(remote: Remote, node: str, address: Address, world: str, is_users: bool) -> str:
    """Return the unit of a node; `is_users` is one of a user's own systemd, not of the system's.

    Where the supervisor's address is one for certificates, the node has its own from the host's folder.
    """
    command, credentials = _escaped(node_command(remote, node, address, world)), ""
    if address.protocol == "tls" and is_users:
        command += f" {_escaped(remote.pki_arguments())}"
    elif address.protocol == "tls" and remote.host.pki is not None:
        command += f" --pki {_CREDENTIALS_FOLDER}"
        folder, who = remote.host.pki.rstrip("/").replace("%", "%%"), identity.node(node)
        own = {"certificate": who + CERTIFICATE_SUFFIX, "key": who + KEY_SUFFIX}
        credentials = _CREDENTIALS.format(ca=CA_FILE, folder=folder, **own)
    return _UNIT.format(
        node=node,
        world=world,
        host=remote.name,
        unit=unit_name(node),
        command=command,
        credentials=credentials,
        watchdog_s=WATCHDOG_S,
        prevent=f"{BAD_INPUT} {REFUSED}",
        memory=MEMORY_MAX,
        tasks=TASKS_MAX,
        user="" if is_users else _SYSTEM,
        wanted_by="default.target" if is_users else "multi-user.target",
    )


def _escaped(words: Sequence[str]) -> str:
    """Return a command line in systemd's syntax, with % and $ escaped."""
    return shlex.join(words).replace("%", "%%").replace("$", "$$")


def units_of(deployment: Deployment, host: str, address: Address, is_users: bool) -> dict[str, str]:
    """Return the units of a host's nodes, by file name. Raises BadValue or Failed when there are none."""
    remote = remote_of(deployment, host)
    if address.port == 0 or address.is_wildcard:
        raise BadValue("a unit needs the address at which the supervisor always listens (--listen)", str(address))
    if address.is_loopback and remote.host.address not in ("localhost", address.host):
        raise BadValue(f"host {host} cannot connect to the supervisor there (--listen)", str(address))
    if address.protocol == "tls" and remote.host.pki is None:
        raise Failed(f"host {host} has no certificates: set hosts.{host}.pki to their folder on it")
    nodes = [name for name, place in places(deployment).items() if place == host and name in deployment.nodes]
    if not nodes:
        raise Failed(f"no node is placed on host {host}")
    return {unit_name(node): unit_text(remote, node, address, deployment.world, is_users) for node in nodes}
