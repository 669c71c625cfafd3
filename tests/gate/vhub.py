"""Bugs of the vHub and of its clients: closing of ticks, account, deliveries, clients, fold."""

from __future__ import annotations

from typing import Any, Final

from msgspec.structs import replace

from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.codec import encode
from foosim.protocol.messages import Deliveries
from foosim.vhub import core
from foosim.vhub.clients import Clients
from foosim.vhub.core import HubCore
from foosim.vhub.sessions import Sessions
from foosim.vhub.state import hub_state, records
from foosim.vhub.state.commits import Commits
from foosim.vhub.state.hub_state import HubState
from tests.gate.planting import Mutant, Planting, Register

register = Register()


@register("vHub speaks before it writes", "the vHub writes one record per tick before it publishes", 1)
def _hasty(planting: Planting) -> None:
    def close_clients(self: Any, now_ns: int) -> bool:
        first = len(self.actions)
        closed = bool(before(self, now_ns))
        self.actions[first:] = reversed(self.actions[first:])
        return closed

    before: Any = planting.swap(HubCore, "_close_clients", close_clients)


@register("vHub does not ask again", "who has had no progress asks again (vHub)", 2)
def _patient(planting: Planting) -> None:
    planting.swap(HubCore, "_request_again", lambda self, now_ns: self._retry.requested(now_ns))


@register("vHub does not answer who asks", "supervisor and vHub keep the last 16 ticks", 2)
def _mute(planting: Planting) -> None:
    planting.swap(HubCore, "_on_want", lambda self, want, payload, now_ns: None)


@register("deliveries are said otherwise again", "deliveries are final when published", 1)
def _not_final(planting: Planting) -> None:
    def on_want(self: Any, want: Any, payload: bytes, now_ns: int) -> None:
        packets = self.state.deliveries.get(want.tick)
        if want.kind == channels.DELIVERIES.name and packets is not None:
            again = encode(Deliveries(want.tick, packets))
            self.actions.append(Publish(channels.DELIVERIES, channels.VHUB, again))
        else:
            before(self, want, payload, now_ns)

    before: Any = planting.swap(HubCore, "_on_want", on_want)


@register("samples of some robots", "closing waits for the samples of every robot", 1)
def _some_robots(planting: Planting) -> None:
    def world_packets(samples: Any, digest: bytes, frame: Any, sampling: Any) -> Any:
        told = list(samples)
        packets = before(told, digest, frame, sampling)
        return [packet for one in told for packet in one.packets] if packets is None and told else packets

    before: Any = planting.swap(core, "world_packets", world_packets)


@register("account leaks", "offered = delivered + dropped + in flight", 1)
def _leak(planting: Planting) -> None:
    def arrive(self: Any, tick: int, fates: Any) -> Any:
        released = before(self, tick, fates)
        self.packets.delivered -= len(released) > 1
        return released

    before: Any = planting.swap(HubState, "_arrive_at_clients", arrive)


@register("packets stay in flight", "each packet has one fate", 1)
def _stay(planting: Planting) -> None:
    def take_arrivals(self: Any, tick: int, to_robots: bool) -> Any:
        taken = before(self, tick, to_robots)
        if to_robots and len(taken) > 2:
            self._flights.setdefault(tick + 1, []).append(taken[0])
        return taken

    before: Any = planting.swap(HubState, "_take_arrivals", take_arrivals)


@register("deliveries out of order", "deliveries are in (due, source, sequence, copy) order", 1)
def _disorder(planting: Planting) -> None:
    planting.swap(hub_state, "order_of", lambda flight: (flight.destination, -flight.due_ns, flight.sequence))


@register("deliveries come early", "what is sent at k arrives at ceil(due / T)", 1)
def _early(planting: Planting) -> None:
    def let_fly(self: Any, flight: Any, earliest: int) -> None:
        before(self, flight, earliest)
        if flight.arrival_tick == earliest + 1 and flight.destination in self._robots:
            self._flights[earliest + 1].remove(flight)
            self._flights.setdefault(earliest, []).append(flight)

    before: Any = planting.swap(HubState, "_let_fly", let_fly)


@register("robots' numbers repeat", "a robot's sequence number is tick x 2^16 + index", 1)
def _numbers(planting: Planting) -> None:
    planting.swap(hub_state, "OUTBOX_SHIFT", 0)


@register("final too far ahead", "deliveries of ticks ahead are final only where nothing can reach robots", 1)
def _too_final(planting: Planting) -> None:
    before: Any = planting.swap(HubState, "_following", lambda self, tick: before(self, tick) + 1)


@register("Go is said once", "Go is repeated until it is answered", 2)
def _go_once(planting: Planting) -> None:
    def repeat(self: Any, waited: Any, now_ns: int) -> None:
        for name in waited:
            session = self.by_name[name]
            session.again_ns = max(session.again_ns, now_ns + session.again_after_ns)

    planting.swap(Sessions, "repeat", repeat)


@register("any Done will do", "Done(k) answers Go(k)", 24)
def _any_done(planting: Planting) -> None:
    def done(self: Any, done: Any, payload: bytes, now_ns: int) -> None:
        session = self._session(done)
        if session is not None and self.waits_for(done.name):
            self.take_done(done.name)
            session.done = done

    planting.swap(Clients, "on_done", done)


@register("downlinks are not numbered", "each downlink has the next number", 1)
def _same_number(planting: Planting) -> None:
    def send_go(self: Any, session: Any, go: Any) -> None:
        before(self, session, replace(go, number=go.number - go.number % 2))

    before: Any = planting.swap(Sessions, "send_go", send_go)


@register("fold forgets downlinks", "a fold of the journal gives the state again", 1)
def _fold(planting: Planting) -> None:
    planting.swap(records, "count_downlinks", lambda state, tick, released: None)


@register("what clients sent is not written", "the record holds the admitted bytes", 1)
def _unwritten(planting: Planting) -> None:
    before: Any = planting.swap(
        core,
        "tick_record",
        lambda closing, commit, samples, admitted, state, deliveries: before(
            closing, commit, samples, {}, state, deliveries
        ),
    )


@register("a packet that arrived is not told", "what a client is told is what counts as delivered", 1)
def _untold(planting: Planting) -> None:
    def arrive(self: Any, tick: int, fates: Any) -> Any:
        released = before(self, tick, fates)
        for flights in released.values():
            del flights[2:]
        return released

    before: Any = planting.swap(HubState, "_arrive_at_clients", arrive)


@register("a delivery is left out", "deliveries are what counts as delivered", 1)
def _left_out(planting: Planting) -> None:
    before: Any = planting.swap(HubState, "_arrive_at_robots", lambda self, tick, fates: before(self, tick, fates)[:3])


@register("Dones lose packets", "nothing that a client answered is lost", 1)
def _cut_dones(planting: Planting) -> None:
    def done(self: Any, done: Any, payload: bytes, now_ns: int) -> None:
        before(self, replace(done, packets=[]) if self.repeated else done, payload, now_ns)

    before: Any = planting.swap(Clients, "on_done", done)


@register("who leaves is not written", "leaving is an input of the tick whose Done is owed", 71)
def _unwritten_leave(planting: Planting) -> None:
    def leave_owing(self: Any, state: Any, closing: Any) -> None:
        before(self, state, closing)
        closing.owing = []

    before: Any = planting.swap(Clients, "leave_owing", leave_owing)


@register("commits are kept for ever", "what a process keeps is bounded (vHub)", 1)
def _kept_commits(planting: Planting) -> None:
    planting.swap(Commits, "forget", lambda self, tick: None)


MUTANTS: Final[tuple[Mutant, ...]] = tuple(register.mutants)
