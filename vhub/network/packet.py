"""A packet in the pipeline, its fate, and the inputs of its fate.

A flight is made when a packet is offered to one receiver. The stages set its due time, or the one cause of its drop,
and the values that led to it.
"""

from __future__ import annotations

from collections.abc import Iterable
from operator import attrgetter
from typing import Final

from msgspec import convert

from foosim.common.limits import PACKET_HEAD_BYTES_MAX
from foosim.protocol.messages import Received
from foosim.vhub.network.memory import FlightState, Numbers
from foosim.vhub.radio.noise import centi, level_of

DELIVERED: Final = "delivered"
DROPPED: Final = "dropped"
IN_FLIGHT: Final = "in_flight"


class Flight:
    """One offered packet: from `source` to one receiver. `memory.FlightState` describes its attributes."""

    __slots__ = FlightState.__struct_fields__

    def __init__(  # noqa: PLR0913, PLR0917  # the columns of an offered packet
        self,
        source: str,
        destination: str,
        channel: str,
        sequence: int,
        sent_ns: int,
        stamp_ns: int,
        payload: bytes,
        published: bool = False,
        copy: int = 0,
    ) -> None:
        """It draws by its sequence number, as a client's does; for a robot's packet the caller sets `draw`, `count`."""
        self.source, self.destination, self.channel = source, destination, channel
        self.sequence, self.sent_ns, self.stamp_ns, self.payload = sequence, sent_ns, stamp_ns, payload
        self.published, self.copy = published, copy
        self.size = len(payload)
        self.draw = sequence
        self.count = self.due_ns = self.slots = self.released_wall_ns = 0
        self.arrival_tick = -1
        self.cause = self.rule = self.radio = self.outcome = ""
        self.words: tuple[int, ...] = ()
        self.mangled = b""
        self.phase_ns = self.queue_bytes = self.queue_ns = self.access_ns = self.airtime_ns = 0
        self.propagation_ns = self.jitter_ns = self.held_ns = self.model_ns = self.bits_flipped = 0
        self.put_off_ns = self.latency_ns = self.frames = 0
        self.is_bad = self.is_doubled = self.is_settled = False
        self.walls: tuple[str, ...] = ()
        self.by_factor: tuple[int, ...] = ()
        self.decided_by: Numbers = ()
        self.distance_mm = self.walls_cdb = self.path_loss_cdb = self.shadowing_cdb = self.fading_cdb = 0
        self.received_cdbm = self.snr_cdb = self.interference = self.rate_bps = self.error_threshold = 0
        self.contenders = self.retries = self.air_start_ns = self.air_end_ns = 0


def state_of(flight: Flight) -> FlightState:
    """Return a flight's columns, for the snapshot."""
    return convert(flight, FlightState, from_attributes=True)


def flight_of(state: FlightState) -> Flight:
    """Return the flight of a snapshot's columns."""
    s = state
    flight = Flight(
        s.source, s.destination, s.channel, s.sequence, s.sent_ns, s.stamp_ns, s.payload, s.published, s.copy
    )
    for name in FlightState.__struct_fields__:
        setattr(flight, name, getattr(state, name))
    return flight


def content_of(flight: Flight) -> bytes:
    """Return the payload as it arrives."""
    return flight.mangled or flight.payload


def size_of(flight: Flight) -> int:
    """Return the greatest size of a packet in a message, in bytes."""
    return PACKET_HEAD_BYTES_MAX + len(flight.payload)


def size_of_payload(size: int) -> int:
    """Return the greatest size in a message of a packet with a payload of `size` bytes."""
    return PACKET_HEAD_BYTES_MAX + size


def level_cdbm(power: int) -> int:
    """Return a power in units of 1e-21 W as a level in 0.01 dBm; 0 for no power."""
    return centi(level_of(power)) if power else 0


def received(flights: Iterable[Flight]) -> list[Received]:
    """Return flights as messages contain them."""
    return [Received(f.source, f.sequence, f.copy, f.channel, f.sent_ns, f.due_ns, content_of(f)) for f in flights]


class ChannelCounts:
    """What became of the packets of a channel over all links, without duplicates that links made."""

    def __init__(self, delivered: int = 0, dropped: int = 0, delay_ns: int = 0) -> None:
        self.delivered, self.dropped = delivered, dropped
        self.delay_ns = delay_ns
        """Sum of (due - sent) over delivered packets."""


order_of: Final = attrgetter("due_ns", "source", "sequence", "copy", "destination")
"""The order of arrivals at one tick; the receiver distinguishes the copies of a broadcast."""


class Packets:
    """The counts over all links: offered = delivered + dropped + in flight, at every tick."""

    def __init__(
        self, offered: int = 0, delivered: int = 0, dropped: int = 0, refused: int = 0, copies: int = 0
    ) -> None:
        self.offered, self.delivered, self.dropped, self.refused = offered, delivered, dropped, refused
        self.copies = copies
        """Duplicates made by links; no other count includes them."""

    @property
    def in_flight(self) -> int:
        return self.offered - self.delivered - self.dropped
