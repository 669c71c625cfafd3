"""The base class of gateways: what carries a run to the programs of another middleware.

A gateway sees its run as a `Run` (run.py): components of robots under the names of MORSE, whose fields and services are
those of the rows (rows.py). All of it is on one asyncio loop, on one thread.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, ClassVar, Final, NamedTuple

from foosim.common.errors import BadValue, UnknownName
from foosim.common.finding import Finding
from foosim.deployment.schema import Deployment
from foosim.gateways.components import components_of, robots_of
from foosim.gateways.rows import Component
from foosim.gateways.run import Listener, Run
from foosim.gateways.supervision import Supervision
from foosim.world.component_types.settings import GatewaySettings


class Peer(NamedTuple):
    """A program at a gateway: its address, what it is connected to, and the messages to and from it so far."""

    name: str
    what: str
    messages: int


class Gateway(Listener):
    """A kind of gateway. The hooks do nothing."""

    type_name: ClassVar = "gateway"

    def __init__(self, settings: Any, run: Run, supervision: Supervision) -> None:
        """`settings` are of the class with which the kind is registered."""
        self.settings: Final = settings
        self.run: Final = run
        self.supervision: Final = supervision
        self.log: Final = logging.getLogger(run.name)

    @staticmethod
    def check(name: str, settings: GatewaySettings, deployment: Deployment) -> Iterable[Finding]:
        """Yield problems of the settings of the gateway `name`, by the place below it."""
        yield from check_components(name, settings, deployment)

    def draws(self, component: Component) -> bool:
        return True

    async def open(self) -> str:
        """Listen; return where, for the log. Raises Refused."""
        return ""

    def go(self) -> bool:
        """A tick waits for the gateway, whose settings have `sync`; return whether it may continue, else call
        `run.proceed()` later."""
        return True

    def peers(self) -> Iterator[Peer]:
        """Yield the programs that are connected."""
        yield from ()

    async def close(self) -> None:
        """Close all connections; what was to be written is written."""


def check_components(name: str, settings: GatewaySettings, deployment: Deployment) -> Iterator[Finding]:
    """Yield components in `classes` and `alter` that the gateway does not serve, and unknown classes and frames."""
    served: Mapping[str, Component] = {}
    for section, its in (("classes", settings.model_copy(update={"alter": {}})), ("alter", settings)):
        try:
            served = components_of(deployment, its)
        except BadValue as bad:
            yield Finding(("gateways", name, section), bad.problem, bad.value, bad.nearest)
            return
    known = robots_of(deployment, settings)
    if doubled := [robot for robot in settings.robots if robot not in known.values()]:
        what = "two robots with one name for programs; `names` gives other ones"
        yield Finding(("gateways", name), what, doubled[0], at="key")
    for key in settings.names:
        if key not in settings.robots:
            unknown = UnknownName("no robot that the gateway serves", key, settings.robots)
            yield Finding(("gateways", name, "names", key), unknown.problem, key, unknown.nearest, at="key")
    for section in ("classes", "alter"):
        for key in getattr(settings, section):
            if key not in served:
                unknown = UnknownName("no component that the gateway serves", key, served)
                yield Finding(("gateways", name, section, key), unknown.problem, key, unknown.nearest, at="key")
