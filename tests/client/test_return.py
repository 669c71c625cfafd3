"""A vHub that dies and comes back, as its clients see it: everything once, both ways, whatever was lost on the way."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random
from typing import Final

import pytest

from foosim.client.core import AWAY_AGAIN_NS, ClientCore
from foosim.client.player import Packet
from foosim.common import limits
from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.channels import Plane
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.hub_messages import ResumeGrant
from foosim.protocol.messages import Build, ClientRefusal, ClientWelcome, Deliveries, Down
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import HubRecord, TickRecord
from foosim.vhub.state.resume import recall
from tests.client.test_core import DEPLOYMENT, HEARD, NAME, TEXT, Air, published

MS: Final = 1_000_000
TICKS: Final = 60


class Storm(Air):
    """An air whose vHub dies: what it had written is there for the next one, what it had said may be lost."""

    def __init__(self) -> None:
        self.records: list[bytes] = []
        super().__init__()

    def said(self) -> list[Publish]:
        self.records += [action.record for action in self.hub.actions if isinstance(action, Journal)]
        return super().said()

    def die(self, clients: Sequence[ClientCore]) -> None:
        """The vHub is killed: what it did not write is not, what was said and not carried is lost."""
        self.hub.actions.clear()
        for client in clients:
            published(client)
            client.hub_gone(self.now_ns)

    def come_back(self, run: str = "run-1") -> None:
        """Another one is started."""
        self.hub = HubCore("boot-2", bytes(32), self.now_ns)
        self.tell(channels.BUILD, "vhub", encode(Build("vhub", "boot-2", "first", run, NAME, TEXT, "fast")))
        self.hub.begin(recall(DEPLOYMENT, run, self.records, None, limits.DOWNLINK_KEPT_NS), self.now_ns)
        self.tell(channels.RESUME_GRANT, "vhub", encode(ResumeGrant("vhub", "boot-2", 0)))
        self.tick = self.closed()

    def settle(self, *clients: ClientCore) -> None:
        """Let some time pass, so that what is said again is said again."""
        for _ in range(4):
            self.now_ns += 400 * MS
            self.hub.wake(self.now_ns)
            for client in clients:
                self.carry(client)


def packets_of(tick: int) -> list[Packet]:
    return [Packet("red.goal", "echo", b"%d" % tick), Packet("blue.goal", "echo", b"%d" % tick)]


def deliveries_of(records: Sequence[bytes]) -> list[Deliveries]:
    """The deliveries of all ticks that are written."""
    found = [decode_any(HubRecord, raw) for raw in records]
    ticks = {record.tick: decode(Deliveries, record.deliveries) for record in found if isinstance(record, TickRecord)}
    return [one for _, one in sorted(ticks.items())]


SEEDS: Final = range(20)
UPWARD: Final = (channels.CLIENT_HELLO, channels.UP)


class Weather:
    """A free-running and a lockstep client in a storm. What travels keeps its order, but some of it comes again later,
    also after the death of its sender; a vHub dies with or without clients, and what it had said may be lost."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)
        self.air = Storm()
        self.air.start()
        self.boots = 0
        self.late: list[Publish] = []
        self.clients: dict[str, ClientCore] = {}
        self.got: list[list[int]] = []
        """The samples that each process of the free-running client has got."""
        for name in ("ear", "hand"):
            self.start(name)
        self.exchange()

    def start(self, name: str) -> None:
        self.boots += 1
        self.clients[name] = ClientCore(name, f"boot {self.boots}", self.air.now_ns)
        if name == "ear":
            self.got.append([])

    def exchange(self) -> None:
        """Carry all messages, and some earlier ones once more."""
        air, cores = self.air, self.clients
        for core in cores.values():
            core.wake(air.now_ns)
        while messages := [*(m for core in cores.values() for m in published(core)), *air.said()]:
            self.late += [message for message in messages if self.random.random() < 0.3]
            while self.late and self.random.random() < 0.3:
                messages.append(self.random.choice(self.late))
            for message in messages:
                if message.channel in UPWARD:
                    air.tell(message.channel, message.name, message.payload)
                else:
                    cores[message.name].receive(message.channel, message.name, message.payload, air.now_ns)
            for name, core in cores.items():
                if core.welcome is not None and core._join is None and core.statistics().downlinks == 0:
                    core.join(int(name == "hand"), HEARD)
        self.got[-1] += [int(packet.payload) for packet in cores["ear"].arrivals]
        cores["ear"].arrivals.clear()

    def act(self) -> None:
        ear, hand = self.clients["ear"], self.clients["hand"]
        if ear.statistics().downlinks:
            ear.report({"tick": float(self.air.tick)})
            ear.send(packets_of(self.air.tick))
        if hand.go is not None:
            hand.report({"tick": float(hand.go.tick)})
            hand.done([Packet("red.goal", "echo", b"%d" % hand.go.tick)])

    def die(self) -> None:
        """Kill the vHub, at times with clients, amid what travels; start what was killed."""
        air, random = self.air, self.random
        self.act()
        if random.random() < 0.5:
            air.said()  # written, and not heard
        for name, core in self.clients.items():
            said = published(core)
            self.late += said  # it comes late, or not at all
            if random.random() < 0.4:
                core.hub_gone(air.now_ns)
                core.wake(air.now_ns)
                self.late += published(core)
                self.start(name)
        air.die([*self.clients.values()])
        air.come_back()

    def settle(self) -> None:
        for _ in range(6):
            self.air.now_ns += 400 * MS
            self.air.hub.wake(self.air.now_ns)
            self.exchange()
            self.act()


@pytest.mark.parametrize("seed", SEEDS)
def test_each_process_that_lives_gets_in_and_everything_arrives_once_both_ways(seed: int) -> None:
    weather = Weather(seed)
    air = weather.air
    while air.closed() < TICKS:
        if air.closed() == air.tick:
            air.close()
        weather.exchange()
        weather.act()
        if weather.random.random() < 0.1:
            weather.die()
            weather.settle()
    weather.settle()
    for _ in range(10):
        air.close()
        weather.exchange()
        weather.act()
        weather.exchange()
    state, ear, hand = air.hub.state, weather.clients["ear"], weather.clients["hand"]
    assert state is not None and not air.hub.lost and not ear.refusal and not hand.refusal
    assert {name: air.hub.sessions.by_name[name].boot for name in weather.clients} == {
        "ear": ear.boot,
        "hand": hand.boot,
    }
    for got in weather.got:
        assert got == [*range(got[0], got[-1] + 1, 5)] if got else True, "each sample once, in order"
    assert weather.got[-1][-1] == state.closed // 5 * 5 and ear.statistics().missing == hand.statistics().missing == 0
    delivered = [packet for one in deliveries_of(air.records) for packet in one.packets]
    numbers = [packet.sequence for packet in delivered if packet.source == "ear"]
    assert sorted(numbers) == [*range(1, len(numbers) + 1)] and len(numbers) >= ear._sequence - 4
    ticks = [int(packet.payload) for packet in delivered if packet.source == "hand"]
    assert ticks == [*range(ticks[0], ticks[-1] + 1)] and ticks[-1] == state.closed, "an answer for each tick"
    assert state.metrics.reported == {"ear": ear._metrics, "hand": hand._metrics}, "the last values, not late ones"


def test_hello_is_said_often_while_the_vhub_is_gone_and_at_once_when_it_is_there() -> None:
    air = Storm()
    ear = air.enter("ear", 0)
    ear.hub_gone(air.now_ns)
    published(ear)
    for number in range(3):
        assert ear.deadline_ns() == air.now_ns + number * AWAY_AGAIN_NS
        ear.wake(ear.deadline_ns())
        assert [message.channel for message in published(ear)] == [channels.CLIENT_HELLO]
    ear.hub_here(air.now_ns + 1)
    assert ear.deadline_ns() == air.now_ns + 1
    assert not ear.lost
    deadlines = DEPLOYMENT.deadlines
    ear.wake(air.now_ns + deadlines.start_ns)
    assert not ear.lost, "its next process may be starting"
    ear.wake(air.now_ns + deadlines.vhub_back_ns)
    assert ear.lost


def test_a_vhub_that_comes_back_with_another_run_is_not_gone_on_with() -> None:
    air = Storm()
    air.start()
    ear = air.enter("ear", 0)
    air.die([ear])
    air.records = []
    air.come_back("run-2")
    air.carry(ear)
    assert ear.refusal == "the vHub is back with run run-2, this client was in run-1"


def test_what_waits_to_be_recorded_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "UPLINKS_KEPT_MAX", 5)
    air = Storm()
    air.start()
    ear = air.enter("ear", 0)
    ear.hub_gone(air.now_ns)
    for tick in range(4):
        ear.send(packets_of(tick))
    assert ear.statistics().sent == 4 and ear.statistics().unsent == 4
    air.come_back()
    air.settle(ear)
    air.close()
    air.settle(ear)
    state = air.hub.state
    assert state is not None and state.members["ear"].sequence == 4
    ear.send(packets_of(9))
    assert ear.statistics().sent == 6, "there is room again"


def test_a_free_running_client_reports_again_what_a_vhub_has_lost_and_late_reports_count_no_more() -> None:
    air = Storm()
    air.start()
    ear = air.enter("ear", 0)
    ear.report({"trips": 1.0, "way": 2.0})
    air.carry(ear)
    air.die([ear])  # before a tick was closed
    ear.report({"turns": 5.0})
    air.come_back()
    air.settle(ear)
    ear.report({"trips": 2.0})
    late = published(ear)
    ear.report({"trips": 3.0})
    air.carry(ear)
    carry_up(air, late)
    ear.report({"trips": 3.0})
    assert published(ear) == [], "nothing is new"
    air.close()
    state = air.hub.state
    assert state is not None and state.metrics.reported == {"ear": {"trips": 3.0, "way": 2.0, "turns": 5.0}}


def test_the_end_of_a_run_is_heard_whatever_its_number() -> None:
    """A vHub that has lost the end of its journal goes on counting downlinks from before those that were sent."""
    air = Storm()
    air.start()
    ear = air.enter("ear", 0)
    for _ in range(11):
        air.close()
    air.carry(ear)
    arrived, tick = len(ear.arrivals), ear.tick
    ear.receive(channels.DOWN, "ear", encode(Down(1, 3, 0, [], False)), air.now_ns)
    assert (ear.ended, ear.statistics().repeated) == (False, 1)
    ear.receive(channels.DOWN, "ear", encode(Down(1, 3, 0, [], True)), air.now_ns)
    assert ear.ended and (len(ear.arrivals), ear.tick) == (arrived, tick)


def test_a_welcome_that_nobody_asked_for_changes_nothing() -> None:
    air = Storm()
    ear = air.enter("ear", 0)
    before = ear.welcome
    assert before is not None
    forged = ClientWelcome("ear", "one", "hub", 99, 99, NAME, TEXT, "run-1")
    ear.receive(channels.CLIENT_WELCOME, "ear", encode(forged), air.now_ns)
    assert ear.welcome is before and not [m for m in published(ear) if m.channel.plane is Plane.RADIO]


def test_the_answer_to_a_hello_of_before_is_none() -> None:
    """One that a vHub said which is gone again, and that comes late."""
    air = Storm()
    air.start()
    ear = air.enter("ear", 0)
    air.die([ear])
    air.come_back()
    ear.wake(air.now_ns + AWAY_AGAIN_NS)
    for message in published(ear):
        air.tell(message.channel, message.name, message.payload)
    (late,) = [said for said in air.said() if said.channel is channels.CLIENT_WELCOME]
    air.die([ear])
    air.come_back()
    ear.receive(channels.CLIENT_WELCOME, "ear", late.payload, air.now_ns)
    assert ear.is_away
    air.settle(ear)
    assert ear.statistics().returns == 1 and air.hub.sessions.by_name["ear"].is_present


# --- late hellos, and two of one name ---------------------------------------------------------------------------------

PERIOD: Final = 1
TAKEN: Final = "a client hand is already here"


def carry_up(air: Air, messages: list[Publish]) -> None:
    for message in messages:
        air.tell(message.channel, message.name, message.payload)


def play(air: Air, core: ClientCore, ticks: int) -> None:
    """Let a client play some ticks, each of which waits for it."""
    for _ in range(ticks):
        if core.go is None:
            air.close()
            air.carry(core)
        assert core.go is not None and not core.refusal
        core.done([])
        air.carry(core)
        assert air.closed() == core.tick


def lost(air: Storm) -> list[Publish]:
    """A client plays, the vHub dies, and the client too: return its last hello, which may come later."""
    dead = air.enter("hand", PERIOD, boot="dead")
    air.start()
    play(air, dead, 3)
    air.die([dead])
    dead.wake(air.now_ns)
    return published(dead)


def test_whoever_says_a_late_hello_only_is_not_waited_for_without_end() -> None:
    air = Storm()
    late_hello = lost(air)
    air.come_back()
    carry_up(air, late_hello)
    session = air.hub.sessions.by_name["hand"]
    assert session.boot == "dead" and session.away_ns > air.now_ns
    air.hub.wake(session.away_ns)
    assert air.hub.lost == "lost hand: its connection closed"


@pytest.mark.parametrize("first", [0, 1])
def test_of_two_that_live_the_first_that_joins_is_in_and_the_other_one_is_refused(first: int) -> None:
    air = Storm()
    lost(air)
    air.come_back()
    twins = [ClientCore("hand", boot, air.now_ns) for boot in ("one", "two")]
    for twin in twins:
        air.carry(twin)
        assert twin.welcome is not None
    winner, loser = twins[first], twins[1 - first]
    winner.join(PERIOD, [])
    air.carry(winner)
    loser.join(PERIOD, [])
    lost_join = published(loser)  # the refusal of this one is lost: it joins again
    carry_up(air, lost_join)
    air.said()
    air.now_ns = loser.deadline_ns()
    air.carry(loser)
    assert (winner.refusal, loser.refusal) == ("", TAKEN)
    third = ClientCore("hand", "three", air.now_ns)
    air.carry(third)
    assert (third.welcome, third.refusal) == (None, TAKEN)
    play(air, winner, 5)
    assert air.hub.sessions.by_name["hand"].boot == winner.boot


def test_a_client_that_is_in_takes_no_refusal_of_a_hello_and_one_that_is_away_none_of_a_join() -> None:
    air = Storm()
    hand = air.enter("hand", PERIOD)
    air.start()
    play(air, hand, 1)
    hand.receive(channels.CLIENT_REFUSAL, "hand", encode(ClientRefusal("hand", "one", TAKEN)), air.now_ns)
    assert not hand.refusal
    air.die([hand])
    hand.receive(channels.CLIENT_REFUSAL, "hand", encode(ClientRefusal("hand", "one", TAKEN, joins=True)), air.now_ns)
    assert not hand.refusal


def test_a_late_join_of_a_dead_process_takes_no_name() -> None:
    """It answers the welcome of a vHub before: it says nothing of who lives, and keeps nobody out."""
    air = Storm()
    dead = air.enter("hand", PERIOD, boot="dead")
    air.start()
    play(air, dead, 3)
    dead._say_join()
    joins = published(dead)
    air.die([dead])
    dead.wake(air.now_ns)
    late = [*published(dead), *joins]
    assert [message.channel for message in late] == [channels.CLIENT_HELLO, channels.UP]
    air.come_back()
    carry_up(air, late)
    assert not air.hub.sessions.by_name["hand"].is_present
    living = ClientCore("hand", "living", air.now_ns)
    air.carry(living)
    living.join(PERIOD, [])
    air.carry(living)
    play(air, living, 5)
