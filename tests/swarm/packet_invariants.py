"""The laws of packets: acceptance, fates, deliveries and accounts of the vHub, checked from its messages."""

from __future__ import annotations

from collections import Counter
from typing import Final

from foosim.client.core import ClientCore
from foosim.deployment.schema import Deployment
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import Deliveries, Done, Down, Go, Samples, Sent
from foosim.simulation.stepped_world import SteppedWorld
from foosim.simulation.system import System
from foosim.vhub.network.packet import DELIVERED, DROPPED, IN_FLIGHT
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import Closing, TickRecord, world_packets
from foosim.world.frame import Frame
from foosim.world.robot_packets import Delivered, RobotPacket
from foosim.world.sampling import Sampling

Key = tuple[str, str, int, int]
"""A packet: source, destination, sequence number, copy."""
LOST_TICKS_MAX: Final = 1000
"""Ticks for which the inputs of fates are kept: more than a machine loss undoes."""
OPEN: Final[tuple[str, ...]] = ("", IN_FLIGHT)
"""The cause of a packet that was not dropped."""


class Broken(AssertionError):
    """A law does not hold."""


def hold(law: bool, what: str) -> None:
    """Raise Broken unless the law holds."""
    if not law:
        raise Broken(what)


class PacketLaws:
    """Checks packets. `said` has the deliveries of each tick as nodes receive them, the final bytes."""

    def __init__(self, deployment: Deployment) -> None:
        self.closed = -1
        self.said: dict[int, bytes] = {0: encode(Deliveries(0, []))}
        self._deployment = deployment
        self._sampling = Sampling(deployment)
        self._written: dict[int, bytes] = {0: self.said[0]}
        self._delivered: dict[tuple[str, int, int], int] = {}
        """The tick at which each packet reached a robot."""
        self._samples: dict[int, list[Samples]] = {}
        self._sequences: dict[str, int] = {}
        self._downlinks: dict[str, dict[int, bytes]] = {}
        self._go_ticks: dict[str, int] = {}
        self._dones: dict[tuple[str, str, int], bytes] = {}
        self._answered: dict[int, dict[str, list[Sent]]] = {}
        """The Dones of ticks that are not closed, by tick and client."""
        self._reached: dict[int, list[Key]] = {}
        """Packets delivered to robots after a tick."""
        self._received: dict[int, dict[str, list[Key]]] = {}
        """Packets sent to clients at a tick."""
        self._owed: dict[tuple[str, int], list[Key] | None] = {}
        """For clients that left with a Done due and an unsent Go, by tick: its packets, None until the closing."""
        self._fates: dict[Key, tuple[int, str]] = {}
        """By packet: the tick at which its fate was final, and the cause."""

    # --- the vHub's side ---------------------------------------------------------------------------------------------

    def closes(self, record: TickRecord, digest: bytes) -> None:
        """A record: the next tick, from samples of the committed frame, with all packets that clients sent."""
        tick = record.tick
        hold(tick == self.closed + 1, f"the vHub closes tick {tick} after {self.closed}")
        self.closed = tick
        samples = [decode(Samples, raw) for raw in record.samples]
        wrong = [message.node for message in samples if message.tick != tick or message.digest != digest]
        hold(not wrong, f"the samples of {wrong} at tick {tick} are not of its frame")
        self._samples[tick] = samples
        for client in record.owing:
            self._owes(client, tick)
        for client, sent in record.admitted:
            for packet in sent:
                known = self._sequences.get(client, 0)
                hold(packet.sequence <= known + 1, f"{client}: packet {packet.sequence} is taken after {known}")
                self._sequences[client] = max(known, packet.sequence)
        said = self._answered.pop(tick, {})
        answered = {name: sent for name, sent in said.items() if sent and name not in record.owing}
        taken = {name: sent for name, sent in record.admitted if sent}
        hold(taken == answered, f"record {tick} has {[*taken]}, clients answered {[*answered]}: a crash has lost some")
        deliveries = decode(Deliveries, record.deliveries)
        self._reached[tick] = [(p.source, p.destination, p.sequence, p.copy) for p in deliveries.packets]
        hold(deliveries.tick == tick + 1, f"record {tick} has deliveries {deliveries.tick}")
        if tick + 1 not in self._written:
            self._written[tick + 1] = record.deliveries
            for following in range(tick + 2, deliveries.last + 1):
                self._written[following] = encode(Deliveries(following, []))
        hold(
            not deliveries.packets or self._written[tick + 1] == record.deliveries, f"deliveries {tick + 1} were final"
        )

    def delivers(self, deliveries: Deliveries, raw: bytes) -> None:
        """Law 3: deliveries are journalled before they are published, and never change. Law 4: each packet once."""
        for tick in range(deliveries.tick, deliveries.last + 1):
            payload = raw if tick == deliveries.tick else encode(Deliveries(tick, []))
            written = self._written.get(tick)
            hold(written is not None, f"deliveries {tick} are published before they are journalled")
            hold(written == payload, f"deliveries {tick} are published differently than journalled")
            if tick not in self.said:
                self.said[tick] = payload
                self._reach(tick, deliveries.packets if tick == deliveries.tick else [])

    def _reach(self, tick: int, packets: list[Delivered]) -> None:
        order = [(packet.due_ns, packet.source, packet.sequence, packet.copy) for packet in packets]
        hold(order == sorted(order), f"deliveries {tick} are out of order")
        late = tick * self._deployment.tick_ns
        hold(all(packet.due_ns <= late for packet in packets), f"deliveries {tick} come before they are due")
        keys = {(packet.source, packet.sequence, packet.copy) for packet in packets}
        hold(
            len(keys) == len(packets) and not keys & self._delivered.keys(), f"deliveries {tick}: a packet comes twice"
        )
        self._delivered.update(dict.fromkeys(keys, tick))

    def fates(self, closing: Closing) -> None:
        """Law 5: each packet has one fate; a robot's has the number of its tick and place.

        A packet that has not reached its receiver counts as dropped: all others were delivered.
        """
        self._came(closing)
        for flight in closing.fates:
            key = flight.source, flight.destination, flight.sequence, flight.copy
            hold(key not in self._fates, f"packet {key} has two fates")
            self._fates[key] = closing.frame.tick, flight.cause
            if flight.source in self._deployment.robots:
                sent = (flight.sequence >> 16) * self._deployment.tick_ns
                hold(flight.sent_ns == sent, f"packet {key} of a robot has another tick's number")

    def _came(self, closing: Closing) -> None:
        """Exactly the packets that count as delivered were in messages to their receivers."""
        tick = closing.frame.tick
        robots: list[Key] = []
        clients: dict[str, list[Key]] = {}
        for flight in closing.fates:
            if not flight.cause:
                to = flight.destination
                of_it = robots if to in self._deployment.robots else clients.setdefault(to, [])
                of_it.append((flight.source, to, flight.sequence, flight.copy))
        hold(robots == self._reached.get(tick, []), f"deliveries {tick + 1} are not the delivered packets")
        for name, owed in self._owed:
            if owed == tick:
                self._owed[name, tick] = clients.pop(name, [])
        told = {name: keys for name, keys in self._received.get(tick, {}).items() if keys}
        hold(clients == told, f"the packets sent to clients at tick {tick} are not those that count as delivered")
        self._reached.pop(tick - LOST_TICKS_MAX, None)
        self._received.pop(tick - LOST_TICKS_MAX, None)

    def senses(self, frame: Frame, world: SteppedWorld) -> None:
        """What robots sent at a frame is a function of it, whoever owned them."""
        samples = self._samples.pop(frame.tick, [])
        taken = world_packets(samples, frame.digest, frame, self._sampling)
        sensed: list[RobotPacket] = [] if self._sampling.is_silent(frame) else world.sense()
        hold(taken is None or taken == sensed, f"robots' packets at tick {frame.tick} are not those of their sensors")

    # --- the clients' side -------------------------------------------------------------------------------------------

    def downlink(self, client: str, down: Go | Down, raw: bytes) -> None:
        """Downlinks are numbered consecutively, and each number identifies one content."""
        known = self._downlinks.setdefault(client, {})
        if down.number not in known:
            keys = [(packet.source, client, packet.sequence, packet.copy) for packet in down.packets]
            self._received.setdefault(down.tick, {}).setdefault(client, []).extend(keys)
            owed = self._owed.pop((client, down.tick), None)
            hold(owed is None or owed == keys, f"downlink {down.number} of {client} is not what its Go had")
        hold(down.number <= len(known) + 1, f"downlink {down.number} of {client} after {len(known)}")
        hold(known.setdefault(down.number, raw) == raw, f"downlink {down.number} of {client} has two contents")
        if isinstance(down, Go):
            hold(down.tick <= self.closed + 1, f"Go {down.tick} before tick {down.tick - 1} is written")
            known_tick = self._go_ticks.setdefault(client, -1)
            hold(down.tick >= known_tick, f"Go {down.tick} of {client} after {known_tick}")
            self._go_ticks[client] = down.tick

    def _owes(self, client: str, tick: int) -> None:
        """A client has left with a Done due: its Go's packets are sent as a message that needs no answer."""
        known = self._downlinks.setdefault(client, {})
        number, raw = next(reversed(known.items()), (0, b""))
        said = decode_any(Go | Down, raw) if raw else None
        if said is None or said.tick < tick:
            self._owed.setdefault((client, tick))
        elif isinstance(said, Go):
            what = said.acknowledged, said.packets, False, said.since, said.absent
            known[number] = encode(Down(number, tick, *what))

    def answers(self, done: Done, raw: bytes) -> None:
        """A lockstep client has one Done per tick; a process that replaces another one sends its own."""
        said = self._dones.setdefault((done.name, done.boot, done.tick), raw)
        hold(said == raw, f"{done.name} has two Dones of {done.tick}")
        if done.tick > self.closed:
            self._answered.setdefault(done.tick, {})[done.name] = done.packets

    # --- account -----------------------------------------------------------------------------------------------------

    @staticmethod
    def account(state: HubState) -> None:
        """Law 5: offered = delivered + dropped + in flight, in total, by link and by channel; copies are in none."""
        packets, flying = state.packets, [flight for flight in state.in_flight() if flight.copy == 0]
        hold(packets.in_flight == len(flying), f"{packets.in_flight} packets in flight, there are {len(flying)}")
        links = list(state.fabric.states.values())
        total = sum(link.offered for link in links), sum(link.delivered for link in links)
        hold(total == (packets.offered, packets.delivered), "the links' account is not that of all")
        channels = list(state.metrics.channels.values())
        total = sum(channel.delivered for channel in channels), sum(channel.dropped for channel in channels)
        hold(total == (packets.delivered, packets.dropped), "the channels' account is not that of all")
        hold(all(link.offered >= link.delivered + link.dropped for link in links), "a link has more fates than packets")

    def end(self, system: System) -> None:
        """Every offered packet and every copy has a fate, and every downlink has arrived."""
        state = system.hub.state
        assert state is not None
        self.account(state)
        hold(not self._owed, f"packets of these open Gos were never sent: {sorted(self._owed)}")
        hold(state.packets.refused == 0, f"lockstep clients repeat nothing, {state.refusals} were refused")
        counted = {DELIVERED: 0, DROPPED: 0, IN_FLIGHT: 0}
        fates = {key: cause for key, (_, cause) in self._fates.items() if key[3] == 0}
        for cause in fates.values():
            counted[DELIVERED if not cause else IN_FLIGHT if cause == IN_FLIGHT else DROPPED] += 1
        packets = state.packets
        copies = len(self._fates) - len(fates)
        hold(copies == packets.copies, f"{copies} copies have a fate, {packets.copies} were made")
        by_link = Counter((source, to) for (source, to, _, _), cause in fates.items() if cause not in OPEN)
        dropped: Counter[tuple[str, str]] = Counter()
        for (source, destination, _), link in state.fabric.states.items():
            if link.dropped:
                dropped[source, destination] += link.dropped
        hold(dict(by_link) == dropped, f"receivers lack {by_link}, links count {dropped} as dropped")
        told = {DELIVERED: packets.delivered, DROPPED: packets.dropped, IN_FLIGHT: packets.in_flight}
        hold(counted == told, f"fates {counted}, the account has {told}")
        for name, process in system.processes.items():
            if isinstance(process.core, ClientCore):
                statistics = process.core.statistics()
                hold(statistics.missing == 0, f"{name} misses {statistics.missing} downlinks")
                sent = process.core.first_sequence + statistics.sent
                hold(sent >= self._sequences.get(name, 0), f"{name} sent less than was taken")
