"""Sessions of clients: which process has a client's name, and what was sent to it and is kept until it answers.

A lockstep client gets `Go(k)` and answers `Done(k)`, stop and wait; a free-running one gets numbered `Down`s. What is
sent to a client is numbered and kept, so that it can resume after an absence. Sessions are about processes; what the
world must remember of a client is in `state`.

A hello reserves a name, a Join takes it. A hello may come late, of a process whose end this vHub has not seen: because
the vHub was away, or because news of the end overtook the hello. Where that can be, a reservation excludes nobody: all
are welcomed, and the first that joins has the name.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple, TypeVar

from foosim.common import limits
from foosim.common.names import nearest_name
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Action, Publish
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import (
    Build,
    ClientHello,
    ClientRefusal,
    ClientWelcome,
    Done,
    Down,
    Go,
    Heard,
    Join,
    Sent,
)
from foosim.runtime.closed import CLOSED, closed
from foosim.vhub.network.memory import Joining
from foosim.vhub.state.downlinks import Downlinks
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.members import may_lockstep, may_restart

T = TypeVar("T")
BOOTS_KEPT: Final = 32
"""Of how many processes of one name it is kept that they were here: what comes late comes within seconds."""


class Claim(NamedTuple):
    """A hello that was welcomed, and the numbers that its process was told."""

    hello: ClientHello
    sequence: int
    downlink: int


@dataclass(slots=True)
class Session:
    """The process of one client: its boot, the Go without a Done, and the packets that it sent between closings."""

    name: str
    boot: str
    """Empty while the client that the state knows has not come to this vHub yet."""
    is_present: bool = False
    """Whether it has joined since its last hello: only then anything is sent to it."""
    received: int = 0
    """The downlink up to which it had received all at its hello."""
    is_behind: bool = True
    """Whether what it had not received then is still to be sent."""
    is_gone: bool = False
    """Whether its process has disconnected, and neither it nor another one has come since."""
    why_gone: str = CLOSED
    """The cause, as far as it is known."""
    returns: int = 0
    """How often its process had lost the vHub when it said hello."""
    before: dict[str, None] = field(default_factory=dict)
    """Boots of the last processes that are gone for good: their late messages are dropped."""
    is_missed: bool = False
    """Whether its hello has shown that the process before it was lost while the vHub was away."""
    claims: dict[str, Claim] = field(default_factory=dict)
    """The last processes that were welcomed to the name and are not known to be gone, by boot."""
    away_ns: int = -1
    """Until when a client that is away may come back at least, and one that was started again may join; -1 while it is
    here."""
    back_ns: int = 0
    """How long it has for that."""
    next_sequence: int = 1
    """The number of its next packet: nothing behind a gap is taken."""
    heard: int = 0
    """The sequence number that was acknowledged to it."""
    heard_ns: int = 0
    go: bytes = b""
    go_tick: int = -1
    again_ns: int = 0
    again_after_ns: int = limits.WANT_AFTER_NS
    deadline_ns: int = 0
    """By when it has to answer; 0 while no answer is due."""
    allowed_ns: int = 0
    deadline: str = ""
    """Which one of the deployment's that is."""
    done: Done | None = None
    inbox: list[Sent] = field(default_factory=list)
    inbox_bytes: int = 0
    """As they came."""

    def is_late(self, hello: ClientHello) -> bool:
        """Whether a hello was said by a process that has gone since: one that comes back counts one return more."""
        is_of_gone = self.is_gone and hello.boot == self.boot and hello.returns <= self.returns
        return is_of_gone or hello.boot in self.before

    def come(self, boot: str, received: int, sequence: int, joins_first: bool = False) -> None:
        """A process of the client is here; it goes on behind these numbers. It may be away until it `joins_first`."""
        if boot != self.boot:
            if self.boot and self.is_gone:
                _remember(self.before, self.boot, None)
                self.claims.pop(self.boot, None)
            self.inbox, self.inbox_bytes, self.next_sequence = [], 0, 1
        self.is_present = self.is_present and boot == self.boot
        self.boot, self.received, self.is_behind, self.is_gone = boot, received, True, False
        self.why_gone = CLOSED
        self.away_ns = self.away_ns if joins_first else -1
        self.next_sequence = max(self.next_sequence, sequence + 1)

    def may_fail(self, boot: str) -> bool:
        """Whether a process has the name, or may get it still."""
        return boot == self.boot or (boot in self.claims and not self.is_present)

    def is_held_against(self, boot: str) -> bool:
        """Whether another process has the name that is not known to be gone."""
        return self.boot not in ("", boot) and not self.is_gone

    @property
    def lost_ns(self) -> int:
        """When a client that is away is lost: its process may be gone, or only stand still, so the later time counts
        of those for coming back and for its answer."""
        return max(self.away_ns, self.deadline_ns)

    def answered(self) -> None:
        """No answer is waited for."""
        self.deadline_ns = 0

    def leave(self, back_ns: int, now_ns: int) -> None:
        """The client is away, and has so long to come back."""
        self.back_ns, self.away_ns = back_ns, now_ns + back_ns

    def rest(self, for_ns: int, now_ns: int) -> None:
        """For so long the client could do nothing: move its deadlines, at most to where they would begin now."""
        if self.away_ns >= 0:
            self.away_ns = min(self.away_ns + for_ns, now_ns + self.back_ns)
        if self.deadline_ns:
            self.deadline_ns = min(self.deadline_ns + for_ns, now_ns + self.allowed_ns)

    def take(self, packets: Sequence[Sent]) -> int:
        """Take what the client sends, each number once and in order; return how many were taken before."""
        repeated = 0
        for packet in sorted(packets, key=lambda sent: sent.sequence):
            if packet.sequence == self.next_sequence:
                self.next_sequence += 1
                self.inbox.append(packet)
            elif packet.sequence < self.next_sequence:
                repeated += 1
        return repeated

    @property
    def unanswered(self) -> str:
        """What is said when the deadline has passed."""
        told = f"{self.name} has not answered tick {self.go_tick} for {self.allowed_ns / 1e9:g} s"
        return f"{told} (deadlines.{self.deadline})"

    def closed(self, now_ns: int) -> str:
        """Return what is known of its process, whose connection has ended: whether it owed an answer until then."""
        owed_ns = now_ns - (self.deadline_ns - self.allowed_ns) if self.deadline_ns else 0
        return closed(owed_ns, f"it had not answered tick {self.go_tick}")

    def wait(self, now_ns: int, allowed_ns: int, again_after_ns: int) -> None:
        """Begin to wait for a Done."""
        self.allowed_ns = allowed_ns
        self.deadline_ns = now_ns + allowed_ns
        self.again_after_ns = again_after_ns
        self.again_ns = now_ns + again_after_ns


class Sessions:
    """The sessions of all clients. What is to be sent is appended to `actions`."""

    def __init__(self, hub_boot: str, actions: list[Action]) -> None:
        self.by_name: dict[str, Session] = {}
        self.joins: dict[str, Joining] = {}
        """Joins that wait for a tick, by client."""
        self.downlinks = Downlinks()
        self._waiting_bytes = 0
        """Of what all of them sent between closings."""
        self._left_behind: dict[str, list[Sent]] = {}
        """What clients had sent before they went."""
        self._goes_on = False
        """Whether this vHub goes on with a run: it does not know who has ended while it was away."""
        self._hub_boot = hub_boot
        self._actions = actions

    def hello(
        self, hello: ClientHello, build: Build, deployment: Deployment, state: HubState, said: int | None = None
    ) -> None:
        """Admit a client, or refuse it with the reason. A repeated hello gets the same answer.

        `said` is the last downlink that was sent to its name, None when that is the last one of all.
        """
        reason = self._reason_against(hello, deployment)
        if reason:
            self._refuse(ClientRefusal(hello.name, hello.boot, reason))
            return
        session = self.by_name.get(hello.name)
        if session is None:
            session = self.by_name[hello.name] = Session(hello.name, hello.boot)
        claim = self._claim(session, hello, state, said)
        _remember(session.claims, hello.boot, claim)
        if not session.is_held_against(hello.boot):
            self._take(session, claim, deployment)
        welcome = ClientWelcome(
            hello.name,
            hello.boot,
            self._hub_boot,
            claim.sequence,
            claim.downlink,
            build.deployment_name,
            build.deployment,
            build.run,
            hello.returns,
        )
        self._actions.append(Publish(channels.CLIENT_WELCOME, hello.name, encode(welcome)))

    def take_over(self, join: Join, deployment: Deployment, state: HubState, said: int | None) -> bool:
        """Give the name to a process that was welcomed while another one had it; False where it is too late for that.

        It is where another one has joined and is present, or has sent something since this one was told its numbers.
        """
        session = self.by_name[join.name]
        claim = session.claims[join.boot]
        is_taken = session.is_present and not session.is_gone
        if is_taken or claim.sequence != self._claim(session, claim.hello, state, said).sequence:
            self._refuse(ClientRefusal(join.name, join.boot, _already_here(join.name), joins=True))
            return False
        self._take(session, claim, deployment)
        return True

    def is_for_another(self, join: Join) -> bool:
        """Whether a Join answers another vHub's welcome: it comes late, perhaps of a process that is gone."""
        return join.hub not in ("", self._hub_boot)

    def _claim(self, session: Session, hello: ClientHello, state: HubState, said: int | None) -> Claim:
        """Return with which numbers a process goes on."""
        member = state.members.get(hello.name)
        sequence = 0 if member is None else member.sequence
        downlink = 0 if member is None else member.downlink if said is None else said
        if hello.returns:
            return Claim(hello, sequence, min(hello.received, downlink))
        # another process: the numbers of what the one before has sent are taken
        waiting = [*self._left_behind.get(hello.name, ()), *(session.inbox if session.boot == hello.boot else ())]
        waiting += [] if session.done is None else session.done.packets
        return Claim(hello, max([sequence, *(packet.sequence for packet in waiting)]), downlink)

    def _take(self, session: Session, claim: Claim, deployment: Deployment) -> None:
        """Give the name to a process."""
        hello = claim.hello
        if session.boot != hello.boot:
            self._left_behind.setdefault(hello.name, []).extend(session.inbox)
        session.returns = hello.returns
        # A process that is started anew takes its time, and one that says that it is back may be gone since.
        is_unsure = self._goes_on and not session.is_present
        joins_first = is_unsure if hello.returns else may_restart(deployment, hello.name)
        session.come(hello.boot, claim.downlink, claim.sequence, joins_first)

    def _refuse(self, refusal: ClientRefusal) -> None:
        self._actions.append(Publish(channels.CLIENT_REFUSAL, refusal.name, encode(refusal)))

    def _reason_against(self, hello: ClientHello, deployment: Deployment) -> str:
        if hello.version != limits.PROTOCOL_VERSION:
            return f"protocol version {hello.version}, this is {limits.PROTOCOL_VERSION}"
        if hello.world not in ("", deployment.world):
            return f"world {hello.world}, this is {deployment.world}"
        declared = [*deployment.players, *deployment.clients]
        if hello.name not in declared:
            nearest = nearest_name(hello.name, declared)
            hint = f", nearest is {nearest}" if nearest else ""
            return f"no client {hello.name} is declared; declared are {', '.join(sorted(declared)) or 'none'}{hint}"
        session = self.by_name.get(hello.name)
        if session is not None and session.is_held_against(hello.boot) and not self.is_in_doubt(session, deployment):
            return _already_here(hello.name)
        return ""

    def is_in_doubt(self, session: Session, deployment: Deployment) -> bool:
        """Whether the process that has the name may be gone, its hello having come late: it has not joined, and
        another process may have been started in its place."""
        return not session.is_present and (self._goes_on or may_restart(deployment, session.name))

    def missing(self, deployment: Deployment, state: HubState) -> list[str]:
        """Return the declared lockstep clients that have not joined yet, in name order."""
        declared = sorted([*deployment.players, *deployment.clients])
        here = {name for name, member in state.members.items() if member.active} | self.joins.keys()
        return [name for name in declared if may_lockstep(deployment, name) and name not in here]

    def expect(self, names: Iterable[str], back_ns: int, now_ns: int) -> None:
        """These clients come back, by then, to this vHub, which is another one."""
        self._goes_on = True
        for name in sorted(names):
            self.by_name[name] = Session(name, "")
            self.by_name[name].leave(back_ns, now_ns)

    def late(self, now_ns: int) -> list[str]:
        """Return the clients that were away for too long, in name order."""
        away = [(name, session) for name, session in sorted(self.by_name.items()) if session.away_ns >= 0]
        return [name for name, session in away if session.lost_ns <= now_ns]

    @property
    def late_ns(self) -> int | None:
        """When the next client has been away for too long."""
        return min((session.lost_ns for session in self.by_name.values() if session.away_ns >= 0), default=None)

    def join(self, join: Join) -> None:
        """Note a join; it takes effect when the hub closes a tick that suits it."""
        subscriptions = {(wanted.source, wanted.channel) for wanted in join.subscriptions}
        arrivals = {(wanted.source, wanted.channel) for wanted in join.arrivals}
        what = sorted(subscriptions), join.offset, sorted(arrivals)
        self.joins[join.name] = Joining(join.name, join.period, *what)

    def take_joins(self, tick: int) -> list[Joining]:
        """Take the joins that take effect at `tick`, in name order."""
        due = [name for name, joining in sorted(self.joins.items()) if joining.suits(tick)]
        return [self.joins.pop(name) for name in due]

    def leave(self, name: str) -> None:
        """Remove a client's session; what it sent stays."""
        session = self.by_name.pop(name)
        self.joins.pop(name, None)
        self._left_behind.setdefault(name, []).extend(session.inbox)

    def admits(self, session: Session, packets: int, size: int) -> bool:
        """Count what a free-running client says, so many packets in so many bytes; False when that is too much."""
        whole = self._waiting_bytes + size
        of_it = session.inbox_bytes + size
        if len(session.inbox) + packets > limits.INBOX_MESSAGES_MAX or of_it > limits.CLIENT_INBOX_BYTES_MAX:
            return False
        if whole > limits.CLIENT_INBOXES_BYTES_MAX:
            return False
        self._waiting_bytes, session.inbox_bytes = whole, of_it
        return True

    def take_sent(self) -> dict[str, list[Sent]]:
        """Take what clients have sent since the last call, by client.

        Where a join waits for its tick, what came with it waits too: there the client is known.
        """
        taken, self._left_behind = self._left_behind, {}
        for name, session in self.by_name.items():
            packets: list[Sent] = []
            if name not in self.joins:
                packets, session.inbox, session.inbox_bytes = session.inbox, [], 0
            if session.done is not None:
                packets = [*packets, *session.done.packets]
                session.done = None
            if packets:
                taken[name] = taken.get(name, []) + packets
        self._waiting_bytes = sum(session.inbox_bytes for session in self.by_name.values())
        return taken

    def send_go(self, session: Session, go: Go) -> None:
        """Send a lockstep client its tick; one that is away gets it when it has returned."""
        session.go = encode(go)
        session.go_tick = go.tick
        session.done = None
        if session.is_present:
            self._actions.append(Publish(channels.DOWN, session.name, session.go))

    def send_owed(self, name: str, now_ns: int) -> None:
        """Send the packets of the Go whose Done is owed as a Down, and keep it: they count as delivered.

        It is not known whether any process, or the one that joins next, has received that Go.
        """
        go = decode(Go, self.by_name[name].go)
        payload = encode(Down(go.number, go.tick, go.acknowledged, go.packets, False))
        self.downlinks.keep(name, go.number, payload, now_ns)
        self._actions.append(Publish(channels.DOWN, name, payload))

    def resend(self, name: str, number: int) -> None:
        """Send a client's downlinks from a number on, which the vHub before may have written and not sent."""
        self._actions += [Publish(channels.DOWN, name, said) for said in self.downlinks.behind(name, number - 1)]

    def send_down(self, name: str, down: Down, now_ns: int) -> None:
        """Send a client what is released to it outside of lockstep, or the end of the run; and keep it."""
        payload = encode(down)
        self.downlinks.keep(name, down.number, payload, now_ns)
        session = self.by_name.get(name)
        if session is not None and (session.is_present or down.ended):
            session.heard = max(session.heard, down.acknowledged)
            self._actions.append(Publish(channels.DOWN, name, payload))

    def catch_up(self, session: Session, waits: bool, now_ns: int) -> None:
        """A client has joined (again): send what it has not received; `waits` is whether a tick waits for its Done."""
        session.is_present = True
        session.away_ns = -1
        if session.is_behind:
            session.deadline_ns = now_ns + session.allowed_ns if waits else 0
            session.is_behind = False
            missed = [*self.downlinks.behind(session.name, session.received), *([session.go] if waits else [])]
            self._actions += [Publish(channels.DOWN, session.name, payload) for payload in missed]

    def acknowledge(self, state: HubState, now_ns: int) -> None:
        """Acknowledge to free-running clients what is recorded of their packets, ten times a second at most."""
        for name, session in self.by_name.items():
            member = state.members.get(name)
            if member is None or member.period or not session.is_present or member.sequence <= session.heard:
                continue
            if now_ns >= session.heard_ns + limits.HEARTBEAT_NS:
                session.heard, session.heard_ns = member.sequence, now_ns
                self._actions.append(Publish(channels.DOWN, name, encode(Heard(member.sequence))))

    def rest(self, for_ns: int, now_ns: int) -> None:
        """For so long no client could do anything."""
        for session in self.by_name.values():
            session.rest(for_ns, now_ns)

    def overdue(self, now_ns: int) -> list[Session]:
        """Return the clients that are connected and have not answered in time, in name order."""
        waited = [session for _, session in sorted(self.by_name.items()) if session.deadline_ns]
        return [session for session in waited if now_ns >= session.deadline_ns and session.away_ns < 0]

    def again_ns(self, waited: Sequence[str]) -> int:
        """When the next Go is repeated."""
        return min(self.by_name[name].again_ns for name in waited)

    def repeat(self, waited: Sequence[str], now_ns: int) -> None:
        """Repeat a Go to clients that have not answered it, with exponential back-off."""
        for name in waited:
            session = self.by_name[name]
            if now_ns >= session.again_ns:
                if session.is_present:
                    self._actions.append(Publish(channels.DOWN, name, session.go))
                session.again_after_ns = min(2 * session.again_after_ns, limits.WANT_EVERY_NS_MAX)
                session.again_ns = now_ns + session.again_after_ns


def _already_here(name: str) -> str:
    return f"a client {name} is already here"


def _remember(by_boot: dict[str, T], boot: str, what: T) -> None:
    """Note something of a process, as the newest of the `BOOTS_KEPT` that are kept."""
    by_boot.pop(boot, None)
    by_boot[boot] = what
    while len(by_boot) > BOOTS_KEPT:
        del by_boot[next(iter(by_boot))]
