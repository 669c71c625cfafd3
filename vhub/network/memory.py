"""What the stages remember between packets: plain values, part of the hub's state, and so of its journal.

Of each link, of each sender's radio (or port of a wire), and of each air, the channel that radios share.
"""

from __future__ import annotations

import msgspec

from foosim.world.robot_packets import Delivered


class LinkState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """What a link's stages remember, and its account."""

    last_due_ns: int = -1
    chain: int = 0
    """The state of its packet-wise model of bursts: 0 good, 1 a burst, and further ones where it has four."""
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
    under_way: list[tuple[int, int, tuple[int, ...]]] = []
    """Where the link has a capacity: (sequence, copy, who took its place) of what is on its way.

    The last is empty, or sequence and copy of another packet and how many were under way when that came.
    """


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
    decided_by: tuple[int, ...] = ()


class RadioState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A sender's radio, or port of a wire: its queue, when it is free, what its duty cycle counts."""

    free_ns: int = 0
    waiting: list[tuple[int, int]] = []
    """(departure, bytes) of what has not left yet, in order."""
    first_above_ns: int = 0
    drop_next_ns: int = 0
    drop_count: int = 0
    last_count: int = 0
    is_dropping: bool = False
    """CoDel's variables, by the names of RFC 8289."""
    sent: list[tuple[int, int, int]] = []
    """Where a duty cycle limits it: (start, end, airtime) of what it sent; of many, neighbours are taken together."""
    sent_ns: int = 0
    """The airtime of these together."""
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
    ready_ns: int = 0
    """When its packet was the first of its radio's queue."""
    turn_ns: int = -1
    """When its station's turn begins: until then it is put off by who comes in between; -1 where turns are for good."""
    radio: str = ""
    hears: list[str] = []
    """Where it can be put off: its sender's radio, and whom the sender hears of those that can be, too."""


class AirState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A channel that radios share: what is on air, in the order of sending."""

    on_air: list[Transmission] = []


class FlightState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A packet on its way, as it is written down: what a `packet.Flight` is.

    Times are simulated nanoseconds. Levels are hundredths of dB or dBm, so that they compare as integers. What no stage
    of the link has looked at is 0 or empty.
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
    put_off_ns: int = 0
    """For how long others did who had their turn on the air before it, after it was sent."""
    model_ns: int = 0
    """What a link model of one's own adds to its delay."""
    outcome: str = ""
    """What the medium found out and the channel says, at sending; empty when it came through."""
    decided_by: tuple[int, ...] = ()
    """The numbers by which a stage dropped it that it has nowhere else; `to_rows.DECIDING` has their names."""


Counts = dict[int, int]
"""How often each age was seen, in ticks."""


class HeardState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A channel that a client hears, or has heard: when its newest packet was sent, and ages at use.

    Those up to the last row, and those since.
    """

    source: str
    channel: str
    sent_ns: int
    """-1 while nothing has come."""
    is_heard: bool
    """Whether it still hears it."""
    whole: Counts
    recent: Counts


class Age(msgspec.Struct, frozen=True):
    """The ages at use of one channel at one client, of some time or of the whole run, up to the closing of a tick."""

    tick: int
    client: str
    source: str
    channel: str
    counts: Counts


class Joining(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A client that joins (again): period and offset in ticks (0: free-running), what it subscribes to, and of that at
    the arrival of what it acts, if it does."""

    name: str
    period: int
    subscriptions: list[tuple[str, str]]
    offset: int = 0
    arrivals: list[tuple[str, str]] = []

    def suits(self, tick: int) -> bool:
        """Whether it can join at a tick."""
        return self.period == 0 or bool(self.arrivals) or tick % self.period == self.offset


class MemberState(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A client that takes part, as it is written down: what a `members.Member` is."""

    period: int
    subscriptions: tuple[tuple[str, str], ...]
    joined_tick: int
    sequence: int = 0
    downlink: int = 0
    active: bool = True
    offset: int = 0
    arrivals: tuple[tuple[str, str], ...] = ()
    called_tick: int = -1


class Snapshot(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The whole state as it is written, field by field as `HubState.snapshot` makes it."""

    closed: int
    packets: tuple[int, int, int, int, int]
    refusals: list[tuple[str, int]]
    members: list[tuple[str, MemberState]]
    links: list[tuple[str, str, str, LinkState]]
    radios: list[tuple[str, str, RadioState]]
    airs: list[tuple[str, AirState]]
    asked: list[tuple[int, str]]
    deliveries: list[tuple[int, list[Delivered]]]
    final: tuple[int, bool]
    ages: list[tuple[str, list[HeardState]]]
    flights: list[FlightState]
