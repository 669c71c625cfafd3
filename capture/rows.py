"""The rows of a capture, as types.

A row is a JSON object; its JSON Schema is generated from its type. Viewers (Foxglove, Lichtblick) parse only a part of
JSON Schema: objects of numbers, strings, booleans, objects and lists of these; no null, no choice between types, no
reference, no list in a list. So a row has every field always, and -1 or an empty text for a missing value.
Fields that come from a clock of the real world have names that start with `wall_`: two runs differ in them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta

from foosim.capture.mcap.checks import CaptureError
from foosim.common import limits
from foosim.common.struct_types import Counter
from foosim.world.edits import Add, Disrupt, Edit, Push, Remove, Set
from foosim.world.robot_packets import Delivered

FORMAT: Final = 4
"""Version of the rows and of the capture's metadata."""
PROFILE: Final = "foosim"

CounterOrNone = Annotated[int, Meta(ge=-1, le=limits.COUNTER_MAX)]
"""-1 where there is no value."""
DigestHex = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
EntityDigestHex = Annotated[str, Meta(pattern="^[0-9a-f]{16}$")]
ArithmeticHex = Annotated[str, Meta(pattern="^[0-9a-f]{0,64}$")]
WordHex = Annotated[str, Meta(extra_json_schema={"type": "string", "pattern": "^([0-9a-f]{16})?$"})]
"""Checked by `capture_columns.word_of` and not with its row: that would take a reader as long as the row's decoding."""
Fate = Literal["delivered", "dropped", "in_flight"]
IN_FLIGHT: Final = "in_flight"


class Row(msgspec.Struct, frozen=True, gc=False):
    """What every row shares: an object with all its fields."""


class EditRow(Row, frozen=True):
    """A change of the world by an order. `impulse` is x, y, z in the world frame, empty where it is no push."""

    kind: Literal["add", "remove", "push", "set", "network"]
    name: str = ""
    impulse: list[float] = []
    event: str = ""
    """What happens to the network, as JSON."""
    field: str = ""
    numbers: list[float] = []
    """What a field of an entity is set to, or all slots of one that is added; SI units."""


class DeliveredRow(Row, frozen=True, omit_defaults=True):
    """A packet that reached a robot."""

    due_ns: Counter
    source: str
    sequence: Counter
    copy: Counter
    destination: str
    channel: str
    payload: bytes


class TickRow(Row, frozen=True):
    """Frame `tick`: its digest D(tick), a 64-bit digest per entity in name order (all in hex), and its inputs:
    edits and deliveries of tick - 1. `wall_closed_ns` is the vHub's monotonic clock."""

    tick: Counter
    digest: DigestHex
    entities: list[EntityDigestHex]
    edits: list[EditRow]
    deliveries: list[DeliveredRow]
    wall_closed_ns: Counter


class EntityRow(Row, frozen=True):
    """One entity of a layout: its slots are `start` to `stop` of the frame's values, from `split` on its owner's."""

    name: str
    model: str
    start: Counter
    split: Counter
    stop: Counter


class LayoutRow(Row, frozen=True):
    """The layout of the frames."""

    tick: Counter
    digest: DigestHex
    size: Counter
    entities: list[EntityRow]


class OutboxRow(Row, frozen=True, omit_defaults=True):
    """The outbox of the entity at `index` of the layout."""

    index: Counter
    packets: bytes


class FrameRow(Row, frozen=True):
    """Frame `tick` itself: its values as little-endian float64, its non-empty outboxes."""

    tick: Counter
    values: bytes
    outboxes: list[OutboxRow]


class DecidedRow(Row, frozen=True, omit_defaults=True):
    """The numbers of a cause, where it has some.

    A `collision` is `contention` (the medium's), `interference`, or `half_duplex`: its receiver was on air itself.
    `by_factor_cdbm` is LoRa's interference by spreading factor from 7 on, 0 for none, whatever the fate. With
    `duty_cycle` there is the airtime that was left; with `queue_full` and `queue_codel` how many packets waited, and of
    CoDel for how long waits had been above its target, and which drop in a row it is; with `rx_full` the bytes that its
    source had left of its share. With `snr` and `collision` there is the frame of several that was given up, from 1.
    """

    collision: Literal["", "contention", "interference", "half_duplex"] = ""
    by_factor_cdbm: list[int] = []
    duty_left_ns: Counter = 0
    queue_packets: Counter = 0
    codel_above_ns: Counter = 0
    codel_drops: Counter = 0
    frame: Counter = 0
    room_left: Counter = 0
    room_share: Counter = 0


NOTHING_MORE: Final = DecidedRow()


class PacketRow(Row, frozen=True, omit_defaults=True):
    """One offered packet and its fate, with the cause of a drop and what the verdict came from.

    Levels are hundredths of a dB or dBm. What no stage looked at has its default and is left out of the file.
    `due_ns` and `arrival_tick` are -1 when it was dropped at sending. The words are the 64-bit draws that were used,
    in hex; their address is seed, link and, of a robot's packet, its channel, the tick of `sent_ns` and `count`: how
    many packets the robot sent on the channel at that tick before. Of a client's packet it is seed, link and
    `sequence`; its `count` is 0. `stamp_ns` is the sender's own. `wall_released_ns` is the vHub's monotonic clock when
    the packet left for its receiver, 0 when it did not.
    """

    source: str
    sequence: Counter
    copy: Counter
    destination: str
    channel: str
    sent_ns: Counter
    stamp_ns: Counter
    due_ns: CounterOrNone
    arrival_tick: CounterOrNone
    fate: Fate
    cause: str
    rule: str
    loss_word: WordHex
    jitter_word: WordHex
    size: Counter
    payload: bytes
    wall_released_ns: Counter
    radio: str = ""
    published: bool = False
    count: Counter = 0
    queue_bytes: Counter = 0
    queue_ns: Counter = 0
    access_ns: Counter = 0
    airtime_ns: Counter = 0
    propagation_ns: Counter = 0
    jitter_ns: Counter = 0
    held_ns: Counter = 0
    model_ns: Counter = 0
    phase_ns: Counter = 0
    is_bad: bool = False
    bits_flipped: Counter = 0
    rate_bps: Counter = 0
    distance_mm: Counter = 0
    walls: list[str] = []
    walls_cdb: int = 0
    path_loss_cdb: int = 0
    shadowing_cdb: int = 0
    fading_cdb: int = 0
    received_cdbm: int = 0
    snr_cdb: int = 0
    interference_cdbm: int = 0
    error_ppm: Counter = 0
    error_word: WordHex = ""
    contenders: Counter = 0
    retries: Counter = 0
    decided_by: DecidedRow = NOTHING_MORE


class SubscriptionRow(Row, frozen=True):
    """A channel of an endpoint to which a client subscribes."""

    source: str
    channel: str


class ClientRow(Row, frozen=True):
    """A client that joins or leaves at `tick`; `period` (0: free-running) and `offset` are in ticks.

    One with `arrivals` acts when a packet of these channels reaches it, and when it has not for a period. One that
    `leaves_owing` was sent its Go at that tick, and has left without an answer.
    """

    tick: Counter
    client: str
    event: Literal["joins", "leaves", "leaves_owing"]
    period: Counter
    subscriptions: list[SubscriptionRow]
    offset: Counter = 0
    arrivals: list[SubscriptionRow] = []


class AgeRow(Row, frozen=True):
    """The age of the newest packet of a channel when its receiver acted, since the previous row: written each second of
    simulated time, up to the closing of `tick`, and at the end.

    `uses` counts the ticks at which the client acted and had something of the channel; `p50_ns`, `p99_ns` and `most_ns`
    are of these. `counts` has the number of times of each of `ages_ns`; ages of 64 ticks and more are rounded down to
    1/32.
    """

    tick: Counter
    client: str
    source: str
    channel: str
    uses: Counter
    p50_ns: Counter
    p99_ns: Counter
    most_ns: Counter
    ages_ns: list[int]
    counts: list[int]


class MetricRow(Row, frozen=True):
    """The value of a metric from the closing of `tick` on. `players.CLIENT.NAME` is what a player or client reports,
    with a row for each change. `network.CHANNEL.loss`, `.delay_ms` and `.age_ms` are figures of the run so far over all
    links; changed ones have rows each second of simulated time and at the end.

    `loss` is the share of packets that were dropped of those whose fate is final, without duplicates that links made,
    `delay_ms` the mean of due less sent of the delivered ones, `age_ms` the mean age at use.
    """

    tick: Counter
    name: str
    value: float


class OwnerRow(Row, frozen=True):
    """A robot and the node that owns it."""

    robot: str
    node: str


class EpochRow(Row, frozen=True):
    """The nodes, and the owner of every robot, from frame `tick` on; `digest` is D(tick).

    `arithmetic` is the digest of a fixed short run of the nodes' engine, in hex: where it differs, worlds may differ.
    It is empty where different ones are admitted.
    """

    tick: Counter
    epoch: Counter
    digest: DigestHex
    roster: list[str]
    owners: list[OwnerRow]
    arithmetic: ArithmeticHex


class RecoveryRow(Row, frozen=True):
    """A process that was lost or came after frame `tick`, and the `epoch` that is the first without or with it.

    `what` is `node` (a node was lost), `join` (one came), `supervisor` (it was started again), `vhub` (it was lost,
    and is back), `player` (a new process continues for one that was lost), `away` (the run continues without a player
    whose connection closed) or `return` (it takes part again). `wall_outage_ns` is the wall time without a commit, by
    the supervisor's clock.
    """

    what: str
    name: str
    reason: str
    tick: Counter
    epoch: Counter
    wall_outage_ns: Counter


EPOCHS: Final = "/epochs"
RECOVERIES: Final = "/recoveries"
TICK: Final = "/tick"
LAYOUT: Final = "/layout"
FRAME: Final = "/frame"
AGES: Final = "/ages"
METRICS: Final = "/metrics"
PACKETS: Final = "/packets"
CLIENTS: Final = "/clients"

ROW_TYPES: Final[Mapping[str, type[Row]]] = {
    EPOCHS: EpochRow,
    RECOVERIES: RecoveryRow,
    LAYOUT: LayoutRow,
    CLIENTS: ClientRow,
    TICK: TickRow,
    FRAME: FrameRow,
    AGES: AgeRow,
    METRICS: MetricRow,
    PACKETS: PacketRow,
}
"""The type of the rows of each topic."""


def json_schema(kind: type[msgspec.Struct]) -> dict[str, Any]:
    """Return the JSON Schema of a row or a reading, in the part of JSON Schema that viewers parse.

    Everything is in its place; what contains itself may be anything there.
    """
    schema = msgspec.json.schema(kind)
    definitions: dict[str, Any] = schema["$defs"]
    content: dict[str, Any] = _in_place(schema, definitions)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **content}


def _in_place(schema: Any, definitions: Mapping[str, Any]) -> Any:
    """Return a schema with references resolved, and with a type for every list of choices."""
    if isinstance(schema, list):
        return [_in_place(item, definitions) for item in schema]
    if not isinstance(schema, dict):
        return schema
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        others = {key: value for key, value in definitions.items() if key != name}
        return _in_place(definitions.get(name, {}), others)
    typed = {"type": "string", **schema} if "enum" in schema else schema
    return {key: _in_place(value, definitions) for key, value in typed.items() if key != "$defs"}


def edit_of(row: EditRow) -> Edit:
    """Return the edit of a row; the inverse of `rows_of_closing.edit_row`."""
    if row.kind == "add":
        return Add(row.name, row.numbers)
    if row.kind == "remove":
        return Remove(row.name)
    if row.kind == "push":
        return Push(row.name, _vector(row.impulse))
    if row.kind == "network":
        return Disrupt(row.event)
    return Set(row.name, row.field, row.numbers)


def delivered_of(row: DeliveredRow) -> Delivered:
    """Return the delivery of a row."""
    return Delivered(row.due_ns, row.source, row.sequence, row.copy, row.destination, row.channel, row.payload)


def _vector(numbers: list[float]) -> tuple[float, float, float]:
    if len(numbers) != 3:
        raise CaptureError(f"an edit with a vector of {len(numbers)} numbers, it has 3")
    return numbers[0], numbers[1], numbers[2]
