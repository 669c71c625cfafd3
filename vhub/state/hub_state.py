"""The vHub's state as a value, and the closing of a tick as a function of it.

Closing tick k has two phases. *World*: the packets that robots sent at k are judged; the clients that are due receive
what has arrived. *Clients*: the packets that clients sent are judged; the deliveries of tick k+1 are final. Fates
depend on frames, times and draws, never on nodes. The journal holds the inputs of every closing, so a fold of it
through this class gives the state again, byte for byte.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from operator import attrgetter

import msgspec

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.deployment.channel_kinds import PLAIN, carried_by
from foosim.deployment.schema import Deployment
from foosim.protocol.codec import decode_any
from foosim.protocol.messages import Deliveries, Sent
from foosim.vhub.links.fabric import Fabric, Link
from foosim.vhub.network.ages import Ages
from foosim.vhub.network.draw_address import counts_within_channels, robot_number
from foosim.vhub.network.memory import Age, Joining, Snapshot
from foosim.vhub.network.packet import ChannelCounts, Flight, Packets, content_of, flight_of, order_of, state_of
from foosim.vhub.stages.receiver import RECEIVER_DOWN, RECEIVER_FULL, TRANSIT_FULL
from foosim.vhub.state.byte_limits import InFlightLimit, ReceiveBudget
from foosim.vhub.state.existence import Existence
from foosim.vhub.state.members import Here, Member
from foosim.vhub.state.metrics import Metric, Metrics, Reports
from foosim.world.edits import Disrupt, Edit
from foosim.world.frame import Frame
from foosim.world.robot_packets import Delivered, RobotPacket
from foosim.world.sampling import Sampling, are_answered

OUTBOX_SHIFT = 16
"""A robot's sequence number is tick x 2^16 + index."""
Counted = tuple[RobotPacket, int]
"""A robot's packet with its count within its channel."""


class HubState:
    """Links, members, packets in flight: plain values, without a clock but the tick."""

    def __init__(self, deployment: Deployment, first_tick: int = 0) -> None:
        """`first_tick` is that of the frame that the run begins with."""
        self.deployment = deployment
        self.tick_ns = deployment.tick_ns
        self.closed = first_tick - 1
        """The last tick whose closing is complete."""
        self.packets = Packets()
        self.refusals: dict[str, int] = {}
        self.members: dict[str, Member] = {}
        self.fabric = Fabric(deployment)
        self.deliveries: dict[int, list[Delivered]] = {first_tick - 1: [], first_tick: []}
        """Deliveries to robots of the last closed tick and of the next one."""
        self.final = first_tick
        """The last tick whose deliveries are final. Those after the next tick are empty."""
        self.was_final = False
        """Whether the deliveries of the next tick were final before the last closing."""
        self.rejected_on_receipt: dict[str, int] = {}
        """Refusals of packets between closings, by cause: counted by the next closing."""
        self.counted_rejections: list[tuple[str, int]] = []
        """The refusals that the last closing counted: an input of it, which the journal has."""
        self.ages = Ages(self.tick_ns)
        self.aged: list[Age] = []
        """The rows of ages at use by the last closing."""
        self.metrics = Metrics(self.ages)
        self._channels = self.metrics.channels
        self.measured: list[Metric] = []
        """The metrics that have rows by the last closing."""
        self._flights: dict[int, list[Flight]] = {}
        """Packets in flight, by the tick of their arrival."""
        self._fates: list[list[Flight]] = []
        """Drops of each packet that clients sent at the last closed tick, in that order; then arrivals at robots."""
        self._deferred: list[tuple[list[Flight], list[Flight]]] = []
        """The packets of these still to be judged: the flights to their receivers, and the list for their drops."""
        self.sampling = Sampling(deployment)
        self._endpoints = frozenset(deployment.endpoints())
        self._robots = frozenset(deployment.robots)
        self._carried = carried_by(deployment)
        self._transit = InFlightLimit(len(self._endpoints))
        self._here = Here(deployment, self.sampling.triggered)
        self.existence = Existence(deployment)

    # --- joining -----------------------------------------------------------------------------------------------------

    def join(self, joining: Joining, tick: int) -> None:
        """Add a client, from `tick` on; one that returns keeps its numbers."""
        known = self.members.get(joining.name)
        member = self.members[joining.name] = Member.of(joining, tick)
        if known is not None:
            member.sequence, member.downlink, member.since = known.sequence, known.downlink, known.since
        self.ages.joins(joining.name, member.subscriptions)
        self._here.renew(self.members)
        self.existence.look_again()

    def leave(self, name: str) -> None:
        """Deactivate a client: no packet is offered to it."""
        if name in self.members:
            self.members[name].subscriptions = ()
            self.members[name].active = False
            self._here.renew(self.members)

    def due_members(self, tick: int) -> list[str]:
        """Return the lockstep clients that are due at `tick`, in name order."""
        return [name for name in sorted(self.members) if self.members[name].is_due(tick)]

    # --- closing a tick ----------------------------------------------------------------------------------------------

    def close_world(
        self,
        frame: Frame,
        packets: Sequence[RobotPacket],
        fates: list[Flight],
        edits: Sequence[Edit] = (),
        counts: Sequence[int] | None = None,
    ) -> dict[str, list[Flight]]:
        """Phase one of closing the frame's tick; `packets` are in (robot, index) order, `edits` the frame's edits.

        `counts` are the packets' counts within their channels, None where `packets` are all packets of the robots: then
        they follow from these. Append packets with a final fate to `fates` and return the released ones, by client.
        """
        tick = frame.tick
        assert tick == self.closed + 1, (tick, self.closed)
        sent_ns = tick * self.tick_ns
        self.fabric.turn_to(frame)
        changed = self._turn_existence_to(frame)
        disruptions = [edit.event for edit in edits if isinstance(edit, Disrupt)]
        if disruptions:
            self._disrupt(tick, disruptions)
        if counts is None:
            counts = counts_within_channels(packets)
        for packet, count in self._in_phase(zip(packets, counts, strict=True)):
            sequence, draw = (tick << OUTBOX_SHIFT) + packet.index, robot_number(tick, count)
            flights = []
            for receiver in self._addressed(packet.robot, packet.destination, packet.channel):
                if receiver not in self._endpoints:
                    self.refuse("no_route")
                    continue
                published = not packet.destination
                what = sequence, sent_ns, 0, packet.payload, published
                flight = Flight(packet.robot, receiver, packet.channel, *what)
                flight.draw, flight.count = draw, count
                if self._carried:
                    size, flight.latency_ns = self._carried.get((packet.robot, packet.channel), PLAIN)
                    flight.size = flight.size if size is None else size
                flights.append(flight)
            self._send(flights, tick, fates)
        released = self._arrive_at_clients(tick, fates)
        for name, member in self.members.items():
            if member.is_due(tick):
                self.ages.used(name, tick)
            elif not member.period and member.active:
                is_new = member.joined_tick == tick and name in self.deployment.players
                if is_new or name in changed:  # it acts by what it hears of its existence
                    released.setdefault(name, [])
        return released

    def _turn_existence_to(self, frame: Frame) -> list[str]:
        """Let clients begin and cease to exist; return those of which that, or who is absent for them, has changed."""
        changed = self.existence.turn_to(frame, self.members)
        if changed:
            self._here.renew(self.members)
        for name in changed:
            if self.members[name].active and self.members[name].since == frame.tick:
                self.ages.joins(name, self.members[name].subscriptions)
        return changed

    def _in_phase(self, packets: Iterable[Counted]) -> Iterable[Counted]:
        """Return packets in the order in which they reach their radios."""
        if not self.fabric.network.defaults.phase_ns:
            return packets
        phase_ns = self.fabric.phase_ns
        return sorted(packets, key=lambda one: (phase_ns(one[0].robot), one[0].robot, one[0].index))

    def close_clients(
        self, frame: Frame, admitted: Mapping[str, Sequence[Sent]], fates: list[Flight], reports: Reports | None = None
    ) -> Deliveries:
        """Phase two: judge the packets of clients, in (phase, source, sequence) order, and take what they report.

        Return the deliveries of the next tick.
        """
        deliveries = self.close_robots(frame, admitted, reports)
        fates += self.close_rest()
        return deliveries

    def close_robots(
        self, frame: Frame, admitted: Mapping[str, Sequence[Sent]], reports: Reports | None = None
    ) -> Deliveries:
        """The part of phase two that robots wait for: return the deliveries of the next tick; `close_rest` follows.

        Packets to robots are judged first, since nodes wait for these; the costly verdicts of a broadcast by radio to
        clients are computed while the nodes solve. No verdict changes by that: a packet is judged first only on a link
        that shares nothing with any other (`Link.is_apart`), and where a link to a robot does share something all
        packets are judged in their order.
        """
        tick = frame.tick
        self.counted_rejections, self.rejected_on_receipt = sorted(self.rejected_on_receipt.items()), {}
        for cause, count in self.counted_rejections:
            self.refuse(cause, count)
        self._fates, self._deferred = [], []
        has_radios = self.fabric.profiles.on_radio
        shares = has_radios and any(not self._is_apart(flight) for flight in self._flights.get(tick + 1, ()))
        for source in sorted(admitted, key=lambda name: (self.fabric.phase_ns(name), name)):
            copies, before = 0, self._sequence_of(source)
            for sent in sorted(admitted[source], key=attrgetter("sequence")):
                if not self._admit(source, sent):
                    continue
                receivers = self._addressed(source, sent.destination, sent.channel)
                copies += 0 if sent.destination else len(receivers)
                if copies > limits.PACKETS_PER_MESSAGE_MAX:
                    self.refuse("broadcast_full")
                    continue
                what = sent.sequence, tick * self.tick_ns, sent.stamp_ns, sent.payload, not sent.destination
                flights = [Flight(source, receiver, sent.channel, *what) for receiver in receivers]
                to_robot = has_radios and sent.destination in self._robots
                is_apart = to_robot and self._is_apart(flights[0])
                shares = shares or (to_robot and not is_apart)
                dropped: list[Flight] = []
                self._fates.append(dropped)
                if is_apart or not has_radios:
                    self._send(flights, tick, dropped)
                else:
                    self._deferred.append((flights, dropped))
            if self._sequence_of(source) > before and not self.members[source].period:
                self.ages.used(source, tick)
        if shares:
            self._send_waiting(tick)
        self.closed = tick
        self.aged = self.ages.take(tick)
        self.measured = self.metrics.report(tick, reports) if reports else []
        arrived: list[Flight] = []
        self._fates.append(arrived)
        deliveries = self._arrive_at_robots(tick + 1, arrived)
        self.deliveries = {tick: self.deliveries[tick], tick + 1: deliveries}
        self.was_final = tick < self.final
        if self.was_final:
            assert not any(member.is_due(tick) for member in self.members.values()), f"a client is due at tick {tick}"
            assert not deliveries, f"deliveries {tick + 1} were final without packets"
            return Deliveries(tick + 1, [])
        following = self._following(tick)
        self.final = tick + 1 + following
        return Deliveries(tick + 1, deliveries, following)

    def close_rest(self) -> list[Flight]:
        """Judge the packets that `close_robots` has deferred; return all whose fate phase two has made final."""
        self._send_waiting(self.closed)
        if self.ages.is_row_due(self.closed):
            self.measured = [*self.measured, *self.metrics.take(self.closed)]
        return [*chain.from_iterable(self._fates)]

    def _send_waiting(self, tick: int) -> None:
        """Judge the packets of a tick that are deferred."""
        deferred, self._deferred = self._deferred, []
        for flights, dropped in deferred:
            self._send(flights, tick, dropped)

    def _is_apart(self, flight: Flight) -> bool:
        """Whether a packet's fate is independent of other links; packets to clients count as such."""
        if flight.destination not in self._robots:
            return True
        link = self.fabric.link(flight.source, flight.destination, flight.channel)
        return link.is_apart(flight.sent_ns)

    @property
    def hears_clients(self) -> bool:
        """Whether the closing of the next tick has joins, leaves and packets of clients as inputs.

        Not where the deliveries after that tick are final already: then no lockstep client is due and no free-running
        one takes part, so only joins and leaves wait.
        """
        return self.closed + 1 >= self.final

    def _following(self, tick: int) -> int:
        """Return for how many ticks after the next one no packet can reach a robot.

        Nothing in flight arrives, and nothing is sent before: no sensor is due, no outbox is
        filled, no lockstep client is due, or may be by packets in flight, none may join, and no other client is here.
        Samples besides a sensor's rate go to clients, which act when they are due.
        """
        if not self._here.is_complete:
            return 0
        members = [member for member in self.members.values() if member.active]
        if self._here.is_called_at_any_tick or any(member.period == 0 for member in members):
            return 0
        if self._is_clogged(tick) or (self._here.on_arrival and self._calls_by_deferred()):
            return 0
        if are_answered(self.deliveries[tick]) or are_answered(self.deliveries[tick + 1]):
            return 0
        for following in range(limits.RELEASE_AHEAD):
            sent, arrival = tick + 1 + following, tick + 2 + following
            if self.sampling.is_due(sent) or any(member.may_be_due(sent, tick) for member in members):
                return following
            if self._here.on_arrival and any(map(self._here.calls, self._flights.get(sent, ()))):
                return following
            if any(flight.destination in self._robots for flight in self._flights.get(arrival, ())):
                return following
        return limits.RELEASE_AHEAD

    def _calls_by_deferred(self) -> bool:
        """Whether a deferred packet makes a client act at its arrival."""
        return any(self._here.calls(flight) for flights, _ in self._deferred for flight in flights)

    def _is_clogged(self, tick: int) -> bool:
        """Whether a clog, which may end at any tick, delays a packet to a robot or to a client that acts at arrival."""
        if not self.fabric.timeline.holds:
            return False
        flights = (flight for arrival, those in self._flights.items() if arrival > tick for flight in those)
        held = (flight for flight in flights if flight.held_ns > 0)
        return any(flight.destination in self._robots or self._here.calls(flight) for flight in held)

    def _admit(self, source: str, sent: Sent) -> bool:
        """Refuse packets before they are offered: repeats, and those without a receiver in this run."""
        member = self.members.get(source)
        if member is None:
            return self.refuse("unknown_source")
        if sent.sequence <= member.sequence:
            return self.refuse("duplicate")
        member.sequence = sent.sequence
        if sent.destination and sent.destination not in self._endpoints:
            return self.refuse("no_route")
        return True

    def _sequence_of(self, source: str) -> int:
        """Return the greatest sequence number that was admitted from a client."""
        member = self.members.get(source)
        return 0 if member is None else member.sequence

    def refuse(self, cause: str, count: int = 1) -> bool:
        """Count refused packets; no link counts them."""
        self.packets.refused += count
        self.refusals[cause] = self.refusals.get(cause, 0) + count
        return False

    def reject_on_receipt(self, cause: str, count: int = 1) -> None:
        """Add packets that are refused between closings; the next closing counts them."""
        self.rejected_on_receipt[cause] = self.rejected_on_receipt.get(cause, 0) + count

    def _addressed(self, source: str, destination: str, channel: str) -> tuple[str, ...]:
        """Return a packet's receivers: its destination, or the clients that subscribe to the channel, by name.

        Each receiver is one offered packet; without a receiver nothing is offered.
        """
        if destination:
            return (destination,)
        return self._here.receivers.get((source, channel), ())

    def _send(self, flights: Sequence[Flight], tick: int, fates: list[Flight]) -> None:
        """Judge a packet for each of its receivers, then the copies: all receivers of a broadcast share the air."""
        twins = []
        for flight in flights:
            is_offered = flight.copy == 0
            self.packets.offered += is_offered
            link = self.fabric.link(flight.source, flight.destination, flight.channel)
            is_under_way = link.send(flight)
            if is_under_way and not self._transit.takes(flight):
                is_under_way = False
                link.drop(flight, TRANSIT_FULL)
            if not is_under_way:
                if is_offered:
                    self.packets.dropped += 1
                    self._counts(flight.channel).dropped += 1
                fates.append(flight)
                continue
            is_sensed = flight.source in self._robots and flight.destination in self.members
            self._let_fly(flight, tick if is_sensed else tick + 1)
            if flight.is_doubled:
                self.packets.copies += 1
                what = flight.sequence, flight.sent_ns, flight.stamp_ns, flight.payload, flight.published
                twin = Flight(flight.source, flight.destination, flight.channel, *what, copy=1)
                twin.draw, twin.count = flight.draw, flight.count
                twin.size, twin.latency_ns = flight.size, flight.latency_ns
                twins.append(twin)
        if twins:
            self._send(twins, tick, fates)

    def _disrupt(self, tick: int, events: Sequence[str]) -> None:
        """Apply requested network events; a clog that begins or ends moves the due times of packets in flight."""
        timeline, now_ns = self.fabric.timeline, tick * self.tick_ns
        flights = self.in_flight()
        pairs = sorted({(flight.source, flight.destination) for flight in flights})
        before = {pair: timeline.holds_of(*pair) for pair in pairs}
        for event in events:
            self.fabric.take(tick, now_ns, event)
        moved = {pair for pair in pairs if timeline.holds_of(*pair) != before[pair]}
        if not moved:
            return
        on_links: dict[Link, list[Flight]] = {}
        self._flights.clear()
        for flight in sorted(flights, key=lambda flight: (flight.sequence, flight.copy)):
            if (flight.source, flight.destination) in moved:
                link = self.fabric.link(flight.source, flight.destination, flight.channel)
                on_links.setdefault(link, []).append(flight)
            else:
                self._put(flight, flight.arrival_tick)
        for link, flights in on_links.items():
            due_ns = [flight.due_ns for flight in flights]
            link.retime(flights, now_ns)
            for flight, before_ns in zip(flights, due_ns, strict=True):
                # The deliveries to robots of this tick are published already.
                earliest = tick + (flight.destination in self._robots)
                self._let_fly(flight, flight.arrival_tick if flight.due_ns == before_ns else earliest)

    def _let_fly(self, flight: Flight, earliest: int) -> None:
        """Schedule a packet's arrival at its due time, at that tick at the earliest."""
        member = self.members.get(flight.destination)
        arrival = max(earliest, -(-flight.due_ns // self.tick_ns))
        self._put(flight, arrival if member is None else member.release_tick(arrival))

    def _put(self, flight: Flight, arrival: int) -> None:
        """Add a packet to the arrivals of a tick."""
        flight.arrival_tick = arrival
        flights = self._flights.get(arrival)
        if flights is None:
            self._flights[arrival] = [flight]
        else:
            flights.append(flight)

    def _arrive(self, flight: Flight, hindered: str) -> bool:
        """Judge a packet at arrival, and count it, unless it is a copy."""
        self._transit.arrived(flight)
        link = self.fabric.link(flight.source, flight.destination, flight.channel)
        is_delivered = link.arrive(flight, hindered)
        if flight.copy == 0:
            counts = self._counts(flight.channel)
            if is_delivered:
                self.packets.delivered += 1
                counts.delivered += 1
                counts.delay_ns += flight.due_ns - flight.sent_ns
            else:
                self.packets.dropped += 1
                counts.dropped += 1
        return is_delivered

    def _counts(self, channel: str) -> ChannelCounts:
        """Return the counts of a channel."""
        counts = self._channels.get(channel)
        return self.metrics.counts(channel) if counts is None else counts

    def _take_arrivals(self, tick: int, to_robots: bool) -> list[Flight]:
        """Remove and return the arrivals of `tick` at robots, or at clients, in (due, source, sequence, copy) order."""
        flights = self._flights.pop(tick, None)
        if not flights:
            return []
        robots = self._robots
        taken = [flight for flight in flights if (flight.destination in robots) is to_robots]
        rest = [flight for flight in flights if (flight.destination in robots) is not to_robots]
        if rest:
            self._flights[tick] = rest
        late = [flight for flight in taken if flight.put_off_ns and flight.due_ns > tick * self.tick_ns]
        for flight in late:
            taken.remove(flight)
            self._let_fly(flight, tick + 1)
        taken.sort(key=order_of)
        return taken

    def _arrive_at_clients(self, tick: int, fates: list[Flight]) -> dict[str, list[Flight]]:
        released: dict[str, list[Flight]] = {}
        turns = self._here.on_arrival
        for client in turns.values():
            if client.is_over(tick):
                client.called_tick = tick
        arriving = self._take_arrivals(tick, to_robots=False)
        if not arriving:
            return released
        room, world = ReceiveBudget(arriving, limits.CLIENT_BYTES_PER_TICK_MAX, is_shared=False), self.fabric.world
        judged: list[Flight] = []
        if turns:  # packets that make clients act are judged first: the others of the tick are delivered with them
            arriving.sort(key=self._here.calls, reverse=True)
        for flight in arriving:
            found = self.members.get(flight.destination)
            is_usual = found is None or (found.active and not found.since)
            member = found if is_usual else self._receiver(flight)
            if member is not None and member.release_tick(tick) != tick:
                self._put(flight, member.release_tick(tick))
                continue
            is_call = flight.destination in turns and self._here.calls(flight)
            if member is not None and member.arrivals and not is_call and member.called_tick != tick:
                self._put(flight, tick + 1)
                continue
            down = member is None or world.is_down(flight.destination)
            hindered = RECEIVER_DOWN if down else "" if room.takes(flight) else RECEIVER_FULL
            if self._arrive(flight, hindered):
                released.setdefault(flight.destination, []).append(flight)
                self.ages.reached(flight.destination, flight.source, flight.channel, flight.sent_ns)
                if is_call:
                    turns[flight.destination].called_tick = tick
            judged.append(flight)
        if turns:
            judged.sort(key=order_of)
            for flights in released.values():
                flights.sort(key=order_of)
        fates += judged
        return released

    def _receiver(self, flight: Flight) -> Member | None:
        """Return the client that a packet is for, if it takes part and exists, and has since the packet was due."""
        member = self.members[flight.destination]
        return member if member.active and member.has_existed_at(flight.due_ns, self.tick_ns) else None

    def _arrive_at_robots(self, tick: int, fates: list[Flight]) -> list[Delivered]:
        deliveries: list[Delivered] = []
        arriving = self._take_arrivals(tick, to_robots=True)
        if not arriving:
            return deliveries
        room, world = ReceiveBudget(arriving, limits.ROBOTS_BYTES_PER_TICK_MAX, is_shared=True), self.fabric.world
        for flight in arriving:
            fates.append(flight)
            to = flight.destination
            hindered = RECEIVER_DOWN if world.is_down(to) else "" if room.takes(flight) else RECEIVER_FULL
            if self._arrive(flight, hindered):
                numbers = flight.sequence, flight.copy
                content = content_of(flight)
                deliveries.append(Delivered(flight.due_ns, flight.source, *numbers, to, flight.channel, content))
        return deliveries

    def in_flight(self) -> list[Flight]:
        """Return the packets in flight, in order of arrival."""
        return [flight for tick in sorted(self._flights) for flight in sorted(self._flights[tick], key=order_of)]

    # --- the state as bytes ------------------------------------------------------------------------------------------

    def snapshot(self) -> bytes:
        """Return the whole state as bytes: equal states give equal bytes."""
        fabric, p = self.fabric, self.packets
        return msgspec.msgpack.encode(
            {
                "closed": self.closed,
                "packets": [p.offered, p.delivered, p.dropped, p.refused, p.copies],
                "refusals": sorted(self.refusals.items()),
                "members": [[name, member.state()] for name, member in sorted(self.members.items())],
                "links": [[*key, fabric.states[key]] for key in sorted(fabric.states)],
                "radios": [[*key, fabric.radios[key]] for key in sorted(fabric.radios)],
                "airs": [[name, fabric.airs[name].state] for name in sorted(fabric.airs)],
                "requested": fabric.requested,
                "deliveries": sorted(self.deliveries.items()),
                "final": [self.final, self.was_final],
                "ages": self.ages.state(),
                "metrics": self.metrics.state(),
                "flights": [state_of(flight) for flight in self.in_flight()],
            }
        )

    @classmethod
    def restore(cls, deployment: Deployment, snapshot: bytes) -> HubState:
        """Return the state of a snapshot; raises Malformed for invalid bytes."""
        content = decode_any(Snapshot, snapshot)
        state = cls(deployment)
        state.closed = content.closed
        state.packets = Packets(*content.packets)
        state.refusals = dict(content.refusals)
        for name, written in content.members:
            state.members[name] = Member(written)
        state._here.renew(state.members)
        state.fabric.restore(content.links, content.radios, content.airs, content.requested)
        state.deliveries = dict(content.deliveries)
        state.final, state.was_final = content.final
        state.ages.restore(content.ages)
        state.metrics.restore(content.metrics)
        if not {state.closed, state.closed + 1} <= state.deliveries.keys():
            raise Malformed(f"a state after tick {state.closed} without the deliveries of that tick and the next")
        ends = {(source, destination) for source, destination, _ in state.fabric.states}
        for flight in map(flight_of, content.flights):
            if (flight.source, flight.destination) not in ends:
                raise Malformed(f"a packet in flight from {flight.source} to {flight.destination} without a link")
            state.fabric.restore_flight(flight)
            state._transit.restored(flight)
            state._put(flight, flight.arrival_tick)
        return state


assert limits.ROBOT_PACKETS_PER_TICK_MAX == 1 << OUTBOX_SHIFT
