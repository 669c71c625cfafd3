"""Access control: who may put, hear and be present on which key of a plane. Generated from the deployment and the
table of channels, which alone spells the keys.

A node writes and hears what nodes do, under its own name; a client writes its own transmit key and hears its own
receive key; an operator writes requests and hears their answers, looks at the run, and hears replays; a viewer looks at
the run. What is not granted is denied.
The routers of the planes enforce it, each for those who connect to it, so it says nothing of a router's own messages.
Zenoh tells nobody what it denies.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from foosim.deployment.schema import Deployment
from foosim.protocol import channels, identity
from foosim.protocol.channels import ALIVE, CHANNELS, REPLAY, SUPERVISOR, VHUB, Channel, Plane

Reads = Sequence[tuple[Channel, bool]]

EVERYBODY: Final = "all"
"""As the table of channels says it of a channel that all processes of the simulation plane write."""
ROUTERS: Final = {Plane.SIMULATION: SUPERVISOR, Plane.RADIO: VHUB, Plane.REPLAY: REPLAY}
"""Whose session is the router of a plane."""
_READS: Final[dict[str, Reads]] = {
    "node": channels.NODE_READS,
    VHUB: channels.VHUB_READS,
    SUPERVISOR: channels.SUPERVISOR_READS,
    "client": channels.CLIENT_READS,
    REPLAY: channels.REPLAY_READS,
    "operator": (*channels.OPERATOR_READS, *channels.VIEW_READS, *channels.LISTENER_READS),
    "viewer": (*channels.OPERATOR_READS, *channels.VIEW_READS),
}
_PLANES: Final = {
    "node": (Plane.SIMULATION,),
    VHUB: (Plane.SIMULATION,),
    "operator": (Plane.SIMULATION, Plane.REPLAY),
    "viewer": (Plane.SIMULATION,),
    "client": (Plane.RADIO,),
}
"""Who connects to which planes' routers. A replay has everybody's packets, so it is for operators."""

PEOPLE: Final = ("operator", "viewer")
"""Each has many sessions at once, with ends of their own to the name, behind a dot, and is never present."""


@dataclass(frozen=True, slots=True)
class Grant:
    """What one identity may do on a plane, as key expressions."""

    identity: str
    name: str
    writes: tuple[str, ...]
    """It may put here."""
    reads: tuple[str, ...]
    """It may subscribe to these and hears what is put on them."""
    interests: tuple[str, ...]
    """It is told that others subscribe to these: what nobody hears, Zenoh does not send."""
    alive: str
    """It may be present here; empty when it never is."""
    watches: str
    """It hears whether this one, its router, is present."""


@dataclass(frozen=True, slots=True)
class Access:
    """Everybody's grants on one plane. `uses_passwords`: they prove who they are by user and password."""

    plane: Plane
    grants: tuple[Grant, ...]
    uses_passwords: bool = False


def access_to(plane: Plane, deployment: Deployment) -> Access:
    """Return who may do what on a plane of a run."""
    roles = [role for role, its in _PLANES.items() if plane in its]
    grants = [grant(who, plane) for who in identity.identities_of(deployment) if _role(who) in roles]
    return Access(plane, tuple(grants), plane is Plane.RADIO and deployment.access.radio == "password")


def grant(who: str, plane: Plane) -> Grant:
    """Return what an identity may do on a plane to which it connects."""
    role, name = identity.parse_identity(who)
    key_name = f"{name}.$*" if role in PEOPLE else name
    written = [channel for channel in CHANNELS if channel.plane is plane and _writes(role, channel)]
    presence = ALIVE[plane]
    return Grant(
        identity=who,
        name=name,
        writes=tuple(channel.key_for(key_name) for channel in written),
        reads=tuple(_each(_READS[role], plane, lambda channel, own: _declared(channel, key_name if own else "*"))),
        interests=tuple(sorted({expression for channel in written for expression in _readers(channel, key_name)})),
        alive="" if role in PEOPLE else presence.replace("{name}", name),
        watches=presence.replace("{name}", ROUTERS[plane]),
    )


def _role(who: str) -> str:
    return identity.parse_identity(who)[0]


def _writes(role: str, channel: Channel) -> bool:
    writers = channel.writers.split(", ")
    known = role in writers
    return known or (writers == [EVERYBODY] and role in ("node", VHUB))


def _declared(channel: Channel, name: str) -> str:
    """Return what covers all that a reader declares: a key, also with what would lie below it (`Session.receive`)."""
    return f"{channel.key_for(name).removesuffix('/*')}/**"


def _each(reads: Reads, plane: Plane, expression: Callable[[Channel, bool], str]) -> Iterable[str]:
    return (expression(channel, own) for channel, own in reads if channel.plane is plane)


def _readers(channel: Channel, writer: str) -> set[str]:
    """Return the key expressions by which a writer may learn that somebody hears it: as a reader declares them, and
    the writer's own key, as which a router may give their sum."""
    heard = any(channel is read and not own for reads in _READS.values() for read, own in reads)
    return {_declared(channel, "*"), channel.key_for(writer)} if heard else {channel.key_for(writer)}


# --- as Zenoh takes it -----------------------------------------------------------------------------------------------

_FLOWS: Final = (
    # what, flow, messages of Zenoh, field of the grant: ingress is from the one who connected
    ("write", "ingress", ("put",), "writes"),
    ("read", "ingress", ("declare_subscriber",), "reads"),
    ("hear", "egress", ("put",), "reads"),
    ("interest", "egress", ("declare_subscriber",), "interests"),
    ("alive", "ingress", ("liveliness_token",), "alive"),
    ("watch", "ingress", ("declare_liveliness_subscriber", "liveliness_query"), "watches"),
    ("presence", "egress", ("liveliness_token",), "watches"),
)


def access_control(access: Access) -> dict[str, Any]:
    """Return the grants as Zenoh's `access_control`."""
    rules, subjects, policies = [], [], []
    for its in access.grants:
        named = []
        for what, flow, messages, field in _FLOWS:
            keys = getattr(its, field)
            keys = [keys] if isinstance(keys, str) else list(keys)
            if keys and keys != [""]:
                named.append(f"{its.identity} {what}")
                rules.append(_rule(named[-1], flow, messages, keys))
        proof = {"usernames": [its.name]} if access.uses_passwords else {"cert_common_names": [its.identity]}
        subjects.append({"id": its.identity, "link_protocols": ["tls"], **proof})
        policies.append({"subjects": [its.identity], "rules": named})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _rule(name: str, flow: str, messages: tuple[str, ...], keys: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": [flow], "messages": list(messages), "key_exprs": keys}
