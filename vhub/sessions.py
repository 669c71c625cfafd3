"""Sessions of clients: which process has a client's name, and the messages that are kept until it answers.

A lockstep client receives `Go(k)` and answers `Done(k)`, stop and wait; a free-running one receives numbered `Down`s.
Messages to a client are numbered and kept, so that it can resume after an absence. A session belongs to a process; the
client's part of the simulated world is in `state`.

A hello reserves a name, a Join takes it. A hello may arrive after the end of its process, if the vHub was down
meanwhile or the disconnect overtook the hello. Where that is possible, a reservation is not exclusive: all processes
are welcomed, and the first that joins has the name.
"""

from __future__ import annotations

from collections import deque
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
    SelectedJoints,
    Sent,
)
from foosim.runtime.roles.standstill import CLOSED, closed
from foosim.vhub.network.memory import Joining
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.members import may_lockstep, may_restart
from foosim.world.assembly.joint_selection import selections

T = TypeVar("T")
BOOTS_KEPT: Final = 32
"""How many earlier processes of one name are remembered: late messages arrive within seconds."""
_Kept = tuple[int, int, bytes]
"""When it expires, its number, its bytes."""


class Downlinks:
    """The last downlinks of every client, each kept for `kept_ns`: one that returns may lack them."""

    def __init__(self) -> None:
        self.kept_ns = limits.DOWNLINK_KEPT_NS
        self._by_client: dict[str, deque[_Kept]] = {}

    def keep(self, client: str, number: int, payload: bytes, now_ns: int) -> None:
        """Add a downlink, and drop expired ones."""
        kept = self._by_client.setdefault(client, deque(maxlen=limits.DOWNLINKS_KEPT_MAX))
        while kept and kept[0][0] < now_ns:
            kept.popleft()
        kept.append((now_ns + self.kept_ns, number, payload))

    def restore(self, downlinks: dict[str, list[tuple[int, bytes]]], now_ns: int) -> None:
        """Restore the downlinks of the vHub process before this one."""
        for client, sent in downlinks.items():
            for number, payload in sent:
                self.keep(client, number, payload, now_ns)

    def after(self, client: str, received: int) -> Iterable[bytes]:
        """Return the downlinks with numbers above `received`, in order."""
        return [payload for _, number, payload in self._by_client.get(client, ()) if number > received]


class Claim(NamedTuple):
    """A hello that was welcomed, and the numbers that its welcome gave."""

    hello: ClientHello
    sequence: int
    downlink: int


@dataclass(slots=True)
class Session:
    """The process of one client: its boot, the Go without a Done, and the packets that it sent between closings."""

    name: str
    boot: str
    """Empty while a client of the restored state has not connected to this vHub yet."""
    is_present: bool = False
    """Whether it has joined since its last hello. Nothing is sent to it before."""
    received: int = 0
    """The number up to which it had received all downlinks at its hello."""
    is_behind: bool = True
    """Whether the downlinks that it lacked at its hello are still to be sent."""
    is_gone: bool = False
    """Whether its process has disconnected, and no process of the name has connected since."""
    why_gone: str = CLOSED
    """The cause, if there is one."""
    returns: int = 0
    """How often its process had lost the vHub, by its last hello."""
    before: dict[str, None] = field(default_factory=dict)
    """Boots of the last processes that have ended: their late messages are dropped."""
    claims: dict[str, Claim] = field(default_factory=dict)
    """The last processes that were welcomed to the name and may still run, by boot."""
    away_ns: int = -1
    """The earliest time at which an absent client is given up, or a restarted one that is still to join; -1 while it
    is present."""
    back_ns: int = 0
    """The time that it is given for that."""
    next_sequence: int = 1
    """The number of its next packet: packets after a gap are dropped."""
    heard: int = 0
    """The last sequence number that was acknowledged to it."""
    heard_ns: int = 0
    go: bytes = b""
    go_tick: int = -1
    again_ns: int = 0
    again_after_ns: int = limits.WANT_AFTER_NS
    deadline_ns: int = 0
    """When its answer is overdue; 0 while none is due."""
    allowed_ns: int = 0
    deadline: str = ""
    """The name of the deadline in the deployment."""
    done: Done | None = None
    fetched_bytes: int = 0
    """What it has fetched, less what it may fetch since."""
    fetched_ns: int = 0
    report: int = 0
    """The number of its newest report outside of lockstep."""
    inbox: list[Sent] = field(default_factory=list)
    inbox_bytes: int = 0
    """Size of the messages as received."""

    def may_fetch(self, now_ns: int) -> bool:
        """Count a piece of a file; return False beyond what a client may fetch."""
        again = (now_ns - self.fetched_ns) * limits.FETCHED_BYTES_PER_S // 1_000_000_000
        self.fetched_bytes, self.fetched_ns = max(0, self.fetched_bytes - again), now_ns
        if self.fetched_bytes >= 2 * limits.ASSETS_BYTES_MAX:
            return False
        self.fetched_bytes += limits.RADIO_PIECE_BYTES
        return True

    def is_late(self, hello: ClientHello) -> bool:
        """Whether the process of a hello has ended since: a process that reconnects has a higher number of returns."""
        is_of_gone = self.is_gone and hello.boot == self.boot and hello.returns <= self.returns
        return is_of_gone or hello.boot in self.before

    def come(self, boot: str, received: int, sequence: int, joins_first: bool = False) -> None:
        """Give the session to a process that continues after these numbers; away until it joins with `joins_first`."""
        if boot != self.boot:
            if self.boot and self.is_gone:
                _remember(self.before, self.boot, None)
                self.claims.pop(self.boot, None)
            self.inbox, self.inbox_bytes, self.next_sequence, self.report = [], 0, 1, 0
        self.is_present = self.is_present and boot == self.boot
        self.boot, self.received, self.is_behind, self.is_gone = boot, received, True, False
        self.why_gone = CLOSED
        self.away_ns = self.away_ns if joins_first else -1
        self.next_sequence = max(self.next_sequence, sequence + 1)

    def may_fail(self, boot: str) -> bool:
        """Whether a process has the name or may still get it: its failure then concerns the run."""
        return boot == self.boot or (boot in self.claims and not self.is_present)

    def is_held_against(self, boot: str) -> bool:
        """Whether another process has the name and has not disconnected."""
        return self.boot not in ("", boot) and not self.is_gone

    @property
    def lost_ns(self) -> int:
        """When an absent client is lost. Its process may have ended or only be suspended, so this is the later of the
        deadlines for its return and for its answer."""
        return max(self.away_ns, self.deadline_ns)

    def answered(self) -> None:
        """Stop waiting for an answer."""
        self.deadline_ns = 0

    def leave(self, back_ns: int, now_ns: int) -> None:
        """Mark the client as away; it is given `back_ns` to return."""
        self.back_ns, self.away_ns = back_ns, now_ns + back_ns

    def rest(self, for_ns: int, now_ns: int) -> None:
        """Extend the deadlines by a standstill of `for_ns`, at most to new deadlines from now on."""
        if self.away_ns >= 0:
            self.away_ns = min(self.away_ns + for_ns, now_ns + self.back_ns)
        if self.deadline_ns:
            self.deadline_ns = min(self.deadline_ns + for_ns, now_ns + self.allowed_ns)

    def take(self, packets: Sequence[Sent]) -> int:
        """Take packets of the client, each number once and in order; return how many were repeats."""
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
        """The message for a deadline that has passed."""
        overdue = f"{self.name} has not answered tick {self.go_tick} for {self.allowed_ns / 1e9:g} s"
        return f"{overdue} (deadlines.{self.deadline})"

    def closed(self, now_ns: int) -> str:
        """Return the message for a closed connection: whether the process owed an answer at that time."""
        owed_ns = now_ns - (self.deadline_ns - self.allowed_ns) if self.deadline_ns else 0
        return closed(owed_ns, f"it had not answered tick {self.go_tick}")

    def wait(self, now_ns: int, allowed_ns: int, again_after_ns: int) -> None:
        """Begin to wait for a Done."""
        self.allowed_ns = allowed_ns
        self.deadline_ns = now_ns + allowed_ns
        self.again_after_ns = again_after_ns
        self.again_ns = now_ns + again_after_ns


class Sessions:
    """The sessions of all clients. Messages to send are appended to `actions`."""

    def __init__(self, hub_boot: str, actions: list[Action]) -> None:
        self.by_name: dict[str, Session] = {}
        self.joins: dict[str, Joining] = {}
        """Joins that wait for a tick, by client."""
        self.reports: dict[str, dict[str, float]] = {}
        """Values of metrics that clients have reported between closings."""
        self.downlinks = Downlinks()
        self._waiting_bytes = 0
        """Size of the packets of all clients between two closings."""
        self._left_behind: dict[str, list[Sent]] = {}
        """Packets of clients that have disconnected."""
        self._is_resumed = False
        """Whether this vHub resumes a run: it has missed disconnects while it was down."""
        self._hub_boot = hub_boot
        self._actions = actions

    def hello(
        self, hello: ClientHello, build: Build, deployment: Deployment, state: HubState, sent: int | None = None
    ) -> None:
        """Admit a client, or refuse it with the reason. A repeated hello gets the same answer.

        `sent` is the number of the last downlink that was sent to the name, None when that is the newest one.
        """
        reason = self._reason_against(hello, deployment)
        if reason:
            self._refuse(ClientRefusal(hello.name, hello.boot, reason))
            return
        session = self.by_name.get(hello.name)
        if session is None:
            session = self.by_name[hello.name] = Session(hello.name, hello.boot)
        claim = self._claim(session, hello, state, sent)
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
            [SelectedJoints([*names], [*pairs]) for names, pairs in selections(deployment)],
        )
        self._actions.append(Publish(channels.CLIENT_WELCOME, hello.name, encode(welcome)))

    def take_over(self, join: Join, deployment: Deployment, state: HubState, sent: int | None) -> bool:
        """Give the name to a process that was welcomed while another one had it; return False where it is too late.

        That is where another process has joined and is present, or has sent packets since this one was welcomed.
        """
        session = self.by_name[join.name]
        claim = session.claims[join.boot]
        is_taken = session.is_present and not session.is_gone
        if is_taken or claim.sequence != self._claim(session, claim.hello, state, sent).sequence:
            self._refuse(ClientRefusal(join.name, join.boot, _already_here(join.name), joins=True))
            return False
        self._take(session, claim, deployment)
        return True

    def is_for_another(self, join: Join) -> bool:
        """Whether a Join answers the welcome of another vHub process: it is late, and its sender may have ended."""
        return join.hub not in ("", self._hub_boot)

    def _claim(self, session: Session, hello: ClientHello, state: HubState, sent: int | None) -> Claim:
        """Return the numbers from which a process continues."""
        member = state.members.get(hello.name)
        sequence = 0 if member is None else member.sequence
        downlink = 0 if member is None else member.downlink if sent is None else sent
        if hello.returns:
            return Claim(hello, sequence, min(hello.received, downlink))
        # a new process: numbers that its predecessor has used are taken
        waiting = [*self._left_behind.get(hello.name, ()), *(session.inbox if session.boot == hello.boot else ())]
        waiting += [] if session.done is None else session.done.packets
        return Claim(hello, max([sequence, *(packet.sequence for packet in waiting)]), downlink)

    def _take(self, session: Session, claim: Claim, deployment: Deployment) -> None:
        """Give the name to a process."""
        hello = claim.hello
        if session.boot != hello.boot:
            self._left_behind.setdefault(hello.name, []).extend(session.inbox)
        session.returns = hello.returns
        # A restarted process needs time to start, and one that reports its return may have ended since.
        is_unsure = self._is_resumed and not session.is_present
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
        """Whether the process that has the name may have ended before its hello arrived: it has not joined, and another
        process may have been started in its place."""
        return not session.is_present and (self._is_resumed or may_restart(deployment, session.name))

    def missing(self, deployment: Deployment, state: HubState) -> list[str]:
        """Return the declared lockstep clients that are still to join, in name order."""
        declared = sorted([*deployment.players, *deployment.clients])
        here = {name for name, member in state.members.items() if member.active} | self.joins.keys()
        return [name for name in declared if may_lockstep(deployment, name) and name not in here]

    def expect(self, names: Iterable[str], back_ns: int, now_ns: int) -> None:
        """Wait `back_ns` for clients of the restored state to connect to this new vHub process."""
        self._is_resumed = True
        for name in sorted(names):
            self.by_name[name] = Session(name, "")
            self.by_name[name].leave(back_ns, now_ns)

    def late(self, now_ns: int) -> list[str]:
        """Return the clients whose absence is over its deadline, in name order."""
        away = [(name, session) for name, session in sorted(self.by_name.items()) if session.away_ns >= 0]
        return [name for name, session in away if session.lost_ns <= now_ns]

    @property
    def late_ns(self) -> int | None:
        """The time at which the next absent client is lost."""
        return min((session.lost_ns for session in self.by_name.values() if session.away_ns >= 0), default=None)

    def join(self, join: Join) -> None:
        """Queue a join; it takes effect at the next tick that fits its period and offset."""
        subscriptions = {(wanted.source, wanted.channel) for wanted in join.subscriptions}
        arrivals = {(wanted.source, wanted.channel) for wanted in join.arrivals}
        what = sorted(subscriptions), join.offset, sorted(arrivals)
        self.joins[join.name] = Joining(join.name, join.period, *what)

    def take_joins(self, tick: int) -> list[Joining]:
        """Remove and return the joins that take effect at `tick`, in name order."""
        due = [name for name, joining in sorted(self.joins.items()) if joining.suits(tick)]
        return [self.joins.pop(name) for name in due]

    def leave(self, name: str) -> None:
        """Remove a client's session; its packets stay."""
        session = self.by_name.pop(name)
        self.joins.pop(name, None)
        self._left_behind.setdefault(name, []).extend(session.inbox)

    def admits(self, session: Session, packets: int, size: int) -> bool:
        """Count packets of a free-running client and their `size` in bytes; return False above the limits."""
        whole = self._waiting_bytes + size
        of_it = session.inbox_bytes + size
        if len(session.inbox) + packets > limits.INBOX_MESSAGES_MAX or of_it > limits.CLIENT_INBOX_BYTES_MAX:
            return False
        if whole > limits.CLIENT_INBOXES_BYTES_MAX:
            return False
        self._waiting_bytes, session.inbox_bytes = whole, of_it
        return True

    def take_sent(self) -> tuple[dict[str, list[Sent]], dict[str, dict[str, float]]]:
        """Remove and return the packets and the values of metrics since the last call, by client.

        Packets of a client whose join waits for its tick wait too: the state has the client from that tick on.
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
        reports, self.reports = self.reports, {}
        return taken, reports

    def send_go(self, session: Session, go: Go) -> None:
        """Send a lockstep client its Go; one that is away receives it after its return."""
        session.go = encode(go)
        session.go_tick = go.tick
        session.done = None
        if session.is_present:
            self._actions.append(Publish(channels.DOWN, session.name, session.go))

    def send_owed(self, name: str, now_ns: int) -> None:
        """Send the packets of an unanswered Go as a Down, and keep it: they count as delivered.

        The lost process and the next one may both lack that Go.
        """
        go = decode(Go, self.by_name[name].go)
        payload = encode(Down(go.number, go.tick, go.acknowledged, go.packets, False, go.since, go.absent))
        self.downlinks.keep(name, go.number, payload, now_ns)
        self._actions.append(Publish(channels.DOWN, name, payload))

    def resend(self, name: str, number: int) -> None:
        """Send a client's downlinks from a number on, as far as they are journalled and may be unsent."""
        self._actions += [Publish(channels.DOWN, name, payload) for payload in self.downlinks.after(name, number - 1)]

    def send_down(self, name: str, down: Down, now_ns: int) -> None:
        """Send a client released packets outside of lockstep, or the end of the run, and keep the message."""
        payload = encode(down)
        self.downlinks.keep(name, down.number, payload, now_ns)
        session = self.by_name.get(name)
        if session is not None and (session.is_present or down.ended):
            session.heard = max(session.heard, down.acknowledged)
            self._actions.append(Publish(channels.DOWN, name, payload))

    def catch_up(self, session: Session, waits: bool, now_ns: int) -> None:
        """Send a client that has joined what it has not received; `waits`: whether a tick waits for its Done."""
        session.is_present = True
        session.away_ns = -1
        if session.is_behind:
            session.deadline_ns = now_ns + session.allowed_ns if waits else 0
            session.is_behind = False
            missed = [*self.downlinks.after(session.name, session.received), *([session.go] if waits else [])]
            self._actions += [Publish(channels.DOWN, session.name, payload) for payload in missed]

    def acknowledge(self, state: HubState, now_ns: int) -> None:
        """Acknowledge recorded packets to free-running clients, at most once in a heartbeat's period."""
        for name, session in self.by_name.items():
            member = state.members.get(name)
            if member is None or member.period or not session.is_present or member.sequence <= session.heard:
                continue
            if now_ns >= session.heard_ns + limits.HEARTBEAT_NS:
                session.heard, session.heard_ns = member.sequence, now_ns
                self._actions.append(Publish(channels.DOWN, name, encode(Heard(member.sequence))))

    def rest(self, for_ns: int, now_ns: int) -> None:
        """Extend the deadlines of all clients by a standstill of `for_ns`."""
        for session in self.by_name.values():
            session.rest(for_ns, now_ns)

    def overdue(self, now_ns: int) -> list[Session]:
        """Return the clients that are connected and have not answered in time, in name order."""
        waited = [session for _, session in sorted(self.by_name.items()) if session.deadline_ns]
        return [session for session in waited if now_ns >= session.deadline_ns and session.away_ns < 0]

    def again_ns(self, waited: Sequence[str]) -> int:
        """The time of the next repeated Go."""
        return min(self.by_name[name].again_ns for name in waited)

    def repeat(self, waited: Sequence[str], now_ns: int) -> None:
        """Repeat a Go to clients that owe its answer, with exponential back-off."""
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
    """Store `what` under a boot, as the newest of at most `BOOTS_KEPT`."""
    by_boot.pop(boot, None)
    by_boot[boot] = what
    while len(by_boot) > BOOTS_KEPT:
        del by_boot[next(iter(by_boot))]
