"""Listening to a replay: the messages that `foosim capture play` publishes, and requests to it.

    with hear_replay("tcp/127.0.0.1:7470") as replay:
        replay.resume()
        for item in replay:
            if isinstance(item, PlayedPacket) and item.channel == "pose":
                print(item.time_ns, replay.value(item))

Messages (`foosim.protocol.replay_messages`) arrive in the order in which they were published. Times are the capture's
simulated ns, lengths are in m, in the world's frame. A replay belongs to one thread.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from foosim.client.errors import ConnectionFailed
from foosim.common import limits
from foosim.common.closable import Closable
from foosim.common.errors import Malformed, Refused, UnknownName
from foosim.common.json_text import decode_json, encode_json
from foosim.deployment.channel_kinds import channel_codec
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.channels import PLAYED, REPLAY, Plane
from foosim.protocol.codec import encode
from foosim.protocol.messages import Answer, Request
from foosim.protocol.replay_messages import CLOCK, STREAMS, Played, PlayedPacket, ReplayClock
from foosim.runtime.transport.certificates import operator_credentials
from foosim.runtime.transport.inbox import Inbox
from foosim.world.component_types.payloads import Value

if TYPE_CHECKING:
    from foosim.runtime.transport.session import Session

CONNECT_S: Final = 5.0
ANSWER_S: Final = 10.0
LAST_S: Final = 0.2
"""How long messages may follow the end of the replay's presence."""


class ReplayRefused(Refused):
    """The replay has refused a request; the text is the reason."""


class ReplayGone(Refused):
    """No replay answers, or it has ended."""

    exit_code = 1


class Replay(Closable):
    """A connection to one replay. Use it in `with`; iterate over it, or `take`."""

    def __init__(self, session: Session, name: str, streams: Sequence[str]) -> None:
        from foosim.runtime.roles.wire import Wire, presence_channel

        self.locator: Final = session.locator
        self.clock: ReplayClock | None = None
        """The newest one that was received."""
        self.ended = False
        """Whether all messages have been received."""
        self.malformed = 0
        self._is_gone = False
        """Whether the presence of the replay has ended, which may overtake its last messages."""
        self._name = name
        self._session = session
        self._inbox = Inbox(limits.INBOX_MESSAGES_MAX)
        self._received: deque[Played] = deque()
        self._requests = 0
        self._deployment: Deployment | None = None
        self._old_names: Mapping[str, str] = {}
        self._old_channels: Mapping[str, str] = {}
        self._open = set(streams)
        """The open streams."""
        keys = [PLAYED.key_for_all] if self._open == set(STREAMS) else [PLAYED.key_for(stream) for stream in streams]
        for key in keys:
            session.subscribe(key, PLAYED.key, self._inbox)
        # Last: a replay that answers knows of the subscriptions before it.
        self._wire = Wire(session, Plane.REPLAY, self._inbox, name)
        self._presence = presence_channel(Plane.REPLAY, name)
        self._wire.read(((channels.REPLAY_ANSWER, True),))
        self._wire.watch_alive(REPLAY)

    @property
    def deployment(self) -> Deployment:
        """The deployment of the captured run."""
        assert self._deployment is not None, "it comes with the first answer"
        return self._deployment

    @property
    def dropped(self) -> int:
        """How many messages were lost because they were not taken in time."""
        return self._inbox.dropped

    def captured_link(self, link: str) -> str:
        """Return the captured name of a link: bodies may be played under others."""
        body, separator, part = link.partition("/")
        return f"{self._old_names.get(body, body)}{separator}{part}"

    def value(self, packet: PlayedPacket) -> Value | None:
        """Return the value in a packet's payload: a sensor's reading or a command; None for other channels."""
        channel = self._old_channels.get(packet.channel, packet.channel)
        for name in (packet.source, packet.destination):
            robot = self._old_names.get(name, name)
            if robot in self.deployment.robots:
                try:
                    codec = channel_codec(self.deployment, robot, channel)
                    return packet.payload if codec is None else codec.decode(packet.payload)
                except (UnknownName, Malformed):
                    continue
        return None

    # --- messages ----------------------------------------------------------------------------------------------------

    def take(self, timeout_s: float | None = None) -> list[Played]:
        """Return the received messages; wait for one until the timeout, or the end of the replay. May be empty."""
        deadline_s = None if timeout_s is None else time.monotonic() + timeout_s
        self._read(0.0)
        while not (self._received or self.ended):
            left_s = None if deadline_s is None else deadline_s - time.monotonic()
            if left_s is not None and left_s <= 0:
                break
            if self._is_gone:
                self._read(LAST_S)
                self.ended |= not self._received
            else:
                self._read(left_s)
        received = list(self._received)
        self._received.clear()
        return received

    def __iter__(self) -> Iterator[Played]:
        """Yield the messages until the replay ends."""
        while items := self.take():
            yield from items

    def _read(self, timeout_s: float | None) -> None:
        for key, name, payload in self._inbox.take(timeout_s):
            self._on_message(key, name, payload)

    def _on_message(self, key: str, name: str, payload: bytes) -> None:
        if key == self._presence:
            self._is_gone |= payload == b"-"
        if key != PLAYED.key:
            return
        try:
            message: Played = channels.read(PLAYED, name, payload)
        except Malformed:
            self.malformed += 1
            return
        if isinstance(message, ReplayClock) and message.state == "ended":
            self._open.discard(name)
            self.ended = not self._open
        if not isinstance(message, ReplayClock):
            self._received.append(message)
        elif name == CLOCK:
            self.clock = message
            self._received.append(message)

    # --- requests ----------------------------------------------------------------------------------------------------

    def status(self) -> dict[str, Any]:
        """Return the state of the replay, and its deployment."""
        return self.request("status")

    def pause(self) -> dict[str, Any]:
        """Pause; as each of these requests, return the status after it. Raises ReplayRefused, ReplayGone."""
        return self.request("pause")

    def resume(self) -> dict[str, Any]:
        return self.request("resume")

    def step(self, ticks: int = 1) -> dict[str, Any]:
        """Publish `ticks` ticks at once, and pause after them."""
        return self.request("step", count=ticks)

    def seek(self, time_ns: int) -> dict[str, Any]:
        """Continue from a captured time."""
        return self.request("seek", time_ns=time_ns)

    def set_rate(self, pace: str) -> dict[str, Any]:
        """Change the rate: realtime, fast, or a factor such as 2x."""
        return self.request("rate", pace=pace)

    def stop(self) -> dict[str, Any]:
        return self.request("stop")

    def request(self, verb: str, timeout_s: float = ANSWER_S, **arguments: Any) -> dict[str, Any]:
        """Send a request and return the status after it; messages that arrive meanwhile are kept for `take`."""
        from foosim.client.requests import answer_to, exchange

        self._requests += 1
        identity = f"r{self._requests}"
        payload = encode(Request(self._name, identity, verb, encode_json(arguments)))
        find = answer_to(channels.REPLAY_ANSWER, identity)

        def take(key: str, name: str, content: bytes) -> Answer | None:
            self._on_message(key, name, content)
            return find(key, name, content)

        def is_over() -> bool:
            return self.ended or self._is_gone

        answer = exchange(
            self._wire, self._inbox, channels.REPLAY_REQUEST, self._name, payload, take, timeout_s, is_over
        )
        if answer is None:
            raise ReplayGone("the replay has ended" if is_over() else f"no answer to {verb} within {timeout_s:g} s")
        if not answer.accepted:
            raise ReplayRefused(answer.text)
        status = decode_json(answer.result)
        if not isinstance(status, dict):
            raise ReplayRefused("the answer is not a status")
        return status

    def learn(self, timeout_s: float) -> None:
        """Request the played deployment, which is needed to decode payloads; `hear_replay` does."""
        status = self.request("status", timeout_s)
        try:
            deployment, name = str(status["deployment"]), str(status["deployment_name"])
            self._old_names = {str(new): str(old) for old, new in status["names"].items()}
            self._old_channels = {str(new): str(old) for old, new in status["channels"].items()}
        except (KeyError, AttributeError) as error:
            raise ReplayRefused(f"the replay's status lacks its deployment: {error}") from None
        self._deployment = load_deployment(deployment, name)

    def close(self) -> None:
        self._session.close()


def hear_replay(
    address: str,
    streams: Sequence[str] = STREAMS,
    timeout_s: float = CONNECT_S,
    pki: str | os.PathLike[str] | None = None,
    answer_s: float = ANSWER_S,
) -> Replay:
    """Connect to the replay that listens at `address`, `tcp/HOST:PORT`, and subscribe to some of its streams.

    `streams` are of `packets`, `poses`, `scene`, `log`, `rows` and `clock`; requests need none. Where the replay has
    certificates the address is `tls/HOST:PORT`, and `pki` the folder with an operator's. Raises UnknownName for an
    unknown stream, BadValue for a bad address, CertificateError, ConnectionFailed when no router answers within
    `timeout_s`, ReplayGone when no replay answers within `answer_s`, as one that does not know this operator.
    """
    from foosim.runtime.transport.session import ConnectError, Session
    from foosim.runtime.transport.settings import Security

    for stream in streams:
        if stream not in STREAMS:
            raise UnknownName("not a stream of a replay", stream, STREAMS)
    credentials = operator_credentials(None if pki is None else Path(pki))
    # With a certificate an operator may use any name that begins with its own and a dot.
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
