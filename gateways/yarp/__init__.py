"""YARP: a port for each component, its services as ports, and ports with bottles as a deployment composes them."""

from __future__ import annotations

import ast
import asyncio
import inspect
import re
from base64 import b64decode
from collections.abc import Iterable, Iterator
from functools import partial
from typing import Annotated, Any, Final

from pydantic import Field, StringConstraints

from foosim.common import limits
from foosim.common.addresses import LOOPBACK, parse_address
from foosim.common.errors import BadValue, Refused, UnknownName
from foosim.common.finding import Finding
from foosim.common.units import ANGLE, LENGTH
from foosim.deployment.hosts import Listen
from foosim.deployment.schema import Deployment
from foosim.gateways.components import components_of
from foosim.gateways.gateway import Gateway, Peer
from foosim.gateways.rows import Component, checked
from foosim.gateways.run import Called, Run
from foosim.gateways.socket import outcome_of
from foosim.gateways.supervision import Supervision
from foosim.gateways.yarp.name_server import NameServer, name_server
from foosim.gateways.yarp.ports import NameClient, Port, Receive
from foosim.gateways.yarp.wire import image
from foosim.world.component_types.payloads import as_float
from foosim.world.component_types.registry import gateway
from foosim.world.component_types.settings import GatewaySettings

UNITS: Final = {unit: float(size) for dimension in (LENGTH, ANGLE) for unit, size in dimension.units.items()}
ITEM: Final = re.compile(r"(?P<sign>-?)(?P<component>.+)\.(?P<field>\w+)(?: (?P<unit>\w+))?")
PortName = Annotated[str, StringConstraints(pattern=r"^(/[A-Za-z0-9_.:-]+)+$", max_length=200)]


class YarpSettings(GatewaySettings):
    """Ports at the name server of YARP at `name_server`; where none answers, the gateway starts one.

    A component has the port PREFIX/ROBOT/COMPONENT/out, or `/in`, unless `ports` names it; without `timestamp` its
    bottles have none, as those of MORSE 0.3. `bottles` are further ports by name, each with the numbers of its bottle,
    `ROBOT.CHANNEL.FIELD` with a unit after it and `-` before it for the other sign, or the name of a port with the same
    bottle. A port that ends with `/in` takes them: of actuators they are commands, of sensors states that a real one
    has measured, for the capture. `listen` is the address of the ports.
    """

    name_server: Listen = "127.0.0.1:10000"
    listen: Listen = LOOPBACK
    prefix: PortName = "/morse"
    timestamp: bool = True
    ports: dict[str, PortName] = Field(default={}, max_length=limits.ENTITIES_MAX)
    bottles: dict[PortName, Annotated[list[str], Field(min_length=1)] | PortName] = Field(
        default={}, max_length=limits.ENTITIES_MAX
    )

    def numbers(self, port: str) -> list[str]:
        """Return the numbers of a bottle; of one that is that of another port, of that one. Raises BadValue."""
        its = self.bottles[port]
        its = self.bottles.get(its, its) if isinstance(its, str) else its
        if isinstance(its, str):
            raise UnknownName("no bottle to be equal to", its, self.bottles)
        return its


class Item:
    """One number of a composed bottle."""

    def __init__(self, text: str, components: dict[str, Component], takes: bool) -> None:
        """`components` are by name; `takes` is whether the port takes the bottle. Raises BadValue."""
        found = ITEM.fullmatch(text)
        if found is None or found["unit"] not in (None, *UNITS):
            raise BadValue(f"not [-]ROBOT.CHANNEL.FIELD [UNIT] (units are {', '.join(UNITS)})", text)
        if found["component"] not in components:
            raise UnknownName("no component that the gateway serves", found["component"], components)
        self.component, self.field = components[found["component"]], found["field"]
        if self.field not in self.component.row.fields:
            raise UnknownName(f"{found['component']} has no such field", self.field, self.component.row.fields)
        if not (takes or self.component.is_out):
            raise BadValue("an actuator in a bottle that is sent; the port of one that is taken ends with /in", text)
        self.factor = (-1.0 if found["sign"] else 1.0) * UNITS.get(found["unit"] or "", 1.0)


class Bottle:
    """A composed bottle. One that is sent is so when each of its components has a new reading."""

    def __init__(self, name: str, texts: Iterable[str], components: dict[str, Component]) -> None:
        self.takes = name.endswith("/in")
        self.items = [Item(text, components, self.takes) for text in texts]
        self.components = {item.component for item in self.items}
        self._fresh: set[Component] = set()

    def arrived(self, component: Component) -> list[Any] | None:
        """Return the bottle, where it is complete."""
        self._fresh.add(component)
        if self._fresh != self.components:
            return None
        self._fresh.clear()
        fields = [(item.component.fields or {})[item.field] for item in self.items]
        return [as_float(one) / item.factor for one, item in zip(fields, self.items, strict=True)]

    def take(self, run: Run, values: list[Any]) -> None:
        """Command the actuators, enter the states that were measured. Raises Refused."""
        if len(values) != len(self.items) or not all(isinstance(value, int | float) for value in values):
            raise Refused(f"{len(self.items)} numbers are valid, not {str(values)[:80]}")
        fields: dict[Component, dict[str, Any]] = {}
        for item, value in zip(self.items, values, strict=True):
            fields.setdefault(item.component, {})[item.field] = value * item.factor
        for component, its in fields.items():
            (run.measured if component.is_out else run.command)(component, its)


@gateway("yarp", YarpSettings)
class Yarp(Gateway):
    """Ports of components, of services and of composed bottles."""

    def __init__(self, settings: YarpSettings, run: Run, supervision: Supervision) -> None:
        super().__init__(settings, run, supervision)
        address = parse_address(settings.name_server)
        self.names: Final = NameClient(address.host, address.port or 10_000)
        self.ports: Final[dict[str, Port]] = {}
        self._server: NameServer | None = None
        self._own = {f"{one.robot}.{one.channel}": one for one in run.components.values()}
        self._outputs: dict[Component, Port] = {}
        self._requests: set[asyncio.Task[list[Any]]] = set()
        self._bottles: dict[Component, list[tuple[Port, Bottle]]] = {}

    @staticmethod
    def check(name: str, settings: GatewaySettings, deployment: Deployment) -> Iterator[Finding]:
        yield from Gateway.check(name, settings, deployment)
        assert isinstance(settings, YarpSettings)
        try:
            served = components_of(deployment, settings)
        except BadValue:  # reported by the base class
            return
        for key in settings.ports:
            if key not in served:
                unknown = UnknownName("no component that the gateway serves", key, served)
                yield Finding(("gateways", name, "ports", key), unknown.problem, key, unknown.nearest, at="key")
        for port in settings.bottles:
            try:
                Bottle(port, settings.numbers(port), served)
            except BadValue as bad:
                yield Finding(("gateways", name, "bottles", port), bad.problem, bad.value, bad.nearest)

    async def open(self) -> str:
        """Register all ports; where no name server answers, start one. Raises Refused."""
        self._server = await name_server(self.names)
        settings = self.settings
        for key, component in self._own.items():
            place = re.sub(r"\.(?=[0-9])", "", component.full).replace(".", "/")
            name = settings.ports.get(key, f"{settings.prefix}/{place}/{'out' if component.is_out else 'in'}")
            if component.is_out:
                self._outputs[component] = await self._port(name)
            else:
                await self._port(name, partial(self._command, component))
        for name in settings.bottles:
            bottle = Bottle(name, settings.numbers(name), self._own)
            port = await self._port(name, partial(bottle.take, self.run) if bottle.takes else None)
            for component in () if bottle.takes else bottle.components:
                self._bottles.setdefault(component, []).append((port, bottle))
        for owner in (*self.run.components, *self.supervision.services):
            reply = await self._port(f"{settings.prefix}/services/{owner}/reply")
            await self._port(f"{settings.prefix}/services/{owner}/request", partial(self._begin, reply))
        own = ", with a name server of its own" if self._server else ""
        return f"{len(self.ports)} ports at {self.names.host}:{self.names.number}{own}"

    async def _port(self, name: str, receive: Receive | None = None) -> Port:
        if name in self.ports:
            raise Refused(f"{self.run.name}: two ports with the name {name}; `ports` and `bottles` give other ones")
        port = self.ports[name] = Port(name, self.names, receive, parse_address(self.settings.listen).host)
        await port.open()
        return port

    async def close(self) -> None:
        """Take all ports out of the name server."""
        for task in self._requests:
            task.cancel()
        for port in (*self.ports.values(), *([self._server] if self._server else [])):
            await port.close()

    def peers(self) -> Iterator[Peer]:
        for port in self.ports.values():
            yield from (Peer(who, port.name, port.counts[who]) for who in {*port.links, *port.sources.values()})

    def draws(self, component: Component) -> bool:
        return bool(self._outputs[component].links) or component in self._bottles

    def arrived(self, component: Component) -> None:
        fields = component.fields or {}
        port = self._outputs[component]
        if port.links and "image" in fields:
            port.write(image(fields["width"], fields["height"], b64decode(fields["image"])))
        elif port.links:
            stamp = [component.time_ns / 1e9] if self.settings.timestamp else []
            port.write(stamp + [one for value in fields.values() for one in items_of(value)])
        for port, bottle in tuple(self._bottles.get(component, ())):
            try:
                values = bottle.arrived(component)
            except TypeError:
                self.log.error("%s is not sent: a field of %s is no number", port.name, component.full)
                self._bottles[component].remove((port, bottle))
                continue
            if values is not None:
                port.write(values)

    def _command(self, component: Component, values: list[Any]) -> None:
        """Command an actuator by the numbers of a bottle in the order of its fields. Raises Refused."""
        fields = component.row.fields
        if len(values) > len(fields):
            raise Refused(f"{component.full} takes {', '.join(fields)}, not {len(values)} items")
        self.run.command(component, dict(zip(fields, values, strict=False)))

    def _begin(self, port: Port, values: list[Any]) -> asyncio.Task[list[Any]]:
        task = asyncio.ensure_future(self._request(values, port))
        self._requests.add(task)
        task.add_done_callback(self._requests.discard)
        return task

    async def _request(self, values: list[Any], port: Port) -> list[Any]:
        """Call a service, `ID COMPONENT SERVICE [PARAMETERS]`; `ID STATUS RESULT` goes to the port and to who waits."""
        over: asyncio.Future[Called] = asyncio.get_running_loop().create_future()
        try:
            if len(values) not in (3, 4):
                raise Refused("Malformed request: ID COMPONENT SERVICE [PARAMETERS] are expected")
            _, owner, service, given = (*values, [])[:4]
            given = ast.literal_eval(given) if isinstance(given, str) else given
            parameters = list(given) if isinstance(given, list | tuple) else [given]
            its = self.supervision.services.get(owner, {}).get(service)
            if its is not None:
                result = checked(service, its, parameters)
            elif owner in self.run.components:
                result = self.run.call(self.run.components[owner], service, parameters, over.set_result)
            else:
                raise Refused(f"The request {service} has not been registered for {owner}")
            result = await result if inspect.isawaitable(result) else result
            outcome = outcome_of(await over) if isinstance(result, Called) else ("SUCCESS", result)
        except (Refused, ValueError, SyntaxError, TypeError, RecursionError, MemoryError) as bad:
            outcome = "FAILED", bad
        reply = [f"{values[0] if values else ''} {outcome[0]} {outcome[1] or ''}".rstrip()]
        port.write(reply)
        return reply


def items_of(value: Any) -> list[Any]:
    """Return the items of a bottle for a value: of an orientation a list of x, y, z, w, of a mapping its pairs."""
    if isinstance(value, dict):
        if set(value) == set("xyzw"):
            return [[value[key] for key in "xyzw"]]
        return [[key, *items_of(item)] for key, item in value.items()]
    if isinstance(value, list | tuple):
        return [[item for one in value for item in items_of(one)]]
    return [value]
