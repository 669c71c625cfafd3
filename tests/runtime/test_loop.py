"""The loop of every process: what it performs, in which order, and when it goes round."""

from __future__ import annotations

import logging
from typing import Any, Final

import pytest

from foosim.protocol import channels
from foosim.protocol.actions import Journal, Log, Publish
from foosim.protocol.channels import ALIVE, CHANNELS, Channel, Plane
from foosim.runtime.journal import JournalError
from foosim.runtime.loop import Loop, channel_of
from foosim.runtime.transport.inbox import Inbox

LATER_NS: Final = 2**62
LOG: Final = logging.getLogger("test_loop")


class Script:
    """A core that notes what it is told, and answers a message with what the test put up."""

    def __init__(self) -> None:
        self.actions: list[Any] = []
        self.told: list[tuple[object, ...]] = []
        self.answers: list[Any] = []

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        self.told.append((channel.name, name, payload))
        self.actions += self.answers

    def wake(self, now_ns: int) -> None:
        self.told.append(("wake",))


class Recorder:
    """Stands where wire, journal and log are, and notes the order in which they are used."""

    def __init__(self, plane: Plane) -> None:
        self.plane = plane
        self.did: list[tuple[str, ...]] = []

    def put(self, channel: Channel, name: str, payload: bytes) -> None:
        self.did.append(("put", channel.key_for(name), payload.decode()))

    def append(self, record: bytes) -> None:
        self.did.append(("append", record.decode()))


def make(core: Script, inbox: Inbox, deadline_ns: int = LATER_NS) -> tuple[Loop, Recorder]:
    """A loop whose wire and journal are one recorder."""
    loop = Loop(core, inbox, LOG, lambda now_ns: deadline_ns)
    recorder = Recorder(Plane.SIMULATION)
    loop.connect(recorder)  # type: ignore[arg-type]
    loop.journal = recorder
    return loop, recorder


def test_a_message_is_received_then_the_turn_comes_then_the_actions_in_their_order() -> None:
    core, inbox = Script(), Inbox(10)
    loop, recorder = make(core, inbox)
    loop.go_round()  # a loop begins with a wake
    assert core.told == [("wake",)]
    core.told.clear()
    core.answers = [Journal(b"one"), Publish(channels.ORDER, "supervisor", b"two"), Journal(b"three")]
    loop.turn = lambda now_ns: core.told.append(("turn",))
    inbox.offer((channels.PART.key, "red", b"part"))
    loop.go_round()
    assert core.told == [("part", "red", b"part"), ("turn",)]
    assert recorder.did == [("append", "one"), ("put", "foosim/simulation/order", "two"), ("append", "three")]
    assert core.actions == []


def test_who_comes_and_goes_is_told_beside_the_core() -> None:
    core, inbox = Script(), Inbox(10)
    loop, _ = make(core, inbox)
    loop.go_round()
    core.told.clear()
    seen: list[tuple[Plane, str, bool]] = []
    loop.on_alive = lambda plane, name, is_alive: seen.append((plane, name, is_alive))
    inbox.offer((ALIVE[Plane.SIMULATION], "red", b"+"))
    inbox.offer((ALIVE[Plane.RADIO], "player", b"-"))
    inbox.offer(("foosim/unknown", "x", b""))
    loop.go_round()
    assert seen == [(Plane.SIMULATION, "red", True), (Plane.RADIO, "player", False)]
    assert core.told == []


def test_a_deadline_that_has_come_wakes_the_core_without_a_message() -> None:
    core, inbox = Script(), Inbox(10)
    loop, recorder = make(core, inbox, deadline_ns=0)
    core.actions = [Publish(channels.WANT, "red", b"again")]
    for _ in range(3):
        loop.go_round()
    assert core.told == [("wake",)] * 3
    assert recorder.did == [("put", "foosim/simulation/want/red", "again")]


def test_it_ends_when_it_is_told_to_while_it_sleeps() -> None:
    core, inbox = Script(), Inbox(10)
    loop, _ = make(core, inbox)
    rounds: list[int] = []

    def is_over() -> bool:
        rounds.append(len(rounds))
        inbox.wake()
        return len(rounds) > 3

    loop.run(is_over)
    assert len(rounds) == 4


def test_what_is_said_is_logged_and_what_only_one_process_has_is_its_own(caplog: pytest.LogCaptureFixture) -> None:
    core, inbox = Script(), Inbox(10)
    loop, recorder = make(core, inbox)
    said: list[Log] = []
    others: list[object] = []
    loop.on_log = said.append
    loop.other = others.append
    core.actions = [Log("warning", "late"), "something else"]
    with caplog.at_level(logging.INFO, "test_loop"):
        loop.perform()
    assert [(record.levelname, record.message) for record in caplog.records] == [("WARNING", "late")]
    assert said == [Log("warning", "late")]
    assert others == ["something else"]
    assert recorder.did == []


def test_a_journal_that_fails_keeps_what_comes_after_from_being_said() -> None:
    core, inbox = Script(), Inbox(10)
    loop, recorder = make(core, inbox)

    class Full:
        def append(self, record: bytes) -> None:
            raise OSError("no space left")

    loop.journal = Full()
    core.actions = [Journal(b"one"), Publish(channels.ORDER, "supervisor", b"two")]
    with pytest.raises(OSError, match="no space left"):
        loop.perform()
    assert recorder.did == []


@pytest.mark.parametrize("channel", CHANNELS, ids=lambda channel: channel.key)
def test_a_key_gives_its_channel_and_name_back(channel: Channel) -> None:
    name = "red" if "{name}" in channel.key else channel.writers
    assert channel_of(channel.key_for("red")) == (channel, name)


@pytest.mark.parametrize(
    "key", ["", "foosim", "foosim/simulation/part", "foosim/simulation/order/red", "foosim/simulation/part/a/b", "x/y"]
)
def test_any_other_key_gives_nothing(key: str) -> None:
    assert channel_of(key) is None


class FullDisk:
    """A journal that takes no more."""

    def append(self, record: bytes) -> None:
        raise JournalError(f"no room for {record.decode()}")


def test_what_follows_a_record_that_cannot_be_written_is_decided_by_the_process() -> None:
    """Told once, in its place among the actions: it may hold back what would have to be written first."""
    core, inbox = Script(), Inbox(10)
    loop, recorder = make(core, inbox)
    loop.journal = FullDisk()
    word = Publish(channels.DELIVERIES, channels.VHUB, b"unwritten")
    with pytest.raises(JournalError, match="no room for one"):
        core.actions = [Journal(b"one"), word]
        loop.perform()
    assert recorder.did == [], "nothing is spoken that was not written"
    told: list[str] = []

    def unwritten(error: JournalError) -> None:
        told.append(str(error))
        loop.holds_back = lambda said: said.channel is channels.DELIVERIES
        core.actions.append(Publish(channels.HEARTBEAT, channels.VHUB, b"ends"))

    loop.on_unwritten = unwritten
    core.actions = [Journal(b"one"), word, Journal(b"two")]
    loop.perform()
    assert told == ["no room for one"] and core.actions == []
    assert recorder.did == [("put", channels.HEARTBEAT.key_for(channels.VHUB), "ends")]
