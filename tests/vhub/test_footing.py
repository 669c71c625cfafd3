"""A vHub that goes on from a journal: what it does before it may."""

from __future__ import annotations

from typing import Final

from foosim.common import limits
from foosim.protocol import channels
from foosim.protocol.actions import Action, Journal, Publish
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.hub_messages import ResumeGrant, ResumeState
from foosim.protocol.messages import Build, ClientHello, Deliveries, Epoch, Want
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import Closing, HeadRecord, HubRecord
from foosim.vhub.state.resume import recall
from tests.client.test_core import DEPLOYMENT, NAME, TEXT
from tests.client.test_return import Storm

CLOSED: Final = 7
Said = list[Action | Closing | Epoch]


class Waiting(Storm):
    """An air whose vHub was killed behind tick 7, and is back on a machine, with a lockstep client that is away."""

    def __init__(self, machine: str = "") -> None:
        super().__init__()
        self.start()
        self.hand = self.enter("hand", 5)
        for _ in range(CLOSED + 1):
            self.close()
            self.answer()
        assert self.closed() == CLOSED
        self.said()
        self.restart(machine)

    def restart(self, machine: str) -> None:
        self.hub = HubCore("boot-2", bytes(32), self.now_ns, machine=machine)
        self.tell(channels.BUILD, "vhub", encode(Build("vhub", "boot-2", "first", "run-1", NAME, TEXT, "fast")))
        self.hub.begin(recall(DEPLOYMENT, "run-1", self.records, None, limits.DOWNLINK_KEPT_NS), self.now_ns)

    def answer(self) -> None:
        """Let the client answer the Go that it gets, if it does."""
        self.carry(self.hand)
        if self.hand.go is not None:
            self.hand.done([])
            self.carry(self.hand)

    def waits(self) -> bool:
        return self.hub.handshake.waits

    def lost_machine(self) -> bool:
        return self.hub.handshake.lost_machine

    def take(self) -> Said:
        taken: Said = [*self.hub.actions]
        self.records += [action.record for action in taken if isinstance(action, Journal)]
        self.hub.actions.clear()
        return taken

    def begin(self, epoch: int, tick: int) -> None:
        owners = [(robot, "n1") for robot in DEPLOYMENT.robots]
        message = Epoch(epoch, tick, bytes(32), ["n1"], owners, b"")
        self.tell(channels.EPOCH, channels.SUPERVISOR, encode(message))

    def proceed(self, epoch: int, boot: str = "boot-2") -> None:
        self.tell(channels.RESUME_GRANT, "vhub", encode(ResumeGrant("vhub", boot, epoch)))


def published(said: Said, channel: channels.Channel) -> list[bytes]:
    return [action.payload for action in said if isinstance(action, Publish) and action.channel is channel]


def test_it_tells_where_it_stands_and_waits() -> None:
    air = Waiting()
    (told,) = [decode(ResumeState, payload) for payload in published(air.take(), channels.RESUME_STATE)]
    assert (told.boot, told.supervisor, told.epoch) == ("boot-2", "first", 1)
    assert told.waits and not told.lost_machine and told.final >= CLOSED + 1
    air.tick = CLOSED
    air.close()
    air.tell(channels.CLIENT_HELLO, "hand", encode(ClientHello("hand", "one", limits.PROTOCOL_VERSION, "", 1, 1)))
    air.tell(channels.WANT, "n1", encode(Want("n1", channels.DELIVERIES.name, CLOSED + 1, 1, [])))
    air.proceed(1, "boot-1")
    assert air.closed() == CLOSED and air.take() == [], "it takes no commit, lets nobody in, answers nobody"
    air.now_ns += limits.WANT_EVERY_NS_MAX
    air.hub.wake(air.now_ns)
    again = air.take()
    assert published(again, channels.RESUME_STATE) and not published(again, channels.WANT), "it asks whether it may"
    air.proceed(1)
    said = air.take()
    (last,) = [decode(Deliveries, raw) for raw in published(said, channels.DELIVERIES)]
    assert last.tick <= CLOSED + 1 <= last.last
    assert published(said, channels.WANT) and not air.waits()


def test_it_waits_for_the_epoch_in_which_it_may_proceed() -> None:
    air = Waiting()
    air.proceed(3)
    assert air.waits()
    air.begin(2, CLOSED)
    assert air.waits()
    air.begin(3, CLOSED)
    assert not air.waits()
    said = [decode(Deliveries, raw) for raw in published(air.take(), channels.DELIVERIES)]
    assert said[0].tick <= CLOSED + 1


def test_the_journal_names_another_machine_only_when_its_end_is_known() -> None:
    """A vHub that is killed before has lost it as well."""

    def named(said: Said) -> list[str]:
        heads = [decode_any(HubRecord, action.record) for action in said if isinstance(action, Journal)]
        return [head.machine for head in heads if isinstance(head, HeadRecord)]

    air = Waiting("first")
    assert not air.lost_machine(), "the journal names none"
    air.proceed(1)
    air.hub.actions.append(Journal(air.hub.head()))
    assert named(air.take())[-1] == "first"
    for _ in range(2):
        air.restart("second")
        assert air.lost_machine() and named(air.take()) == ["first"]
    air.proceed(1)
    assert named(air.take()) == ["second"]
    air.restart("second")
    assert not air.lost_machine()


def test_a_commit_of_an_older_epoch_does_not_count() -> None:
    """One that was on its way when the epoch began."""
    air = Waiting()
    air.take()
    air.begin(4, CLOSED)
    air.proceed(4)
    air.tick, air.epoch = CLOSED, 2
    air.close()
    assert air.closed() == CLOSED and air.hub.repeated > 0
    air.tick, air.epoch = CLOSED, 4
    air.close()
    assert air.closed() == CLOSED + 1
