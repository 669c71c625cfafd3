"""The process of a gateway: its clients on the radio plane, and its connections to other programs, on one asyncio loop.

Each robot that it serves has a client on board. The clients share the loop of the process, which has its turns in that
of asyncio, and its session where there are no certificates.
"""

from __future__ import annotations

import asyncio
import resource
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import Annotated, Any, Final

import typer

from foosim.client.control import Control
from foosim.client.core import NEVER_NS, ClientCore
from foosim.client.main import ClientShell, Sessions
from foosim.client.player import Packet
from foosim.common.errors import BadValue, UnknownName
from foosim.gateways.gateway import Gateway
from foosim.gateways.run import Run
from foosim.gateways.supervision import Supervision
from foosim.protocol.channels import Plane
from foosim.runtime.command import PkiOption, new_app
from foosim.runtime.process import Stop, die_with_parent
from foosim.runtime.roles.shell import RUN, Process, address_of
from foosim.runtime.run_folder import RunFolder, open_run
from foosim.runtime.transport.certificates import operator_credentials
from foosim.world.component_types.registry import find

WAIT_S_MAX: Final = 60.0
REPORT_S: Final = 1.0
"""The period of the reports on the programs at a gateway, which the console reads."""


class Endpoint:
    """Acts for one client of a gateway: it hands on what arrives."""

    def __init__(self, core: ClientCore) -> None:
        self.core: Final = core
        self._gateway: Gateway | None = None
        self._robot, self._waits_at = "", -1

    def join(self, gateway: Gateway, robot: str) -> None:
        """Take part, and receive the components of a robot; without one in lockstep, where the gateway has `sync`."""
        self._gateway, self._robot, run = gateway, robot, gateway.run
        rate_hz = run.deployment.clients[self.core.name].rate_hz
        self.core.join(0 if rate_hz is None else run.deployment.ticks(rate_hz), run.heard(robot))

    @property
    def has_joined(self) -> bool:
        """Whether it takes part."""
        return self._gateway is not None

    def step(self, now_ns: int) -> None:
        """Hand on what has arrived; a tick that waits continues when the gateway lets it."""
        core, gateway = self.core, self._gateway
        if gateway is None:
            return
        run = gateway.run
        if core.arrivals:
            packets = [*core.arrivals]
            core.arrivals.clear()
            run.arrived(self._robot, packets, core.tick)
        if core.go is not None and core.go.number > self._waits_at:
            self._waits_at = core.go.number
            run.arrived(self._robot, core.go.packets, core.tick)
            if gateway.go():
                run.proceed()

    def deadline_ns(self) -> int:
        """It acts when a message comes."""
        return NEVER_NS


class GatewayProcess:
    """One gateway, from its first connection to the end of the run."""

    def __init__(
        self, name: str, sessions: Sessions, stop: Stop, operate: Callable[[], Control], folder: RunFolder | None
    ) -> None:
        """`operate` makes an operator's session. `folder` is that of the run, where it is on this machine."""
        self._name, self._sessions, self._stop, self._operate, self._folder = name, sessions, stop, operate, folder
        self._process = Process(name, is_shared=True, on_offer=self._schedule)
        self._shells: dict[str, ClientShell] = {}
        self._endpoints: dict[str, Endpoint] = {}
        self._timer: asyncio.TimerHandle | None = None
        self._turned = asyncio.Event()
        """Set after each turn."""
        self._report: dict[str, Any] = {}
        self._is_over = False
        self._failure: BaseException | None = None

    async def serve(self) -> int:
        """Serve until the run ends; return the exit code. Raises Refused."""
        self._loop = asyncio.get_running_loop()
        self._stop.then(self._schedule)
        self._process.loop.begin()
        core = self._add(self._name).core
        await self._until(lambda: core.deployment is not None)
        deployment = core.deployment
        if deployment is None:
            return self._process.end()
        if self._name not in deployment.gateways:
            raise UnknownName("no gateway of the deployment", self._name, deployment.gateways)
        run = Run(deployment, self._name, self._send, self._proceed)
        supervision = Supervision(run, self._operate)
        gateway: Gateway = find("gateway", run.settings.kind).factory(run.settings, run, supervision)
        run.listeners.extend((supervision, gateway))
        for client in run.clients.values():
            if client != self._name:
                self._add(client)
        await self._until(lambda: all(shell.core.deployment is not None for shell in self._shells.values()))
        where = await gateway.open()
        gateway.log.info("%s serves %d robots: %s", self._name, len(run.robots), where)
        self._report = {"kind": gateway.settings.kind, "robots": [*run.robots], "at": where, "programs": []}
        self._write_report()
        for robot, client in run.clients.items():
            self._endpoints[client].join(gateway, robot)
        tasks = [asyncio.create_task(supervision.follow()), asyncio.create_task(self._report_peers(gateway))]
        try:
            await self._until(lambda: False)  # the run ends
        finally:
            for task in tasks:
                task.cancel()
            supervision.close()
            await gateway.close()
        return self._process.end()

    def _add(self, client: str) -> ClientShell:
        """Add a client of the gateway. Raises Refused."""
        session, credentials = self._sessions.of(client)
        shell = ClientShell(self._process, client, session, credentials=credentials, driver=self._endpoint)
        self._process.add(shell)
        self._shells[client] = shell
        self._schedule()
        return shell

    def _endpoint(self, core: ClientCore) -> Endpoint:
        endpoint = self._endpoints[core.name] = Endpoint(core)
        return endpoint

    def _send(self, client: str, packet: Packet) -> None:
        shell = self._shells[client]
        shell.core.send([packet], time.monotonic_ns())
        shell.role.perform()

    def _proceed(self) -> None:
        """Answer the tick that waits for the gateway."""
        shell = self._shells[self._name]
        if shell.core.go is not None:
            shell.core.done(())
            shell.role.perform()

    async def _until(self, reached: Callable[[], bool]) -> None:
        """Wait until something is reached or the process is over. Raises what a turn has raised."""
        while not (reached() or self._is_over):
            self._turned.clear()
            await self._turned.wait()
            if self._failure is not None:
                raise self._failure

    def _schedule(self) -> None:
        """Have a turn soon; from any thread."""
        self._loop.call_soon_threadsafe(self._turn)

    def _turn(self) -> None:
        """Run a round of the process's loop, and set the timer for the next one."""
        if self._timer is not None:
            self._timer.cancel()
        if self._stop.is_set():
            self._process.stop()
        try:
            next_ns = None if self._is_over else self._process.step()
        except BaseException as error:  # noqa: BLE001  # it is raised where the process waits
            self._failure, next_ns = error, None
        if next_ns is None:
            self._is_over = True
        else:
            wait_s = min(max(0.0, (next_ns - time.monotonic_ns()) / 1e9), WAIT_S_MAX)
            self._timer = self._loop.call_later(wait_s, self._turn)
        self._turned.set()

    async def _report_peers(self, gateway: Gateway) -> None:
        """Write the programs at the gateway with their rates, in messages a second."""
        known: dict[tuple[str, str], int] = {}
        while self._folder is not None:
            await asyncio.sleep(REPORT_S)
            peers = [*gateway.peers()]
            rates = [(one.messages - known.get(one[:2], 0)) / REPORT_S for one in peers]
            known = {one[:2]: one.messages for one in peers}
            found = [{"name": one.name, "what": one.what, "hz": rate} for one, rate in zip(peers, rates, strict=True)]
            self._report = {**self._report, "programs": found}
            self._write_report()

    def _write_report(self) -> None:
        with suppress(OSError):  # the console shows the last one
            if self._folder is not None:
                self._folder.write_gateway(self._name, self._report)


def raise_descriptors() -> None:
    """Have as many file descriptors as the system permits: each stream takes one, and each program."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))


app = new_app()


@app.command()
def gateway(
    name: Annotated[str, typer.Option(help="Name of the gateway in the deployment.")],
    connect: Annotated[str, typer.Option(help="Address of the vHub's radio plane: tcp/HOST:PORT, or run:NAME.")],
    supervisor: Annotated[
        str, typer.Option(metavar="ADDRESS", help="That of the supervisor; by default that of the run of --connect.")
    ] = "",
    pki: PkiOption = None,
) -> None:
    """Run a gateway: it serves robots of a run to programs of another middleware.

    The process ends with the run.

    Exit codes: 0 when the run ended, 1 when the vHub was lost for longer than the deployment's `deadlines.vhub_back`,
    3 when the vHub refused it or no port is free.
    """
    die_with_parent()
    raise_descriptors()
    run = next((one.removeprefix(RUN) for one in (supervisor, connect) if one.startswith(RUN)), "")
    if not (run or supervisor):
        raise BadValue("--supervisor: the address of the supervisor is needed beside one of the vHub", supervisor)
    stop = Stop()

    def operate() -> Control:
        address = address_of(run, Plane.SIMULATION, stop.is_set) if run else supervisor
        return Control(address, operator_credentials(pki), stop.is_set)

    folder = open_run(run) if run else None
    with ExitStack() as stack:
        process = GatewayProcess(name, Sessions(stack, connect, pki, stop), stop, operate, folder)
        raise typer.Exit(asyncio.run(process.serve()))
