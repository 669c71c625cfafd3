"""What the stages remember between packets: plain values, part of the hub's state, and so of its journal.

Of each link, of each sender's radio (or port of a wire), and of each air, the channel that radios share.
Neighbours: `stages` read and write them, `state` writes them down and takes them up again.
"""

from __future__ import annotations

import msgspec


class LinkState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """What a link's stages remember, and its account."""

    last_due_ns: int = -1
    chain: int = 0
    """The state of its packet-wise model of bursts; 0 is good."""
    offered: int = 0
    delivered: int = 0
    dropped: int = 0
    delay_ns: int = 0
    """Sum of (due - sent) of what was delivered, for people."""
    copies: int = 0
    """Copies that the link made; they are in none of the other counts."""
    causes: dict[str, int] = {}
    """How many were dropped by each cause."""
    model: bytes = b""
    """What a link model of one's own remembers, as msgpack."""
    under_way: list[tuple[int, int, bool]] = []
    """(sequence, copy, whether it was evicted) of what is on its way, where the link has a capacity."""


class Sending(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A broadcast as the queue and the medium saw it; its receivers share it."""

    sequence: int
    copy: int
    cause: str
    queue_bytes: int = 0
    queue_ns: int = 0
    access_ns: int = 0
    airtime_ns: int = 0
    start_ns: int = 0
    end_ns: int = 0
    contenders: int = 0
    rate_bps: int = 0
    outcome: str = ""
    is_ready: bool = False
    """Whether the medium has dealt with it; the queue does before."""


class RadioState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A sender's radio, or port of a wire: its queue, when it is free, how much of its duty cycle is left."""

    free_ns: int = 0
    waiting: list[tuple[int, int]] = []
    """(departure, bytes) of what has not left yet, in order."""
    first_above_ns: int = 0
    drop_next_ns: int = 0
    drop_count: int = 0
    is_dropping: bool = False
    """CoDel's variables, by the names of RFC 8289."""
    tokens_ns: int = -1
    tokens_at_ns: int = 0
    """Airtime that the duty cycle leaves, as of a time; -1 before the first packet."""
    opportunity: int = 0
    opportunity_bytes: int = 0
    """How far a trace of capacity is used up."""
    last: Sending | None = None
    """The last broadcast."""

    def sending(self, sequence: int, copy: int) -> Sending | None:
        """Return the last broadcast if it is that of a packet: its receivers share it."""
        last = self.last
        return last if last is not None and last.sequence == sequence and last.copy == copy else None


class Transmission(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """Something on air: from whom, when, from where (m, world frame), with which power (0.01 dBm)."""

    source: str
    sequence: int
    copy: int
    start_ns: int
    end_ns: int
    until_ns: int
    """Until when those who hear it wait: acknowledgements and retries with it."""
    position: tuple[float, float, float]
    power_cdbm: int
    spreading_factor: int = 0


class AirState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A channel that radios share: what is on air, in the order of sending."""

    on_air: list[Transmission] = []
