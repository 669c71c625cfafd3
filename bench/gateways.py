"""Gateways: how fast a program of MORSE connects to 500 robots, how soon services answer, what 50 robots cost a tick.

The program asks as pymorse does when it starts: for the description of all robots, then the port of each stream; its
gateway is in this process, without a run. Services are asked of a gateway in a run of real processes, in realtime. The
50 robots have their poses heard at 100 Hz by a gateway, and recorded, in a rehearsal: all roles in this process.
"""

from __future__ import annotations

import asyncio
import json
import socket
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, Final

from bench.bare_tick import bare_tick_us
from bench.runs import watch
from foosim.client.core import ClientCore
from foosim.client.player import Packet
from foosim.common.errors import Failed
from foosim.common.units import Pace
from foosim.deployment.loader import load_deployment
from foosim.gateways.main import Endpoint, raise_descriptors
from foosim.gateways.run import Run
from foosim.gateways.socket import Socket, SocketSettings
from foosim.gateways.supervision import Supervision
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings

FLEET: Final = """
format: 2
world: fleet
seed: 1
tick: 10 ms
substeps: 1
engine: pure
pace: realtime
scene: {{kind: empty}}
robots:
  r:
    model: differential_drive
    count: {count}
    spacing: {{x: 2 m}}
    at: {{x: {start} m}}
    sensors: {{pose: {{kind: pose_3d, rate: 100 Hz}}, velocity: {{kind: velocity, rate: 1 Hz}}}}
    actuators: {{motion: {{kind: v_w}}}}
gateways:
  morse: {{kind: socket, listen: '127.0.0.1:{port}', streams: 0}}
nodes: {{n1: {{launch: local, robots: ['*']}}}}
deadlines: {{start: 60 s}}
"""
MANY: Final = 500
HEARD: Final = 50
STREAMS: Final = ("pose", "velocity", "motion")
CALLS: Final = 200
WARM_TICKS: Final = 200


@dataclass(frozen=True, slots=True)
class Gateways:
    """Wall time of a program's start (s), median and p99 of two services in ticks of 10 ms, processor time of a tick
    with 50 robots (us), and b beside it (us)."""

    connect_s: float
    call_ticks: tuple[float, float]
    command_ticks: tuple[float, float]
    tick_us: float
    bare_tick_us: float

    @property
    def ratio(self) -> float:
        """A tick over b."""
        return self.tick_us / self.bare_tick_us


def gateways(seconds: float = 5.0) -> Gateways:
    """Measure; `seconds` is the simulated time of the 50 robots and of the run."""
    raise_descriptors()
    connect_s = _connect_s()
    calls, commands = _services_s(seconds)
    bare_us, tick_us = bare_tick_us(), _tick_us(int(seconds * 100))
    return Gateways(round(connect_s, 2), _shown(calls), _shown(commands), round(tick_us), round(bare_us, 1))


def lines(found: Gateways) -> list[str]:
    """Return the figures as text."""
    return [
        f"a program of MORSE connects to {MANY} robots with {len(STREAMS)} streams each in {found.connect_s} s",
        "a service is answered after {} ticks (p99 {}), a command after {} (p99 {})".format(
            *found.call_ticks, *found.command_ticks
        ),
        f"{HEARD} robots with poses at 100 Hz, heard and recorded in one process: {found.tick_us:.0f} us a tick, "
        f"{found.ratio:.1f} b (b = {found.bare_tick_us:.0f} us)",
    ]


def _shown(times_s: list[float]) -> tuple[float, float]:
    ordered = [round(one / 0.01, 3) for one in sorted(times_s)]
    return median(ordered), ordered[len(ordered) * 99 // 100]


def _unreachable() -> Any:
    raise Failed("no supervisor")


def _gateway(count: int, send: Callable[[str, Packet], None]) -> Socket:
    deployment = load_deployment(FLEET.format(count=count, start=-count, port=0), "fleet.yaml")
    run = Run(deployment, "morse", send, lambda: None)
    assert isinstance(run.settings, SocketSettings)
    gateway = Socket(run.settings, run, Supervision(run, _unreachable))
    run.listeners.append(gateway)
    return gateway


class Program:
    """A program at the services of a gateway."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port))
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._lines = self._socket.makefile("rb")

    def call(self, component: str, service: str, *parameters: object) -> str:
        """Return the answer to a request."""
        self._socket.sendall(f"id {component} {service} {json.dumps(parameters)}\n".encode())
        return self._lines.readline().decode()

    def close(self) -> None:
        self._lines.close()
        self._socket.close()


def _connect_s() -> float:
    loop = asyncio.new_event_loop()
    gateway = _gateway(MANY, lambda client, packet: None)
    loop.run_until_complete(gateway.open())
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    begun_s = time.perf_counter()
    program = Program(gateway.service_port)
    program.call("simulation", "details")
    for name in sorted(gateway.ports):
        if name.rpartition(".")[2] in STREAMS:
            program.call("simulation", "get_stream_port", name)
    taken_s = time.perf_counter() - begun_s
    program.close()
    loop.call_soon_threadsafe(loop.stop)
    thread.join()
    loop.run_until_complete(gateway.close())
    loop.close()
    return taken_s


def _services_s(seconds: float) -> tuple[list[float], list[float]]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    found: list[list[float]] = []

    def ask() -> None:
        program = None
        while program is None:
            try:
                program = Program(port)
            except OSError:
                time.sleep(0.1)
        for component, service, parameters in (
            ("simulation", "list_robots", ()),
            ("r-1.motion", "set_speed", (0.0, 0.1)),
        ):
            times_s = []
            for _ in range(CALLS):
                begun_s = time.perf_counter()
                program.call(component, service, *parameters)
                times_s.append(time.perf_counter() - begun_s)
                time.sleep(0.003)  # at any time within a tick
            found.append(times_s)
        program.close()

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fleet.yaml"
        path.write_text(FLEET.format(count=2, start=0, port=port))
        thread = threading.Thread(target=ask)
        thread.start()
        watch("realtime", max(seconds, 5.0), deployment=path)
        thread.join()
    return found[0], found[1]


def _tick_us(ticks: int) -> float:
    """Return the processor time of a tick: the difference of a long and a short rehearsal."""
    short_s, long_s = _spent_s(WARM_TICKS), _spent_s(WARM_TICKS + ticks)
    return (long_s - short_s) / ticks * 1e6


def _spent_s(ticks: int) -> float:
    """Return the processor time of a rehearsal with a gateway that hears all robots."""
    endpoints: dict[str, Endpoint] = {}
    gateway = _gateway(HEARD, lambda client, packet: endpoints[client].core.send([packet], 0))

    def entered(robot: str) -> Callable[[ClientCore], Callable[[int], None]]:
        def enter(core: ClientCore) -> Callable[[int], None]:
            endpoint = endpoints[core.name] = Endpoint(core)

            def turn(now_ns: int) -> None:
                if core.deployment is not None and not endpoint.has_joined:
                    endpoint.join(gateway, robot)
                endpoint.step(now_ns)

            return turn

        return enter

    text = FLEET.format(count=HEARD, start=-HEARD, port=0)
    settings = Settings(clients={client: entered(robot) for robot, client in gateway.run.clients.items()})
    with tempfile.TemporaryDirectory() as folder:
        capture, begun_s = Path(folder) / "run.mcap", time.process_time()
        rehearse(text, "fleet.yaml", ticks, 1, (), settings, pace=Pace("realtime"), capture=capture)
        spent_s = time.process_time() - begun_s
    heard = sum(one.count for one in gateway.run.components.values())
    assert heard > HEARD * (ticks - WARM_TICKS), heard
    return spent_s
