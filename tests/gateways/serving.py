"""A gateway in a rehearsal: its clients and its sockets in the process of the test, on virtual time."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from foosim.client.core import ClientCore
from foosim.client.player import Packet
from foosim.common.closable import Closable
from foosim.common.errors import Failed
from foosim.common.units import Pace
from foosim.deployment.loader import load_deployment
from foosim.gateways.gateway import Gateway
from foosim.gateways.main import Endpoint
from foosim.gateways.run import Run
from foosim.gateways.supervision import Supervision
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings, System
from foosim.world.component_types.registry import find

ROUNDS = 20
"""Rounds of the event loop in which most of what was written to a loopback socket is read and answered."""


def unreachable() -> Any:
    """Have no session of an operator."""
    raise Failed("no supervisor")


Script = Callable[["Served"], Iterator[int]]
"""What programs do at a gateway: it yields the tick at which it continues, or the next one of which a client of the
gateway hears."""


class Served:
    """One gateway of a rehearsal."""

    def __init__(self, text: str, name: str, script: Script) -> None:
        deployment = load_deployment(text, "test.yaml")
        self.text, self.loop, self._script = text, asyncio.new_event_loop(), script(self)
        self.run = Run(deployment, name, self._send, self._proceed)
        supervision = Supervision(self.run, unreachable)
        kind = find("gateway", self.run.settings.kind)
        self.gateway: Gateway = kind.factory(self.run.settings, self.run, supervision)
        self.run.listeners.extend((supervision, self.gateway))
        self._endpoints: dict[str, Endpoint] = {}
        self.system: System | None = None
        self._tick = self._until = -1
        self.wires: list[Closable] = []

    def rehearse(self, ticks: int, nodes: int = 1, seed: int = 1, capture: Path | None = None) -> Rehearsed:
        """Open the gateway, run the rehearsal, close the gateway."""
        self.loop.run_until_complete(self.gateway.open())
        clients = {client: self._entered(robot) for robot, client in self.run.clients.items()}
        try:
            result = rehearse(
                self.text,
                "test.yaml",
                ticks,
                nodes,
                (f"seed={seed}",),
                Settings(clients=clients),
                pace=Pace("realtime"),
                prepare=self._keep,
                capture=capture,
            )
            next(self._script, None)  # after the end
            return result
        finally:
            for wire in self.wires:
                wire.close()
            self.loop.run_until_complete(self.gateway.close())
            self.go_round()
            self.loop.close()

    def go_round(self) -> None:
        """Let the gateway read and write its sockets."""
        for _ in range(ROUNDS):
            self.loop.run_until_complete(asyncio.sleep(0))

    def _keep(self, system: System) -> None:
        self.system = system

    def _entered(self, robot: str) -> Callable[[ClientCore], Callable[[int], None]]:
        def enter(core: ClientCore) -> Callable[[int], None]:
            endpoint = self._endpoints[core.name] = Endpoint(core)

            def turn(now_ns: int) -> None:
                if core.deployment is not None and not endpoint.has_joined:
                    endpoint.join(self.gateway, robot)
                endpoint.step(now_ns)
                if self.run.tick > self._tick:
                    self._tick = self.run.tick
                    if self._tick >= self._until:
                        self._until = next(self._script, 1 << 60)

            return turn

        return enter

    def _send(self, client: str, packet: Packet) -> None:
        self._endpoints[client].core.send([packet], 0)

    def _proceed(self) -> None:
        core = self._endpoints[self.run.name].core
        if core.go is not None:
            core.done(())


class Wire(Closable):
    """A program at a socket of a gateway."""

    def __init__(self, served: Served, port: int) -> None:
        self._served, self._rest = served, b""
        self.is_open = True
        served.wires.append(self)
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setblocking(False)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # what is written is there at once
        served.go_round()

    def write(self, text: str | bytes) -> None:
        """Write, and let the gateway read."""
        left = text.encode() if isinstance(text, str) else text
        while left and self.is_open:
            try:
                left = left[self.socket.send(left) :]
            except BlockingIOError:
                pass
            except OSError:
                self.is_open = False
            self._served.go_round()

    def lines(self, count: int = 0) -> list[str]:
        """Return the whole lines that have come since; wait until there are `count`."""
        found = self._come()
        while len(found) < count:
            found += self._come()
        return found

    def _come(self) -> list[str]:
        self._served.go_round()
        try:
            while data := self.socket.recv(1 << 20):
                self._rest += data
            self.is_open = False
        except BlockingIOError:
            pass
        except OSError:
            self.is_open = False
        *lines, self._rest = self._rest.split(b"\n")
        return [line.decode() for line in lines]

    def close(self) -> None:
        self.socket.close()
        self._served.go_round()
