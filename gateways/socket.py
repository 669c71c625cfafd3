"""MORSE's socket: services as lines on one port, a port for the stream of each component, a trigger for each step.

A service is `ID COMPONENT SERVICE [JSON list]`, answered by `ID SUCCESS|FAILED|PREEMPTED [JSON]`; a stream has a JSON
object in each line. The formats are those of MORSE 1.4, as its clients, such as pymorse, read and write them.
"""

from __future__ import annotations

import asyncio
import inspect
import json
from collections.abc import Callable, Mapping
from functools import partial
from typing import Annotated, Any, Final

from pydantic import Field

from foosim.common.addresses import Address, parse_address
from foosim.common.errors import Refused
from foosim.common.spec_base import Rate, SpecBase
from foosim.deployment.hosts import Listen
from foosim.gateways.lines import Connection, LineServer
from foosim.gateways.rows import MANAGER, WRONG_TYPES, Component, checked, wrong_type
from foosim.gateways.run import Called, Run
from foosim.gateways.supervision import Supervision
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.registry import gateway
from foosim.world.component_types.settings import GatewaySettings

SERVICE_PORTS: Final = 10
"""Ports for services that are tried in turn."""
Port = Annotated[int, Field(ge=0, le=65_535)]


class SyncSettings(SpecBase):
    """A trigger of steps: while a program is connected to `port`, each step of `rate` waits for bytes from one."""

    rate_hz: Rate = Field(alias="rate")
    port: Port = 6000


class SocketSettings(GatewaySettings):
    """MORSE's socket. Services are at `listen`, or at one of the nine ports after it where that is busy, streams at the
    free ports from `streams` upwards; with 0 at any free ones.
    """

    listen: Listen = "127.0.0.1:4000"
    streams: Port = 60_000
    sync: SyncSettings | None = None


@gateway("socket", SocketSettings)
class Socket(LineServer):
    """Streams and services as of MORSE's socket interface."""

    def __init__(self, settings: SocketSettings, run: Run, supervision: Supervision) -> None:
        super().__init__(settings, run, supervision)
        self.ports: Final[dict[str, int]] = {}
        """The port of the stream of each component, by name."""
        self._readers: dict[str, set[Stream]] = {name: set() for name in run.components}
        self.triggers: Final = Triggers(run.proceed)
        self.service_port = self.sync_port = 0
        streams: dict[str, Callable[..., Any]] = {
            "list_streams": lambda: sorted(self.ports),
            "get_stream_port": self._stream_port,
            "get_all_stream_ports": lambda: self.ports,
        }
        its = supervision.services
        self.services: Final[Mapping[str, Mapping[str, Callable[..., Any]]]] = {
            **its,
            "simulation": {**its["simulation"], **streams},
        }

    async def open(self) -> str:
        """Listen. Raises Refused where no port is free."""
        settings, address = self.settings, parse_address(self.settings.listen)
        many = range(address.port, address.port + (SERVICE_PORTS if address.port else 1))
        self.service_port = await self.listen(address.host, many, partial(Requests, self))
        port = settings.streams
        for name in sorted(self.run.components):
            component = self.run.components[name]
            many = range(port, 65_536) if port else range(1)
            self.ports[name] = await self.listen(address.host, many, partial(Stream, self, component))
            port = self.ports[name] + 1 if port else 0
        if settings.sync is not None:
            many = range(settings.sync.port, settings.sync.port + 1)
            self.sync_port = await self.listen(address.host, many, partial(Trigger, self))
        return f"services at {Address(address.host, self.service_port)}, {len(self.ports)} streams"

    def draws(self, component: Component) -> bool:
        return bool(self._readers[component.full])

    def arrived(self, component: Component) -> None:
        readers = self._readers[component.full]
        if readers:
            data = {"timestamp": component.time_ns / 1e9, **(component.fields or {})}
            line = json.dumps(data).encode() + b"\n"
            for reader in readers:
                reader.offer(line)

    def readers(self, component: Component) -> set[Stream]:
        """Return the connections that read the stream of a sensor."""
        return self._readers[component.full]

    def go(self) -> bool:
        return self.triggers.go()

    def _stream_port(self, name: str) -> int:
        if name not in self.ports:
            raise Refused(f"Stream unavailable for component {name}")
        return self.ports[name]


class Stream(Connection[Socket]):
    """The stream of a component: to readers of a sensor, from writers of an actuator.

    Of the lines that a writer has sent at once, the last one counts.
    """

    def __init__(self, gateway: Socket, component: Component) -> None:
        super().__init__(gateway)
        self.what, self._component, self._refused = component.full, component, 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._gateway.readers(self._component).add(self)

    def connection_lost(self, error: Exception | None) -> None:
        super().connection_lost(error)
        self._gateway.readers(self._component).discard(self)
        if self._refused > 1:
            self._gateway.log.warning("%s: %d lines of %s were refused", self.what, self._refused, self.peer)

    def received(self, lines: list[bytes]) -> None:
        if self._component.is_out:
            return
        try:
            data = json.loads(lines[-1])
            if not isinstance(data, dict):
                raise Refused(f"{self.what} takes JSON objects, not {lines[-1][:80]!r}")
            self._gateway.run.command(self._component, data)
        except (Refused, ValueError, RecursionError) as error:
            self._refused += 1
            if self._refused == 1:
                self._gateway.log.warning("%s of %s: %s", self.what, self.peer, error)


class Requests(Connection[Socket]):
    """The services for one program. Jobs continue when it leaves: it may connect again."""

    what = "services"

    def __init__(self, gateway: Socket) -> None:
        super().__init__(gateway)
        self._running: dict[str, Called | asyncio.Task[None]] = {}
        """What takes time, by the id of its request."""

    def received(self, lines: list[bytes]) -> None:
        for line in lines:
            tokens = line.decode(errors="replace").split(None, 3)
            if tokens:
                self._take(*tokens)

    def _take(self, identity: str, component: str = "", service: str = "", text: str = "[]") -> None:
        if component == "cancel" and not service:
            self._cancel(identity)
        elif not service:
            self._answer(identity, "FAILED", "Malformed request! ")
        elif identity in self._running:
            self._answer(identity, "FAILED", f"The request {identity} is still running")
        else:
            try:
                result = self._call(identity, component, service, parameters_of(text))
            except Refused as refused:
                self._answer(identity, "FAILED", str(refused))
                return
            if inspect.isawaitable(result):
                self._running[identity] = asyncio.ensure_future(self._await(identity, service, result))
            elif isinstance(result, Called):
                if not result.job.state.has_ended:
                    self._running[identity] = result
            else:
                self._answer(identity, "SUCCESS", result)

    def _call(self, identity: str, component: str, service: str, parameters: list[Any]) -> Any:
        run, services = self._gateway.run, self._gateway.services.get(component)
        if services is not None and service in services:
            return checked(service, services[service], parameters)
        if component not in run.components:
            raise Refused(f"The request {service} has not been registered in {MANAGER}")

        def ended(called: Called) -> None:
            self._running.pop(identity, None)
            self._answer(identity, *outcome_of(called))

        return run.call(run.components[component], service, parameters, ended)

    async def _await(self, identity: str, service: str, result: Any) -> None:
        try:
            outcome = "SUCCESS", await result
        except Refused as refused:
            outcome = "FAILED", str(refused)
        except WRONG_TYPES as error:
            outcome = "FAILED", wrong_type(service, error)
        except asyncio.CancelledError:
            outcome = "PREEMPTED", None
        del self._running[identity]
        self._answer(identity, *outcome)

    def _cancel(self, identity: str) -> None:
        running = self._running.get(identity)
        if isinstance(running, Called):
            self._gateway.run.cancel(running)
        elif running is not None:
            running.cancel()

    def _answer(self, identity: str, status: str, result: Any) -> None:
        text = f" {json.dumps(result)}" if result else ""  # MORSE leaves out what is false
        self.answer(f"{identity} {status}{text}\n".encode())


def parameters_of(text: str) -> list[Any]:
    """Return the parameters of a request. Raises Refused."""
    try:
        parameters = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise Refused(f"Invalid request syntax: error while parsing the parameters: {text[:200]}. {error}") from None
    if not isinstance(parameters, list):
        raise Refused(f"Invalid request syntax: error while parsing the parameters: {text[:200]}. It is no list")
    return parameters


def outcome_of(called: Called) -> tuple[str, Any]:
    """Return status and result of a service that took time."""
    if called.job.state == JobState.DONE:
        return "SUCCESS", called.answer
    if called.job.state == JobState.FAILED:
        return "FAILED", f"{called.component.full} has failed{f': {called.job.why}' if called.job.why else ''}"
    return "PREEMPTED", None


class Triggers:
    """The trigger of steps: bytes of any program, several at once being one."""

    def __init__(self, proceed: Callable[[], None]) -> None:
        self._proceed, self.programs, self._has_bytes, self._waits = proceed, 0, False, False

    def go(self) -> bool:
        """A step waits; return whether it may be computed at once."""
        may = self._has_bytes or not self.programs
        self._has_bytes, self._waits = False, not may
        return may

    def pull(self) -> None:
        """Bytes have come, or the last program has left."""
        if not self._waits:
            self._has_bytes = bool(self.programs)
            return
        self._waits = False
        self._proceed()


class Trigger(Connection[Socket]):
    """A program that triggers steps."""

    what = "steps"

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._gateway.triggers.programs += 1

    def connection_lost(self, error: Exception | None) -> None:
        super().connection_lost(error)
        triggers = self._gateway.triggers
        triggers.programs -= 1
        if not triggers.programs:
            triggers.pull()

    def data_received(self, data: bytes) -> None:
        self.count += 1
        self._gateway.triggers.pull()
