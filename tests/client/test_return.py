"""A vHub that dies and comes back, as its clients see it: everything once, both ways, whatever was lost on the way."""

from __future__ import annotations

from collections.abc import Sequence
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
from foosim.protocol.messages import Build, ClientWelcome, Deliveries, Down
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import HubRecord, TickRecord
from foosim.vhub.state.resume import recall
from tests.client.test_core import DEPLOYMENT, NAME, TEXT, Air, published

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


PLANS: Final[tuple[tuple[tuple[int, bool, bool], ...], ...]] = (
    (),
    ((2, False, False),),
    ((20, True, False),),
    ((20, False, True),),
    ((20, True, True), (21, True, True), (23, False, False)),
    ((5, True, False), (30, False, True), (31, True, True), (59, True, False)),
)


@pytest.mark.parametrize("dies", PLANS)
def test_a_free_running_client_gets_and_sends_everything_once(dies: tuple[tuple[int, bool, bool], ...]) -> None:
    """(when, whether its last words are lost, whether the client's are)."""
    air = Storm()
    air.start()
    ear = air.enter("ear", 0)
    air.close()
    air.carry(ear)
    got: list[int] = []
    sent = 0
    plans = {tick: (unheard, unsaid) for tick, unheard, unsaid in dies}
    while air.tick < TICKS:
        unheard, unsaid = plans.pop(air.tick, (None, None))
        ear.send(packets_of(air.tick))
        sent += 2
        if unheard is not None:
            if not unsaid:
                for message in published(ear):
                    air.tell(message.channel, message.name, message.payload)
            air.close()
            if unheard:
                air.said()  # written, and nobody heard it
            air.die([ear])
            ear.send(packets_of(air.tick))
            sent += 2
            air.come_back()
            air.settle(ear)
        else:
            air.carry(ear)
            air.close()
            air.carry(ear)
        got += [int(packet.payload) for packet in ear.arrivals]
        ear.arrivals.clear()
    air.settle(ear)
    got += [int(packet.payload) for packet in ear.arrivals]
    state = air.hub.state
    assert state is not None and state.members["ear"].sequence >= sent - 4, "the last ones wait for another tick"
    assert got == list(range(0, state.closed + 1, 5)), "each sample once, in order"
    assert ear.statistics().missing == 0 and ear.statistics().returns == len(dies)
    delivered = [packet.sequence for one in deliveries_of(air.records) for packet in one.packets]
    assert sorted(delivered) == list(range(1, len(delivered) + 1)) and len(delivered) >= sent - 6, "each packet once"
    assert len(ear._unrecorded) <= 4, "what is recorded is not kept"


def deliveries_of(records: Sequence[bytes]) -> list[Deliveries]:
    """The deliveries of all ticks that are written."""
    found = [decode_any(HubRecord, raw) for raw in records]
    ticks = {record.tick: decode(Deliveries, record.deliveries) for record in found if isinstance(record, TickRecord)}
    return [one for _, one in sorted(ticks.items())]


def test_a_client_whose_process_dies_too_goes_on_with_its_numbers() -> None:
    air = Storm()
    air.start()
    ear = air.enter("ear", 0)
    for tick in range(5):
        ear.send(packets_of(tick))
        air.carry(ear)
        air.close()
    air.carry(ear)
    recorded = ear.statistics().sent
    air.die([])
    air.come_back()
    other = ClientCore("ear", "another boot", air.now_ns)
    air.carry(other)
    assert other.welcome is not None and other.welcome.sequence == recorded
    other.join(0, [("red.goal", "encoder")])
    other.send(packets_of(9))
    air.carry(other)
    before = len(other.arrivals)
    for _ in range(3):
        air.close()
        air.carry(other)
    state = air.hub.state
    assert state is not None and state.members["ear"].sequence == recorded + 2 and state.refusals == {}
    assert [packet.payload for packet in list(other.arrivals)[before:]] == [b"%16d" % 5]
    assert other.statistics().missing == 0


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


def test_a_client_of_a_run_that_has_begun_waits_as_long_as_the_run() -> None:
    air = Storm()
    air.start()
    ear = air.enter("ear", 0)
    for _ in range(TICKS):
        air.close()
        air.carry(ear)
    assert ear.statistics().received
    ear.hub_gone(air.now_ns)
    ear.wake(air.now_ns + DEPLOYMENT.deadlines.vhub_back_ns - 1)
    assert not ear.lost
    ear.wake(air.now_ns + DEPLOYMENT.deadlines.vhub_back_ns)
    assert ear.lost, "a run does not wait longer for it either"


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


def test_what_is_recorded_is_told_to_a_client_that_hears_nothing() -> None:
    air = Storm()
    air.start()
    ear = ClientCore("ear", "one", air.now_ns)
    air.carry(ear)
    ear.join(0, [])
    air.carry(ear)
    air.close()
    ear.send(packets_of(1))
    air.carry(ear)
    air.close()
    assert len(ear._unrecorded) == 2
    air.settle(ear)
    assert len(ear._unrecorded) == 0 and ear.statistics().downlinks == 0


def test_a_welcome_that_nobody_asked_for_changes_nothing() -> None:
    air = Storm()
    ear = air.enter("ear", 0)
    before = ear.welcome
    assert before is not None
    forged = ClientWelcome("ear", "one", "hub", 99, 99, NAME, TEXT, "run-1")
    ear.receive(channels.CLIENT_WELCOME, "ear", encode(forged), air.now_ns)
    assert ear.welcome is before and not [m for m in published(ear) if m.channel.plane is Plane.RADIO]


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


def test_a_late_downlink_of_a_vhub_that_is_gone_is_no_answer_to_a_join() -> None:
    air = Storm()
    air.start()
    ear = air.enter("ear", 0)
    for _ in range(6):
        air.close()
    (late, *_) = [said for said in air.said() if said.channel is channels.DOWN]
    ear.receive(late.channel, "ear", late.payload, air.now_ns)
    air.die([ear])
    air.come_back()
    ear.wake(air.now_ns + AWAY_AGAIN_NS)
    for message in published(ear):
        air.tell(message.channel, message.name, message.payload)
    (welcome,) = [said for said in air.said() if said.channel is channels.CLIENT_WELCOME]
    ear.receive(channels.CLIENT_WELCOME, "ear", welcome.payload, air.now_ns)
    (lost,) = published(ear)
    assert lost.channel is channels.UP and not ear.is_away
    ear.receive(late.channel, "ear", late.payload, air.now_ns)
    air.settle(ear)
    assert air.hub.sessions.by_name["ear"].is_present


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
