"""The table of channels: key, message, direction, plane, service, whether the journal or capture has it.

No other code spells a key. `{name}` is the sender where many write, and the receiver where one is addressed; a message
that names its sender must arrive on that sender's key. Permissions are derived from this table as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import Any, Final, get_args

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.protocol import hub_messages, messages, replay_messages
from foosim.protocol.codec import decode


class Plane(Enum):
    """A separate network of channels: no message passes from one plane to another."""

    SIMULATION = 1
    RADIO = 2
    REPLAY = 3


@dataclass(frozen=True)
class Channel:
    """One row of the table. A `blocking` channel holds its writer when a reader is slow; another one drops messages for
    it."""

    name: str
    key: str
    message: Any
    plane: Plane
    writers: str
    readers: str
    rate: str
    bytes_max: int
    blocking: bool

    def key_for(self, name: str) -> str:
        """Return the key for one sender or receiver."""
        return self.key.replace("{name}", name)

    @property
    def key_for_all(self) -> str:
        """Return the key expression that matches every name."""
        return self.key.replace("{name}", "*")


def _channel(  # noqa: PLR0913, PLR0917  # the columns of the table
    plane: Plane,
    name: str,
    message: Any,
    writers: str,
    readers: str,
    rate: str,
    named: bool = True,
    bytes_max: int = limits.MESSAGE_BYTES_MAX,
    blocking: bool = True,
) -> Channel:
    key = f"foosim/{plane.name.lower()}/{name}" + ("/{name}" if named else "")
    return Channel(name, key, message, plane, writers, readers, rate, bytes_max, blocking)


_simulation: Final = partial(_channel, Plane.SIMULATION)
_radio: Final = partial(_channel, Plane.RADIO, bytes_max=limits.RADIO_MESSAGE_BYTES_MAX)
_replay: Final = partial(_channel, Plane.REPLAY)
_SMALL: Final = limits.SMALL_MESSAGE_BYTES_MAX

HELLO: Final = _simulation("hello", messages.Hello, "node, vhub", "supervisor", "5 Hz until answered", bytes_max=_SMALL)
RECALL: Final = _simulation("recall", messages.Recall, "supervisor", "node, vhub", "an unknown heartbeat", named=False)
BUILD: Final = _simulation("build", messages.Build, "supervisor", "the named one", "an answer")
FETCH: Final = _simulation("fetch", messages.Fetch, "node, vhub, operator, viewer", "supervisor", "a piece of a file")
PIECE: Final = _simulation("piece", messages.Piece, "supervisor", "the named one", "an answer")
REFUSAL: Final = _simulation("refusal", messages.Refusal, "supervisor", "the named one", "an answer")
READY: Final = _simulation(
    "ready", messages.Ready, "node, vhub", "supervisor", "5 Hz until the epoch", bytes_max=_SMALL
)
RESUME_STATE: Final = _simulation("resume_state", hub_messages.ResumeState, "vhub", "supervisor", "with each ready")
RESUME_GRANT: Final = _simulation("resume_grant", hub_messages.ResumeGrant, "supervisor", "the named one", "an answer")
EPOCH: Final = _simulation("epoch", messages.Epoch, "supervisor", "node, vhub", "an epoch", named=False)
ORDER: Final = _simulation("order", messages.Order, "supervisor", "node", "tick", named=False)
PART: Final = _simulation("part", messages.Part, "node", "node, supervisor", "tick")
SAMPLES: Final = _simulation("samples", messages.Samples, "node", "vhub", "tick")
COMMIT: Final = _simulation("commit", messages.Commit, "supervisor", "the named one", "tick (vhub)")
DELIVERIES: Final = _simulation("deliveries", messages.Deliveries, "vhub", "node, supervisor", "tick", named=False)
WANT: Final = _simulation(
    "want", messages.Want, "all", "all", "20 ms doubling to 1 s without progress", bytes_max=_SMALL
)
HEARTBEAT: Final = _simulation("heartbeat", messages.Heartbeat, "node, vhub", "supervisor", "10 Hz")
TEMPO: Final = _simulation("tempo", messages.Tempo, "supervisor", "vhub", "a change, and an answer", named=False)
WATCHED: Final = _simulation(
    "watched", messages.Watched, "supervisor", "vhub", "a change of what viewers watch, and an answer", named=False
)
END: Final = _simulation("end", messages.End, "supervisor", "node, vhub", "once", named=False)
FAREWELL: Final = _simulation("farewell", messages.Farewell, "node, vhub", "supervisor", "once")
REQUEST: Final = _simulation("request", messages.Request, "operator", "supervisor", "a request", bytes_max=_SMALL)
INQUIRY: Final = _simulation(
    "inquiry", messages.Inquiry, "operator, viewer", "supervisor", "a request that only reads", bytes_max=_SMALL
)
ANSWER: Final = _simulation("answer", messages.Answer, "supervisor", "the named one", "an answer")
VIEW: Final = _simulation(
    "view", messages.Commit, "supervisor", "operator, viewer", "by lease", named=False, blocking=False
)

CLIENT_HELLO: Final = _radio("hello", messages.ClientHello, "client", "vhub", "5 Hz until answered", bytes_max=_SMALL)
CLIENT_WELCOME: Final = _radio("welcome", messages.ClientWelcome, "vhub", "the named one", "an answer")
CLIENT_REFUSAL: Final = _radio("refusal", messages.ClientRefusal, "vhub", "the named one", "an answer")
CLIENT_FETCH: Final = _radio("file_request", messages.Fetch, "client", "vhub", "a piece of a file", bytes_max=_SMALL)
CLIENT_PIECE: Final = _radio("file_piece", messages.Piece, "vhub", "the named one", "an answer", blocking=False)
_UPLINK: Final = messages.Join | messages.Up | messages.Done | messages.Failure
UP: Final = _radio("up", _UPLINK, "client", "vhub", "the client's rate")
DOWN: Final = _radio("down", messages.Go | messages.Down | messages.Heard, "vhub", "the named one", "the client's rate")

PLAYED: Final = _replay("played", replay_messages.Played, "replay", "operator", "as captured")
REPLAY_REQUEST: Final = _replay("request", messages.Request, "operator", "replay", "a request", bytes_max=_SMALL)
REPLAY_ANSWER: Final = _replay("answer", messages.Answer, "replay", "the named one", "an answer")

CHANNELS: Final[tuple[Channel, ...]] = tuple(value for value in list(globals().values()) if isinstance(value, Channel))
"""All of the above, in their order."""

_NAMES: Final = {
    channel.key: field
    for channel in CHANNELS
    if "{name}" in channel.key
    for kind in (get_args(channel.message) or (channel.message,))[:1]
    for field in ("sender", "node", "name")
    if field in kind.__struct_fields__
}
"""The field of each channel's messages with the name in the key."""


def read(channel: Channel, name: str, payload: bytes) -> Any:
    """Return the message that arrived on the key of `name`; raise `Malformed` also when it has another name."""
    message = decode(channel.message, payload, channel.bytes_max)
    field = _NAMES.get(channel.key)
    if field is not None and getattr(message, field) != name:
        raise Malformed(f"a message on the key of {name} that names {getattr(message, field)}")
    return message


Reads = tuple[tuple[Channel, bool], ...]
NODE_READS: Final[Reads] = (*((channel, True) for channel in (
    BUILD, PIECE, REFUSAL, COMMIT
)), *((channel, False) for channel in (
    RECALL, EPOCH, ORDER, PART, DELIVERIES, WANT, END
)))  # fmt: skip
VHUB_READS: Final[Reads] = (*((channel, True) for channel in (
    BUILD, PIECE, REFUSAL, RESUME_GRANT, COMMIT
)), *((channel, False) for channel in (
    RECALL, EPOCH, SAMPLES, WANT, TEMPO, WATCHED, END, CLIENT_HELLO, CLIENT_FETCH, UP
)))  # fmt: skip
SUPERVISOR_READS: Final[Reads] = tuple((channel, False) for channel in (
    HELLO, FETCH, READY, RESUME_STATE, PART, DELIVERIES, WANT, HEARTBEAT, FAREWELL, REQUEST, INQUIRY
))  # fmt: skip
CLIENT_READS: Final[Reads] = ((CLIENT_WELCOME, True), (CLIENT_REFUSAL, True), (CLIENT_PIECE, True), (DOWN, True))
OPERATOR_READS: Final[Reads] = ((ANSWER, True), (PIECE, True))
VIEW_READS: Final[Reads] = ((VIEW, False),)
REPLAY_READS: Final[Reads] = ((REPLAY_REQUEST, False),)
LISTENER_READS: Final[Reads] = ((PLAYED, False), (REPLAY_ANSWER, True))
"""The channels that each role reads: (channel, whether only messages addressed to it by name)."""

NODE_WAITS: Final[tuple[Channel, ...]] = (ORDER, PART, DELIVERIES)
SUPERVISOR_WAITS: Final[tuple[Channel, ...]] = (PART, DELIVERIES)
VHUB_WAITS: Final[tuple[Channel, ...]] = (COMMIT, SAMPLES, UP)
CLIENT_WAITS: Final[tuple[Channel, ...]] = (DOWN,)
"""The channels with messages at every tick, by role: it waits in the queue of the missing one."""

ALIVE: Final = {plane: f"foosim/{plane.name.lower()}/alive/{{name}}" for plane in Plane}
"""Liveliness tokens: presence shows that a process and its link are up, not that it advances."""

VHUB: Final = "vhub"
"""The vHub's name on the simulation plane; no node may have it."""
SUPERVISOR: Final = "supervisor"
REPLAY: Final = "replay"
"""The name under which a replay is present on its plane."""
