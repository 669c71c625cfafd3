"""The handshake of a process with the supervisor, as the process sees it: hello, build, ready, and the heartbeat.

Hello and ready are repeated until they are answered, because a declared subscriber may not be known to the other side
yet. A restarted supervisor recalls the members: hello, build and ready once more, while a process keeps what it has
computed. Shared by node and vHub.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Final, Literal

from foosim.common import limits
from foosim.common.errors import DeploymentError, Malformed, Refused
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Action, Log, Publish
from foosim.protocol.asset_transfer import Fetching
from foosim.protocol.codec import encode
from foosim.protocol.messages import (
    Build,
    ComponentVersion,
    Epoch,
    FailedComponent,
    Fetch,
    Heartbeat,
    Hello,
    Piece,
    Ready,
    Recall,
    Refusal,
)
from foosim.world.assembly.versions import foreign_versions
from foosim.world.components.view import ComponentError
from foosim.world.layout import Layout, build_layout
from foosim.world.matter.mesh import AssetError

AGAIN_NS: Final = 200_000_000


def sendable(text: str) -> str:
    """Return a text without characters outside UTF-8, such as in an error of a user's code."""
    return text.encode(errors="replace").decode()


class NotValidHere(Refused):
    """The run's deployment cannot be used on this machine: it lacks a package, or a component fails here."""


def failed_component(error: ComponentError) -> tuple[str, FailedComponent]:
    """Return the traceback of a component that has raised, and its report in a heartbeat."""
    trace = sendable("".join(traceback.format_exception(error.cause)))
    component, end = error.component[: limits.TEXT_LENGTH_MAX], trace[-limits.TEXT_LENGTH_MAX :]
    return trace, FailedComponent(error.entity, component, error.tick, end)


class Member:
    """The state of one process's membership. Messages to send go to `actions`."""

    def __init__(
        self,
        role: Literal["node", "vhub"],
        name: str,
        boot: str,
        fingerprint: bytes,
        world: str,
        actions: list[Action],
        now_ns: int,
    ) -> None:
        self.role = role
        self.name = name
        self.boot = boot
        self.refusal = ""
        self.problem = ""
        """Why the run's deployment cannot be used on this machine."""
        self._not_valid: str | None = None
        """The deployment with this problem; another one may still be valid."""
        self.build: Build | None = None
        self._known: Build | None = None
        """The build of the present world, also outside of an epoch."""
        self.deployment: Deployment | None = None
        self.layout: Layout | None = None
        """The layout of the world at the build."""
        self.deadline_ns = now_ns
        self.is_ready = False
        self.simulation = b""
        """A node's digest of a fixed short run of its engine, once it has one."""
        self.meshes = bytes(32)
        """A node's digest of the meshes and hulls of its world, once it has one."""
        self._fingerprint = fingerprint
        self._world = world
        self._actions = actions
        self._entered = False
        self._entered_by = ""
        """Boot of the supervisor of the last epoch with this process."""
        self._coming: tuple[Build, Deployment, Fetching] | None = None
        """A build whose files are being fetched."""
        self._files: dict[str, bytes] = {}
        """Files of earlier builds, by digest."""
        self._recalled_by = ""
        """Boot of a supervisor that has recalled this process and not answered its hello yet."""
        self.standing: Callable[[], Action] | None = None
        """Returns the message to publish before each ready (vHub)."""

    def take_build(self, build: Build | Piece) -> bool:
        """Accept the supervisor's answer to hello, and then the files that it refers to; True when all have arrived.

        False also for a message to another boot, or a duplicate. Raises NotValidHere: this process cannot take part.
        """
        if build.boot != self.boot or (isinstance(build, Build) and build.deployment == self._not_valid):
            return False
        if self.build is not None:
            return isinstance(build, Build) and self._take_again(build)
        if isinstance(build, Build):
            if self._coming is None and self._is_of_this_run(build):
                self._begin_build(build)
        elif self._coming is not None and self._coming[2].take(build):
            self.deadline_ns = 0  # the next one follows at once
        if self._coming is None or self._coming[2].lacking is not None:
            return False
        self._end_build(*self._coming)
        return True

    @property
    def is_fetching(self) -> bool:
        """Whether files of the build are being fetched."""
        return self._coming is not None

    def _begin_build(self, build: Build) -> None:
        try:
            deployment = load_deployment(build.deployment, build.deployment_name)
        except DeploymentError as error:
            raise self._invalid(build, f"the deployment is not valid on its machine: {error.problems[0]}") from None
        if self.role == "node" and (lack := deployment.engine_type.lack):
            raise self._invalid(build, f"its machine cannot compute the run: {lack}")
        if not deployment.lacks_files:  # else when they have come
            build_layout(deployment)
        self._coming = build, deployment, Fetching(deployment.files(drawn=self._draws(deployment)), self._files)
        self.deadline_ns = 0

    def _end_build(self, build: Build, deployment: Deployment, fetching: Fetching) -> None:
        self._coming, self._files = None, fetching.files
        try:
            deployment = deployment.with_assets(fetching.contents(), drawn=self._draws(deployment))
        except AssetError as error:
            raise self._invalid(build, f"a file of the deployment is not valid on its machine: {error}") from None
        self.deployment, self.layout = deployment, build_layout(deployment)
        self.build = self._known = build
        self.problem = ""
        self.deadline_ns = 0  # the first heartbeat follows at once: the vHub's carries the address of the radio plane
        self._world = deployment.world

    def _draws(self, deployment: Deployment) -> bool:
        """Whether this process needs what robots look like: a node does for the view of cameras alone."""
        return self.role != "node" or deployment.has_drawn_readings

    def _invalid(self, build: Build, what: str) -> NotValidHere:
        self._not_valid = build.deployment
        self.problem = sendable(f"lost {self.name}: {what}")[: limits.TEXT_LENGTH_MAX]
        self._coming, self.deadline_ns = None, 0
        self._actions.append(Log("error", self.problem))
        return NotValidHere(self.problem)

    def _fetch(self, fetching: Fetching) -> None:
        """Request the next missing piece."""
        assert fetching.lacking is not None
        digest, offset = fetching.lacking
        fetch = Fetch(self.name, self.boot, bytes.fromhex(digest), offset)
        self._actions.append(Publish(channels.FETCH, self.name, encode(fetch)))

    @property
    def first_tick(self) -> int:
        """The tick of the run's first frame."""
        return 0 if self.build is None or self.build.origin is None else self.build.origin.tick

    def _is_of_this_run(self, build: Build) -> bool:
        """Whether a build is of the run that this process has built the world of, or the first one."""
        if self._known is None or (build.run, build.deployment) == (self._known.run, self._known.deployment):
            return True
        self.refusal = f"the supervisor is that of run {build.run}, this process belongs to {self._known.run}"
        self._actions.append(Log("error", self.refusal))
        return False

    def _take_again(self, build: Build) -> bool:
        """Accept the answer of the supervisor that has recalled this process, if it is of the same run."""
        if not self._recalled_by or self.deployment is None:
            return False
        if not self._is_of_this_run(build):
            return False
        self._recalled_by = ""
        self.build = build
        self.deadline_ns = 0
        return True

    def recall(self, recall: Recall) -> bool:
        """Send a hello to a supervisor that misses this process, unless it is the known one."""
        if self.build is None or recall.boot in (self.build.supervisor, self._recalled_by):
            return False
        self._actions.append(Log("warning", "recalled by a restarted supervisor"))
        self._recalled_by = recall.boot
        self._entered = False
        self.deadline_ns = 0
        return True

    def refuse(self, refusal: Refusal) -> bool:
        """Accept a refusal; False when it is addressed to another boot."""
        if refusal.boot != self.boot:
            return False
        self.refusal = refusal.reason
        self._actions.append(Log("error", f"refused by the supervisor: {refusal.reason}"))
        return True

    def check_epoch(self, epoch: Epoch) -> None:
        """Raise `Malformed` unless every robot has one owner that is a member."""
        assert self.deployment is not None
        owners, roster = dict(epoch.owners), set(epoch.roster)
        if len(owners) != len(epoch.owners) or owners.keys() != self.deployment.robots.keys():
            raise Malformed(f"epoch {epoch.epoch}: owners of {len(epoch.owners)} robots, not of each robot once")
        if not set(owners.values()) <= roster or len(roster) != len(epoch.roster):
            raise Malformed(f"epoch {epoch.epoch}: a roster of {', '.join(epoch.roster)} without every owner once")

    def ready(self) -> None:
        """Report that the world is built."""
        assert self.layout is not None
        self.is_ready = True
        if self.standing is not None:
            self._actions.append(self.standing())
        versions = foreign_versions(self.deployment) if self.role == "node" and self.deployment is not None else {}
        components = [ComponentVersion(name, version) for name, version in versions.items()]
        arithmetic = self.simulation or self._fingerprint
        ready = Ready(self.name, self.boot, self.layout.digest, arithmetic, self.meshes, components)
        self._actions.append(Publish(channels.READY, self.name, encode(ready)))

    def entered(self) -> None:
        """An epoch with this process has begun: nothing is repeated."""
        self._entered = True
        self._entered_by = "" if self.build is None else self.build.supervisor

    def repeated(self, is_present: bool) -> None:
        """Handle a duplicate of an epoch; the current one answers a repeated ready.

        A supervisor that has recalled this process begins a new epoch, so a duplicate is of an earlier one.
        """
        is_known = self.build is not None and self.build.supervisor == self._entered_by and not self._recalled_by
        self._entered = self._entered or (is_present and is_known)

    def begin_anew(self) -> None:
        """Begin the handshake again, because the run continues without this process. What was built stays."""
        self.build = self._coming = None
        self.is_ready = self._entered = False
        self._recalled_by = ""
        self.deadline_ns = 0

    def wake(self, now_ns: int, heartbeat: Callable[[], Heartbeat]) -> None:
        """Send hello or ready again and the heartbeat, each when it is due."""
        if now_ns < self.deadline_ns:
            return
        if self.refusal:
            self.deadline_ns = now_ns + AGAIN_NS
            return
        if self.problem:
            self._actions.append(Publish(channels.HEARTBEAT, self.name, encode(heartbeat())))
            self.deadline_ns = now_ns + limits.HEARTBEAT_NS
            return
        if self._coming is not None:
            self._fetch(self._coming[2])
            self._actions.append(Publish(channels.HEARTBEAT, self.name, encode(heartbeat())))
            self.deadline_ns = now_ns + AGAIN_NS
            return
        if self.build is None or self._recalled_by:
            hello = Hello(self.role, self.name, self.boot, limits.PROTOCOL_VERSION, self._world, self._fingerprint)
            self._actions.append(Publish(channels.HELLO, self.name, encode(hello)))
            self.deadline_ns = now_ns + AGAIN_NS
            if self.build is None:
                return
        elif not self._entered and self.is_ready:
            self.ready()
        self._actions.append(Publish(channels.HEARTBEAT, self.name, encode(heartbeat())))
        self.deadline_ns = now_ns + limits.HEARTBEAT_NS
