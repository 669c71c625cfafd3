"""Listening to a replay: what `foosim-replay play` publishes, as values, and requests to it.

    with hear_replay("tcp/127.0.0.1:7470") as replay:
        replay.resume()
        for item in replay:
            if isinstance(item, ReplayedPacket) and item.channel == "ball":
                print(item.time_ns, item.value)

All that is heard comes in the order in which it was published. Times are the capture's simulated ns, lengths are in
m, in the world's frame. A replay belongs to one thread. Neighbours: `protocol.replay_messages` (the wire), `payloads`
(what payloads mean), the other side is in the package `rehearsal`.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

from foosim.client.errors import ConnectionFailed
from foosim.client.payloads import Value, decode_payload
from foosim.protocol import channels, limits
from foosim.protocol.certificates import operator_credentials
from foosim.protocol.channel_kinds import channel_kind
from foosim.protocol.channels import ALIVE, PLAYED, REPLAY, Plane
from foosim.protocol.codec import encode
from foosim.protocol.deployment import Deployment
from foosim.protocol.deployment_file import load_deployment
from foosim.protocol.errors import BadValue, Malformed, Refused, UnknownName, show
from foosim.protocol.inbox import Inbox
from foosim.protocol.json_text import decode_json, encode_json
from foosim.protocol.messages import Answer, Request
from foosim.protocol.names import nearest_name
from foosim.protocol.replay_messages import (
    CLOCK,
    STREAMS,
    Played,
    PlayedLine,
    PlayedPacket,
    PlayedPoses,
    PlayedRow,
    PlayedScene,
)

if TYPE_CHECKING:
    from foosim.protocol.session import Session

CONNECT_S: Final = 5.0
ANSWER_S: Final = 10.0
AGAIN_S: Final = 0.2
NS_PER_S: Final = 1_000_000_000


class ReplayRefused(Refused):
    """The replay would not do what was asked; the text says why."""


class ReplayGone(Refused):
    """No replay answers, or it has ended."""

    exit_code = 1


@dataclass(frozen=True, slots=True)
class ReplayedPacket:
    """A captured packet, at the time at which it reached its receiver; names are those that it is played under."""

    time_ns: int
    source: str
    destination: str
    channel: str
    sequence: int
    copy: int
    sent_ns: int
    due_ns: int
    payload: bytes
    value: Value | None
    """What the payload holds, None where that is not known."""


@dataclass(frozen=True, slots=True)
class ReplayedPose:
    """Where a link is: position in m, orientation as a quaternion x, y, z, w."""

    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class ReplayedPoses:
    """The captured poses of all links, by name (`ball`, `red.goal/slide`)."""

    time_ns: int
    poses: Mapping[str, ReplayedPose]


@dataclass(frozen=True, slots=True)
class ReplayedScene:
    """What there is to see from here on: a Foxglove SceneUpdate as Protobuf, for a viewer."""

    time_ns: int
    update: bytes


@dataclass(frozen=True, slots=True)
class ReplayedLine:
    """A line of the run's log; `level` is info, warning or error."""

    time_ns: int
    level: str
    text: str


@dataclass(frozen=True, slots=True)
class ReplayedRow:
    """A row of any other kind, as in the capture: of `/clients`, `/epochs`, ..."""

    time_ns: int
    topic: str
    row: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class ReplayTime:
    """Where the replay is. `jumps` counts seeks and rounds: what follows another number goes on from elsewhere."""

    time_ns: int
    rate: str
    state: str
    jumps: int


Replayed = ReplayedPacket | ReplayedPoses | ReplayedScene | ReplayedLine | ReplayedRow | ReplayTime


class Replay:
    """A connection to one replay. Use it in `with`; iterate over it, or `take`."""

    def __init__(self, session: Session, name: str, streams: Sequence[str]) -> None:
        from foosim.protocol.loop import Wire

        self.locator: Final = session.locator
        self.clock: ReplayTime | None = None
        """The newest that was heard."""
        self.ended = False
        """Whether all was heard that comes."""
        self._is_gone = False
        """Whether its presence has ended: news that may overtake what it has said."""
        self.malformed = 0
        self._name = name
        self._session = session
        self._inbox = Inbox(limits.INBOX_MESSAGES_MAX)
        self._heard: deque[Replayed] = deque()
        self._answers: dict[str, Answer] = {}
        self._asked = 0
        self._deployment: Deployment | None = None
        self._old_names: Mapping[str, str] = {}
        self._old_channels: Mapping[str, str] = {}
        self._streams = frozenset(streams)
        self._over: set[str] = set()
        """The streams of which all was heard."""
        if set(streams) == set(STREAMS):
            session.subscribe(PLAYED.key_for_all, PLAYED.key, self._inbox)
        else:
            for stream in streams:
                session.subscribe(PLAYED.key_for(stream), PLAYED.key, self._inbox)
        # Last: whoever hears its answer knows of the subscriptions before it.
        self._wire = Wire(session, Plane.REPLAY, self._inbox, name)
        self._wire.read(((channels.REPLAY_ANSWER, True),))
        self._wire.watch_alive(REPLAY)

    @property
    def deployment(self) -> Deployment:
        """The deployment of the captured run."""
        assert self._deployment is not None, "it comes with the first answer"
        return self._deployment

    def captured_link(self, link: str) -> str:
        """Return the name that a link had in the captured run: bodies may be played under others."""
        body, separator, part = link.partition("/")
        return f"{self._old_names.get(body, body)}{separator}{part}"

    @property
    def dropped(self) -> int:
        """How many messages were lost because this side took them too late."""
        return self._inbox.statistics().dropped

    # --- hearing -----------------------------------------------------------------------------------------------------

    def take(self, timeout_s: float | None = None) -> list[Replayed]:
        """Return what has come; wait for something until the timeout, or the end of the replay. May be empty."""
        deadline_s = None if timeout_s is None else time.monotonic() + timeout_s
        self._read(0.0)
        while not self._heard and not self.ended:
            left_s = None if deadline_s is None else deadline_s - time.monotonic()
            if left_s is not None and left_s <= 0:
                break
            if self._is_gone:
                self._read(AGAIN_S)
                self.ended |= not self._heard
            else:
                self._read(left_s)
        heard = list(self._heard)
        self._heard.clear()
        return heard

    def __iter__(self) -> Iterator[Replayed]:
        """Yield what comes until the replay ends."""
        while True:
            items = self.take()
            if not items:
                return
            yield from items

    def _read(self, timeout_s: float | None) -> None:
        for key, name, payload in self._inbox.take(timeout_s):
            try:
                if key == PLAYED.key:
                    self._hear(name, channels.read(PLAYED, name, payload))
                elif key == channels.REPLAY_ANSWER.key:
                    answer: Answer = channels.read(channels.REPLAY_ANSWER, name, payload)
                    self._answers[answer.id] = answer
                elif key == ALIVE[Plane.REPLAY]:
                    self._is_gone |= payload == b"-"
            except Malformed:
                self.malformed += 1

    def _hear(self, stream: str, message: Played) -> None:
        if isinstance(message, PlayedPacket):
            self._heard.append(self._packet(message))
        elif isinstance(message, PlayedPoses):
            poses = {pose.link: ReplayedPose(pose.position, pose.orientation) for pose in message.poses}
            self._heard.append(ReplayedPoses(message.time_ns, poses))
        elif isinstance(message, PlayedScene):
            self._heard.append(ReplayedScene(message.time_ns, message.update))
        elif isinstance(message, PlayedLine):
            self._heard.append(ReplayedLine(message.time_ns, message.level, message.text))
        elif isinstance(message, PlayedRow):
            row = decode_json(message.row)
            if not isinstance(row, dict):
                raise Malformed("a row that is no object")
            self._heard.append(ReplayedRow(message.time_ns, f"/{message.topic}", row))
        else:
            if stream == CLOCK:
                self.clock = ReplayTime(message.time_ns, message.rate, message.state, message.jumps)
                self._heard.append(self.clock)
            if message.state == "ended":
                self._over.add(stream)
                self.ended = self._over >= self._streams

    def _packet(self, message: PlayedPacket) -> ReplayedPacket:
        stamps = message.sequence, message.copy, message.sent_ns, message.due_ns
        names = message.source, message.destination, message.channel
        return ReplayedPacket(message.time_ns, *names, *stamps, message.payload, self._value(message))

    def _value(self, message: PlayedPacket) -> Value | None:
        """Return what a payload holds: it is a sensor's of its source, or a command to its destination."""
        channel = self._old_channels.get(message.channel, message.channel)
        for name in (message.source, message.destination):
            robot = self._old_names.get(name, name)
            if robot in self.deployment.robots:
                try:
                    return decode_payload(channel_kind(self.deployment, robot, channel), message.payload)
                except (UnknownName, Malformed):
                    continue
        return None

    # --- asking ------------------------------------------------------------------------------------------------------

    def status(self) -> dict[str, Any]:
        """Return where the replay is and what it plays."""
        return self.ask("status")

    def pause(self) -> dict[str, Any]:
        """Have it stand still; each of these returns its status then. Raises ReplayRefused, ReplayGone."""
        return self.ask("pause")

    def resume(self) -> dict[str, Any]:
        """Have it go on."""
        return self.ask("resume")

    def step(self, ticks: int = 1) -> dict[str, Any]:
        """Have it publish so many ticks at once, and stand still behind them."""
        return self.ask("step", count=ticks)

    def seek(self, time_ns: int) -> dict[str, Any]:
        """Have it go to a captured time."""
        return self.ask("seek", time_ns=time_ns)

    def set_rate(self, pace: str) -> dict[str, Any]:
        """Have it go on at another rate: realtime, fast, or a factor such as 2x."""
        return self.ask("rate", pace=pace)

    def stop(self) -> dict[str, Any]:
        """Have it end."""
        return self.ask("stop")

    def ask(self, verb: str, timeout_s: float = ANSWER_S, **arguments: Any) -> dict[str, Any]:
        """Ask for something and return the status behind it; what is heard meanwhile waits for `take`."""
        self._asked += 1
        identity = f"r{self._asked}"
        payload = encode(Request(self._name, identity, verb, encode_json(arguments)))
        deadline_s = time.monotonic() + timeout_s
        while time.monotonic() < deadline_s and not (self.ended or self._is_gone):
            self._wire.put(channels.REPLAY_REQUEST, self._name, payload)
            answer = self._wait(identity)
            if answer is None:
                continue
            if not answer.accepted:
                raise ReplayRefused(answer.text)
            status = decode_json(answer.result)
            if not isinstance(status, dict):
                raise ReplayRefused("an answer that is no status")
            return status
        has_ended = self.ended or self._is_gone
        raise ReplayGone("the replay has ended" if has_ended else f"no answer to {verb} within {timeout_s:g} s")

    def _wait(self, identity: str) -> Answer | None:
        """Return the answer to a request when it comes soon: the news that the replay has ended may overtake it."""
        again_s = time.monotonic() + AGAIN_S
        while identity not in self._answers and (left_s := again_s - time.monotonic()) > 0:
            self._read(left_s)
        return self._answers.pop(identity, None)

    def learn(self, timeout_s: float) -> None:
        """Ask what is played, which is needed to know what payloads mean; `hear_replay` does."""
        status = self.ask("status", timeout_s)
        try:
            deployment, name = str(status["deployment"]), str(status["deployment_name"])
            self._old_names = {str(new): str(old) for old, new in status["names"].items()}
            self._old_channels = {str(new): str(old) for old, new in status["channels"].items()}
        except (KeyError, AttributeError) as error:
            raise ReplayRefused(f"the replay does not say what it plays: {error}") from None
        self._deployment = load_deployment(deployment, name)

    # --- the end -----------------------------------------------------------------------------------------------------

    def close(self) -> None:
        self._session.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()


def hear_replay(
    address: str,
    streams: Sequence[str] = STREAMS,
    timeout_s: float = CONNECT_S,
    pki: str | os.PathLike[str] | None = None,
    answer_s: float = ANSWER_S,
) -> Replay:
    """Connect to the replay that listens at `address`, `tcp/HOST:PORT`, and hear some of its streams.

    `streams` are of `packets`, `poses`, `scene`, `log`, `rows` and `clock`; none is enough to ask. Where the replay has
    certificates the address is `tls/HOST:PORT`, and `pki` the folder with an operator's. Raises BadValue for an unknown
    stream or an address that is none, CertificateError, ConnectionFailed when nobody listens within `timeout_s`,
    ReplayGone when no replay answers within `answer_s`, which is also how one looks that does not know this operator.
    """
    from foosim.protocol.session import ConnectError, Session
    from foosim.protocol.session_settings import Security

    for stream in streams:
        if stream not in STREAMS:
            nearest = nearest_name(stream, STREAMS)
            what = f"not a stream of a replay (there are: {', '.join(STREAMS)})"
            raise BadValue(what, stream, None if nearest is None else show(nearest))
    credentials = operator_credentials(None if pki is None else Path(pki))
    # Under its certificate an operator may speak by any name that begins with his own and a dot.
    stem = f"listener-{os.getpid()}-" if credentials is None else f"{credentials.name}."
    name = f"{stem}{os.urandom(4).hex()[:7]}"
    security = None if credentials is None else Security(credentials)
    try:
        session = Session.client(address, timeout_s, limits.MESSAGE_BYTES_MAX, security=security)
    except ConnectError as error:
        raise ConnectionFailed(error.what) from None
    try:
        replay = Replay(session, name, streams)
        replay.learn(answer_s)
    except BaseException:
        session.close()
        raise
    return replay
