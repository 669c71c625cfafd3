"""A packet on its way through the pipeline, and what became of it.

A flight is made when a packet is offered to one receiver; stages read it and write its due time, or name the one cause
of its drop, with the inputs that led there. Neighbours: `links` walks the stages, `stages` are one file each.
"""

from __future__ import annotations

from typing import Final

from foosim.protocol.limits import PACKET_HEAD_BYTES_MAX

DELIVERED: Final = "delivered"
DROPPED: Final = "dropped"
IN_FLIGHT: Final = "in_flight"


class Flight:
    """One offered packet: from `source` to one receiver. Times are simulated nanoseconds."""

    __slots__ = (
        "arrival_tick",
        "cause",
        "channel",
        "copy",
        "destination",
        "due_ns",
        "payload",
        "released_wall_ns",
        "rule",
        "sent_ns",
        "sequence",
        "source",
        "stamp_ns",
        "words",
    )

    def __init__(
        self, source: str, destination: str, channel: str, sequence: int, sent_ns: int, stamp_ns: int, payload: bytes
    ) -> None:
        self.source = source
        self.destination = destination
        self.channel = channel
        self.sequence = sequence
        self.copy = 0
        self.sent_ns = sent_ns
        self.stamp_ns = stamp_ns
        self.payload = payload
        self.due_ns = sent_ns
        self.arrival_tick = -1
        """-1 until it is on its way; a packet that is dropped at sending never is."""
        self.cause = ""
        self.rule = ""
        self.words: tuple[int, ...] = ()
        """The draws of the packet, when a stage asked for them: eight 64-bit words."""
        self.released_wall_ns = 0


def size_of(flight: Flight) -> int:
    """Return how many bytes a packet takes in a message at most."""
    return PACKET_HEAD_BYTES_MAX + len(flight.payload)
