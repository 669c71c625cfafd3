"""The cost of a verdict with its row, on one core: without radio, and with every stage of a Wi-Fi link through walls.

Endpoints stand in a hall of concrete walls and send to one another, by turns a unicast and a broadcast to three; the
frame is another one at each tick, so nothing about places is remembered longer than in a run. Judging at sending and at
arrival, the row and its JSON are in the time. `rovers` are the 20 of the warehouse, among its shelves, each on a circle
of its own: no line of sight is that of the tick before. The last two lines send the same packets among 200 endpoints,
with 40,000 possible links: cost follows the traffic.
"""

from __future__ import annotations

import gc
import json
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from math import cos, sin, tau
from typing import Any, Final

import msgspec
import numpy as np
import yaml

from bench.runs import ROOT, TABLE
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.runtime import GC_THRESHOLDS
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.packet import Flight
from foosim.vhub.recording.rows_of_closing import packet_row
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import Frame
from foosim.world.layout import build_layout

WAREHOUSE: Final = ROOT / "deploy" / "warehouse.yaml"
TICK_NS: Final = 2_000_000
PAYLOAD: Final = bytes(100)
TALKERS: Final = 20
WARM_TICKS: Final = 20
RECEIVERS: Final = 3
"""Of a broadcast."""
WALL: Final = {
    "shape": "box",
    "length": "0.2 m",
    "width": "10 m",
    "height": "3 m",
    "surface": "walls",
    "radio": "concrete",
}
WIRE: Final = {
    "links": [
        {
            "id": "wire",
            "from": "*",
            "to": "*",
            "delay": "1 ms",
            "jitter": {"shape": "gamma", "sd": "0.3 ms"},
            "loss": "0.5 %",
        }
    ]
}
WIFI: Final = {
    "radios": {"wifi": {"preset": "wifi_5_indoor", "fading": {"kind": "nakagami"}}},
    "robots": {"e*": ["wifi"]},
}
CIRCLE_M: Final = 2.0
TURN_TICKS: Final = 5_000
"""A circle of a rover takes 10 s."""
Frames = Callable[[int], Frame]
"""Gives the frame of a tick."""


@dataclass(frozen=True, slots=True)
class Verdicts:
    """One way: the number of endpoints, the number of judged packets, and their fates."""

    way: str
    endpoints: int
    packets: int
    us_per_packet: float
    row_bytes: float
    fates: dict[str, int]


def verdict(seconds: float = 4.0) -> list[Verdicts]:
    """Measure each way for some simulated seconds of 20 packets a tick."""
    ticks = max(10, round(seconds * 100))
    found = []
    for way, network, count in (("wire", WIRE, 20), ("wifi", WIFI, 20), ("wire", WIRE, 200), ("wifi", WIFI, 200)):
        deployment = standing(network, count)
        found.append(measure(way, deployment, resting(deployment), [f"e{n}" for n in range(count)], ticks))
    deployment = driving()
    names = [name for name in deployment.robots if name.startswith("rover")]
    found.insert(2, measure("rovers", deployment, circling(deployment), names, ticks))
    return found


def standing(network: dict[str, Any], count: int) -> Deployment:
    """Return the table's hall with `count` clients, in rows between walls."""
    data = yaml.safe_load(TABLE.read_text())
    names = [f"e{n}" for n in range(count)]
    data["players"], data["clients"] = {}, {name: {} for name in names}
    data["scenery"] = {f"wall-{n}": {**WALL, "x": f"{3 * n - 8} m"} for n in range(6)}
    places = {
        name: [f"{n % 10 * 1.7 - 7.7:.1f} m", f"{n // 10 * 0.4 - 4:.1f} m", "1 m"] for n, name in enumerate(names)
    }
    data["network"] = {**network, "places": places}
    return load_deployment(yaml.safe_dump(data), TABLE.name)


def driving() -> Deployment:
    """Return the warehouse over the bench's network."""
    network = json.dumps({**WIFI, "robots": {"rover*": ["wifi"]}})
    return load_deployment(apply_sets(WAREHOUSE.read_text(), WAREHOUSE.name, [f"network={network}"]), WAREHOUSE.name)


def resting(deployment: Deployment) -> Frames:
    """Return frames in which nothing moves."""
    layout = build_layout(deployment)
    numbers = np.array(initial_numbers(deployment, layout))
    return lambda tick: Frame(tick, layout, numbers)


def circling(deployment: Deployment) -> Frames:
    """Return frames in which each rover drives on a circle."""
    layout = build_layout(deployment)
    numbers = np.array(initial_numbers(deployment, layout))
    places = [entity.offsets["position"] for entity in layout.of("rover")]

    def frame(tick: int) -> Frame:
        moved = numbers.copy()
        for n, at in enumerate(places):
            angle = tau * (tick / TURN_TICKS + n / len(places))
            moved[at] += CIRCLE_M * cos(angle)
            moved[at + 1] += CIRCLE_M * sin(angle)
        return Frame(tick, layout, moved)

    return frame


def measure(way: str, deployment: Deployment, frames: Frames, names: list[str], ticks: int) -> Verdicts:
    """Measure `ticks` ticks of packets from the first of the endpoints `names`."""
    fabric = Fabric(deployment)
    past = [frames(tick) for tick in range(WARM_TICKS + ticks)]
    fates: Counter[str] = Counter()
    judged = size = 0
    begun_s = 0.0
    under_way: list[Flight] = []
    for tick in range(-WARM_TICKS, ticks):
        if tick == 0:  # tables that are made once a run are there, and garbage is collected as in a process that runs
            gc.collect()
            gc.freeze()
            gc.set_threshold(*GC_THRESHOLDS)
            fates.clear()
            judged = size = 0
            begun_s = time.process_time()
        fabric.turn_to(past[WARM_TICKS + tick])
        for flight in _offered(WARM_TICKS + tick, names):
            link = fabric.link(flight.source, flight.destination, flight.channel)
            judged += 1
            if link.send(flight):
                under_way.append(flight)
            else:
                size += _row(flight, fates)
        over_ns = (WARM_TICKS + tick + 1) * TICK_NS
        late = [flight for flight in under_way if flight.due_ns > over_ns]
        for flight in under_way:
            if flight.due_ns <= over_ns:
                flight.arrival_tick = tick + 1
                fabric.link(flight.source, flight.destination, flight.channel).arrive(flight, "")
                size += _row(flight, fates)
        under_way = late
    spent_s = time.process_time() - begun_s
    gc.unfreeze()
    return Verdicts(way, len(names), judged, round(spent_s / judged * 1e6, 1), round(size / judged, 1), dict(fates))


def _row(flight: Flight, fates: Counter[str]) -> int:
    """Count a packet's fate and make its row; return how long that is without the payload."""
    fates[flight.cause or "delivered"] += 1
    return len(msgspec.json.encode(packet_row(flight))) - 4 * len(PAYLOAD) // 3


def _offered(tick: int, names: list[str]) -> list[Flight]:
    """Return the packets sent at a tick: by half of the talkers to the next one, by a few to three."""
    sent_ns = tick * TICK_NS
    flights = []
    for n in range(tick % 2, TALKERS, 2):
        source = names[n]
        if n % 5:
            to, published = [(n + 1 + tick % 7) % TALKERS], False
        else:
            to, published = [(n + 1 + k) % TALKERS for k in range(RECEIVERS)], True
        flights += [Flight(source, names[one], "talk", tick, sent_ns, 0, PAYLOAD, published) for one in to if one != n]
    return flights


def lines(rows: list[Verdicts]) -> list[str]:
    """Return the figures for people."""
    goals = {"wire": "at most 12", "wifi": "at most 20", "rovers": "at most 20"}
    return [
        f"{row.way:6}{row.endpoints:5} endpoints {row.us_per_packet:7.1f} us a packet with its row ({goals[row.way]}), "
        f"{row.row_bytes:.0f} bytes of JSON beside it; "
        + ", ".join(f"{cause} {count}" for cause, count in sorted(row.fates.items()))
        for row in rows
    ]
