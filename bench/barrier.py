"""The barrier of a tick, and nothing else: what do messages cost? `python bench/barrier.py [--json]`

Four processes exchange what a tick needs: the supervisor (router of the plane), two nodes and the vHub. Seven messages
are published for each tick and twelve received:

    order       supervisor -> both nodes, four ticks ahead
    part        node -> other node, supervisor
    commit      supervisor -> vHub, when both parts are there
    samples     node -> vHub
    deliveries  vHub -> both nodes, supervisor, when commit and samples are there

Each row is a way to receive or to send. Ticks per second say what is left of the machine when it does nothing else;
processor time per tick is what a real run pays, and is what to compare on a machine that others use, too. Rows take
turns, so that a disturbance hits all of them; the most ticks and the least time of the turns are shown.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from foosim.common.limits import RELEASE_AHEAD, WANT_AFTER_NS
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import CLIENT_RUNTIME, ROUTER_RUNTIME, Session

ROLES: Final = ("supervisor", "node1", "node2", "vhub")
KIND: Final = {"supervisor": "supervisor", "node1": "node", "node2": "node", "vhub": "vhub"}
GROUP: Final = {"order": "tick", "part": "tick", "deliveries": "tick", "commit": "hub", "samples": "hub"}
"""Stands in the key, so that one expression can hold all that a process reads."""
READS: Final = {
    "supervisor": ("part", "deliveries"),
    "node": ("order", "part", "deliveries"),
    "vhub": ("commit", "samples"),
}
WRITES: Final = {"supervisor": ("order", "commit"), "node": ("samples", "part"), "vhub": ("deliveries",)}
PREAMBLE: Final = (1 << 64) - 1
"""The tick of a message that only finds out whether its readers hear it."""
SILENCE_S: Final = 5.0
ZENOHS_OWN: Final = "()"


@dataclass(frozen=True, slots=True)
class Way:
    """One way to receive and send, and Zenoh's threads in the router and in its clients.

    The reader `waits` for all that it `lacks` of one channel (nothing else wakes it), for `any` message of its channels
    in one queue, or for `threads`, one for each channel.
    """

    name: str
    waits: str = "lacks"
    express: bool = True
    router_runtime: str = ROUTER_RUNTIME
    client_runtime: str = CLIENT_RUNTIME


WAYS: Final = (
    Way("as foosim does"),
    Way("one queue for all channels", waits="any"),
    Way("a thread for each channel", waits="threads"),
    Way("batched, not express", express=False),
    Way("Zenoh's own threads", router_runtime=ZENOHS_OWN, client_runtime=ZENOHS_OWN),
    Way("both of Zenoh's", waits="threads", router_runtime=ZENOHS_OWN, client_runtime=ZENOHS_OWN),
    Way("the client's threads in the router", router_runtime=CLIENT_RUNTIME),
    Way("another thread watches the router's sockets", router_runtime="(rx: (worker_threads: 8))"),
)


@dataclass(frozen=True, slots=True)
class Load:
    """How many ticks, what a message weighs, and how long each process computes in a tick."""

    ticks: int
    message_bytes: int
    node_us: int
    server_us: int


@dataclass(frozen=True, slots=True)
class Cost:
    """What one process paid for a tick: processor time and voluntary changes of context."""

    ticks_per_s: float
    cpu_us: float
    switches: float


def key_of(channel: str, sender: str) -> str:
    return f"bench/{GROUP[channel]}/{channel}/{sender}"


def read_key(key: str) -> tuple[str, str]:
    _, _, channel, sender = key.split("/")
    return channel, sender


class Member:
    """One process of the barrier: its session, and what it has heard."""

    def __init__(self, role: str, locator: str, way: Way, load: Load) -> None:
        self.role = role
        self.load = load
        self.session = Session.router(locator) if role == "supervisor" else Session.client(locator, 20.0)
        self.inbox = Inbox(1 << 16)
        self.heard: set[tuple[str, str, int]] = set()
        kind = KIND[role]
        reads = READS[kind]
        if way.waits == "any":
            self.session.receive(f"bench/{GROUP[reads[0]]}", "", read_key, self.inbox)
        for channel in () if way.waits == "any" else reads:
            if way.waits == "lacks":
                self.session.receive(key_of(channel, "*"), channel, read_key, self.inbox)
            else:
                self.session.subscribe(key_of(channel, "*"), channel, self.inbox)
        self.publishers = {
            channel: self.session.publisher(key_of(channel, role), express=way.express) for channel in WRITES[kind]
        }
        self.filling = bytes(load.message_bytes - 8)

    def needs(self) -> set[tuple[str, str]]:
        """Return (channel, sender) of all that it waits for."""
        if self.role == "vhub":
            return {("commit", "supervisor"), ("samples", "node1"), ("samples", "node2")}
        if self.role == "supervisor":
            return {("part", "node1"), ("part", "node2"), ("deliveries", "vhub")}
        return {("order", "supervisor"), ("deliveries", "vhub"), ("part", other_node(self.role))}

    def put(self, channel: str, tick: int) -> None:
        self.publishers[channel].put(tick.to_bytes(8, "little") + self.filling)

    def take(self, lacking: str = "", count: int = 1) -> None:
        for channel, sender, payload in self.inbox.take(WANT_AFTER_NS / 1e9, lacking, count):
            self.heard.add((channel, sender, int.from_bytes(payload[:8], "little")))

    def wait_for(self, *wanted: tuple[str, str, int]) -> None:
        """Return when all of these have been heard; what comes last stands last."""
        since = time.monotonic()
        while missing := [want for want in wanted if want not in self.heard]:
            lacking = missing[-1][0]
            self.take(lacking, sum(channel == lacking for channel, _, _ in missing))
            assert time.monotonic() - since < SILENCE_S, f"{self.role} has not heard {missing}"
        self.heard.difference_update(wanted)

    def meet(self) -> None:
        """Return when each process hears all it needs: that one subscribes takes time to reach the publishers."""
        wanted = {(channel, sender, PREAMBLE) for channel, sender in self.needs()}
        ready = False
        while len(self.session.alive("bench-ready/*")) < len(ROLES):
            for channel in self.publishers:
                self.put(channel, PREAMBLE)
            self.take()
            if not ready and wanted <= self.heard:
                ready = True
                self.session.declare_alive(f"bench-ready/{self.role}")

    def compute(self, time_us: int) -> None:
        """Keep the interpreter busy, as numpy and the physics engine do."""
        end_ns = time.thread_time_ns() + time_us * 1000
        while time_us and time.thread_time_ns() < end_ns:
            pass

    def ticks(self) -> Iterator[int]:
        """Take part in the barrier; yields each tick when it is over."""
        return {"supervisor": self._supervisor, "node": self._node, "vhub": self._vhub}[KIND[self.role]]()

    def _supervisor(self) -> Iterator[int]:
        for tick in range(RELEASE_AHEAD):
            self.put("order", tick)
        self.put("commit", 0)
        for tick in range(self.load.ticks):
            self.wait_for(("deliveries", "vhub", tick), ("part", "node1", tick), ("part", "node2", tick))
            self.compute(self.load.server_us)
            self.put("commit", tick + 1)
            self.put("order", tick + RELEASE_AHEAD)
            yield tick

    def _node(self) -> Iterator[int]:
        for tick in range(self.load.ticks):
            self.put("samples", tick)
            self.wait_for(("order", "supervisor", tick), ("deliveries", "vhub", tick))
            self.compute(self.load.node_us)
            self.put("part", tick)
            self.wait_for(("part", other_node(self.role), tick))
            yield tick

    def _vhub(self) -> Iterator[int]:
        self.put("deliveries", 0)
        for tick in range(self.load.ticks):
            self.wait_for(("commit", "supervisor", tick), ("samples", "node1", tick), ("samples", "node2", tick))
            self.compute(self.load.server_us)
            self.put("deliveries", tick + 1)
            yield tick


def other_node(role: str) -> str:
    return "node2" if role == "node1" else "node1"


def play(role: str, locator: str, way: Way, load: Load) -> Cost:
    """Be one process of the barrier. The first fifth of the ticks warms up and is not counted."""
    member = Member(role, locator, way, load)
    with member.session:
        member.meet()
        first = load.ticks // 5
        start_ns, used = time.monotonic_ns(), resource.getrusage(resource.RUSAGE_SELF)
        for tick in member.ticks():
            if tick == first - 1:
                start_ns, used = time.monotonic_ns(), resource.getrusage(resource.RUSAGE_SELF)
        seconds, now = (time.monotonic_ns() - start_ns) / 1e9, resource.getrusage(resource.RUSAGE_SELF)
        while role == "supervisor" and len(member.session.alive("bench-ready/*")) > 1:
            time.sleep(0.05)  # the others still need the router
        counted = load.ticks - first
        cpu_s = now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime
        return Cost(counted / seconds, cpu_s / counted * 1e6, (now.ru_nvcsw - used.ru_nvcsw) / counted)


def measure(way: Way, load: Load) -> dict[str, Cost]:
    """Run the barrier once, in processes of its own."""
    locator = f"tcp/127.0.0.1:{free_port()}"
    children = []
    for role in ROLES:
        runtime = way.router_runtime if role == "supervisor" else way.client_runtime
        task = json.dumps({"role": role, "locator": locator, "way": asdict(way), "load": asdict(load)})
        environment = {**os.environ, "ZENOH_RUNTIME": runtime}
        command = [sys.executable, __file__, "--play", task]
        children.append(subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True))
    try:
        answers = [child.communicate(timeout=120)[0] for child in children]
    finally:
        for child in children:
            child.kill()
    return {role: Cost(**json.loads(answer)) for role, answer in zip(ROLES, answers, strict=True)}


def compare(ways: Sequence[Way], load: Load, turns: int) -> list[dict[str, Any]]:
    """Measure all ways in turns; return a row for each."""
    runs: dict[str, list[dict[str, Cost]]] = {way.name: [] for way in ways}
    for _ in range(turns):
        for way in ways:
            runs[way.name].append(measure(way, load))
    return [row_of(name, costs) for name, costs in runs.items()]


def row_of(name: str, runs: Sequence[dict[str, Cost]]) -> dict[str, Any]:
    """Return the best of some runs of one way."""
    least = min(runs, key=lambda costs: sum(cost.cpu_us for cost in costs.values()))
    return {
        "way": name,
        "ticks_per_s": round(max(costs["supervisor"].ticks_per_s for costs in runs)),
        "cpu_us": round(sum(cost.cpu_us for cost in least.values())),
        "switches": round(sum(cost.switches for cost in least.values()), 1),
        "processes": {role: round(cost.cpu_us) for role, cost in least.items()},
    }


def table(rows: Sequence[dict[str, Any]], load: Load) -> str:
    """Return the rows for people."""
    lines = [
        f"{load.message_bytes} bytes a message; each node computes {load.node_us} us a tick, each server "
        f"{load.server_us} us; {os.cpu_count()} cores, {platform.machine()}",
        f"{'':36}{'ticks/s':>8}{'us/tick':>9}{'switches':>10}" + "".join(f"{role:>12}" for role in ROLES),
    ]
    lines += [
        f"{row['way']:36}{row['ticks_per_s']:>8}{row['cpu_us']:>9}{row['switches']:>10}"
        + "".join(f"{row['processes'][role]:>12}" for role in ROLES)
        for row in rows
    ]
    return "\n".join(lines)


def free_port() -> int:
    """Return a port that was free a moment ago: the clients must know it before the router listens."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure; print a table, and JSON in the last line."""
    parser = argparse.ArgumentParser(description="What the messages of a tick cost.")
    parser.add_argument("--ticks", type=int, default=5000)
    parser.add_argument("--bytes", type=int, default=1200, help="size of a message")
    parser.add_argument("--node-us", type=int, default=0, help="processor time that a node computes in a tick")
    parser.add_argument("--server-us", type=int, default=0, help="the same of supervisor and vHub")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--json", action="store_true", help="JSON only")
    parser.add_argument("--play", help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    if chosen.play is not None:
        task = json.loads(chosen.play)
        cost = play(task["role"], task["locator"], Way(**task["way"]), Load(**task["load"]))
        print(json.dumps(asdict(cost)), flush=True)
        return
    load = Load(chosen.ticks, chosen.bytes, chosen.node_us, chosen.server_us)
    rows = compare(WAYS, load, chosen.turns)
    if not chosen.json:
        print(table(rows, load))
    print(json.dumps({"load": asdict(load), "rows": rows}))


if __name__ == "__main__":
    main()
