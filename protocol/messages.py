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
from foosim.world.edits import Edits
from foosim.world.initial_state import Added, Origin
from foosim.world.robot_packets import Delivered, Outboxes, RobotPacket

# --- simulation plane: the tick --------------------------------------------------------------------------------------


class Order(Message, frozen=True):
    """Permission to compute `tick`, with what changes the world at it, and the `following` ticks, without edits."""

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
        """The last tick that it is about."""
        return self.tick + self.following


class Samples(Message, frozen=True):
    """What the robots of `node` send at `tick`, from the frame with digest `digest`; `robots` are those it covers."""

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
    """A loss or a return that is over: `what` (node, join, supervisor, vhub, player, return) of `name`, behind frame
    `tick`, with `epoch` the first without or with it; `outage_ns` is the supervisor's wall time without a commit."""

    what: Name
    name: Name
    reason: Text
    tick: Counter
    epoch: Counter
    outage_ns: Counter


Recoveries = Annotated[list[Recovered], Meta(max_length=limits.RECOVERIES_PER_COMMIT_MAX)]


class Commit(Message, frozen=True):
    """Frame `tick` as the supervisor assembled it, with the order that led to it (none for frame 0).

    `last` says that the run ends with this frame: its tick is not closed. `recovered` is what ends with this frame.
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
    """Ask again for `kind` (a channel's name) of `tick` in `epoch`; `of` are the nodes that are asked, none for all."""

    sender: Name
    kind: Name
    tick: Counter
    epoch: Counter
    of: Annotated[list[Name], Meta(max_length=limits.NODES_MAX)]


DONE_OF: Final = "Done of "
SAMPLES_OF: Final = "samples of "
JOIN_OF: Final = "join of "
CAPTURE: Final = "capture"
"""How a heartbeat of the vHub says whom it waits for: names follow, joined by a comma and a space. `CAPTURE`
says that its run has ended and that it closes the capture."""


class Heartbeat(Message, frozen=True):
    """Progress of a process, ten times a second: `waiting_for` names what its tick lacks, `lost` says why the
    run cannot go on (the vHub's), `busy` is its load (0 to 1), `report` is JSON for people.

    Without a report it is the vHub's word, before late deliveries, on whom they waited for."""

    sender: Name
    tick: Counter
    epoch: Counter
    waiting_for: Text
    lost: Text
    busy: float
    report: Annotated[bytes, Meta(max_length=limits.RADIO_MESSAGE_BYTES_MAX)]


# --- simulation plane: who takes part --------------------------------------------------------------------------------


class Hello(Message, frozen=True, tag="hello"):
    """A process asks to take part. `world` is empty when it takes whatever world it finds."""

    role: Name
    name: Name
    boot: Name
    version: Counter
    world: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)]
    fingerprint: Digest


class Recall(Message, frozen=True):
    """The supervisor, started as `boot`, does not know a process that takes part: who knows another one says hello."""

    boot: Name


class Build(Message, frozen=True):
    """Everything that a process needs to build the world: one address was all that it had to know.

    `supervisor` is the boot of the supervisor that says it.
    """

    name: Name
    boot: Name
    supervisor: Name
    run: Name
    deployment_name: Text
    deployment: Annotated[str, Meta(max_length=2 * limits.DEPLOYMENT_BYTES_MAX)]
    pace: Name
    added: Added
    origin: Origin | None = None


class Refusal(Message, frozen=True, tag="refusal"):
    """The supervisor will not have this process, and why."""

    name: Name
    boot: Name
    reason: Text


class Ready(Message, frozen=True):
    """The process has built the layout with this digest (and, a vHub, heard from all declared lockstep clients).

    A node's `fingerprint` is the digest of a fixed small run of its engine: equal ones compute equal worlds.
    """

    name: Name
    boot: Name
    layout: Digest
    fingerprint: Digest


class Prepare(Message, frozen=True):
    """Build an engine for the layout with these added entities, and say when it is ready."""

    added: Added


class Epoch(Message, frozen=True):
    """Who does what from tick `tick` on: `owners` is (robot, node) for every robot.

    `arithmetic` is the digest of the nodes' fixed small run; empty where nodes of several kinds are let in.
    """

    epoch: Counter
    tick: Counter
    digest: Digest
    roster: Names
    owners: Annotated[list[tuple[Name, Name]], Meta(max_length=limits.ENTITIES_MAX)]
    added: Added
    arithmetic: Annotated[bytes, Meta(max_length=32)]


class Tempo(Message, frozen=True):
    """The pace that the supervisor keeps (`realtime`, `fast`, `2x`): the vHub releases by it."""

    pace: Name
    paused: bool


class End(Message, frozen=True):
    """The run is over after `tick` ticks."""

    tick: Counter
    reason: Text
    failed: bool


class Farewell(Message, frozen=True):
    """A process has finished its part of an ended run; `report` is JSON (the vHub's: packets and capture)."""

    name: Name
    report: Annotated[bytes, Meta(max_length=limits.RADIO_MESSAGE_BYTES_MAX)]


class Request(Message, frozen=True):
    """What a person or a script asks of the supervisor: `verb` with JSON `arguments`. The same id, the same answer."""

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
    """A process that builds the world asks for the file with this digest, from the byte at `offset` on."""

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


# --- simulation plane: what people look at ----------------------------------------------------------------------------

Pairs = Annotated[list[tuple[Name, Name]], Meta(max_length=limits.WATCHED_MAX)]


class Watched(Message, frozen=True):
    """The links (source, destination) and readings (robot, channel) that somebody looks at; all others nobody does."""

    links: Pairs
    readings: Pairs


# --- radio plane -----------------------------------------------------------------------------------------------------


class Subscription(Item, frozen=True):
    """A channel of an endpoint (a robot, player or client) that a client wants to hear."""

    source: Name
    channel: Name


class ClientHello(Message, frozen=True, tag="clienthello"):
    """A client asks to be let in. `received` is the last downlink number that it has. It goes on with its own numbers
    when it had been let in and has lost the vHub: `returns` is how often."""

    name: Name
    boot: Name
    version: Counter
    world: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)]
    received: Counter
    returns: Counter = 0


class ClientWelcome(Message, frozen=True):
    """The vHub accepts a client, as an answer to its hello with the same `returns`: numbers go on from `sequence`, the
    next downlink is `downlink` + 1. Everything up to `sequence` is recorded, nothing behind it is: who comes back sends
    that again."""

    name: Name
    boot: Name
    hub: Name
    sequence: Counter
    downlink: Counter
    deployment_name: Text
    deployment: Annotated[str, Meta(max_length=2 * limits.DEPLOYMENT_BYTES_MAX)]
    run: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)] = ""
    returns: Counter = 0


class Sent(Item, frozen=True):
    """One packet of a client: to all subscribers without a `destination`. `stamp_ns`, its own clock, is not judged."""

    sequence: Counter
    destination: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)]
    channel: Name
    stamp_ns: Counter
    payload: Payload


Packets = Annotated[list[Sent], Meta(max_length=limits.PACKETS_PER_MESSAGE_MAX)]
Subscriptions = Annotated[list[Subscription], Meta(max_length=limits.ENTITIES_MAX)]


class Join(Message, frozen=True):
    """A client takes part: with period and offset in ticks (0: free-running), or when a packet of `arrivals` comes.

    `hub` is the vHub's process whose welcome it answers; where it is empty, any.
    """

    name: Name
    boot: Name
    period: Counter
    subscriptions: Subscriptions
    offset: Counter = 0
    arrivals: Subscriptions = field(default_factory=list)
    hub: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)] = ""


class Up(Message, frozen=True):
    """Packets of a free-running client, numbered one after the other; the vHub takes none behind a gap."""

    name: Name
    boot: Name
    packets: Packets


class Done(Message, frozen=True):
    """A lockstep client's answer to `Go(tick)`: what it sends at that tick."""

    name: Name
    boot: Name
    tick: Counter
    packets: Packets


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
    """Downlink `number` to a lockstep client: it is due at `tick`; these packets have reached it since its last."""

    number: Counter
    tick: Counter
    acknowledged: Counter
    packets: Annotated[list[Received], Meta(max_length=limits.PACKETS_PER_MESSAGE_MAX)]


class Down(Message, frozen=True):
    """Downlink `number` to a free-running client, or (a lockstep client too) the news that the run is over."""

    number: Counter
    tick: Counter
    acknowledged: Counter
    packets: Annotated[list[Received], Meta(max_length=limits.PACKETS_PER_MESSAGE_MAX)]
    ended: bool


class Heard(Message, frozen=True):
    """The vHub has recorded what a free-running client sent up to the number `acknowledged`.

    Downlinks say the same; this is for a client that gets none.
    """

    acknowledged: Counter


class ClientRefusal(Message, frozen=True, tag="clientrefusal"):
    """The vHub will not have this client, and why. `joins`: it answers a Join of one that was welcomed, not a hello."""

    name: Name
    boot: Name
    reason: Text
    joins: bool = False


class Failure(Message, frozen=True):
    """A player's own code has failed: its process ends, and no other one would do better. `reason` is a sentence."""

    name: Name
    boot: Name
    reason: Text
