"""Identities, which certificates carry: `supervisor`, `vhub`, `node.NAME`, `client.NAME` (players too),
`operator.NAME` (a person or a script that controls the run), `viewer.NAME` (one that only watches it).

An identity is the common name of a certificate and the stem of its files.
"""

from __future__ import annotations

from typing import Final

from foosim.common.errors import BadValue
from foosim.common.names import is_name
from foosim.deployment.schema import Deployment
from foosim.protocol.channels import SUPERVISOR, VHUB

ROLES: Final = ("node", "client", "operator", "viewer")
"""Roles of which there are several, told apart by name."""
FORMS: Final = "supervisor, vhub, node.NAME, client.NAME, operator.NAME or viewer.NAME"


def node(name: str) -> str:
    """Return the identity of a node."""
    return f"node.{name}"


def client(name: str) -> str:
    """Return the identity of a client, or of a player."""
    return f"client.{name}"


def operator(name: str) -> str:
    """Return the identity of an operator."""
    return f"operator.{name}"


def viewer(name: str) -> str:
    """Return the identity of a viewer."""
    return f"viewer.{name}"


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
    return [
        SUPERVISOR,
        VHUB,
        *map(node, sorted(deployment.nodes)),
        *map(client, sorted([*deployment.players, *deployment.clients])),
        *map(operator, sorted(deployment.access.operators)),
        *map(viewer, sorted(deployment.access.viewers)),
    ]
