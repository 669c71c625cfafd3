"""Handles what clients send to the vHub (hello, join, packets, Done) and their disconnects.

A client that disconnects may come back: one that the run waits for within `deadlines.client_back`, any other at any
time by a new join. Before the first tick, and after a restart of the vHub, clients have `deadlines.start`, since their
processes may have to be started.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from typing import Final

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.names import is_name
from foosim.common.units import parse_pace
from foosim.protocol import channels
from foosim.protocol.actions import Action, Journal, Publish
from foosim.protocol.asset_transfer import piece_of
from foosim.protocol.codec import encode
from foosim.protocol.messages import Build, ClientHello, Done, Failure, Fetch, Go, Join, Tempo, Up
from foosim.runtime.roles.standstill import REPORTED_NS
from foosim.vhub.absences import Absences
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight, received
from foosim.vhub.paced_release import Releases
from foosim.vhub.sessions import Session, Sessions
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.members import Member, may_lockstep, may_restart
from foosim.vhub.state.records import AbsencesRecord, Closing, InputsRecord
from foosim.vhub.wait_times import WaitTimes

LOST_MEANWHILE: Final = "its process was lost while the vHub was away"


class Clients:
    """The clients of one run: members, absent ones, and whose Done a tick waits for."""

    def __init__(
        self,
        sessions: Sessions,
        actions: list[Action],
        waits: WaitTimes,
        report: Callable[[], None],
        give_up: Callable[[str], None],
    ) -> None:
        """`report` sends a heartbeat at once, `give_up` ends the run for a reason."""
        self.waited: list[str] = []
        """Clients whose Done the tick that is being closed lacks."""
        self.repeated = 0
        """Messages that came twice or too late."""
        self.has_begun = False
        """Whether the run is in an epoch."""
        self._sessions = sessions
        self._actions = actions
        self._wait_times = waits
        self._report = report
        self._give_up = give_up
        self._state: HubState | None = None
        self._releases: Releases | None = None
        self.written: InputsRecord | None = None
        """The joins and leaves of the next tick, where they are journalled already."""
        self._leaves: list[str] = []
        self._owing: list[str] = []
        """Clients that leave at the tick that waits for their Dones."""
        self.absences = Absences()
        self._looked_ns = 0

    def begin(self, state: HubState, releases: Releases) -> None:
        """Take part in a run; before this every message of a client is dropped."""
        self._state, self._releases = state, releases

    def resume(self, written: InputsRecord | None, absences: AbsencesRecord, now_ns: int) -> None:
        """Wait for the clients of the vHub process before this one; `written` is its record of joins and leaves at
        the next tick, `absences` its record of absent players."""
        assert self._state is not None
        self.written = written
        members, came = self._state.members, set()
        here = {name for name, member in members.items() if member.active}
        if written is not None:
            came = {joining.name for joining in written.joins if _is_return(joining, members)}
            here = (here - set(written.leaves)) | {joining.name for joining in written.joins}
        self.absences.restore(absences, here, came, self._state.closed if written is None else written.tick)
        self._sessions.expect(here, self._start_ns, now_ns)  # their processes may have ended as well, and be restarted

    def _known(self, name: str) -> Member | Joining | None:
        """Return the newest record of a client: its pending join, else its member in the state."""
        written = [] if self.written is None else self.written.joins
        for joining in (self._sessions.joins.get(name), *written):
            if joining is not None and joining.name == name:
                return joining
        return None if self._state is None else self._state.members.get(name)

    def come_and_go(self, tick: int) -> tuple[list[Joining], list[str]]:
        """Return joining and leaving clients of a tick. Its Go depends on them and leaves before the tick's record is
        written, so it has a record of its own."""
        assert self._state is not None
        written, self.written = self.written, None
        if written is not None and written.tick == tick:
            return written.joins, written.leaves
        if not self._state.hears_clients:
            return [], []
        joins = self._sessions.take_joins(tick)
        members = self._state.members
        leaves = [name for name in dict.fromkeys(self._leaves) if name in members and members[name].active]
        self._leaves = []
        if joins or leaves:
            self._actions.append(Journal(encode(InputsRecord(tick, joins, leaves))))
            for name in leaves:
                self.absences.leave(name, tick)
            for joining in joins:
                if _is_return(joining, members):
                    self.absences.come_back(joining.name, tick)
            self.report()
        return joins, leaves

    def go(self, name: str, tick: int, flights: list[Flight], now_ns: int) -> None:
        """Send a lockstep client the Go of a tick, and begin to wait for its Done."""
        assert self._state is not None and self._releases is not None
        member = self._state.members[name]
        member.downlink += 1
        session = self._sessions.by_name.get(name)
        if session is None:
            return
        for flight in flights:
            flight.released_wall_ns = now_ns
        go = Go(member.downlink, tick, member.sequence, received(flights), member.since, [*member.absent])
        self._sessions.send_go(session, go)
        session.deadline = "lockstep_realtime" if self._releases.factor else "lockstep_fast"
        allowed_ns: int = getattr(self._state.deployment.deadlines, f"{session.deadline}_ns")
        session.wait(now_ns, allowed_ns, max(limits.WANT_AFTER_NS, 2 * self._state.deployment.tick_ns))

    # --- messages ----------------------------------------------------------------------------------------------------

    def on_hello(self, hello: ClientHello, build: Build) -> None:
        """Admit a client, or refuse it with the reason."""
        if self._state is None:
            return
        session, known = self._sessions.by_name.get(hello.name), self._state.members.get(hello.name)
        if session is not None and session.is_late(hello):
            self.repeated += 1
            return
        if session is not None and not session.boot and not hello.returns and known is not None and known.active:
            self._miss(hello.name, "", LOST_MEANWHILE)
        self._sessions.hello(hello, build, self._state.deployment, self._state, self._last_sent(hello.name))

    def on_join(self, join: Join, now_ns: int) -> bool:
        """Note a client's join, which takes effect at a tick that suits it; a member is sent what it has missed.

        Return whether a new client takes part.
        """
        session = self._joining(join)
        if session is None or self._state is None:
            return False
        if session.is_gone:  # sent before it disconnected
            self.repeated += 1
            return False
        if join.period and not may_lockstep(self._state.deployment, join.name):
            raise Malformed(f"{join.name} joins in lockstep, but is not declared lockstep")
        _check_timing(join)
        is_another = not (session.is_present or session.returns or join.period)
        self._sessions.catch_up(session, self.waits_for(join.name), now_ns)
        self.absences.end(join.name, join.boot, session.returns)
        self.report()
        known = self._known(join.name)
        if known is not None and join.name not in self._leaves and _is_member(known, join) and not is_another:
            self.repeated += 1
            return False
        self._sessions.join(join)
        return True

    def on_fetch(self, fetch: Fetch, payload: bytes, now_ns: int) -> None:
        """Send a client a piece of a file of the world, within what it may fetch. Raises Malformed for no such file."""
        session = self._sessions.by_name.get(fetch.name)
        if session is None or fetch.boot not in session.claims or self._state is None:
            self.repeated += 1
            return
        if session.may_fetch(now_ns):
            piece = piece_of(self._state.deployment, fetch, limits.RADIO_PIECE_BYTES)
            self._actions.append(Publish(channels.CLIENT_PIECE, fetch.name, encode(piece)))

    def on_up(self, up: Up, payload: bytes, now_ns: int) -> None:
        """Take packets of a free-running client."""
        session = self._session(up)
        if session is None or self._state is None:
            return
        if self._sessions.is_in_doubt(session, self._state.deployment):
            self.repeated += 1
            return
        if up.report > session.report:
            self._take_metrics(up)
            session.report = up.report
        if not self._sessions.admits(session, len(up.packets), len(payload)):
            self._state.reject_on_receipt("inbox_full", len(up.packets))
            return
        repeated = session.take(up.packets)
        if repeated:
            self._state.reject_on_receipt("duplicate", repeated)
            session.heard = 0  # acknowledge again: it lacks the acknowledgement

    def on_done(self, done: Done, payload: bytes, now_ns: int) -> None:
        """Take a lockstep client's answer to a Go."""
        session = self._session(done)
        if session is None:
            return
        is_current = self.waits_for(done.name) and done.tick == session.go_tick
        if not is_current or not session.is_present:
            self.repeated += 1
            return
        self._take_metrics(done)
        self.take_done(done.name)
        session.answered()
        if session.away_ns >= 0:  # it lives, and has to come back
            session.leave(session.back_ns, now_ns)
        session.done = done

    def _take_metrics(self, message: Up | Done) -> None:
        """Keep what a client reports for the next closing that hears clients. Raises Malformed.

        A player with more names than a run may have ends the run; another client's message is dropped.
        """
        metrics, waiting = message.metrics, self._sessions.reports
        if not metrics or self._state is None:
            return
        for name, value in metrics:
            if not is_name(name) or not isfinite(value):
                raise Malformed(f"{message.name} reports a metric {name!r} of {value}")
        known = {(who, one) for all in (self._state.metrics.reported, waiting) for who in all for one in all[who]}
        if len(known | {(message.name, name) for name, _ in metrics}) > limits.METRICS_OF_RUN_MAX:
            problem = f"{message.name} reports more metrics; a run has at most {limits.METRICS_OF_RUN_MAX}"
            if message.name in self._state.deployment.players:
                self._give_up(problem)
            raise Malformed(problem)
        waiting.setdefault(message.name, {}).update(metrics)

    def take_done(self, client: str) -> None:
        """End a tick's wait for this client."""
        self.waited.remove(client)
        self._wait_times.client = client

    def waits_for(self, client: str) -> bool:
        """Whether a tick waits for this client's Done."""
        return client in self.waited

    def on_failure(self, failure: Failure, payload: bytes, now_ns: int) -> None:
        """End the run for a player that reports its own failure: the run cannot continue without it."""
        session = self._sessions.by_name.get(failure.name)
        if session is None or self._state is None or not session.may_fail(failure.boot):
            self.repeated += 1
            return
        if failure.name not in self._state.deployment.players:
            raise Malformed(f"{failure.name} reports a failure; only players may")
        self._give_up(failure.reason)

    def _joining(self, join: Join) -> Session | None:
        """Return the session of a process that joins. A process that was welcomed while another one had its name gets
        it unless that one has joined, and is refused otherwise."""
        session = self._sessions.by_name.get(join.name)
        if self._sessions.is_for_another(join):
            self.repeated += 1
            return None
        if session is None or session.boot == join.boot or join.boot not in session.claims:
            return self._session(join)
        assert self._state is not None
        if not self._sessions.take_over(join, self._state.deployment, self._state, self._last_sent(join.name)):
            return None
        known = self._state.members.get(join.name)
        if not session.returns and known is not None and known.active:
            self._miss(join.name, "", LOST_MEANWHILE)
        return session

    def _session(self, message: Join | Up | Done) -> Session | None:
        session = self._sessions.by_name.get(message.name)
        if session is None or session.boot != message.boot:
            self.repeated += 1
            return None
        return session

    def _last_sent(self, name: str) -> int | None:
        """Return the last downlink sent to a client: neither a Go without a Done nor an unreleased one."""
        member = None if self._state is None else self._state.members.get(name)
        if member is None or self._releases is None:
            return None
        waiting = self._releases.first_number(name)
        return member.downlink - self.waits_for(name) if waiting is None else waiting - 1

    def on_tempo(self, tempo: Tempo, payload: bytes, now_ns: int) -> None:
        """Take the pace of simulated time. Deadlines of clients are suspended while it is paused."""
        releases, pace = self._releases, parse_pace(tempo.pace)
        if releases is None:
            return
        was_fast = not releases.factor
        releases.set_tempo(0.0 if pace.kind == "fast" else float(pace.factor), tempo.paused)
        if was_fast != (not releases.factor):
            self._turn_to_pace(now_ns)

    # --- absences ----------------------------------------------------------------------------------------------------

    def on_gone(self, name: str, now_ns: int) -> None:
        """A client has disconnected: a free-running one leaves the run, for a lockstep one the run waits."""
        session = self._sessions.by_name.get(name)
        if session is None or self._state is None:
            return
        session.is_gone = True
        if self._is_waited_for(name):
            session.why_gone = session.closed(now_ns)
            session.leave(self._back_ns(name), now_ns)
            self._miss(name, session.boot if session.is_present else "", session.why_gone)
            return
        self._leave(name)

    def _miss(self, name: str, boot: str, reason: str) -> None:
        """Record that a player's process is away from a run that has begun."""
        if self._state is not None and may_restart(self._state.deployment, name) and self.has_begun:
            self.absences.begin(name, boot, reason, self._tick)
            self.report()

    def report(self) -> None:
        """Report new absences and returns at once, after their record: a run may end soon."""
        if self.absences.is_new:
            self.absences.is_new = False
            self._actions.append(Journal(encode(self.absences.record())))
            self._report()

    def _back_ns(self, name: str) -> int:
        """Return for how long the run waits for a client that is away."""
        assert self._state is not None
        is_started_again = may_restart(self._state.deployment, name) and not self._may_continue_without(name)
        if is_started_again or not self.has_begun:
            return self._start_ns
        return self._state.deployment.deadlines.client_back_ns

    def _may_continue_without(self, name: str) -> bool:
        """Whether the run continues while a client is restarted: in realtime, once it has begun."""
        assert self._state is not None
        is_realtime = self._releases is not None and self._releases.factor > 0
        return may_restart(self._state.deployment, name) and is_realtime and self.has_begun

    def _turn_to_pace(self, now_ns: int) -> None:
        """The pace has turned to or from realtime: give players that are away the deadline of the new pace."""
        deployment = None if self._state is None else self._state.deployment
        for name, session in self._sessions.by_name.items():
            if session.away_ns >= 0 and deployment is not None and may_restart(deployment, name):
                session.leave(self._back_ns(name), now_ns)

    @property
    def _tick(self) -> int:
        """The tick that is closed next."""
        return 0 if self._state is None else self._state.closed + 1

    def rest(self, stood_ns: int, now_ns: int) -> None:
        """The vHub's own loop was blocked for `stood_ns`: that counts against no client.

        Where connections may have closed by it, clients have their whole time from now on (`standstill`).
        """
        self._sessions.rest(limits.COUNTER_MAX if stood_ns >= REPORTED_NS else stood_ns, now_ns)
        self._looked_ns = now_ns

    def wake(self, now_ns: int, *, holds: bool) -> None:
        """Repeat Go, and end the run or continue without clients whose answer or return is overdue.

        Both deadlines are suspended while the run is paused. They begin anew while the vHub `holds`, waiting for its
        supervisor: the cause that closed that connection may have closed connections of clients as well.
        """
        if self._state is None:
            return
        self._sessions.repeat(self.waited, now_ns)
        passed_ns, self._looked_ns = now_ns - self._looked_ns, now_ns
        if holds:
            self._sessions.rest(limits.COUNTER_MAX, now_ns)
        elif self._releases is not None and self._releases.paused:
            self._sessions.rest(passed_ns, now_ns)
        for late in self._sessions.overdue(now_ns):
            self._give_up(late.unanswered)
        for name in self._sessions.late(now_ns):
            session = self._sessions.by_name[name]
            if not self._is_waited_for(name):
                self._leave(name)
                continue
            session.away_ns = -1  # its session stays: a tick may be waiting for it, and another process may come
            if self._may_continue_without(name):
                self._continue_without(name)
            else:
                self._give_up(lost(name, self._why_lost(session)))

    def _why_lost(self, session: Session) -> str:
        """Return why the run does not wait any longer for a client that is away."""
        assert self._state is not None
        deployment = self._state.deployment
        if may_restart(deployment, session.name):
            return f"it was not started again within {deployment.deadlines.start_ns / 1e9:g} s (deadlines.start)"
        return session.why_gone if session.boot else "it did not come back to the vHub"

    def _continue_without(self, name: str) -> None:
        """Have a player leave until its process is restarted: at the tick whose Done it owes, or at the next one."""
        self._sessions.joins.pop(name, None)
        self._sessions.by_name[name].answered()
        if self.waits_for(name):
            self.waited.remove(name)
            self._owing.append(name)
        else:
            self._leaves.append(name)

    def leave_owing(self, state: HubState, closing: Closing) -> None:
        """Have the clients leave without whose Dones the tick is closed; its record is the first to name them."""
        closing.owing += sorted(self._owing)
        for name in closing.owing:
            state.leave(name)
            self.absences.leave(name, closing.frame.tick)
        self._owing = []

    def send_owed(self, closing: Closing, now_ns: int) -> None:
        """After the record of a tick, send the packets of its Go to the clients that left without a Done."""
        for name in closing.owing:
            self._sessions.send_owed(name, now_ns)

    def _is_waited_for(self, name: str) -> bool:
        """Whether the run waits for a client: it is in lockstep, or the present tick closes by its Done."""
        known = self._known(name)
        is_here = isinstance(known, Joining) or (known is not None and known.active and name not in self._leaves)
        is_in_lockstep = known is not None and is_here and known.period > 0
        return self.waits_for(name) or name in self._owing or is_in_lockstep

    @property
    def _start_ns(self) -> int:
        """How long a client has to come whose process is being started."""
        assert self._state is not None
        deadlines = self._state.deployment.deadlines
        return max(deadlines.client_back_ns, deadlines.start_ns)

    def _leave(self, name: str) -> None:
        self._sessions.leave(name)
        if self._known(name) is not None:
            self._leaves.append(name)


def lost(name: str, why: str) -> str:
    """Return the reason with which a run ends that has lost what it cannot do without."""
    return f"lost {name}: {why}"


def _is_return(joining: Joining, members: Mapping[str, Member]) -> bool:
    """Whether a lockstep client that joins took part before, and had left."""
    return joining.period > 0 and joining.name in members and not members[joining.name].active


def _is_member(known: Member | Joining, join: Join) -> bool:
    """Whether a client is a member as its Join requests."""
    wanted = [{(item.source, item.channel) for item in items} for items in (join.subscriptions, join.arrivals)]
    active = isinstance(known, Joining) or known.active
    is_timed_so = (known.period, known.offset) == (join.period, join.offset)
    heard = [{(source, name) for source, name in pairs} for pairs in (known.subscriptions, known.arrivals)]
    return active and is_timed_so and heard == wanted


def _check_timing(join: Join) -> None:
    """Raises Malformed for an offset or arrivals that its period or its subscriptions do not allow."""
    if join.offset >= (1 if join.arrivals else max(1, join.period)):
        acts = ", and acts at arrival" if join.arrivals else ""
        raise Malformed(f"{join.name} joins with an offset of {join.offset} ticks, its period is {join.period}{acts}")
    if join.arrivals and not join.period:
        raise Malformed(f"{join.name} acts at arrival and joins free-running: acting at arrival needs lockstep")
    for item in join.arrivals:
        if item not in join.subscriptions:
            raise Malformed(f"{join.name} acts at the arrival of {item.source} {item.channel}, which it does not hear")
