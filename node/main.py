"""The process `foosim role node`: a node's core between the simulation plane and its physics engine.

It needs one address only: deployment and models come with the handshake.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Final

import typer

from foosim.common.errors import BadValue
from foosim.common.names import is_name
from foosim.node.core import NodeCore
from foosim.node.engines_pool import Solver
from foosim.protocol import channels
from foosim.protocol.actions import Log
from foosim.protocol.channels import SUPERVISOR, Plane
from foosim.protocol.fingerprint import library_fingerprint
from foosim.runtime.command import DONE, FAILED, REFUSED, PkiOption, new_app
from foosim.runtime.health import ProgressOption
from foosim.runtime.process import Stop, die_with_parent, new_boot
from foosim.runtime.roles.shell import Process, RoleShell, client_session
from foosim.runtime.supervisor_timeout import SupervisorTimeout
from foosim.runtime.transport.certificates import Credentials
from foosim.runtime.transport.session import Session


class NodeShell:
    """One node on one session, until the run ends, the supervisor is gone for too long, or `stop`."""

    def __init__(
        self, process: Process, name: str, session: Session, world: str = "", credentials: Credentials | None = None
    ) -> None:
        self.core = NodeCore(name, new_boot(), library_fingerprint(), time.monotonic_ns(), world)
        self._supervisor_timeout = SupervisorTimeout()
        self._solver = Solver(self.core)
        self._is_present = self._is_stopped = False
        self._shell = RoleShell(process, name, self.core, self._deadline_ns, credentials)
        self.role: Final = self._shell.role
        self.role.turn, self.role.work = self._turn, self._work
        self.role.lacking = lambda: self.core.lacking
        self.role.on_alive, self.role.stood = self._on_alive, self._supervisor_timeout.rest
        self._wire = self._shell.connect(session, Plane.SIMULATION)
        self._wire.read(channels.NODE_READS, channels.NODE_WAITS)
        self._shell.watch_router(self._wire, SUPERVISOR)

    def is_over(self) -> bool:
        """Whether the run has ended, or this node leaves it."""
        return self._is_stopped or self.core.ended is not None or bool(self.core.member.refusal)

    def finish(self) -> int:
        """Perform the last actions; return the exit code."""
        ended = self.core.ended
        how = "leaves the run" if ended is None else f"the run has ended at tick {ended.tick}: {ended.reason}"
        if not self.core.member.refusal:
            self.core.actions.append(Log("info", how))
        self.role.perform()
        self.leave()
        if self.core.member.refusal:
            return REFUSED
        return DONE if ended is not None else FAILED

    def leave(self) -> None:
        """Close the engines."""
        self._solver.close()

    def stop(self) -> None:
        """Have the node leave the run; a signal handler may call this."""
        self._is_stopped = True

    def _turn(self, now_ns: int) -> None:
        """Compute ticks up to the last complete inputs; a tick's first messages are published before it is solved."""
        core = self.core
        core.busy = self.role.busy
        self._shell.check(now_ns)
        if core.member.build is not None and not self._is_present:
            self._is_present = True
            self._wire.declare_alive()
            core.actions.append(Log("info", f"takes part in run {core.member.build.run}"))
        if self._supervisor_timeout.is_over(core.deployment, now_ns) and not self.is_over():
            core.actions.append(Log("error", "lost the supervisor, and it has not come back"))
            self.stop()
        core.advance(now_ns)
        self._solver.build()

    def _work(self, now_ns: int) -> bool:
        """Solve the current tick, if there is one to solve."""
        work = self.core.work
        if work is None:
            return False
        self._solver.solve(work)
        self.core.advance(now_ns)
        return True

    def _deadline_ns(self, now_ns: int) -> int:
        return self.core.deadline_ns()

    def _on_alive(self, plane: Plane, name: str, is_alive: bool) -> None:
        if plane is not Plane.SIMULATION:
            return
        self._shell.on_alive(name, is_alive)
        if name != SUPERVISOR or self.core.ended is not None:
            return
        if not is_alive:
            self.core.actions.append(Log("warning", "lost the supervisor: waits until it is back"))
        elif self._supervisor_timeout.is_alone:
            self.core.actions.append(Log("info", "the supervisor is back"))
        self._supervisor_timeout.hear(is_alive, time.monotonic_ns())


def run_node(name: str, connect: str, world: str = "", pki: Path | None = None, progress: Path | None = None) -> int:
    """Run a node until its run ends; return the exit code. Raises Refused when no router answers.

    `pki` is the folder with its certificate.
    """
    if not is_name(name):
        raise BadValue("not a name for a node", name)
    stop = Stop()
    with client_session(connect, f"node.{name}", pki, stop, sets_runtime=True) as (session, credentials):
        process = Process(name, progress)
        process.add(NodeShell(process, name, session, world, credentials))
        stop.then(process.stop)
        return process.run()


app = new_app()


@app.command()
def node(
    name: Annotated[str, typer.Option(help="Name of the node in the deployment.")],
    connect: Annotated[str, typer.Option(help="Address of the supervisor: tcp/HOST:PORT, or run:NAME.")],
    world: Annotated[str, typer.Option(help="Refuse to join a run of another world.")] = "",
    pki: PkiOption = None,
    progress_file: ProgressOption = None,
) -> None:
    """Run a simulation node.

    The supervisor sends the deployment and the models. The process ends with the run.

    Exit codes: 0 when the run ended, 1 when the supervisor was lost for longer than the deployment's
    `deadlines.orphan`, 3 when the supervisor refused it.
    """
    die_with_parent()
    raise typer.Exit(run_node(name, connect, world, pki, progress_file))
