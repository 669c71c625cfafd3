"""A run of the football table as processes of this one, each of which can be killed, stopped, cut off, started again.

Every process has its fixed command, and dials through a proxy of its own. What ends by itself is started again at once,
as a service manager would; what was taken down on purpose stays down until it is started.
"""

from __future__ import annotations

import os
import random
import signal
import socket
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self, TypeVar

import numpy as np

from foosim.capture.reader import open_capture
from foosim.client.control import Control, NoAnswer
from foosim.common.units import parse_pace
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.launcher.processes import Child, Launcher
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.runtime.run_folder import RunFolder, open_run, run_exists
from foosim.simulation.run import rehearse
from foosim.simulation.verify import verify_capture
from tests.wire.proxy import Proxy, Weather

TABLE: Final = Path(__file__).resolve().parents[2] / "deploy" / "table.yaml"
POLL_S: Final = 0.01
LIMIT_S: Final = 900.0
"""How long anything may take at all: who waits longer has found a hang."""
STATUS_S: Final = 2.0

T = TypeVar("T")


PORTS: Final = range(20_000, 32_000)
"""Below those that a system gives to who asks for any: a process that is started again finds its port free."""


class FaultError(Exception):
    """Something did not hold that must."""


def two_ports() -> int:
    """Return a port that is free now, as the one above it: both planes of a run."""
    for port in random.SystemRandom().sample(PORTS, 100):
        with socket.socket() as first, socket.socket() as second:
            try:
                first.bind(("127.0.0.1", port))
                second.bind(("127.0.0.1", port + 1))
            except OSError:
                continue
            return port
    raise FaultError(f"no free ports from {PORTS.start} to {PORTS.stop}")


class Cluster:
    """Supervisor, vHub, nodes and players of one run. Use it in `with`; `end` ends the run and checks it."""

    def __init__(
        self,
        folder: Path,
        name: str,
        sets: Sequence[str] = (),
        *,
        pace: str = "realtime",
        seed: int = 1,
        weather: Weather | None = None,
        programs: dict[str, list[str]] | None = None,
    ) -> None:
        """`folder` takes deployment, capture and logs; `programs` are other words than a node's `foosim role node`."""
        self.folder = folder
        self.name = name
        self.pace = pace
        self.text = apply_sets(TABLE.read_text(), "table.yaml", list(sets))
        self.deployment = load_deployment(self.text, "table.yaml")
        self.capture = folder / f"{name}.mcap"
        self.control: Control
        self.proxies: dict[str, Proxy] = {}
        self._file = folder / f"{name}.yaml"
        self._file.write_text(self.text)
        self._port = two_ports()
        self._seed = seed
        self._weather = weather
        self._programs = programs or {}
        self._launcher = Launcher()
        self._down: set[str] = set()
        self._stack = ExitStack()

    # --- processes ---------------------------------------------------------------------------------------------------

    @property
    def nodes(self) -> list[str]:
        return sorted(self.deployment.nodes)

    @property
    def radio(self) -> str:
        """The address for clients that are let in beside the players."""
        return f"tcp/127.0.0.1:{self._port + 1}"

    @property
    def run_folder(self) -> RunFolder:
        return open_run(self.name)

    def __enter__(self) -> Self:
        try:
            clients = sorted(self.deployment.players)
            for number, process in enumerate([VHUB, *self.nodes, *clients]):
                port = self._port + (process in clients)
                proxy = Proxy(port, self._seed * 1000 + number, self._weather, self._weather)
                self.proxies[process] = self._stack.enter_context(proxy)
            for process in (SUPERVISOR, *self.proxies):
                self.start(process)
            self.wait("the supervisor", lambda: run_exists(self.name) and self.run_folder.info() is not None)
            self.control = self._stack.enter_context(Control(f"tcp/127.0.0.1:{self._port}"))
            self.wait("the first tick", lambda: self.status()["ticks"] > 0)
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._close()

    def _close(self) -> None:
        self._launcher.kill()
        self._launcher.close()
        self._stack.close()

    def command(self, process: str) -> list[str]:
        """Return the words that start a process."""
        here = f"tcp/127.0.0.1:{self._port}"
        if process == SUPERVISOR:
            words = ["foosim", "run", str(self._file), "--listen", here, "--run", self.name]
            return [*words, "--pace", self.pace]
        words = ["--connect", self.proxies[process].address]
        if process == VHUB:
            words += ["--listen", self.radio, "--capture", str(self.capture)]
            return ["foosim", "role", "vhub", *words, "--run-folder", str(self.folder / f"{self.name}.vhub")]
        program = ["foosim", "role", "player"] if process in self.deployment.players else ["foosim", "role", "node"]
        return [*self._programs.get(process, program), "--name", process, *words]

    def start(self, process: str) -> Child:
        """Start a process, again if it ran before."""
        self._down.discard(process)
        return self._launcher.start(process, self.command(process), self.folder / f"{self.name}-{process}.log")

    def child(self, process: str) -> Child:
        return self._launcher.children[process]

    def is_alive(self, process: str) -> bool:
        return self.child(process).exit_code is None

    def signal(self, process: str, number: signal.Signals) -> None:
        os.kill(self.child(process).process.pid, number)

    def take_down(self, process: str) -> None:
        """Kill a process; it stays down until `start`."""
        self._down.add(process)
        self.signal(process, signal.SIGKILL)
        self.child(process).process.wait()

    def keep_down(self, process: str) -> None:
        """Leave a process down when it ends by itself."""
        self._down.add(process)

    def look(self) -> None:
        """Start again what ended by itself, as long as the run goes on."""
        for child in self._launcher.ended():
            if child.name in self._down:
                continue
            if child.name in self.deployment.players:
                raise FaultError(f"{child.name} {child.ending}: {' | '.join(child.last_lines())}")
            self.start(child.name)

    # --- the run -----------------------------------------------------------------------------------------------------

    def wait(self, what: str, found: Callable[[], T | None], limit_s: float = LIMIT_S) -> T:
        """Return the first true value of `found`; raises FaultError when there is none in time."""
        deadline_s = time.monotonic() + limit_s
        while time.monotonic() < deadline_s:
            self.look()
            try:
                value = found()
            except NoAnswer:
                value = None
            if value:
                return value
            time.sleep(POLL_S)
        raise FaultError(f"waited {limit_s:g} s for {what}")

    def status(self) -> dict[str, Any]:
        """Return the state of the run; a supervisor that is busy, or just comes back, is asked again."""
        return self.wait("a status", lambda: self.control.status(STATUS_S))

    def recoveries(self, what: str, name: str) -> list[dict[str, Any]]:
        """Return the losses ("node") or returns ("join") of a node that are over."""
        told = self.status()["recoveries"]
        return [it for it in told if (it["what"], it["name"]) == (what, name) and it["outage_ms"] is not None]

    def next_recovery(self, what: str, name: str, known: int) -> dict[str, Any]:
        """Return the first recovery behind those that were known."""
        entries = self.wait(f"a {what} of {name}", lambda: self.recoveries(what, name)[known:])
        return entries[0]

    def advance(self, ticks: int = 1) -> int:
        """Wait until the world has gone on by so many ticks; return the tick."""
        goal = self.status()["ticks"] + ticks
        return int(self.wait(f"tick {goal}", lambda: found if (found := self.status()["ticks"]) >= goal else None))

    def end(self, altered: bool = False) -> dict[str, Any]:
        """End the run in order, check it (`compare`), and return its result."""
        for process in (SUPERVISOR, *self.proxies):
            self.keep_down(process)
        self.control.request("down")
        if not self._launcher.wait(LIMIT_S):
            raise FaultError(f"{', '.join(child.name for child in self._launcher.alive())} did not end with the run")
        result = self.run_folder.result()
        if result is None or result["failed"] or result["reason"] != "stopped":
            raise FaultError(f"the run did not end in order: {result and result['reason']}")
        self.compare(result, altered)
        return result

    def compare(self, result: dict[str, Any], altered: bool = False) -> None:
        """Raise FaultError unless the run's frames are those of an undisturbed rehearsal.

        Where the world was altered by requests, they must be those that come out of the capture's orders and
        deliveries.
        """
        if altered:
            verified = verify_capture(self.capture)
            if not verified.equal:
                raise FaultError(f"the capture differs when it is computed again: {verified}")
            if not np.isfinite(open_capture(self.capture).frames.values).all():
                raise FaultError("the capture has frames with numbers that are not finite")
            return
        again = rehearse(self.text, "table.yaml", result["ticks"], None, pace=parse_pace("fast")).json
        for figure in ("digest", "packets", "score"):
            if again[figure] != result[figure]:
                raise FaultError(f"{figure}: {result[figure]}, undisturbed {again[figure]}")
