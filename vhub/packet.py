"""A packet on its way through the pipeline, what became of it, and what led there.

A flight is made when a packet is offered to one receiver; stages read it and write its due time, or name the one cause
of its drop, and what they found on the way: the inputs of its fate. Neighbours: `links` walks the stages, `stages` are
one file each.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from operator import attrgetter
from typing import Final

import msgspec

from foosim.protocol.limits import PACKET_HEAD_BYTES_MAX
from foosim.protocol.messages import Received
from foosim.vhub.radio.noise import centi, level_of

DELIVERED: Final = "delivered"
DROPPED: Final = "dropped"
IN_FLIGHT: Final = "in_flight"


class Flight(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """One offered packet: from `source` to one receiver. Times are simulated nanoseconds.

    Levels are hundredths of dB or dBm, so that they compare as integers. What no stage of the link has looked at is 0
    or empty.
    """

    source: str
    destination: str
    channel: str
    sequence: int
    sent_ns: int
    stamp_ns: int
    payload: bytes
    published: bool = False
    """Whether it goes to all who subscribe; else its sender named the receiver."""
    copy: int = 0
    """1 for a copy that the link made."""
    due_ns: int = 0
    arrival_tick: int = -1
    """-1 until it is on its way; a packet that is dropped at sending never is."""
    cause: str = ""
    rule: str = ""
    words: tuple[int, ...] = ()
    """The draws of the packet, when a stage asked for them: eight 64-bit words."""
    slots: int = 0
    """Which of them its link uses: bit n for slot n."""
    released_wall_ns: int = 0
    radio: str = ""
    phase_ns: int = 0
    """By how much later than its tick it came to its radio."""
    queue_bytes: int = 0
    """What waited before it when it came."""
    queue_ns: int = 0
    access_ns: int = 0
    airtime_ns: int = 0
    """On air or wire, the last time; what attempts before it took is in `access_ns`."""
    propagation_ns: int = 0
    jitter_ns: int = 0
    distance_mm: int = 0
    walls: tuple[str, ...] = ()
    """Names of the bodies in the way."""
    walls_cdb: int = 0
    path_loss_cdb: int = 0
    """With walls, shadowing and fading."""
    shadowing_cdb: int = 0
    fading_cdb: int = 0
    received_cdbm: int = 0
    snr_cdb: int = 0
    interference: int = 0
    """Power of others on air meanwhile, in units of 1e-21 W."""
    rate_bps: int = 0
    error_threshold: int = 0
    """It was lost when its draw for errors was below this: the packet error rate in units of 2^-64."""
    contenders: int = 0
    retries: int = 0
    is_bad: bool = False
    """Whether the link was in a bad time."""
    bits_flipped: int = 0
    mangled: bytes = b""
    """The payload as it arrives, where bits are flipped; what was offered stays."""
    air_start_ns: int = 0
    air_end_ns: int = 0
    """When it was on air the last time; others who are on air between may spoil it."""
    is_doubled: bool = False
    """Whether the link makes a copy of it."""
    is_settled: bool = False
    """Whether it was acknowledged: nothing that is sent later spoils it."""
    by_factor: tuple[int, ...] = ()
    """Of LoRa: the interference by spreading factor, from 7 on."""
    held_ns: int = 0
    """For how long clogs put off its due time."""
    model_ns: int = 0
    """What a link model of one's own adds to its delay."""
    outcome: str = ""
    """What the medium found out and the channel says, at sending; empty when it came through."""


def content_of(flight: Flight) -> bytes:
    """Return the payload as it arrives."""
    return flight.mangled or flight.payload


def size_of(flight: Flight) -> int:
    """Return how many bytes a packet takes in a message at most."""
    return PACKET_HEAD_BYTES_MAX + len(flight.payload)


def level_cdbm(power: int) -> int:
    """Return a power in units of 1e-21 W as a level in 0.01 dBm; 0 for no power."""
    return centi(level_of(power)) if power else 0


def received(flights: Iterable[Flight]) -> list[Received]:
    """Return flights as a client gets them."""
    return [Received(f.source, f.sequence, f.copy, f.channel, f.sent_ns, f.due_ns, content_of(f)) for f in flights]


order_of: Final = attrgetter("due_ns", "source", "sequence", "copy", "destination")
"""Where a packet stands among what arrives at one tick; the receiver tells copies of a broadcast apart."""


@dataclass(slots=True)
class Packets:
    """The account over all links: offered = delivered + dropped + in flight, at every tick."""

    offered: int = 0
    delivered: int = 0
    dropped: int = 0
    refused: int = 0
    copies: int = 0
    """Made by links, on purpose; they are in none of the other counts."""

    @property
    def in_flight(self) -> int:
        return self.offered - self.delivered - self.dropped
