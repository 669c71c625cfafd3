"""Packets offered to links of a small deployment, and what becomes of them: the real pipeline, from a text to a fate.

Clients `a` to `d` (and the table's robots) are the ends. `fates` drives one link and gives its flights one by one, so
that a million of them need no memory; `play` drives many links in the order of simulated time, arrivals among them;
`Hub` closes ticks of a whole state.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from heapq import heappop, heappush
from pathlib import Path
from typing import Final

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Deliveries, Sent
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight
from foosim.vhub.network.series_math import ln
from foosim.vhub.state.hub_state import HubState
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.edits import Edit
from foosim.world.frame import Frame
from foosim.world.robot_packets import RobotPacket

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
ENDS: Final = ("a", "b", "c", "d")
MS: Final = 1_000_000
S: Final = 1_000_000_000


@lru_cache(maxsize=256)
def _load(sets: tuple[str, ...]) -> Deployment:
    clients = ", ".join(f"{name}: {{}}" for name in ENDS)
    base = "players={}", f"clients={{{clients}}}", "network.links=[]"
    return load_deployment(apply_sets(TABLE.read_text(), "t", [*base, *sets]), "t")


def deployment_of(*sets: str, files: Mapping[str, str] | None = None) -> Deployment:
    """Return the table without players, with the four clients, and what is set."""
    deployment = _load(sets)
    return deployment if files is None else deployment.with_assets({k: v.encode() for k, v in files.items()})


def rule(settings: str, ends: str = "from: a, to: b", name: str = "tried") -> str:
    """Return the set that gives the network one rule."""
    return f"network.links=[{{id: {name}, {ends}, {settings}}}]"


def fabric_of(settings: str, seed: int = 1, *sets: str, files: Mapping[str, str] | None = None) -> Fabric:
    """Return a network in which the rule for a to b has these settings."""
    deployment = deployment_of(rule(settings), *sets, files=files)
    return Fabric(deployment, deployment.network.model_copy(update={"seed": seed}))


def fates(
    fabric: Fabric,
    times_ns: Iterable[int],
    sizes: Iterable[int] | int = 100,
    ends: tuple[str, str] = ("a", "b"),
    channel: str = "data",
) -> Iterator[Flight]:
    """Offer packets 1, 2, ... at times that ascend to one link; yield each after its arrival or its drop."""
    source, destination = ends
    link = fabric.link(source, destination, channel)
    payload = bytes(sizes) if isinstance(sizes, int) else b""
    lengths = None if isinstance(sizes, int) else iter(sizes)
    for sequence, sent_ns in enumerate(times_ns, 1):
        if lengths is not None:
            payload = bytes(next(lengths))
        flight = Flight(source, destination, channel, sequence, sent_ns, 0, payload)
        if link.send(flight):
            link.arrive(flight, "")
        yield flight


def play(fabric: Fabric, offers: Sequence[Flight]) -> list[Flight]:
    """Offer flights in (time, source, sequence) order; whatever is due is judged at arrival before what is sent later.

    Return them in that order. Copies that links make are offered, too; they are at the end.
    """
    waiting: list[tuple[int, int, Flight]] = []
    order = sorted(offers, key=lambda flight: (flight.sent_ns, flight.source, flight.sequence, flight.destination))
    copies: list[Flight] = []

    def send(flight: Flight) -> None:
        payload = flight.payload
        if fabric.link(flight.source, flight.destination, flight.channel).send(flight):
            heappush(waiting, (flight.due_ns, len(waiting) + id(flight), flight))
            if flight.is_doubled:
                what = flight.sequence, flight.sent_ns, flight.stamp_ns, payload, flight.published
                twin = Flight(flight.source, flight.destination, flight.channel, *what, copy=1)
                copies.append(twin)
                send(twin)

    for flight in order:
        while waiting and waiting[0][0] <= flight.sent_ns:
            arrived = heappop(waiting)[2]
            fabric.link(arrived.source, arrived.destination, arrived.channel).arrive(arrived, "")
        send(flight)
    while waiting:
        arrived = heappop(waiting)[2]
        fabric.link(arrived.source, arrived.destination, arrived.channel).arrive(arrived, "")
    return order + copies


def uniforms(count: int, seed: int, *purpose: str) -> list[float]:
    """Return numbers between 0 and 1 that have nothing to do with any link's."""
    key = draw_key(seed, "offered", *purpose)
    words = (word for block in range(-(-count // 8)) for word in draw_words(key, block))
    return [unit_interval(next(words)) for _ in range(count)]


def poisson_ns(count: int, rate_hz: float, seed: int) -> list[int]:
    """Return the times of a Poisson process."""
    at = 0.0
    times = []
    for u in uniforms(count, seed, "poisson"):
        at -= ln(1.0 - u) / rate_hz * 1e9
        times.append(int(at))
    return times


def every(period_ns: int, count: int, first_ns: int = 0) -> range:
    """Return the times of a periodic sender."""
    return range(first_ns, first_ns + count * period_ns, period_ns)


class Hub:
    """A hub's state whose ticks are closed under packets of clients and robots; fates are kept as they become final."""

    def __init__(self, deployment: Deployment, state: HubState | None = None, joined: Sequence[str] = ENDS) -> None:
        self.deployment = deployment
        self.start = initial_frame(deployment)
        if state is None:
            state = HubState(deployment)
            heard = [(source, "news") for source in (*ENDS, "red.goal")]
            for name in joined:
                state.join(Joining(name, 0, [pair for pair in heard if pair[0] != name]), 0)
        self.state = state
        self.fates: list[Flight] = []
        self.deliveries: list[Deliveries] = []

    def close(
        self, sent: Mapping[str, Sequence[Sent]], packets: Sequence[RobotPacket] = (), edits: Sequence[Edit] = ()
    ) -> None:
        """Close the next tick."""
        tick = self.state.closed + 1
        frame = Frame(tick, self.start.layout, self.start.values)
        self.state.close_world(frame, packets, self.fates, edits)
        self.deliveries.append(self.state.close_clients(frame, sent, self.fates))
