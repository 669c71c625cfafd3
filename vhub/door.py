"""What clients say to the vHub: hello, join, packets, Done; and that they are gone.

A client that is gone may come back: one that the run waits for within `deadlines.client_back`, any other at any time as
one that joins. Before the first tick, and after a restart of the vHub, when all that it knew are away, they have
`deadlines.start`: their processes may have to be started.
Neighbours: `core` closes the ticks, `sessions` has the clients.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from foosim.protocol import limits
from foosim.protocol.actions import Journal, Say
from foosim.protocol.codec import encode
from foosim.protocol.errors import Malformed
from foosim.protocol.messages import ClientHello, Done, Failure, Go, Join, Tempo, Up
from foosim.protocol.standstill import TOLD_NS, told
from foosim.protocol.units import parse_pace
from foosim.vhub.absences import Absences
from foosim.vhub.members import Member, may_lockstep, may_restart
from foosim.vhub.memory import Joining
from foosim.vhub.packet import Flight, received
from foosim.vhub.records import AbsencesRecord, Closing, InputsRecord
from foosim.vhub.sessions import Session
from foosim.vhub.state import HubState

if TYPE_CHECKING:
    from foosim.vhub.core import HubCore


LOST_MEANWHILE: Final = "its process was lost while the vHub was away"


class Door:
    """Takes what clients say, for one core."""

    def __init__(self, core: HubCore) -> None:
        self._core = core
        self.written: InputsRecord | None = None
        """Who joins and leaves at the tick that is closed next, where that is written already."""
        self._leaves: list[str] = []
        self._owing: list[str] = []
        """Who leaves at the tick that waits for their Dones."""
        self.absences = Absences()
        self._looked_ns = 0

    def go_on(self, written: InputsRecord | None, absences: AbsencesRecord, now_ns: int) -> None:
        """Expect those back who were there with the vHub before; `written` is what it wrote for the next tick, and
        `absences` which players it knew to be away."""
        core = self._core
        assert core.state is not None and core.deployment is not None
        self.written = written
        members, came = core.state.members, set()
        here = {name for name, member in members.items() if member.active}
        if written is not None:
            came = {joining.name for joining in written.joins if _is_return(joining, members)}
            here = (here - set(written.leaves)) | {joining.name for joining in written.joins}
        self.absences.go_on(absences, here, came, core.state.closed if written is None else written.tick)
        core.sessions.expect(here, self._start_ns, now_ns)  # theirs may have ended as well, and be started again

    def _known(self, name: str) -> Member | Joining | None:
        """Return what is known of a client, the latest first: as it joins, or as the state has it."""
        core = self._core
        written = [] if self.written is None else self.written.joins
        for joining in (core.sessions.joins.get(name), *written):
            if joining is not None and joining.name == name:
                return joining
        return None if core.state is None else core.state.members.get(name)

    def come_and_go(self, tick: int) -> tuple[list[Joining], list[str]]:
        """Take who joins and leaves at a tick. Its Go depends on it, and is said before the record is written."""
        core = self._core
        assert core.state is not None
        written, self.written = self.written, None
        if written is not None and written.tick == tick:
            return written.joins, written.leaves
        if not core.state.hears_clients:
            return [], []
        joins = core.sessions.take_joins(tick)
        members = core.state.members
        leaves = [name for name in dict.fromkeys(self._leaves) if name in members and members[name].active]
        self._leaves = []
        if joins or leaves:
            core.actions.append(Journal(encode(InputsRecord(tick, joins, leaves))))
            for name in leaves:
                self.absences.leave(name, tick)
            for joining in joins:
                if _is_return(joining, members):
                    self.absences.come_back(joining.name, tick)
            self.tell()
        return joins, leaves

    def go(self, name: str, tick: int, flights: list[Flight], now_ns: int) -> None:
        """Give a lockstep client its tick, and begin to wait for its Done."""
        core = self._core
        assert core.state is not None and core.deployment is not None and core.releases is not None
        member = core.state.members[name]
        member.downlink += 1
        session = core.sessions.by_name.get(name)
        if session is None:
            return
        for flight in flights:
            flight.released_wall_ns = now_ns
        core.sessions.say_go(session, Go(member.downlink, tick, member.sequence, received(flights), core.state.branch))
        session.deadline = "lockstep_realtime" if core.releases.factor else "lockstep_fast"
        allowed_ns: int = getattr(core.deployment.deadlines, f"{session.deadline}_ns")
        session.wait(now_ns, allowed_ns, max(limits.WANT_AFTER_NS, 2 * core.deployment.tick_ns))

    # --- messages ----------------------------------------------------------------------------------------------------

    def hello(self, hello: ClientHello, payload: bytes, now_ns: int) -> None:
        """Let a client in, or say why not; before it is known where the run goes on nobody is told how far it is."""
        core = self._core
        if core.footing.waits:
            return
        if core.state is not None and core.deployment is not None and core.member.build is not None:
            session, known = core.sessions.by_name.get(hello.name), core.state.members.get(hello.name)
            if session is not None and session.is_late(hello):
                core.repeated += 1
                return
            if session is not None and not session.boot and not hello.returns and known is not None and known.active:
                session.is_missed = not self.absences.is_away(hello.name)
                self._miss(hello.name, "", LOST_MEANWHILE)
            core.sessions.hello(hello, core.member.build, core.deployment, core.state, self._said(hello.name))

    def join(self, join: Join, payload: bytes, now_ns: int) -> None:
        """A client takes part, from a tick that suits it; one that does already is told what it has missed."""
        core = self._core
        session = self._joining(join)
        if session is None or core.state is None:
            return
        if session.is_gone:  # said before it went
            core.repeated += 1
            return
        if join.period and not may_lockstep(core.state.deployment, join.name):
            raise Malformed(f"{join.name} joins in lockstep, it is not declared so: the run would wait for it")
        _check_timing(join)
        core.sessions.catch_up(session, core.waits_for(join.name), now_ns)
        self.absences.end(join.name, join.boot)
        session.is_missed = False
        self.tell()
        known = self._known(join.name)
        if known is not None and join.name not in self._leaves and _is_member(known, join):
            core.repeated += 1
            return
        core.sessions.join(join)
        core.ready_if_complete()

    def up(self, up: Up, payload: bytes, now_ns: int) -> None:
        """Packets of a free-running client."""
        core = self._core
        session = self._session(up)
        if session is None or core.state is None:
            return
        if up.branch != core.state.branch or core.sessions.is_in_doubt(session, core.state.deployment):
            core.repeated += 1
            return
        if not core.sessions.admits(session, len(up.packets), len(payload)):
            core.state.refuse_at_door("inbox_full", len(up.packets))
            return
        repeated = session.take(up.packets)
        if repeated:
            core.state.refuse_at_door("duplicate", repeated)
            session.heard = 0  # it does not know what is recorded

    def done(self, done: Done, payload: bytes, now_ns: int) -> None:
        """The answer to a Go."""
        core = self._core
        session = self._session(done)
        if session is None:
            return
        is_of_another = core.state is None or done.branch != core.state.branch
        is_asked = core.waits_for(done.name) and done.tick == session.go_tick
        if is_of_another or not is_asked or not session.is_present:
            core.repeated += 1
            return
        self.take_done(done.name)
        session.answered()
        if session.away_ns >= 0:  # it lives, and has to come back
            session.leave(session.back_ns, now_ns)
        session.done = done

    def take_done(self, client: str) -> None:
        """A tick waits for this client no more."""
        self._core.waited.remove(client)
        self._core.waits.client = client

    def failure(self, failure: Failure, payload: bytes, now_ns: int) -> None:
        """A client says that it has failed. Without a player the run cannot go on."""
        core = self._core
        session = core.sessions.by_name.get(failure.name)
        if session is None or core.deployment is None or not session.may_fail(failure.boot):
            core.repeated += 1
            return
        if failure.name not in core.deployment.players:
            raise Malformed(f"{failure.name} says that it has failed, it is no player")
        core.give_up(failure.reason)

    def _joining(self, join: Join) -> Session | None:
        """Return the session of a process that joins. One that was welcomed while another one had its name gets it
        where that has not joined, and is refused where it has."""
        core = self._core
        session = core.sessions.by_name.get(join.name)
        if core.sessions.is_for_another(join):
            core.repeated += 1
            return None
        if session is None or session.boot == join.boot or join.boot not in session.claims:
            return self._session(join)
        assert core.state is not None
        if not core.sessions.take_over(join, core.state.deployment, core.state, self._said(join.name)):
            return None
        known = core.state.members.get(join.name)
        if session.returns and session.is_missed and self.absences.is_away(join.name):
            self.absences.deny(join.name)
        elif not session.returns and known is not None and known.active:
            self._miss(join.name, "", LOST_MEANWHILE)
        return session

    def _session(self, message: Join | Up | Done) -> Session | None:
        session = self._core.sessions.by_name.get(message.name)
        if session is None or session.boot != message.boot:
            self._core.repeated += 1
            return None
        return session

    def _said(self, name: str) -> int | None:
        """Return the last downlink that was said to a client: not the Go that it has not answered, nor what waits."""
        core = self._core
        member = None if core.state is None else core.state.members.get(name)
        if member is None or core.releases is None:
            return None
        waiting = core.releases.first_number(name)
        return member.downlink - core.waits_for(name) if waiting is None else waiting - 1

    def tempo(self, tempo: Tempo, payload: bytes, now_ns: int) -> None:
        """Learn how fast simulated time runs. Deadlines of clients rest while it is paused."""
        releases, pace = self._core.releases, parse_pace(tempo.pace)
        if releases is None:
            return
        was_fast = not releases.factor
        releases.set_tempo(0.0 if pace.kind == "fast" else float(pace.factor), tempo.paused)
        if was_fast != (not releases.factor):
            self._turn_to_pace(now_ns)

    # --- who is away -------------------------------------------------------------------------------------------------

    def gone(self, name: str, now_ns: int) -> None:
        """A client's presence has ended: a free-running one leaves the run, for one in lockstep it waits a while."""
        core = self._core
        session = core.sessions.by_name.get(name)
        if session is None or core.state is None or core.deployment is None or core.ended is not None:
            return
        session.is_gone = True
        if self._is_waited_for(name):
            session.why_gone = session.closed(now_ns)
            session.leave(self._back_ns(name), now_ns)
            self._miss(name, session.boot, session.why_gone)
            return
        self._leave(name)

    def _miss(self, name: str, boot: str, reason: str) -> None:
        """Note that a player's process is away from a run that has begun."""
        core = self._core
        if core.deployment is not None and may_restart(core.deployment, name) and core.epoch > 0:
            self.absences.begin(name, boot, reason, self._tick)
            self.tell()

    def tell(self) -> None:
        """Tell the supervisor at once of whoever has gone or come, when that is written: a run may end soon."""
        if self.absences.is_new:
            self.absences.is_new = False
            self._core.actions.append(Journal(encode(self.absences.record())))
            self._core.say_heartbeat()

    def _back_ns(self, name: str) -> int:
        """Return for how long the run waits for a client that is away."""
        core = self._core
        assert core.deployment is not None
        is_started_again = may_restart(core.deployment, name) and not self._may_go_on_without(name)
        return self._start_ns if is_started_again or not core.epoch else core.deployment.deadlines.client_back_ns

    def _may_go_on_without(self, name: str) -> bool:
        """Whether the run goes on while a client is started again: in realtime, once it has begun."""
        core = self._core
        assert core.deployment is not None
        is_realtime = core.releases is not None and core.releases.factor > 0
        return may_restart(core.deployment, name) and is_realtime and core.epoch > 0

    def _turn_to_pace(self, now_ns: int) -> None:
        """The run goes by the wall clock now, or does not any more: players that are away have the time of then."""
        deployment = self._core.deployment
        for name, session in self._core.sessions.by_name.items():
            if session.away_ns >= 0 and deployment is not None and may_restart(deployment, name):
                session.leave(self._back_ns(name), now_ns)

    @property
    def _tick(self) -> int:
        """The tick that is closed next."""
        return 0 if self._core.state is None else self._core.state.closed + 1

    @property
    def holds(self) -> bool:
        """Whether the vHub waits for its supervisor: nothing can go on, and nobody is let in."""
        return self._core.orphan.is_alone or self._core.footing.waits

    def rest(self, stood_ns: int, now_ns: int) -> None:
        """The vHub's own loop stood still for so long: that counts against no client, and not against the supervisor.

        Where connections may have closed by it, clients have their whole time from now on (`standstill`).
        """
        core = self._core
        core.orphan.rest(stood_ns, now_ns)
        if stood_ns >= TOLD_NS:
            core.actions.append(Say("warning", told(stood_ns)))
        core.sessions.rest(limits.COUNTER_MAX if stood_ns >= TOLD_NS else stood_ns, now_ns)
        self._looked_ns = now_ns

    def wake(self, now_ns: int) -> None:
        """Say Go again, lose who has not answered in time, and give up who was away for too long.

        Both clocks rest while the run is paused; they begin anew when the vHub has waited for its supervisor, since
        what closed that connection may have closed those of clients as well.
        """
        core = self._core
        if core.state is None:
            return
        core.sessions.repeat(core.waited, now_ns)
        passed_ns, self._looked_ns = now_ns - self._looked_ns, now_ns
        if self.holds:
            core.sessions.rest(limits.COUNTER_MAX, now_ns)
        elif core.releases is not None and core.releases.paused:
            core.sessions.rest(passed_ns, now_ns)
        for late in core.sessions.overdue(now_ns):
            core.give_up(late.unanswered)
        for name in core.sessions.late(now_ns):
            session = core.sessions.by_name[name]
            if not self._is_waited_for(name):
                self._leave(name)
                continue
            session.away_ns = -1  # its session stays: a tick may be waiting for it, and another process may come
            if self._may_go_on_without(name):
                self._go_on_without(name)
            else:
                core.lose(name, self._why_lost(session))

    def _why_lost(self, session: Session) -> str:
        """Return why the run does not wait any longer for a client that is away."""
        deployment = self._core.deployment
        assert deployment is not None
        if may_restart(deployment, session.name):
            return f"it was not started again within {deployment.deadlines.start_ns / 1e9:g} s (deadlines.start)"
        return session.why_gone if session.boot else "it did not come back to the vHub"

    def _go_on_without(self, name: str) -> None:
        """A player leaves until it is started again: at the tick whose Done it owes, or at the next one."""
        core = self._core
        core.sessions.joins.pop(name, None)
        core.sessions.by_name[name].answered()
        if core.waits_for(name):
            core.waited.remove(name)
            self._owing.append(name)
        else:
            self._leaves.append(name)

    def leave_owing(self, state: HubState, closing: Closing) -> None:
        """Let those go without whose Dones the tick is closed; its record says so, before anything else does."""
        closing.owing += sorted(self._owing)
        for name in closing.owing:
            state.leave(name)
            self.absences.leave(name, closing.frame.tick)
        self._owing = []

    def say_owed(self, closing: Closing, now_ns: int) -> None:
        """Behind the record of a tick, say what its Go had to the processes that come for those who left owing."""
        for name in closing.owing:
            self._core.sessions.say_owed(name, now_ns)

    def _is_waited_for(self, name: str) -> bool:
        """Whether the run waits for a client: it is in lockstep, or the tick that is being closed goes by its Done."""
        known = self._known(name)
        is_here = isinstance(known, Joining) or (known is not None and known.active and name not in self._leaves)
        is_in_lockstep = known is not None and is_here and known.period > 0
        return self._core.waits_for(name) or name in self._owing or is_in_lockstep

    @property
    def _start_ns(self) -> int:
        """How long a client has to come whose process is being started."""
        assert self._core.deployment is not None
        deadlines = self._core.deployment.deadlines
        return max(deadlines.client_back_ns, deadlines.start_ns)

    def _leave(self, name: str) -> None:
        core = self._core
        core.sessions.leave(name)
        if self._known(name) is not None:
            self._leaves.append(name)


def _is_return(joining: Joining, members: Mapping[str, Member]) -> bool:
    """Whether a lockstep client that joins took part before, and had left."""
    return joining.period > 0 and joining.name in members and not members[joining.name].active


def _is_member(known: Member | Joining, join: Join) -> bool:
    """Whether a client takes part as it asks to."""
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
        raise Malformed(f"{join.name} acts at arrival and joins free-running: only who is in lockstep can")
    for item in join.arrivals:
        if item not in join.subscriptions:
            raise Malformed(f"{join.name} acts at the arrival of {item.source} {item.channel}, which it does not hear")
