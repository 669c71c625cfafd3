"""The messages of both planes, as typed structs that are their own schema.

On the wire each is a MessagePack array: the tag (`part.1`: name and protocol version), then the fields in order.
Hello and refusal are the same in every version and have none in their tags, so that both sides can name a mismatch.
Decoding validates: unknown fields, negative counters, oversized lists and bytes are refused. Number arrays travel as
raw little-endian float64 bytes. Floats are checked to be finite where they are used, since msgspec does not.
"""

from __future__ import annotations

from typing import Annotated, Final

from msgspec import Meta, field

from foosim.common import limits
from foosim.common.struct_types import Counter, Digest, Item, Message, Name, Names, Numbers, Payload, Text
from foosim.world.component_types.descriptions import JOINTS_READ_MAX
from foosim.world.edits import Edits
from foosim.world.robot_packets import Delivered, Outboxes, RobotPacket
from foosim.world.start import Origin

# --- simulation plane: the tick --------------------------------------------------------------------------------------


class ComponentVersion(Item, frozen=True):
    """The version of a component from another package: `name` is its type name, module and class."""

    name: Annotated[str, Meta(max_length=limits.COMPONENT_NAME_MAX)]
    version: Annotated[str, Meta(max_length=limits.COMPONENT_NAME_MAX)]


class FailedComponent(Item, frozen=True):
    """A component has raised: its label, its `entity` (empty for one of the world), the tick and the end of the
    traceback."""

    entity: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)]
    component: Text
    tick: Counter
    traceback: Text


class Order(Message, frozen=True):
    """Permission to compute `tick`, with its edits, and the `following` ticks, without edits."""

    epoch: Counter
    tick: Counter
    edits: Edits
    following: Annotated[int, Meta(ge=0, le=limits.KEPT_TICKS)] = 0


class Deliveries(Message, frozen=True):
    """The packets that reach robots at `tick`, in (due, source, sequence, copy) order. Final when published.

    At the `following` ticks none do, and that is final, too.
    """

    tick: Counter
    packets: Annotated[list[Delivered], Meta(max_length=limits.PACKETS_PER_MESSAGE_MAX)]
    following: Annotated[int, Meta(ge=0, le=limits.KEPT_TICKS)] = 0

    @property
    def last(self) -> int:
        """The last tick that the message covers."""
        return self.tick + self.following


class Samples(Message, frozen=True):
    """The packets of robots of `node` at `tick`, from the frame with digest `digest`; `robots` are those covered."""

    tick: Counter
    digest: Digest
    node: Name
    robots: Names
    packets: Annotated[list[RobotPacket], Meta(max_length=limits.PACKETS_PER_MESSAGE_MAX)]


class Part(Message, frozen=True):
    """One node's slots of frame `tick`: of the entities it `solved` (indices, ascending) and of the robots it owns."""

    epoch: Counter
    tick: Counter
    node: Name
    input_digest: Digest
    solved: Annotated[list[Counter], Meta(max_length=limits.ENTITIES_MAX)]
    solver_values: Numbers
    owner_values: Numbers
    outboxes: Outboxes


class Recovered(Item, frozen=True):
    """A completed loss or return: `what` (node, join, supervisor, vhub, player, return) of `name`, after frame `tick`;
    `epoch` is the first without or with it, `outage_ns` the supervisor's wall time without a commit."""

    what: Name
    name: Name
    reason: Text
    tick: Counter
    epoch: Counter
    outage_ns: Counter


Recoveries = Annotated[list[Recovered], Meta(max_length=limits.RECOVERIES_PER_COMMIT_MAX)]


class Commit(Message, frozen=True):
    """Frame `tick` as the supervisor assembled it, with the order that led to it (none for frame 0).

    With `last` the run ends with this frame, and its tick is not closed. `recovered` are the losses that end with it.
    """

    epoch: Counter
    tick: Counter
    digest: Digest
    values: Numbers
    outboxes: Outboxes
    edits: Edits
    last: bool
    recovered: Recoveries = field(default_factory=list)


class Want(Message, frozen=True):
    """Request `kind` (a channel's name) of `tick` in `epoch` again, of the nodes `of`, or of all where it is empty."""

    sender: Name
    kind: Name
    tick: Counter
    epoch: Counter
    of: Annotated[list[Name], Meta(max_length=limits.NODES_MAX)]


DONE_OF: Final = "Done of "
SAMPLES_OF: Final = "samples of "
JOIN_OF: Final = "join of "
CAPTURE: Final = "capture"
"""Prefixes of `Heartbeat.waiting_for` of the vHub: names follow, joined by a comma and a space. `CAPTURE` means that
the run has ended and that the vHub closes the capture."""


class Heartbeat(Message, frozen=True):
    """Progress of a process, ten times a second: `waiting_for` names what its tick lacks, `lost` is the reason why the
    run cannot continue (a client is lost, a component has raised), `busy` is its load (0 to 1), `report` is JSON for
    display, `failed` the component that has raised.

    The vHub sends one without a report before late deliveries, to name the clients that these waited for."""

    sender: Name
    tick: Counter
    epoch: Counter
    waiting_for: Text
    lost: Text
    busy: float
    report: Annotated[bytes, Meta(max_length=limits.RADIO_MESSAGE_BYTES_MAX)]
    failed: FailedComponent | None = None


# --- simulation plane: membership -----------------------------------------------------------------------------------


class Hello(Message, frozen=True, tag="hello"):
    """A process requests membership. An empty `world` accepts any world."""

    role: Name
    name: Name
    boot: Name
    version: Counter
    world: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)]
    fingerprint: Digest


class Recall(Message, frozen=True):
    """The supervisor of this `boot` misses a member: a process with another supervisor sends its hello."""

    boot: Name


class Build(Message, frozen=True):
    """Everything that a process needs to build the world.

    `supervisor` is the boot of the supervisor that sends it.
    """

    name: Name
    boot: Name
    supervisor: Name
    run: Name
    deployment_name: Text
    deployment: Annotated[str, Meta(max_length=2 * limits.DEPLOYMENT_BYTES_MAX)]
    pace: Name
    origin: Origin | None = None


class Refusal(Message, frozen=True, tag="refusal"):
    """The supervisor refuses this process; `reason` is a sentence."""

    name: Name
    boot: Name
    reason: Text


class Ready(Message, frozen=True):
    """The process has built the layout with this digest; of the vHub, all declared lockstep clients have joined too.

    A node's `fingerprint` is the digest of a fixed short run of its engine: equal fingerprints compute equal worlds.
    Its `meshes` are the digest of the meshes and hulls as it has read them, which depend on the versions of libraries.
    Its `components` are the versions of the components of the world from other packages.
    """

    name: Name
    boot: Name
    layout: Digest
    fingerprint: Digest
    meshes: Digest
    components: Annotated[list[ComponentVersion], Meta(max_length=limits.COMPONENTS_MAX)] = field(default_factory=list)


class Epoch(Message, frozen=True):
    """Members and owners from tick `tick` on: `owners` is (robot, node) for every robot.

    `arithmetic` is the digest of the nodes' fixed short run; empty where different ones are admitted.
    """

    epoch: Counter
    tick: Counter
    digest: Digest
    roster: Names
    owners: Annotated[list[tuple[Name, Name]], Meta(max_length=limits.ENTITIES_MAX)]
    arithmetic: Annotated[bytes, Meta(max_length=32)]


class Tempo(Message, frozen=True):
    """The supervisor's pace (`realtime`, `fast`, `2x`), by which the vHub releases packets."""

    pace: Name
    paused: bool


class End(Message, frozen=True):
    """The run is over after `tick` ticks; `failed_component` is the one whose error ended it, if any."""

    tick: Counter
    reason: Text
    failed: bool
    failed_component: FailedComponent | None = None


class Farewell(Message, frozen=True):
    """A process has finished its part of an ended run; `report` is JSON (the vHub's: packets and capture)."""

    name: Name
    report: Annotated[bytes, Meta(max_length=limits.RADIO_MESSAGE_BYTES_MAX)]


class Request(Message, frozen=True):
    """A request of an operator: `verb` with JSON `arguments`. A request repeated with its id gets the same answer."""

    sender: Name
    id: Name
    verb: Name
    arguments: Annotated[bytes, Meta(max_length=limits.TEXT_LENGTH_MAX)]


class Inquiry(Request, frozen=True):
    """A request that changes nothing."""


class Answer(Message, frozen=True):
    """The supervisor's answer: the tick at which the request takes effect and JSON `result`, or why not."""

    sender: Name
    id: Name
    accepted: bool
    tick: Counter
    text: Text
    result: Annotated[bytes, Meta(max_length=limits.RADIO_MESSAGE_BYTES_MAX)]


# --- simulation plane: files that a deployment refers to --------------------------------------------------------------


class Fetch(Message, frozen=True):
    """A process that builds the world, or a client that hears a camera, requests the file with this digest, from the
    byte at `offset` on."""

    name: Name
    boot: Name
    digest: Digest
    offset: Counter


class Piece(Message, frozen=True):
    """The bytes at `offset` of the file of `size` bytes with this digest."""

    name: Name
    boot: Name
    digest: Digest
    offset: Counter
    size: Annotated[int, Meta(ge=0, le=limits.ASSET_BYTES_MAX)]
    content: Annotated[bytes, Meta(max_length=limits.ASSET_PIECE_BYTES)]


# --- simulation plane: viewing ----------------------------------------------------------------------------------------

Pairs = Annotated[list[tuple[Name, Name]], Meta(max_length=limits.WATCHED_MAX)]


class Watched(Message, frozen=True):
    """The links (source, destination) and readings (robot, channel) that viewers watch, all of them."""

    links: Pairs
    readings: Pairs


# --- radio plane -----------------------------------------------------------------------------------------------------


class Subscription(Item, frozen=True):
    """A channel of an endpoint (a robot, player or client) that a client subscribes to."""

    source: Name
    channel: Name


class ClientHello(Message, frozen=True, tag="clienthello"):
    """A client requests admission. `received` is the last downlink number up to which it has all. `returns` counts how
    often it has lost the vHub after a welcome; its own numbers then continue."""

    name: Name
    boot: Name
    version: Counter
    world: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)]
    received: Counter
    returns: Counter = 0


class SelectedJoints(Item, frozen=True):
    """The names of the joints that components of robots select, which follow from files: a client has none."""

    names: Annotated[
        list[Annotated[str, Meta(max_length=limits.PART_NAME_LENGTH_MAX)]], Meta(max_length=JOINTS_READ_MAX)
    ]
    channels: Annotated[list[tuple[Name, Name]], Meta(max_length=limits.ENTITIES_MAX)]


class ClientWelcome(Message, frozen=True):
    """The vHub admits a client, in answer to its hello with the same `returns`: numbers continue from `sequence`, the
    next downlink is `downlink` + 1. Packets up to `sequence` are recorded; a client sends later ones again."""

    name: Name
    boot: Name
    hub: Name
    sequence: Counter
    downlink: Counter
    deployment_name: Text
    deployment: Annotated[str, Meta(max_length=2 * limits.DEPLOYMENT_BYTES_MAX)]
    run: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)] = ""
    returns: Counter = 0
    joints: Annotated[list[SelectedJoints], Meta(max_length=limits.ENTITIES_MAX)] = field(default_factory=list)


class Sent(Item, frozen=True):
    """One packet of a client: to all subscribers without a `destination`.

    `stamp_ns` is of the client's own clock and affects no fate.
    """

    sequence: Counter
    destination: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)]
    channel: Name
    stamp_ns: Counter
    payload: Payload


Packets = Annotated[list[Sent], Meta(max_length=limits.PACKETS_PER_MESSAGE_MAX)]
Subscriptions = Annotated[list[Subscription], Meta(max_length=limits.ENTITIES_MAX)]


class Join(Message, frozen=True):
    """A client joins: with period and offset in ticks (0: free-running), or due when a packet of `arrivals` arrives.

    `hub` is the boot of the vHub whose welcome it answers; empty for any.
    """

    name: Name
    boot: Name
    period: Counter
    subscriptions: Subscriptions
    offset: Counter = 0
    arrivals: Subscriptions = field(default_factory=list)
    hub: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)] = ""


Metrics = Annotated[list[tuple[Name, float]], Meta(max_length=limits.METRICS_MAX)]
"""Numbers of the run's result that a client reports, with their names. They are no packets, and have no numbers."""


class Up(Message, frozen=True):
    """Packets of a free-running client, numbered without gaps; the vHub accepts none after a gap.

    Or the metrics of its report of this number, which is above those of its earlier ones.
    """

    name: Name
    boot: Name
    packets: Packets
    metrics: Metrics = field(default_factory=list)
    report: Counter = 0


class Done(Message, frozen=True):
    """A lockstep client's answer to `Go(tick)`: the packets that it sends at that tick, and changed metrics."""

    name: Name
    boot: Name
    tick: Counter
    packets: Packets
    metrics: Metrics = field(default_factory=list)


class Received(Item, frozen=True):
    """One packet that reaches a client. `sent_ns` and `due_ns` are simulated time."""

    source: Name
    sequence: Counter
    copy: Counter
    channel: Name
    sent_ns: Counter
    due_ns: Counter
    payload: Payload


class Go(Message, frozen=True):
    """Downlink `number` to a lockstep client: it is due at `tick`; these packets have reached it since its last.

    The client exists since the frame of tick `since`, as another one than before it. `absent` are those of its robots
    that are.
    """

    number: Counter
    tick: Counter
    acknowledged: Counter
    packets: Annotated[list[Received], Meta(max_length=limits.PACKETS_PER_MESSAGE_MAX)]
    since: Counter = 0
    absent: Names = field(default_factory=list)


class Down(Message, frozen=True):
    """Downlink `number` to a free-running client, or, to any client, the end of the run.

    A free-running player gets one with or without packets at the tick at which it is taken in, and at which `since` or
    `absent` become others: they are as in a Go, `since` is -1 while it does not exist.
    """

    number: Counter
    tick: Counter
    acknowledged: Counter
    packets: Annotated[list[Received], Meta(max_length=limits.PACKETS_PER_MESSAGE_MAX)]
    ended: bool
    since: Annotated[int, Meta(ge=-1, le=limits.COUNTER_MAX)] = 0
    absent: Names = field(default_factory=list)


class Heard(Message, frozen=True):
    """The vHub has recorded the packets of a free-running client up to the number `acknowledged`.

    Downlinks carry the same number; this is for a client that receives none.
    """

    acknowledged: Counter


class ClientRefusal(Message, frozen=True, tag="clientrefusal"):
    """The vHub refuses this client; with `joins` it answers the Join of a welcomed client instead of a hello."""

    name: Name
    boot: Name
    reason: Text
    joins: bool = False


class Failure(Message, frozen=True):
    """A player's own code has raised: its process ends and is not restarted. `reason` is a sentence."""

    name: Name
    boot: Name
    reason: Text
