"""The table of faults: what is done to a run, and in how much time what must have followed.

A new kind is a function and a row. The function gets a running cluster and returns its figures; it raises FaultError
when something does not hold that must hold however slow the machine is. Figures are in ms unless their name says what
else they count.
"""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.runtime.process import script
from tests.faults.cluster import LIMIT_S, Cluster, FaultError
from tests.wire.proxy import BOTH, Direction

Figures = dict[str, float]

KILLED_MS: Final = 250.0
HUNG_MS: Final = 1500.0
SUPERVISOR_MS: Final = 2000.0
VHUB_MS: Final = 1000.0
BOTH_MS: Final = SUPERVISOR_MS + VHUB_MS
BACK_MS: Final = 2000.0
JOIN_MS: Final = 1000.0
BLINK_S: Final = 0.2
CALM_S: Final = (0.2, 0.7)
ADDED: Final = 41
"""With eight rods and the ball there are 50 bodies."""

HANGING_NODE: Final = """
import ctypes, signal
def hang(number, frame):
    while True:
        ctypes.PyDLL(None).usleep(100_000)  # holds the interpreter, as a loop in C does
signal.signal(signal.SIGUSR1, hang)
from foosim.cli import main
main()
"""
"""A node that hangs for ever at SIGUSR1, while the threads of its session go on."""
NODE: Final = [sys.executable, "-c", HANGING_NODE, "role", "node"]


@dataclass(slots=True)
class Trial:
    """What a fault is done to, and the dice that decide when and to whom."""

    cluster: Cluster
    dice: random.Random
    calm_s: tuple[float, float] = CALM_S

    def calm(self) -> None:
        """Let the run go on for a random time."""
        self.cluster.advance()
        time.sleep(self.dice.uniform(*self.calm_s))

    def node(self) -> str:
        return self.dice.choice(self.cluster.nodes)


@dataclass(frozen=True, slots=True)
class Kind:
    """A row of the table. `limits` are those of the 99th percentile of figures, in their unit."""

    name: str
    title: str
    trial: Callable[[Trial], Figures]
    limits: Mapping[str, float] = field(default_factory=dict)
    sets: Sequence[str] = ()
    prepare: Callable[[Cluster], None] = lambda cluster: None
    altered: bool = False
    """Whether the world is altered by requests, so that a plain rehearsal is another one."""
    pace: str = "realtime"
    trials_a_run: int = 0
    """0: as many as usual."""
    costs: int = 1
    """Of how many trials of another kind one takes the place."""


def node_killed(trial: Trial) -> Figures:
    """`kill -9` of a node: the rest goes on from the last commit."""
    cluster, node = trial.cluster, trial.node()
    trial.calm()
    with Lost(cluster, node) as lost:
        cluster.take_down(node)
        outage_ms = lost.outage_ms()
        cluster.start(node)
    return {"outage": outage_ms}


def node_hung(trial: Trial) -> Figures:
    """SIGSTOP: no sign of life at all; then SIGCONT, and it is a zombie that has to come back by the handshake."""
    cluster, node = trial.cluster, trial.node()
    trial.calm()
    with Lost(cluster, node) as lost:
        cluster.signal(node, signal.SIGSTOP)
        outage_ms = lost.outage_ms()
        cluster.signal(node, signal.SIGCONT)
    return {"outage": outage_ms, "back": lost.back_ms}


def node_stuck(trial: Trial) -> Figures:
    """The interpreter hangs, links and presence live on; whoever watches the process kills it."""
    cluster, node = trial.cluster, trial.node()
    trial.calm()
    with Lost(cluster, node) as lost:
        cluster.signal(node, signal.SIGUSR1)
        outage_ms = lost.outage_ms()
        cluster.take_down(node)
        cluster.start(node)
    return {"outage": outage_ms}


def node_blinks(trial: Trial) -> Figures:
    """A node stands still for 0.2 s: too short to be lost."""
    cluster, node = trial.cluster, trial.node()
    trial.calm()
    known = len(cluster.status()["recoveries"])
    cluster.signal(node, signal.SIGSTOP)
    time.sleep(BLINK_S)
    cluster.signal(node, signal.SIGCONT)
    cluster.advance(50)
    lost = len(cluster.status()["recoveries"]) - known
    cluster.wait("all nodes", lambda: not missing(cluster))
    return {"nodes lost": lost}


def link_cut(trial: Trial) -> Figures:
    """The node's connection is reset: seen at once by both sides."""
    cluster, node = trial.cluster, trial.node()
    trial.calm()
    with Lost(cluster, node) as lost:
        cluster.proxies[node].cut()
        outage_ms = lost.outage_ms()
    return {"outage": outage_ms}


def link_silent(trial: Trial) -> Figures:
    """Nothing passes any more, in one direction or both, and nobody is told: a cable is out, a machine is off."""
    cluster, node = trial.cluster, trial.node()
    ways: list[Sequence[Direction]] = [["up"], ["down"], BOTH]
    trial.calm()
    with Lost(cluster, node) as lost:
        cluster.proxies[node].silence(trial.dice.choice(ways))
        outage_ms = lost.outage_ms()
        cluster.proxies[node].heal()
    return {"outage": outage_ms}


def node_stopped(trial: Trial) -> Figures:
    """Somebody stops a node and starts it again: its robots move away first, so nothing is lost."""
    cluster, node = trial.cluster, trial.node()
    trial.calm()
    known = len(cluster.recoveries("join", node))
    cluster.keep_down(node)
    cluster.control.request("stop", node=node)
    cluster.wait(f"the end of {node}", lambda: not cluster.is_alive(node))
    cluster.control.request("start", node=node)
    cluster.start(node)
    return {"outage": float(cluster.next_recovery("join", node, known)["outage_ms"])}


def robot_moved(trial: Trial) -> Figures:
    """A robot gets another owner, and its own one back."""
    cluster, dice = trial.cluster, trial.dice
    robot = dice.choice(sorted(cluster.deployment.robots))
    (home,) = [name for name, node in cluster.deployment.nodes.items() if robot in node.robots]
    away = dice.choice([node for node in cluster.nodes if node != home])
    trial.calm()
    for node in (away, home):
        cluster.control.request("move", robot=robot, node=node)
        cluster.advance()
        if robot not in cluster.status()["nodes"][node]["owned"]:
            raise FaultError(f"{robot} was moved to {node}, which does not own it")
    return {}


def twin_refused(trial: Trial) -> Figures:
    """A second node of the same name is refused, and costs the first one nothing."""
    cluster, node = trial.cluster, trial.node()
    trial.calm()
    before = cluster.status()
    words = cluster.command(node)
    done = subprocess.run(
        [script(words[0]), *words[1:]], capture_output=True, text=True, timeout=LIMIT_S, check=False, cwd=cluster.folder
    )
    if done.returncode != 3 or f"a node {node} is already here" not in done.stderr:
        raise FaultError(f"a second {node} ended with exit code {done.returncode}: {done.stderr[-200:]}")
    after = cluster.status()
    if after["recoveries"] != before["recoveries"]:
        raise FaultError(f"a second {node} cost the run {after['recoveries'][len(before['recoveries']) :]}")
    return {}


def supervisor_killed(trial: Trial) -> Figures:
    """`kill -9` of the supervisor: another one takes over the nodes that hold."""
    return _started_again(trial, SUPERVISOR)


def vhub_killed(trial: Trial) -> Figures:
    """`kill -9` of the vHub: another one goes on from its journal, and the players come back to it."""
    return _started_again(trial, VHUB)


def both_killed(trial: Trial) -> Figures:
    """`kill -9` of supervisor and vHub at once: each goes on from its own journal, whoever is back first."""
    cluster = trial.cluster
    trial.calm()
    known = len(cluster.recoveries(SUPERVISOR, SUPERVISOR))
    both = [SUPERVISOR, VHUB]
    trial.dice.shuffle(both)
    for process in both:
        cluster.take_down(process)
    trial.dice.shuffle(both)
    for process in both:
        cluster.start(process)
    return {"outage": float(cluster.next_recovery(SUPERVISOR, SUPERVISOR, known)["outage_ms"])}


def _started_again(trial: Trial, process: str) -> Figures:
    cluster = trial.cluster
    trial.calm()
    known = len(cluster.recoveries(process, process))
    cluster.take_down(process)
    cluster.start(process)
    return {"outage": float(cluster.next_recovery(process, process, known)["outage_ms"])}


def node_joins(trial: Trial) -> Figures:
    """A node comes late to a world of 50 bodies: from its hello until it takes part."""
    cluster, node = trial.cluster, trial.node()
    trial.calm()
    with Lost(cluster, node) as lost:
        cluster.take_down(node)
        lost.outage_ms()
        cluster.start(node)
        cluster.wait(f"the hello of {node}", lambda: not cluster.status()["processes"][node]["lost"])
        hello_s = time.monotonic()
        cluster.next_recovery("join", node, lost.joined)
        joined_ms = 1e3 * (time.monotonic() - hello_s)
    return {"join": joined_ms}


def add_bodies(cluster: Cluster) -> None:
    """Fill the table: rows of balls between the rods, that fall on it."""
    for number in range(ADDED):
        x, y = -0.45 + 0.15 * (number % 7), -0.25 + 0.1 * (number // 7)
        cluster.control.request("add", name="ball", at=f"{x:g},{y:g},0.1")


class Lost:
    """A node that is to be lost and to come back, within `with`; its end waits until the node is back."""

    def __init__(self, cluster: Cluster, node: str) -> None:
        self.back_ms = 0.0
        self.joined = len(cluster.recoveries("join", node))
        self._cluster = cluster
        self._node = node
        self._lost = len(cluster.recoveries("node", node))
        self._on_s = 0.0

    def outage_ms(self) -> float:
        """Wait until the others go on without it; return the time without a commit."""
        found = self._cluster.next_recovery("node", self._node, self._lost)
        self._on_s = time.monotonic()
        return float(found["outage_ms"])

    def __enter__(self) -> Lost:
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        if kind is not None:
            return
        cluster, node = self._cluster, self._node
        cluster.next_recovery("join", node, self.joined)
        self.back_ms = 1e3 * (time.monotonic() - self._on_s)
        cluster.wait(f"all robots of {node}", lambda: not missing(cluster))


def missing(cluster: Cluster) -> list[str]:
    """Return the nodes that do not have their own robots."""
    owned: dict[str, Any] = cluster.status()["nodes"]
    declared = cluster.deployment.nodes
    return [name for name, node in declared.items() if sorted(node.robots) != sorted(owned[name]["owned"])]


KINDS: Final = (
    Kind("node_killed", "kill -9 of a node", node_killed, {"outage": KILLED_MS}),
    Kind("node_hung", "a node stands still, then goes on", node_hung, {"outage": HUNG_MS, "back": BACK_MS}),
    Kind("node_stuck", "a node's interpreter hangs", node_stuck, {"outage": HUNG_MS}),
    Kind("node_blinks", "a node stands still for 0.2 s", node_blinks, {"nodes lost": 0}),
    Kind("link_cut", "a node's connection is reset", link_cut, {"outage": KILLED_MS}),
    Kind("link_silent", "a node's link is silent, one way or both", link_silent, {"outage": HUNG_MS}),
    Kind("node_stopped", "a node is stopped and started", node_stopped, {"outage": KILLED_MS}),
    Kind("robot_moved", "a robot moves to another node and back", robot_moved),
    Kind("supervisor_killed", "kill -9 of the supervisor", supervisor_killed, {"outage": SUPERVISOR_MS}),
    Kind("vhub_killed", "kill -9 of the vHub", vhub_killed, {"outage": VHUB_MS}),
    Kind("both_killed", "kill -9 of supervisor and vHub", both_killed, {"outage": BOTH_MS}),
    Kind("twin_refused", "a second node of the same name", twin_refused),
    Kind(
        "node_joins",
        "a node comes to a world of 50 bodies",
        node_joins,
        {"join": JOIN_MS},
        sets=("tick=10 ms", "substeps=20", f"table.spare_balls={ADDED}"),
        prepare=add_bodies,
        altered=True,
    ),
)
