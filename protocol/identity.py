"""Identities, which certificates carry: `supervisor`, `vhub`, `node.NAME`, `client.NAME` (players too),
`process.NAME` (a process with several of these roles), `operator.NAME` (a person or a script that controls the run),
`viewer.NAME` (one that only watches it).

An identity is the common name of a certificate and the stem of its files.
"""

from __future__ import annotations

from typing import Final

from foosim.common.errors import BadValue
from foosim.common.names import is_name
from foosim.deployment.processes import Process, is_joint, joint_processes
from foosim.deployment.schema import SUPERVISOR, VHUB, Deployment

ROLES: Final = ("node", "client", "process", "operator", "viewer")
"""Roles of which there are several, distinguished by name."""
FORMS: Final = "supervisor, vhub, node.NAME, client.NAME, process.NAME, operator.NAME or viewer.NAME"


def of_role(role: str, deployment: Deployment) -> str:
    """Return the identity of a role: of the supervisor, the vHub, a node or a player."""
    if role in (SUPERVISOR, VHUB):
        return role
    return f"node.{role}" if role in deployment.nodes else f"client.{role}"


def of_process(its: Process, deployment: Deployment) -> list[str]:
    """Return the identities that a process needs: as a router, as a client of the simulation plane, and of players and
    gateways.

    Beside the supervisor nodes need none, beside the vHub players.
    """
    routers: list[str] = [role for role in (SUPERVISOR, VHUB) if role in its.roles]
    nodes = [f"node.{role}" for role in its.roles if role in deployment.nodes and SUPERVISOR not in its.roles]
    players = [f"client.{role}" for role in its.roles if role in deployment.players and VHUB not in its.roles]
    gateways = [(role, deployment.gateways[role]) for role in its.roles if role in deployment.gateways]
    players += [f"client.{name}" for role, gateway in gateways for name in gateway.clients(role).values()]
    return [*routers, *([f"process.{its.name}"] if is_joint(its, deployment) else nodes), *players]


def parse_identity(text: str) -> tuple[str, str]:
    """Return role and name, the name of supervisor and vHub being their role; raises BadValue."""
    if text in (SUPERVISOR, VHUB):
        return text, text
    role, _, name = text.partition(".")
    if role not in ROLES or not is_name(name) or name in (SUPERVISOR, VHUB):
        raise BadValue(f"not an identity ({FORMS})", text)
    return role, name


def identities_of(deployment: Deployment) -> list[str]:
    """Return all identities of a run: servers first, others by role and name."""
    names = (
        ("node", deployment.nodes),
        ("client", [*deployment.players, *deployment.clients]),
        ("process", joint_processes(deployment)),
        ("operator", deployment.access.operators),
        ("viewer", deployment.access.viewers),
    )
    return [SUPERVISOR, VHUB, *(f"{role}.{name}" for role, each in names for name in sorted(each))]
