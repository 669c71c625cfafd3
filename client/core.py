"""The core of a client: takes messages and the time, and keeps its side of the session with the vHub.

Hello is repeated until it is answered, Join until a new message arrives, and again after each second without one. In
lockstep `go` is the Go that waits for an answer, and `done` answers it: stop and wait, so that a repeated Go gets the
same bytes again. A free-running client takes `arrivals` and sends at any time; its packets are kept until the vHub has
recorded them. Downlinks are numbered: repeats are dropped, gaps counted. When the vHub is gone (`hub_gone`) the session
restarts with hello and resumes at its numbers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from msgspec import structs

from foosim.client.errors import PacketError
from foosim.client.files import ClientFiles, are_drawn
from foosim.client.packets import check_packet, check_subscription, split
from foosim.client.player import Packet, keep_metrics
from foosim.common import limits
from foosim.common.errors import DeploymentError, Malformed
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Action, Log, Publish
from foosim.protocol.channels import Channel
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import (
    ClientHello,
    ClientRefusal,
    ClientWelcome,
    Done,
    Down,
    Failure,
    Go,
    Heard,
    Join,
    Piece,
    Received,
    Sent,
    Subscription,
    Up,
)
from foosim.protocol.rejects import Refusals
from foosim.world.assembly.joint_selection import with_selections

AGAIN_NS: Final = 200_000_000
"""Period of a repeated hello, and first back-off of a repeated Join, which doubles up to a second."""
AWAY_AGAIN_NS: Final = 50_000_000
"""The same while the vHub is gone: the run waits for returning clients."""
NEVER_NS: Final = limits.COUNTER_MAX
GAPS_KEPT: Final = 1024
"""Numbers of missing downlinks that are kept, to distinguish a late one from a repeat."""


@dataclass(frozen=True, slots=True)
class ClientStatistics:
    """A client's account so far. `missing` downlinks were passed over and have not come since."""

    downlinks: int
    repeated: int
    missing: int
    malformed: int
    overflowed: int
    received: int
    sent: int
    answered: int
    unsent: int = 0
    """Packets that were not sent, since too many wait to be recorded."""
    returns: int = 0
    """The count of returns after a loss of the vHub."""


class ClientCore:
    """One client's state machine. `actions` are the shell's next steps."""

    def __init__(
        self, name: str, boot: str, now_ns: int, world: str = "", cache: MutableMapping[str, bytes] | None = None
    ) -> None:
        """`world` is empty when the client accepts any world. `cache` keeps fetched files, by digest."""
        self.name = name
        self.boot = boot
        self.actions: list[Action] = []
        self.refusals = Refusals(self.actions.append, lambda: self.deployment)
        self.welcome: ClientWelcome | None = None
        self.deployment: Deployment | None = None
        self.refusal = ""
        self.go: Go | None = None
        self.arrivals: deque[Received] = deque()
        """Packets that have reached a free-running client and were not taken yet, in order."""
        self.tick = -1
        """The newest tick that the vHub has named."""
        self.since = -1
        """The tick since which a free-running client exists; -1 while it does not, and before the vHub reports it."""
        self.absent: Sequence[str] = ()
        """Those of its robots that are absent."""
        self.ended = False
        self.is_away = False
        """Whether the vHub is gone, and has not let the client in again."""
        self.lost = False
        """Whether it was gone for longer than a run waits for it."""
        self._world = world
        self._now_ns = self._again_ns = now_ns
        self._again_after_ns = AGAIN_NS
        self._join: Join | None = None
        self._cache = {} if cache is None else cache
        self._files: ClientFiles | None = None
        """While files are fetched, before the Join."""
        self._lost_ns = NEVER_NS
        self._gone = 0
        """Number of losses of the vHub. An answer to a hello from before the last one is ignored."""
        self._unrecorded: deque[Sent] = deque()
        self._resend_ns = NEVER_NS
        self._period = self._offset = 0
        self._on_arrival = False
        self._sequence = self.first_sequence = 0
        """The number of its last packet; and of the last one of processes before it, whose place it takes."""
        self._downlink, self._gaps = 0, set[int]()
        self._metrics, self._changed = dict[str, float](), dict[str, float]()
        """The last value of each metric that the client has reported; in lockstep, what the next answer has."""
        self._done, self._done_number = b"", -1
        self._downlinks = self._repeated = self._missing = self._malformed = self._overflowed = 0
        self._received = self._sent = self._answered = self._unsent = self._returns = self._reports = 0
        self._readers: dict[type[Any], Callable[[Any], None]] = {
            ClientWelcome: self._on_welcome,
            ClientRefusal: self._on_refusal,
            Piece: self._on_piece,
            Go: self._on_go,
            Down: self._on_down,
            Heard: self._on_heard,
        }

    # --- calls of the shell ----------------------------------------------------------------------------------------

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        """Handle one message; an invalid one is counted and dropped."""
        self._now_ns = max(self._now_ns, now_ns)
        try:
            if name != self.name:
                raise Malformed(f"addressed to {name}")
            message = decode(channel.message, payload, channel.bytes_max)
            reader = self._readers.get(type(message))
            if reader is None:
                raise Malformed(f"a client does not read the channel {channel.name}")
            reader(message)
        except Malformed as error:
            self._malformed += 1
            self.refusals.refuse(channel, name, payload, error, now_ns)

    def wake(self, now_ns: int) -> None:
        """Repeat unanswered messages that are due."""
        self._now_ns = max(self._now_ns, now_ns)
        if now_ns >= self._lost_ns:
            self.lost, self._lost_ns = True, NEVER_NS
        if now_ns >= self._hello_ns:
            if self.welcome is None or self.is_away:
                self._say_hello()
            else:
                self._say_join()
                self._again_after_ns = min(2 * self._again_after_ns, limits.WANT_EVERY_NS_MAX)
            self._again_ns = now_ns + self._again_after_ns
        if now_ns >= self._resend_ns:
            self._resend(whole=False)

    @property
    def _hello_ns(self) -> int:
        """When hello or Join is sent next."""
        waits = self.welcome is None or self.is_away or self._join is not None
        return self._again_ns if waits and not self.refusal and not self.ended else NEVER_NS

    def deadline_ns(self) -> int:
        """When `wake` has something to do next."""
        return min(self._hello_ns, self._lost_ns, self._resend_ns)

    def hub_gone(self, now_ns: int) -> None:
        """The vHub's presence has ended: repeat hello until it is back. Packets sent meanwhile are kept."""
        if self.deployment is None or self.ended:
            return
        self._gone += 1
        if self.is_away:
            return
        self.is_away = True
        self._lost_ns = now_ns + self._outage_ns_max(self.deployment)
        self._again_ns, self._again_after_ns = now_ns, AWAY_AGAIN_NS
        self._resend_ns = NEVER_NS
        self.actions.append(Log("warning", "the vHub is gone; waits for it to come back"))

    def hub_here(self, now_ns: int) -> None:
        """A vHub is present."""
        if self.is_away:
            self._again_ns = now_ns

    def rest(self, stood_ns: int, now_ns: int) -> None:
        """Exclude a standstill of the client's own loop from the vHub's deadline (`runtime.standstill`)."""
        if self._lost_ns != NEVER_NS and self.deployment is not None:
            self._lost_ns = min(self._lost_ns + stood_ns, now_ns + self._outage_ns_max(self.deployment))

    def _outage_ns_max(self, deployment: Deployment) -> int:
        """How long to wait for a lost vHub. Before its first message this is the time for a start."""
        deadlines = deployment.deadlines
        has_begun = self._answered or self._received
        return deadlines.vhub_back_ns if has_begun else max(deadlines.vhub_back_ns, deadlines.start_ns)

    def statistics(self) -> ClientStatistics:
        downlinks = self._downlinks, self._repeated, self._missing, self._malformed, self._overflowed
        packets = self._received, self._sent, self._answered, self._unsent
        return ClientStatistics(*downlinks, *packets, self._returns)

    # --- calls of the client ---------------------------------------------------------------------------------------

    def join(
        self,
        period_ticks: int,
        subscriptions: Iterable[tuple[str, str]],
        offset_ticks: int = 0,
        arrivals: Iterable[tuple[str, str]] = (),
    ) -> None:
        """Take part: in lockstep every `period_ticks`, or free-running with 0; subscribe to these (endpoint, channel).

        Its ticks leave the remainder `offset_ticks`, which is below the period. With `arrivals`, which
        are some of what it hears, they are those at which a packet of these arrives, or a period has passed.

        Raises UnknownName for an endpoint or a robot's channel that the deployment does not have.
        """
        assert self.deployment is not None and self.welcome is not None, "join before a welcome"
        assert 0 <= offset_ticks < max(1, period_ticks), (offset_ticks, period_ticks)
        pairs = sorted(set(subscriptions))
        for source, channel in pairs:
            check_subscription(self.deployment, source, channel)
        items = [Subscription(source, channel) for source, channel in pairs]
        calling = [Subscription(source, channel) for source, channel in sorted(set(arrivals))]
        assert all(item in items for item in calling), (calling, items)
        self._join = Join(self.name, self.boot, period_ticks, items, offset_ticks, calling)
        self._period, self._offset, self._on_arrival = period_ticks, offset_ticks, bool(calling)
        self._files = None
        if are_drawn(self.deployment, pairs) and not self.deployment.fetched:
            self._files = ClientFiles(self.name, self.boot, self.deployment, self._cache, self.actions)
        if not self.is_away:
            self._say_join()
        self._again_after_ns = AGAIN_NS
        self._again_ns = self._now_ns + AGAIN_NS

    def done(self, packets: Sequence[Packet]) -> None:
        """Answer the open Go with the packets of its tick. Raises UnknownName or PacketError, and the Go stays open."""
        assert self.go is not None and self.deployment is not None, "nothing to answer"
        # A packet's stamp is its tick's time: with a wall clock's, two equal runs would not give equal bytes.
        sent = self._numbered(packets, self.go.tick * self.deployment.tick_ns)
        payload = encode(Done(self.name, self.boot, self.go.tick, sent, [*self._changed.items()]))
        if len(payload) > channels.UP.bytes_max:
            raise PacketError(f"{len(payload)} bytes in one answer, at most {channels.UP.bytes_max} are allowed")
        self._count_sent(sent)
        self._done, self._done_number = payload, self.go.number
        self._changed = {}
        self.go = None
        self._answered += 1
        self._publish(payload)

    def send(self, packets: Sequence[Packet], stamp_ns: int = 0) -> None:
        """Send packets, free-running; `stamp_ns` is the client's own clock. Raises UnknownName or PacketError.

        Where more than `UPLINKS_KEPT_MAX` would wait to be recorded, they are not sent, and counted.
        """
        assert self.welcome is not None, "send before a welcome"
        sent = self._numbered(packets, stamp_ns)
        if len(self._unrecorded) + len(sent) > limits.UPLINKS_KEPT_MAX:
            if not self._unsent:
                self.actions.append(
                    Log("warning", f"{len(self._unrecorded)} packets wait for the vHub: no more is sent")
                )
            self._unsent += len(sent)
            return
        self._count_sent(sent)
        if not self._unrecorded:
            self._resend_ns = self._now_ns + limits.WANT_EVERY_NS_MAX
        self._unrecorded.extend(sent)
        if self.is_away:
            self._resend_ns = NEVER_NS
            return
        for part in split(sent, channels.UP.bytes_max):
            self._publish(encode(Up(self.name, self.boot, part)))

    def report(self, metrics: Mapping[str, float]) -> None:
        """Report metrics: in lockstep with the next answer, else at once. Raises BadValue for too many names."""
        changed = {name: value for name, value in metrics.items() if self._metrics.get(name) != value}
        if not changed:
            return
        keep_metrics(self._metrics, changed)
        if self._period:
            self._changed |= changed
        elif not self.is_away:
            self._publish_metrics(changed)

    def _publish_metrics(self, metrics: Mapping[str, float]) -> None:
        self._reports += 1
        self._publish(encode(Up(self.name, self.boot, [], [*metrics.items()], self._reports)))

    def fail(self, reason: str, trace: str = "") -> None:
        """Report that this client's own code has failed, and why, before its process ends; `trace` goes to the log."""
        if trace:
            self.actions.append(Log("error", trace))
        self.actions.append(Log("error", reason))
        self._publish(encode(Failure(self.name, self.boot, reason)))

    # --- messages --------------------------------------------------------------------------------------------------

    def _on_welcome(self, welcome: ClientWelcome) -> None:
        # One that answers an earlier hello is of a vHub that is gone, too.
        is_old = welcome.returns != self._gone or (self.welcome is not None and not self.is_away)
        if not self._is_for_me(welcome) or self.refusal or is_old:
            self._repeated += 1
            return
        if self.welcome is not None:
            self._return(welcome, self.welcome)
            return
        try:
            deployment = load_deployment(welcome.deployment, welcome.deployment_name)
        except DeploymentError as error:
            self._refused(f"the vHub's deployment is not valid here:\n{error}")
            return
        self.welcome = welcome
        self.deployment = with_selections(deployment, [(one.names, one.channels) for one in welcome.joints])
        self._sequence = self.first_sequence = welcome.sequence
        self._downlink = welcome.downlink

    def _return(self, welcome: ClientWelcome, before: ClientWelcome) -> None:
        """Resume with a vHub that is back: join as before, and send the packets that it has not recorded."""
        if welcome.run != before.run:
            self._refused(f"the vHub is back with run {welcome.run}, this client was in {before.run}")
            return
        self.welcome = welcome
        self.is_away = False
        self._lost_ns = NEVER_NS
        self._returns += 1
        if self._join is not None:
            self._say_join()
            self._again_after_ns, self._again_ns = AGAIN_NS, self._now_ns + AGAIN_NS
        self._recorded(welcome.sequence)
        self._resend(whole=True)
        if self._metrics and not self._period:  # it may not have recorded them; an answer in lockstep comes again
            self._publish_metrics(self._metrics)
        self.actions.append(Log("info", "the vHub is back"))

    def _on_refusal(self, refusal: ClientRefusal) -> None:
        is_in = self.welcome is not None and not self.is_away
        if not self._is_for_me(refusal) or is_in != refusal.joins or self.refusal:
            self._repeated += 1
            return
        self._refused(refusal.reason)

    def _refused(self, reason: str) -> None:
        self.refusal = reason or "no reason given"
        self.actions.append(Log("error", f"refused by the vHub: {self.refusal}"))

    def _on_piece(self, piece: Piece) -> None:
        if not self._is_for_me(piece) or self._files is None or not self._files.take(piece):
            self._repeated += 1
            return
        self._again_after_ns, self._again_ns = AGAIN_NS, self._now_ns + AGAIN_NS
        if not self.is_away:
            self._say_join()

    def _is_for_me(self, message: ClientWelcome | ClientRefusal | Piece) -> bool:
        if message.name != self.name:
            raise Malformed(f"a message on the key of {self.name} names {message.name}")
        return message.boot == self.boot

    def _on_heard(self, heard: Heard) -> None:
        self._hears()
        self._recorded(heard.acknowledged)

    def _hears(self) -> None:
        """A new message confirms the Join. A repeated one does not: it may be of an earlier vHub process."""
        if not self.is_away:
            self._again_after_ns = limits.WANT_EVERY_NS_MAX
            self._again_ns = self._now_ns + self._again_after_ns

    def _on_go(self, go: Go) -> None:
        if go.number == self._done_number:
            self._repeated += 1
            self._publish(self._done)
            return
        if not self._is_new(go):
            return
        if self._period == 0 or (not self._on_arrival and go.tick % self._period != self._offset):
            timing = f"a period of {self._period} ticks and an offset of {self._offset}"
            raise Malformed(f"Go for tick {go.tick} to a client with {timing}")
        if go.tick <= self.tick or self.ended:
            self._repeated += 1
            return
        self._take_number(go.number)
        self.tick = go.tick
        self.go = go
        self._received += len(go.packets)

    def _on_down(self, down: Down) -> None:
        self._recorded(down.acknowledged)
        if down.ended:  # also of a vHub that has lost the numbers of its last downlinks
            self.ended = True
            self.go = None
        if not self._is_new(down):
            return
        is_newest = down.number > self._downlink
        self._take_number(down.number)
        self.tick = max(self.tick, down.tick)
        self._received += len(down.packets)
        if is_newest and not down.ended:
            if down.since != self.since:
                self.arrivals.clear()  # they have reached another one
            self.since, self.absent = down.since, down.absent
        if down.since != self.since:
            return
        room = limits.INBOX_MESSAGES_MAX - len(self.arrivals)
        self.arrivals.extend(down.packets[: max(0, room)])
        self._overflowed += max(0, len(down.packets) - room)

    def _is_new(self, downlink: Go | Down) -> bool:
        """Whether a downlink is new; one that was not requested is refused."""
        if self.welcome is None:
            raise Malformed("a downlink before the welcome")
        if downlink.number > self._downlink or downlink.number in self._gaps:
            return True
        self._repeated += 1
        return False

    def _take_number(self, number: int) -> None:
        self._downlinks += 1
        self._hears()
        if number <= self._downlink:
            self._gaps.remove(number)
            self._missing -= 1
            return
        gap = number - self._downlink - 1
        if gap:
            self._missing += gap
            self._gaps.update(range(max(self._downlink + 1, number - GAPS_KEPT), number))
            if len(self._gaps) > GAPS_KEPT:
                self._gaps = set(sorted(self._gaps)[-GAPS_KEPT:])
        self._downlink = number

    # --- sending ---------------------------------------------------------------------------------------------------

    def _numbered(self, packets: Sequence[Packet], stamp_ns: int) -> list[Sent]:
        """Return the packets with their numbers, checked; nothing is counted yet."""
        if len(packets) > limits.PACKETS_PER_MESSAGE_MAX:
            raise PacketError(f"{len(packets)} packets at once, at most {limits.PACKETS_PER_MESSAGE_MAX} are allowed")
        assert self.deployment is not None
        for packet in packets:
            check_packet(self.deployment, packet)
        return [
            Sent(self._sequence + index, packet.destination, packet.channel, stamp_ns, packet.payload)
            for index, packet in enumerate(packets, 1)
        ]

    def _recorded(self, sequence: int) -> None:
        """Drop the packets that the vHub has recorded."""
        kept = self._unrecorded
        if kept and kept[0].sequence <= sequence:
            self._resend_ns = self._now_ns + limits.WANT_EVERY_NS_MAX
            while kept and kept[0].sequence <= sequence:
                kept.popleft()
        if not kept:
            self._resend_ns = NEVER_NS

    def _resend(self, whole: bool) -> None:
        """Repeat the unrecorded packets: all, or as many as fit one message."""
        for part in split(self._unrecorded, channels.UP.bytes_max):
            self._publish(encode(Up(self.name, self.boot, part)))
            if not whole:
                break
        self._resend_ns = self._now_ns + limits.WANT_EVERY_NS_MAX if self._unrecorded else NEVER_NS

    def _say_hello(self) -> None:
        received = min(self._gaps, default=self._downlink + 1) - 1
        who = self.name, self.boot, limits.PROTOCOL_VERSION, self._world
        hello = ClientHello(*who, received, self._gone)
        self.actions.append(Publish(channels.CLIENT_HELLO, self.name, encode(hello)))

    def _say_join(self) -> None:
        assert self._join is not None and self.welcome is not None
        if self._files is not None and not self._files.is_over:
            self._files.request()
            if not self._files.is_over:
                return
        self._files = None
        self._publish(encode(structs.replace(self._join, hub=self.welcome.hub)))

    def _count_sent(self, sent: Sequence[Sent]) -> None:
        self._sequence += len(sent)
        self._sent += len(sent)

    def _publish(self, payload: bytes) -> None:
        self.actions.append(Publish(channels.UP, self.name, payload))
