"""The state of stages between packets: plain values, part of the vHub's state, and so of its journal.

There is one for each link, for each sender's radio (or port of a wire), and for each air, a channel shared by radios.
"""

from __future__ import annotations

import msgspec

from foosim.world.robot_packets import Delivered

Numbers = tuple[int | str, ...]
"""What decided a drop: numbers, and the names that belong to them; `rows_of_closing.DECIDING` has their fields."""


class LinkState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """The state of a link's stages, and its counts."""

    last_due_ns: int = -1
    chain: int = 0
    """The state of its Markov chain of bursts: 0 good, 1 a burst, and further ones of a four-state chain."""
    offered: int = 0
    delivered: int = 0
    dropped: int = 0
    delay_ns: int = 0
    """Sum of (due - sent) over delivered packets, for statistics."""
    copies: int = 0
    """Duplicates that the link made; no other count includes them."""
    causes: dict[str, int] = {}
    """Dropped packets by cause."""
    model: bytes = b""
    """The memory of a custom link model, as msgpack."""


class Sending(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """The result of queue and medium for a broadcast, which its receivers share."""

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
    """Whether the medium's result is there; the queue comes before it."""
    decided_by: Numbers = ()


class RadioState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A sender's radio, or port of a wire: its queue, when it is free, and its airtime in the duty cycle's window."""

    free_ns: int = 0
    waiting: list[tuple[int, int]] = []
    """(departure, bytes) of queued packets, in order."""
    first_above_ns: int = 0
    drop_next_ns: int = 0
    drop_count: int = 0
    last_count: int = 0
    is_dropping: bool = False
    """CoDel's variables, by the names of RFC 8289."""
    sent: list[tuple[int, int, int]] = []
    """With a duty cycle: (start, end, airtime) of its transmissions; neighbours are merged when there are many."""
    sent_ns: int = 0
    """The sum of these airtimes."""
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
    """A transmission: its sender, times, position (m, world frame) and power (0.01 dBm)."""

    source: str
    sequence: int
    copy: int
    start_ns: int
    end_ns: int
    until_ns: int
    """Until when stations in range defer: with its acknowledgements and retries."""
    position: tuple[float, float, float]
    power_cdbm: int
    spreading_factor: int = 0
    ready_ns: int = 0
    """When its packet became the first of its radio's queue."""
    turn_ns: int = -1
    """When its station's turn begins: earlier transmissions may defer it until then; -1 where turns are final."""
    radio: str = ""
    hears: list[str] = []
    """Where it can be deferred: its sender's radio, and the stations in range whose turns can be deferred, too."""
    frame: int = 0
    """Of a packet in several frames that each take a turn: which one it is, from 0."""


class AirState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A channel that radios share: its transmissions, in the order of sending."""

    on_air: list[Transmission] = []


class FlightState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A packet in flight, as the snapshot has it: the columns of `packet.Flight`.

    Times are simulated nanoseconds. Levels are hundredths of dB or dBm, so that they compare as integers. Columns
    that no stage of the link has set are 0 or empty.
    """

    source: str
    destination: str
    channel: str
    sequence: int
    sent_ns: int
    stamp_ns: int
    payload: bytes
    published: bool = False
    """Whether it goes to all subscribers of its channel; else its sender named the receiver."""
    copy: int = 0
    """1 for a duplicate that the link made."""
    draw: int = 0
    """The number of its draws under the key of its link, and of a robot's channel (`draw_address`)."""
    count: int = 0
    """Of a robot's packet: how many it sent on the channel at that tick before."""
    due_ns: int = 0
    arrival_tick: int = -1
    """-1 until it is in flight, and for a packet that is dropped at sending."""
    cause: str = ""
    rule: str = ""
    words: tuple[int, ...] = ()
    """The draws of the packet, if its link uses any: eight 64-bit words."""
    slots: int = 0
    """The words that its link uses: bit n for slot n."""
    released_wall_ns: int = 0
    radio: str = ""
    phase_ns: int = 0
    """By how much later than its tick it reached its radio."""
    queue_bytes: int = 0
    """Bytes before it in the queue at its arrival there."""
    queue_ns: int = 0
    access_ns: int = 0
    airtime_ns: int = 0
    """On air or wire, of the last attempt; earlier attempts are in `access_ns`."""
    propagation_ns: int = 0
    jitter_ns: int = 0
    distance_mm: int = 0
    walls: tuple[str, ...] = ()
    """Names of the bodies in the way."""
    walls_cdb: int = 0
    path_loss_cdb: int = 0
    """Including walls, shadowing and fading."""
    shadowing_cdb: int = 0
    fading_cdb: int = 0
    received_cdbm: int = 0
    snr_cdb: int = 0
    interference: int = 0
    """Power of concurrent transmissions, in units of 1e-21 W."""
    rate_bps: int = 0
    error_threshold: int = 0
    """The packet error rate in units of 2^-64: it is lost when its draw for errors is below."""
    contenders: int = 0
    retries: int = 0
    is_bad: bool = False
    """Whether the link was in a bad period."""
    bits_flipped: int = 0
    mangled: bytes = b""
    """The payload as it arrives, where bits are flipped; `payload` is the offered one."""
    air_start_ns: int = 0
    air_end_ns: int = 0
    """Start and end of its last attempt on air; overlapping transmissions may destroy it."""
    is_doubled: bool = False
    """Whether the link duplicates it."""
    is_settled: bool = False
    """Whether it was acknowledged: later transmissions cannot destroy it."""
    by_factor: tuple[int, ...] = ()
    """LoRa: the interference by spreading factor, from 7 on."""
    held_ns: int = 0
    """The delay of its due time by clogs."""
    put_off_ns: int = 0
    """The delay by stations that had their turn before it, after it was sent."""
    model_ns: int = 0
    """The delay that a custom link model adds."""
    outcome: str = ""
    """The result of medium and channel at sending; empty when it got through."""
    decided_by: Numbers = ()
    """Further numbers that decided its drop."""
    size: int = 0
    """Its bytes for the network: those of the payload, unless its sensor declares others."""
    frames: int = 0
    """How many frames of it take a turn on the air, where these are several."""
    latency_ns: int = 0
    """The latency of its sensor, after the network's delay."""


Counts = dict[int, int]
"""Number of occurrences by age in ticks."""


class HeardState(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    """A channel that a client receives, or has received: when its newest packet was sent, and the ages at use up to
    the last row and since.
    """

    source: str
    channel: str
    sent_ns: int
    """-1 before the first packet."""
    is_heard: bool
    """Whether it still subscribes to it."""
    whole: Counts
    recent: Counts


class Age(msgspec.Struct, frozen=True):
    """The ages at use of one channel at one client, of some time or of the whole run, up to the closing of a tick."""

    tick: int
    client: str
    source: str
    channel: str
    counts: Counts


class MetricsState(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """The metrics of a run: the last values that each client reported, the `ChannelCounts` of each channel, and
    the network's figures in the last rows of them."""

    reported: list[tuple[str, dict[str, float]]]
    channels: list[tuple[str, int, int, int]]
    taken: dict[str, float]


class Joining(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A client that joins (again): period and offset in ticks (0: free-running), what it subscribes to, and of that at
    the arrival of what it acts, if it does."""

    name: str
    period: int
    subscriptions: list[tuple[str, str]]
    offset: int = 0
    arrivals: list[tuple[str, str]] = []

    def suits(self, tick: int) -> bool:
        """Whether a tick fits its period and offset."""
        return self.period == 0 or bool(self.arrivals) or tick % self.period == self.offset


class MemberState(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A client that takes part, as the snapshot has it: the fields of `members.Member`."""

    period: int
    subscriptions: tuple[tuple[str, str], ...]
    joined_tick: int
    sequence: int = 0
    downlink: int = 0
    active: bool = True
    offset: int = 0
    arrivals: tuple[tuple[str, str], ...] = ()
    called_tick: int = -1
    since: int = 0
    absent: tuple[str, ...] = ()


class Snapshot(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The whole state, field by field as `HubState.snapshot` encodes it."""

    closed: int
    packets: tuple[int, int, int, int, int]
    refusals: list[tuple[str, int]]
    members: list[tuple[str, MemberState]]
    links: list[tuple[str, str, str, LinkState]]
    radios: list[tuple[str, str, RadioState]]
    airs: list[tuple[str, AirState]]
    requested: list[tuple[int, str]]
    deliveries: list[tuple[int, list[Delivered]]]
    final: tuple[int, bool]
    ages: list[tuple[str, list[HeardState]]]
    metrics: MetricsState
    flights: list[FlightState]
