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
from tests.gate.planting import Bug, Mutant, Planting, Register, nothing

register = Register()


@register("vHub speaks before it writes", "one record per tick comes before its messages", 1, HubCore, "_close_clients")
def _hasty(before: Bug, self: Any, now_ns: int) -> bool:
    first = len(self.actions)
    closed = bool(before(self, now_ns))
    self.actions[first:] = reversed(self.actions[first:])
    return closed


@register("vHub does not ask again", "who has had no progress asks again (vHub)", 2, HubCore, "_request_again")
def _patient(before: Bug, self: Any, now_ns: int) -> None:
    self._retry.requested(now_ns)


register("vHub does not answer who asks", "supervisor and vHub keep the last 16 ticks", 2, HubCore, "_on_want")(nothing)


@register("deliveries are said otherwise again", "deliveries are final when published", 1, HubCore, "_on_want")
def _not_final(before: Bug, self: Any, want: Any, payload: bytes, now_ns: int) -> None:
    packets = self.state.deliveries.get(want.tick)
    if want.kind == channels.DELIVERIES.name and packets is not None:
        again = encode(Deliveries(want.tick, packets))
        self.actions.append(Publish(channels.DELIVERIES, channels.VHUB, again))
    else:
        before(self, want, payload, now_ns)


@register("samples of some robots", "closing waits for the samples of every robot", 1, core, "world_packets")
def _some_robots(before: Bug, samples: Any, digest: bytes, frame: Any, sampling: Any) -> Any:
    told = list(samples)
    packets = before(told, digest, frame, sampling)
    return [packet for one in told for packet in one.packets] if packets is None and told else packets


@register("account leaks", "offered = delivered + dropped + in flight", 1, HubState, "_arrive_at_clients")
def _leak(before: Bug, self: Any, tick: int, fates: Any) -> Any:
    released = before(self, tick, fates)
    self.packets.delivered -= len(released) > 1
    return released


@register("packets stay in flight", "each packet has one fate", 1, HubState, "_take_arrivals")
def _stay(before: Bug, self: Any, tick: int, to_robots: bool) -> Any:
    taken = before(self, tick, to_robots)
    if to_robots and len(taken) > 2:
        self._flights.setdefault(tick + 1, []).append(taken[0])
    return taken


@register("deliveries out of order", "their order is (due, source, sequence, copy)", 1, hub_state, "order_of")
def _disorder(before: Bug, flight: Any) -> Any:
    return flight.destination, -flight.due_ns, flight.sequence


@register("deliveries come early", "what is sent at k arrives at ceil(due / T)", 1, HubState, "_let_fly")
def _early(before: Bug, self: Any, flight: Any, earliest: int) -> None:
    before(self, flight, earliest)
    if flight.arrival_tick == earliest + 1 and flight.destination in self._robots:
        self._flights[earliest + 1].remove(flight)
        self._flights.setdefault(earliest, []).append(flight)


@register("robots' numbers repeat", "a robot's sequence number is tick x 2^16 + index", 1)
def _numbers(planting: Planting) -> None:
    planting.swap(hub_state, "OUTBOX_SHIFT", 0)


@register("final too far ahead", "ticks ahead are final where nothing can reach robots", 1, HubState, "_following")
def _too_final(before: Bug, self: Any, tick: int) -> int:
    return int(before(self, tick)) + 1


@register("Go is said once", "Go is repeated until it is answered", 2, Sessions, "repeat")
def _go_once(before: Bug, self: Any, waited: Any, now_ns: int) -> None:
    for name in waited:
        session = self.by_name[name]
        session.again_ns = max(session.again_ns, now_ns + session.again_after_ns)


@register("any Done will do", "Done(k) answers Go(k)", 24, Clients, "on_done")
def _any_done(before: Bug, self: Any, done: Any, payload: bytes, now_ns: int) -> None:
    session = self._session(done)
    if session is not None and self.waits_for(done.name):
        self.take_done(done.name)
        session.done = done


@register("downlinks are not numbered", "each downlink has the next number", 1, Sessions, "send_go")
def _same_number(before: Bug, self: Any, session: Any, go: Any) -> None:
    before(self, session, replace(go, number=go.number - go.number % 2))


register("fold forgets downlinks", "a fold gives the state again", 1, records, "count_downlinks")(nothing)


@register("what clients sent is not written", "the record holds the admitted bytes", 1, core, "tick_record")
def _unwritten(before: Bug, closing: Any, commit: Any, samples: Any, admitted: Any, *more: Any) -> Any:
    return before(closing, commit, samples, {}, *more)


@register("a packet that arrived is not told", "a client is told what is delivered", 1, HubState, "_arrive_at_clients")
def _untold(before: Bug, self: Any, tick: int, fates: Any) -> Any:
    released = before(self, tick, fates)
    for flights in released.values():
        del flights[2:]
    return released


@register("a delivery is left out", "deliveries are what counts as delivered", 1, HubState, "_arrive_at_robots")
def _left_out(before: Bug, self: Any, tick: int, fates: Any) -> Any:
    return before(self, tick, fates)[:3]


@register("Dones lose packets", "nothing that a client answered is lost", 1, Clients, "on_done")
def _cut_dones(before: Bug, self: Any, done: Any, payload: bytes, now_ns: int) -> None:
    before(self, replace(done, packets=[]) if self.repeated else done, payload, now_ns)


@register("who leaves is not written", "leaving is an input of the tick whose Done is owed", 71, Clients, "leave_owing")
def _unwritten_leave(before: Bug, self: Any, state: Any, closing: Any) -> None:
    before(self, state, closing)
    closing.owing = []


register("commits are kept for ever", "what a process keeps is bounded (vHub)", 1, Commits, "forget")(nothing)

MUTANTS: Final[tuple[Mutant, ...]] = tuple(register.mutants)
