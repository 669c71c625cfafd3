"""The vHub's account against a small model: offered = delivered + dropped + in flight, each packet in one class.

The real state closes ticks under clients that join, leave and come back, robots that send and go down, packets that
repeat, are for nobody, or come from strangers. The model is the set of packets offered and the set of those with a
fate. At any time the state is put away as bytes and taken out again.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Final

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.protocol.messages import Sent
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight
from foosim.vhub.state.hub_state import HubState
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame
from foosim.world.robot_packets import RobotPacket

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
LINKS: Final = (
    "[{id: fast, from: red.*, to: '*', delay: 1 ms, loss: 30 %}, "
    "{id: slow, from: '*', to: '*', delay: 9 ms, jitter: {shape: gamma, sd: 3 ms}, loss: 10 %, order: free}]"
)
DEPLOYMENT: Final = load_deployment(
    apply_sets(
        TABLE.read_text(),
        "t",
        ["robots.camera.sensors.ball.rate=250 Hz", f"network.links={LINKS}", "clients={tool: {}, probe: {}}"],
    ),
    "t",
)
START: Final = initial_frame(DEPLOYMENT)
CLIENTS: Final = ("player-blue", "player-red", "probe", "tool")
ROBOTS: Final = ("blue.goal", "camera", "red.attack", "red.goal")
CHANNELS: Final = ("ball", "encoder", "echo")
Packet = tuple[str, str, int]
"""Source, destination, sequence."""
SUBSCRIPTIONS: Final = st.lists(st.tuples(st.sampled_from(ROBOTS), st.sampled_from(CHANNELS)), max_size=3, unique=True)
COMMANDS: Final = st.lists(
    st.tuples(
        st.sampled_from((*CLIENTS, "stranger")), st.integers(-2, 3), st.sampled_from((*ROBOTS, "tool", "nobody"))
    ),
    max_size=6,
)
SAMPLES: Final = st.lists(
    st.tuples(
        st.sampled_from(ROBOTS), st.sampled_from(("", *CLIENTS, "red.goal", "nobody")), st.sampled_from(CHANNELS)
    ),
    max_size=5,
)


class Ledger(RuleBasedStateMachine):
    """A hub's state, tick after tick."""

    def __init__(self) -> None:
        super().__init__()
        self.state = HubState(DEPLOYMENT)
        self.next_number = dict.fromkeys(CLIENTS, 1)
        self.down: frozenset[str] = frozenset()
        # the model
        self.heard: dict[str, frozenset[tuple[str, str]]] = {}
        self.newest: dict[str, int] = {}
        self.offered: set[Packet] = set()
        self.fates: dict[Packet, str] = {}
        self.refused: Counter[str] = Counter()

    @rule(name=st.sampled_from(CLIENTS), period=st.sampled_from((0, 1, 3)), hears=SUBSCRIPTIONS)
    def join(self, name: str, period: int, hears: list[tuple[str, str]]) -> None:
        self.state.join(Joining(name, period, hears), self.state.closed + 1)
        self.heard[name] = frozenset(hears)
        self.newest.setdefault(name, 0)

    @rule(name=st.sampled_from(CLIENTS))
    def leave(self, name: str) -> None:
        self.state.leave(name)
        self.heard.pop(name, None)

    @rule(down=st.frozensets(st.sampled_from(ROBOTS)))
    def robots_go_down(self, down: frozenset[str]) -> None:
        self.down = down

    @rule(count=st.integers(1, 5), cause=st.sampled_from(("malformed", "inbox_full")))
    def reject_on_receipt(self, count: int, cause: str) -> None:
        self.state.reject_on_receipt(cause, count)
        self.refused[cause] += count

    @rule()
    def put_away_and_take_out(self) -> None:
        door = self.state.rejected_on_receipt
        raw = self.state.snapshot()
        self.state = HubState.restore(DEPLOYMENT, raw)
        self.state.rejected_on_receipt = door  # what no closing has counted is not of the state yet
        assert self.state.snapshot() == raw

    @rule(samples=SAMPLES, commands=COMMANDS)
    def close(self, samples: list[tuple[str, str, str]], commands: list[tuple[str, int, str]]) -> None:
        tick = self.state.closed + 1
        if not self.state.sampling.is_due(tick):
            samples = []  # robots send when a sensor is due, or from an outbox
        packets = [
            RobotPacket(robot, index, destination, channel, b"x")
            for index, (robot, destination, channel) in enumerate(sorted(samples))
        ]
        for packet in packets:
            self._offer_robots(packet, tick * 65_536 + packet.index)
        sent: dict[str, list[Sent]] = {}
        if self.state.hears_clients:
            for name, way, destination in commands:
                number = max(1, self.next_number.get(name, 1) + way)
                self.next_number[name] = max(number + 1, self.next_number.get(name, 1))
                sent.setdefault(name, []).append(Sent(number, destination, "echo", 0, b"y"))
            self._offer_clients(sent)
        fates: list[Flight] = []
        frame = self._frame(tick)
        self.state.close_world(frame, packets, fates)
        self.state.close_clients(frame, sent, fates)
        assert self.state.closed == tick
        for flight in fates:
            packet_key = flight.source, flight.destination, flight.sequence
            assert packet_key in self.offered, "a fate of what nobody sent"
            assert packet_key not in self.fates, "a second fate"
            assert flight.copy == 0
            self.fates[packet_key] = flight.cause

    def _frame(self, tick: int) -> Frame:
        values = START.values.copy()
        for name in self.down:
            values[START.layout[name].offsets["down"]] = 1.0
        return Frame(tick, START.layout, values)

    def _offer_robots(self, packet: RobotPacket, sequence: int) -> None:
        if packet.destination:
            receivers = [packet.destination]
        else:
            receivers = [name for name, wanted in self.heard.items() if (packet.robot, packet.channel) in wanted]
        for receiver in receivers:
            if receiver == "nobody":
                self.refused["no_route"] += 1
            else:
                self.offered.add((packet.robot, receiver, sequence))

    def _offer_clients(self, sent: dict[str, list[Sent]]) -> None:
        for name, packets in sent.items():
            for packet in sorted(packets, key=lambda one: one.sequence):
                if name not in self.newest:
                    self.refused["unknown_source"] += 1
                elif packet.sequence <= self.newest[name]:
                    self.refused["duplicate"] += 1
                else:
                    self.newest[name] = packet.sequence
                    if packet.destination == "nobody":
                        self.refused["no_route"] += 1
                    else:
                        self.offered.add((name, packet.destination, packet.sequence))

    @invariant()
    def every_packet_is_in_one_class(self) -> None:
        flying = {(flight.source, flight.destination, flight.sequence) for flight in self.state.in_flight()}
        assert flying == self.offered - self.fates.keys()
        packets = self.state.packets
        dropped = sum(1 for cause in self.fates.values() if cause)
        assert (packets.offered, packets.dropped) == (len(self.offered), dropped)
        assert (packets.delivered, packets.in_flight) == (len(self.fates) - dropped, len(flying))

    @invariant()
    def every_link_balances(self) -> None:
        offered = Counter((source, destination) for source, destination, _ in self.offered)
        assert {key[:2]: link.offered for key, link in self.state.fabric.states.items()} == dict(offered)
        for key, link in self.state.fabric.states.items():
            causes = [cause for packet, cause in self.fates.items() if packet[:2] == key[:2]]
            assert (link.delivered, link.dropped) == (causes.count(""), len(causes) - causes.count(""))

    @invariant()
    def refusals_stand_apart(self) -> None:
        counted = Counter(self.state.refusals) + Counter(self.state.rejected_on_receipt)
        assert counted == +self.refused
        assert self.state.packets.refused == sum(self.state.refusals.values())


TestLedger = Ledger.TestCase
TestLedger.settings = settings(max_examples=40, stateful_step_count=40)
