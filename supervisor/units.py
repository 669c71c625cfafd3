"""The unit of systemd that runs a node on its host: its text.

Where systemd restarts a node, the run goes on without it and takes it in again, as with a node that `up` started. Pure;
neighbours: `install` writes it onto the host, `remote` starts it, `protocol.notify` is what it is told.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Final

from foosim.protocol.addresses import Address
from foosim.protocol.command import BAD_INPUT, REFUSED
from foosim.protocol.deployment import Deployment
from foosim.protocol.errors import BadValue, Failed
from foosim.protocol.hosts import places
from foosim.protocol.names import nearest_name
from foosim.supervisor.remote import Remote, unit_name

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
# Ready is who has found the supervisor, whenever that comes.
TimeoutStartSec=infinity
TimeoutStopSec=10
# The loop says that it goes on; one that hangs is killed, and started again.
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


def node_command(remote: Remote, node: str, address: Address, world: str) -> list[str]:
    """Return what the unit of a node runs."""
    return [remote.path("foosim-node"), "--name", node, "--connect", str(address), "--world", world]


def unit_text(remote: Remote, node: str, address: Address, world: str, is_users: bool) -> str:
    """Return the unit of a node; `is_users` is one of a user's own systemd, not of the system's."""
    return _UNIT.format(
        node=node,
        world=world,
        host=remote.name,
        unit=unit_name(node),
        command=_escaped(node_command(remote, node, address, world)),
        watchdog_s=WATCHDOG_S,
        prevent=f"{BAD_INPUT} {REFUSED}",
        memory=MEMORY_MAX,
        tasks=TASKS_MAX,
        user="" if is_users else _SYSTEM,
        wanted_by="default.target" if is_users else "multi-user.target",
    )


def _escaped(words: Sequence[str]) -> str:
    """Return a command line as systemd reads it: % and $ stand for themselves."""
    return shlex.join(words).replace("%", "%%").replace("$", "$$")


def units_of(deployment: Deployment, host: str, address: Address, is_users: bool) -> dict[str, str]:
    """Return the units of a host's nodes, by file name. Raises BadValue or Failed when there are none."""
    if host not in deployment.hosts:
        raise BadValue("unknown host", host, nearest_name(host, deployment.hosts))
    if address.port == 0 or address.is_wildcard:
        raise BadValue("a unit needs the address at which the supervisor always listens (--listen)", str(address))
    remote = Remote(host, deployment.hosts[host])
    if address.is_loopback and remote.host.address not in ("localhost", address.host):
        raise BadValue(f"host {host} cannot connect to the supervisor there (--listen)", str(address))
    nodes = [name for name, place in places(deployment).items() if place == host and name in deployment.nodes]
    if not nodes:
        raise Failed(f"no node is placed on host {host}")
    return {unit_name(node): unit_text(remote, node, address, deployment.world, is_users) for node in nodes}
