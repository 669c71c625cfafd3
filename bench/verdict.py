"""What a verdict with its row costs, on one core: without radio, and with every stage of a Wi-Fi link through walls.

Endpoints stand in a hall of concrete walls and send to one another, by turns a unicast and a broadcast to three; the
frame is another one at each tick, so nothing about places is remembered longer than in a run. Judging at sending and at
arrival, the row and its JSON are in the time. The last two lines send the same packets among 20 endpoints and among
200, with 40,000 possible links: cost follows the traffic.
Neighbours: `foosim.vhub.fabric`, `hub` (the whole core with journal and capture).
"""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass
from typing import Any, Final

import msgspec
import numpy as np
import yaml

from bench.runs import TABLE
from foosim.protocol.deployment import Deployment
from foosim.protocol.deployment_file import load_deployment
from foosim.protocol.frame import Frame
from foosim.protocol.layout import build_layout
from foosim.protocol.start import initial_numbers
from foosim.vhub.fabric import Fabric
from foosim.vhub.packet import Flight
from foosim.vhub.rows import packet_row

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


@dataclass(frozen=True, slots=True)
class Verdicts:
    """One way: so many endpoints, so many packets judged, what became of them."""

    way: str
    endpoints: int
    packets: int
    us_per_packet: float
    row_bytes: float
    fates: dict[str, int]


def verdict(seconds: float = 4.0) -> list[Verdicts]:
    """Measure each way for so many simulated seconds of 20 packets a tick."""
    ticks = max(10, round(seconds * 100))
    ways = (("wire", WIRE, TALKERS), ("wifi", WIFI, TALKERS), ("wire", WIRE, 200), ("wifi", WIFI, 200))
    return [_measure(way, network, count, ticks) for way, network, count in ways]


def _deployment(network: dict[str, Any], count: int) -> Deployment:
    data = yaml.safe_load(TABLE.read_text())
    names = [f"e{n}" for n in range(count)]
    data["players"], data["clients"] = {}, {name: {} for name in names}
    data["scenery"] = {f"wall-{n}": {**WALL, "x": f"{3 * n - 8} m"} for n in range(6)}
    places = {
        name: [f"{n % 10 * 1.7 - 7.7:.1f} m", f"{n // 10 * 0.4 - 4:.1f} m", "1 m"] for n, name in enumerate(names)
    }
    data["network"] = {**network, "places": places}
    return load_deployment(yaml.safe_dump(data), TABLE.name)


def _measure(way: str, network: dict[str, Any], count: int, ticks: int) -> Verdicts:
    deployment = _deployment(network, count)
    layout = build_layout(deployment)
    numbers = np.array(initial_numbers(deployment, layout))
    fabric = Fabric(deployment)
    fates: Counter[str] = Counter()
    judged = size = 0
    begun_s = 0.0
    for tick in range(-WARM_TICKS, ticks):
        if tick == 0:  # tables that are made once a run are there
            fates.clear()
            judged = size = 0
            begun_s = time.process_time()
        fabric.turn_to(Frame(WARM_TICKS + tick, layout, numbers))
        for flight in _offered(WARM_TICKS + tick):
            link = fabric.link(flight.source, flight.destination, flight.channel)
            if link.send(flight):
                flight.arrival_tick = tick + 1
                link.arrive(flight, "")
            size += len(msgspec.json.encode(packet_row(flight))) - 4 * len(PAYLOAD) // 3
            fates[flight.cause or "delivered"] += 1
            judged += 1
    spent_s = time.process_time() - begun_s
    return Verdicts(way, count, judged, round(spent_s / judged * 1e6, 1), round(size / judged, 1), dict(fates))


def _offered(tick: int) -> list[Flight]:
    """Return what is sent at a tick: by half of the talkers to the next one, by a few to three."""
    sent_ns = tick * TICK_NS
    flights = []
    for n in range(tick % 2, TALKERS, 2):
        source = f"e{n}"
        if n % 5:
            to, published = [(n + 1 + tick % 7) % TALKERS], False
        else:
            to, published = [(n + 1 + k) % TALKERS for k in range(RECEIVERS)], True
        flights += [Flight(source, f"e{one}", "talk", tick, sent_ns, 0, PAYLOAD, published) for one in to if one != n]
    return flights


def lines(rows: list[Verdicts]) -> list[str]:
    """Return the figures for people."""
    asked = {"wire": "at most 12", "wifi": "at most 20"}
    return [
        f"{row.way:6}{row.endpoints:5} endpoints {row.us_per_packet:7.1f} us a packet with its row ({asked[row.way]}), "
        f"{row.row_bytes:.0f} bytes of JSON beside it; "
        + ", ".join(f"{cause} {count}" for cause, count in sorted(row.fates.items()))
        for row in rows
    ]
