"""Access control: which identity may put, subscribe and be present on which key of a plane. Generated from the
deployment and the table of channels, the only place with the keys.

A node puts and receives the messages of nodes, under its own name. A client puts on its own transmit key and receives
its own receive key. An operator puts requests and receives their answers, commits for display, and replays. A viewer
receives commits for display. Everything else is denied. The routers of the planes enforce the grants for the sessions
that connect to them; a router's own messages are not checked. Zenoh reports no denial to the denied.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from foosim.deployment.processes import joint_processes
from foosim.deployment.schema import Deployment
from foosim.protocol import channels, identity
from foosim.protocol.channels import ALIVE, CHANNELS, REPLAY, SUPERVISOR, VHUB, Channel, Plane

Reads = Sequence[tuple[Channel, bool]]

EVERYBODY: Final = "all"
"""The value of `Channel.writers` of a channel that all processes of the simulation plane write."""
ROUTERS: Final = {Plane.SIMULATION: SUPERVISOR, Plane.RADIO: VHUB, Plane.REPLAY: REPLAY}
"""The role whose session is the router of a plane."""
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
"""The roles that connect to the router of each plane. A replay has all packets, so it is for operators."""

PEOPLE: Final = ("operator", "viewer")
"""Roles with several sessions at once, named NAME.RANDOM, and without presence."""


@dataclass(frozen=True, slots=True)
class Grant:
    """The grants of one identity on a plane, as key expressions."""

    identity: str
    name: str
    writes: tuple[str, ...]
    """Keys on which it may put."""
    reads: tuple[str, ...]
    """Keys to which it may subscribe."""
    interests: tuple[str, ...]
    """Keys whose subscribers it learns of: Zenoh sends nothing without a subscriber."""
    alive: tuple[str, ...]
    """The keys of its presence: one for each role; none for people."""
    watches: str
    """The key of its router's presence, which it may read."""


@dataclass(frozen=True, slots=True)
class Access:
    """All grants on one plane."""

    plane: Plane
    grants: tuple[Grant, ...]


def access_to(plane: Plane, deployment: Deployment) -> Access:
    """Return the grants of all identities on a plane of a run."""
    roles = [role for role, its in _PLANES.items() if plane in its]
    grants = [grant(who, plane) for who in identity.identities_of(deployment) if _role(who) in roles]
    for process in joint_processes(deployment).values() if plane is Plane.SIMULATION else ():
        members = [identity.of_role(role, deployment) for role in process.roles]
        grants.append(_union(process.name, [grant(who, plane) for who in members if _role(who) in roles]))
    return Access(plane, tuple(grants))


def grant(who: str, plane: Plane) -> Grant:
    """Return the grants of an identity on a plane to which it connects."""
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
        alive=() if role in PEOPLE else (presence.replace("{name}", name),),
        watches=presence.replace("{name}", ROUTERS[plane]),
    )


def _union(process: str, grants: Sequence[Grant]) -> Grant:
    """Return the grants of a process, which has the roles of several identities."""

    def each(keys: Callable[[Grant], Sequence[str]]) -> tuple[str, ...]:
        return tuple(sorted({key for its in grants for key in keys(its)}))

    return Grant(
        identity=f"process.{process}",
        name=process,
        writes=each(lambda its: its.writes),
        reads=each(lambda its: its.reads),
        interests=each(lambda its: its.interests),
        alive=each(lambda its: its.alive),
        watches=grants[0].watches,
    )


def _role(who: str) -> str:
    return identity.parse_identity(who)[0]


def _writes(role: str, channel: Channel) -> bool:
    writers = channel.writers.split(", ")
    known = role in writers
    return known or (writers == [EVERYBODY] and role in ("node", VHUB))


def _declared(channel: Channel, name: str) -> str:
    """Return a key expression that covers all declarations of a reader: a key and keys below it (`Session.receive`)."""
    return f"{channel.key_for(name).removesuffix('/*')}/**"


def _each(reads: Reads, plane: Plane, expression: Callable[[Channel, bool], str]) -> Iterable[str]:
    return (expression(channel, own) for channel, own in reads if channel.plane is plane)


def _readers(channel: Channel, writer: str) -> set[str]:
    """Return the key expressions by which a writer may learn of subscribers: as readers declare them, and its own key,
    as which a router may announce their union."""
    heard = any(channel is read and not own for reads in _READS.values() for read, own in reads)
    return {_declared(channel, "*"), channel.key_for(writer)} if heard else {channel.key_for(writer)}


# --- Zenoh's configuration -------------------------------------------------------------------------------------------

_FLOWS: Final = (
    # right, flow, messages of Zenoh, field of the grant: ingress is from the connected session
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
        subjects.append({"id": its.identity, "link_protocols": ["tls"], "cert_common_names": [its.identity]})
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
