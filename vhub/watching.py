"""Keeps the last drops of links and the last readings of channels that viewers watch.

Unwatched links and channels keep nothing, and none of it is in the state, the journal or the capture: viewers do not
change a run.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Iterable, Mapping
from typing import Any, Final

import msgspec

from foosim.common.json_text import encode_json
from foosim.protocol.messages import Watched
from foosim.vhub.network.packet import IN_FLIGHT, Flight
from foosim.vhub.recording.rows_of_closing import packet_row
from foosim.vhub.state.hub_state import HubState
from foosim.world.robot_packets import RobotPacket

DROPS_KEPT: Final = 8
"""Of each link."""
READINGS_KEPT: Final = 128
"""Of each channel of a robot."""
REPORT_BYTES_MAX: Final = 96 * 1024
"""Limit of drops, of readings, and of requested network events in a report, which has the newest."""
_NUMBER_BYTES: Final = 8

Pair = tuple[str, str]


class WatchList:
    """The watched links and channels, with their last drops and readings."""

    def __init__(self) -> None:
        self.links: dict[Pair, deque[Flight]] = {}
        """By source and destination, the packets that were dropped last."""
        self.readings: dict[Pair, deque[bytes]] = {}
        """By robot and channel, the last readings as JSON: the tick and its numbers."""

    def take(self, watched: Watched, payload: bytes, now_ns: int) -> None:
        """Watch these links and readings; drop what was kept for others."""
        self.links = {pair: self.links.get(pair, deque(maxlen=DROPS_KEPT)) for pair in sorted(watched.links)}
        kept = self.readings
        self.readings = {pair: kept.get(pair, deque(maxlen=READINGS_KEPT)) for pair in sorted(watched.readings)}

    def sensed(self, tick: int, packets: Iterable[RobotPacket]) -> None:
        """Keep the robots' packets of watched readings."""
        for packet in packets:
            kept = self.readings.get((packet.robot, packet.channel))
            count, rest = divmod(len(packet.payload), _NUMBER_BYTES)
            if kept is not None and not rest:
                kept.append(encode_json([tick, struct.unpack(f"<{count}d", packet.payload)]))

    def judged(self, flights: Iterable[Flight]) -> None:
        """Keep the packets that were dropped on watched links."""
        for flight in flights:
            if flight.cause and flight.cause != IN_FLIGHT:
                kept = self.links.get((flight.source, flight.destination))
                if kept is not None:
                    kept.append(flight)

    def report(self, state: HubState) -> dict[str, Any]:
        """Return the report, empty while nothing is watched.

        `drops` has for each link, `FROM>TO`, its last packets that were dropped, as rows of a capture without their
        payloads, oldest first; `readings` for each `ROBOT/CHANNEL` its last readings, [tick, [numbers]]; `events` the
        requested events of the network, [tick, event as JSON], and `here` the active clients, both for the explanation
        of drops.
        """
        if not self.links and not self.readings:
            return {}
        rows = {f"{a}>{b}": [_row(flight) for flight in flights] for (a, b), flights in self.links.items()}
        readings = {f"{robot}/{channel}": list(kept) for (robot, channel), kept in self.readings.items()}
        events = [encode_json(event) for event in state.fabric.requested] if self.links else []
        watched = {
            "drops": _newest(rows),
            "readings": _newest(readings),
            "events": _newest({"": events})[""],
            "here": sorted(name for name, member in state.members.items() if member.active),
        }
        return {"watched": watched}


def _row(flight: Flight) -> bytes:
    return encode_json(msgspec.structs.replace(packet_row(flight), payload=b""))


def _newest(kept: Mapping[str, list[bytes]]) -> dict[str, list[msgspec.Raw]]:
    """Return the last of each that fit into an equal share of a report, in their order."""
    share = REPORT_BYTES_MAX // max(1, len(kept))
    newest: dict[str, list[msgspec.Raw]] = {}
    for name, contents in kept.items():
        left, chosen = share, []
        for content in reversed(contents):
            left -= len(content)
            if left < 0:
                break
            chosen.append(msgspec.Raw(content))
        newest[name] = chosen[::-1]
    return newest
