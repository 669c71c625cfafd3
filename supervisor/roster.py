"""The processes that take part, and the checks that admit them.

A hello is checked for protocol version, world, a free and declared name, and the arithmetic fingerprint; the first
layout that a node has built is checked for the digest of a small run of its engine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from foosim.common import limits
from foosim.common.errors import show
from foosim.common.names import nearest_name
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Action, Log, Publish
from foosim.protocol.channels import VHUB
from foosim.protocol.codec import encode
from foosim.protocol.messages import Heartbeat, Hello, Ready, Refusal
from foosim.world.assembly.versions import foreign_versions

SILENT_NS: Final = 3 * limits.HEARTBEAT_NS
"""A process that lives is not silent for so long, unless its machine or its loop is suspended."""
IN_FLIGHT_NS: Final = 500_000_000
"""How long the last messages of a process may take after its connection has closed: they do not mean that it is back.
"""
ROLES: Final[tuple[str, ...]] = ("node", "vhub")


@dataclass
class Process:
    """One process of the run."""

    role: str
    name: str
    boot: str
    ready: bool = False
    """Whether it has built the world."""
    arithmetic: bytes = b""
    """A node's digest of a fixed small run of its engine, once it has one."""
    last_message_ns: int = 0
    heartbeat: Heartbeat | None = None
    report: dict[str, Any] = field(default_factory=dict)
    farewell: bool = False
    closed_ns: int = 0
    in_doubt: bool = False
    """Its connection has ended, possibly by a standstill of the supervisor."""
    lost: bool = False
    """The run continues without it; it may rejoin by the handshake."""


class Roster:
    """The processes of a run, by name."""

    def __init__(self, deployment: Deployment, fingerprint: bytes) -> None:
        self.deployment = deployment
        self.by_name: dict[str, Process] = {}
        self.stopped: set[str] = set()
        """Nodes that an operator stopped: they are refused until an operator starts them."""
        self.starts: dict[str, int] = {}
        """Number of start requests by node; a launcher that sees it grow starts the node's process."""
        self.hub_account: dict[str, Any] = {}
        """The last report of a vHub with its state: a restarted one has none before it has read it."""
        self._fingerprint = fingerprint
        self._simulation = self._meshes = b""

    @property
    def expected(self) -> list[str]:
        """Names of the nodes and the vHub that the deployment declares."""
        return [*sorted(self.deployment.nodes), VHUB]

    @property
    def arithmetic(self) -> bytes:
        """The digest of the fixed small run that all nodes share; empty when there is none, or several."""
        digests = {process.arithmetic for process in self.by_name.values() if process.arithmetic}
        return digests.pop() if len(digests) == 1 else b""

    def reason_against(self, hello: Hello) -> str:
        """Return why this process cannot take part, or an empty string."""
        if hello.version != limits.PROTOCOL_VERSION:
            return f"protocol version {hello.version}, this is {limits.PROTOCOL_VERSION}"
        if hello.world not in ("", self.deployment.world):
            return f"world {hello.world}, this is {self.deployment.world}"
        if hello.role not in ROLES:
            return f"role {show(hello.role)}, there are {', '.join(ROLES)}"
        choices = [VHUB] if hello.role == "vhub" else sorted(self.deployment.nodes)
        if hello.name not in choices:
            nearest = nearest_name(hello.name, choices)
            hint = f", nearest is {nearest}" if nearest else ""
            return f"no {hello.role} {show(hello.name)} is declared; declared are {', '.join(choices)}{hint}"
        if hello.name in self.stopped:
            return f"{hello.name} is stopped; `foosim start {hello.name}` lets it take part again"
        known = self.by_name.get(hello.name)
        if known is not None and known.boot != hello.boot and not known.lost and not known.in_doubt:
            return f"a {known.role} {hello.name} is already here"
        if hello.fingerprint != self._fingerprint and not self.deployment.mixed_cpu:
            return (
                f"arithmetic fingerprint {hello.fingerprint.hex()[:16]}, this is {self._fingerprint.hex()[:16]}: "
                "its results would differ (the deployment may say mixed_cpu: true)"
            )
        return ""

    def has_silent_namesake(self, hello: Hello, now_ns: int) -> bool:
        """Whether another process of this name takes part and has missed some heartbeats: it may be gone."""
        known = self.by_name.get(hello.name)
        is_other = known is not None and known.boot != hello.boot and not known.lost
        return known is not None and is_other and now_ns - known.last_message_ns > SILENT_NS

    def take(self, hello: Hello, now_ns: int) -> Process:
        """Note a process whose hello was accepted; a lost one begins anew."""
        known = self.by_name.get(hello.name)
        if known is None or known.lost:
            known = self.by_name[hello.name] = Process(hello.role, hello.name, hello.boot, last_message_ns=now_ns)
        return known

    def hear(self, process: Process, report: dict[str, Any]) -> None:
        """Note the report of a process."""
        process.report = report
        if process.name == VHUB and "packets" in report:
            self.hub_account = report

    @property
    def is_hub_away(self) -> bool:
        """Whether the vHub that gave the last account is gone, and no other has given one since."""
        hub = self.by_name.get(VHUB)
        return bool(self.hub_account) and (hub is None or hub.lost or hub.report is not self.hub_account)

    def lose(self, process: Process) -> None:
        """Exclude a process until it sends a hello again."""
        process.lost = True

    def note_ready(self, process: Process, ready: Ready, layout: bytes) -> str:
        """Note that a process has built the world; return why it cannot take part after all, or an empty string.

        `layout` is the digest of the layout that is to be built.
        """
        if ready.layout != layout:
            self.by_name.pop(process.name)
            return "its world has another layout than the supervisor's: install the same version on all machines"
        if process.role == "node":
            there = {one.name: one.version for one in ready.components}
            differing = _differing(there, foreign_versions(self.deployment))
            if differing:
                self.by_name.pop(process.name)
                return differing
            if not self._simulation:
                self._simulation, self._meshes = ready.fingerprint, ready.meshes
            if ready.meshes != self._meshes and not self.deployment.mixed_cpu:
                self.by_name.pop(process.name)
                return (
                    f"it has read other meshes or hulls from the same files, with digest {ready.meshes.hex()[:16]}, "
                    f"the first node's is {self._meshes.hex()[:16]}: install the same versions of numpy and pycollada "
                    "on all machines (the deployment may say mixed_cpu: true)"
                )
            if ready.fingerprint != self._simulation and not self.deployment.mixed_cpu:
                self.by_name.pop(process.name)
                return (
                    f"a fixed small run of its engine has digest {ready.fingerprint.hex()[:16]}, the first node's is "
                    f"{self._simulation.hex()[:16]}: its results would differ (the deployment may say mixed_cpu: true)"
                )
            process.arithmetic = ready.fingerprint
        process.ready = True
        return ""

    def missing(self) -> list[str]:
        """Return the declared processes that are still to be ready."""
        here = {name for name, process in self.by_name.items() if not process.lost and process.ready}
        return [name for name in self.expected if name not in here]

    def silent(self, now_ns: int, deadline_ns: int) -> list[str]:
        """Return the processes without a heartbeat for longer than the deadline."""
        return [
            name
            for name, process in sorted(self.by_name.items())
            if now_ns - process.last_message_ns > deadline_ns and not process.farewell and not process.lost
        ]


def _differing(there: Mapping[str, str], here: Mapping[str, str]) -> str:
    """Return which component has another version in a node than in the supervisor, empty if none has."""
    for name in sorted({*there, *here}):
        if there.get(name) != here.get(name):
            versions = there.get(name, "missing"), here.get(name, "missing")
            return f"{name} has version {versions[0]} there and {versions[1]} here: install the same on all machines"
    return ""


def refuse(role: str, name: str, boot: str, reason: str) -> list[Action]:
    """Return the actions that refuse a process, with the reason."""
    refusal = encode(Refusal(name, boot, reason))
    return [Log("warning", f"{role} {name} refused: {reason}"), Publish(channels.REFUSAL, name, refusal)]
