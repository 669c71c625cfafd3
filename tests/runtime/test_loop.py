"""The loop of every process: what it performs, in which order, and when it goes round."""

from __future__ import annotations

import logging
from typing import Any, Final

import pytest

from foosim.protocol import channels
from foosim.protocol.actions import Journal, Log, Publish
from foosim.protocol.channels import ALIVE, Channel, Plane
from foosim.runtime.journal import JournalError
from foosim.runtime.roles.bus import Bus
from foosim.runtime.roles.loop import Loop
from foosim.runtime.roles.role import Role
from foosim.runtime.roles.wire import Wire, presence_channel
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


def make(core: Script, inbox: Inbox, deadline_ns: int = LATER_NS) -> tuple[Loop, Role, Recorder]:
    """A loop with one role, whose wire and journal are one recorder."""
    role = Role("script", core, LOG, lambda now_ns: deadline_ns)
    recorder = Recorder(Plane.SIMULATION)
    role.connect(recorder)  # type: ignore[arg-type]
    role.journal = recorder
    loop = Loop(inbox, LOG)
    loop.add(role)
    return loop, role, recorder


def test_a_message_is_received_then_the_turn_comes_then_the_actions_in_their_order() -> None:
    core, inbox = Script(), Inbox(10)
    loop, role, recorder = make(core, inbox)
    loop.go_round()  # a loop begins with a wake
    assert core.told == [("wake",)]
    core.told.clear()
    core.answers = [Journal(b"one"), Publish(channels.ORDER, "supervisor", b"two"), Journal(b"three")]
    role.turn = lambda now_ns: core.told.append(("turn",))
    inbox.offer((channels.PART.key, "red", b"part"))
    loop.go_round()
    assert core.told == [("part", "red", b"part"), ("turn",)]
    assert recorder.did == [("append", "one"), ("put", "foosim/simulation/order", "two"), ("append", "three")]
    assert core.actions == []


def test_who_comes_and_goes_is_told_beside_the_core() -> None:
    core, inbox = Script(), Inbox(10)
    loop, role, _ = make(core, inbox)
    loop.go_round()
    core.told.clear()
    seen: list[tuple[Plane, str, bool]] = []
    role.on_alive = lambda plane, name, is_alive: seen.append((plane, name, is_alive))
    inbox.offer((presence_channel(Plane.SIMULATION, "script"), "red", b"+"))
    inbox.offer((presence_channel(Plane.RADIO, "script"), "player", b"-"))
    inbox.offer(("foosim/unknown", "x", b""))
    loop.go_round()
    assert seen == [(Plane.SIMULATION, "red", True), (Plane.RADIO, "player", False)]
    assert core.told == []


def test_a_deadline_that_has_come_wakes_the_core_without_a_message() -> None:
    core, inbox = Script(), Inbox(10)
    loop, _role, recorder = make(core, inbox, deadline_ns=0)
    core.actions = [Publish(channels.WANT, "red", b"again")]
    for _ in range(3):
        loop.go_round()
    assert core.told == [("wake",)] * 3
    assert recorder.did == [("put", "foosim/simulation/want/red", "again")]


def test_what_is_said_is_logged_and_what_only_one_process_has_is_its_own(caplog: pytest.LogCaptureFixture) -> None:
    core, inbox = Script(), Inbox(10)
    _loop, role, recorder = make(core, inbox)
    said: list[Log] = []
    others: list[object] = []
    role.on_log = said.append
    role.other = others.append
    core.actions = [Log("warning", "late"), "something else"]
    with caplog.at_level(logging.INFO, "test_loop"):
        role.perform()
    assert [(record.levelname, record.message) for record in caplog.records] == [("WARNING", "late")]
    assert said == [Log("warning", "late")]
    assert others == ["something else"]
    assert recorder.did == []


def test_a_journal_that_fails_keeps_what_comes_after_from_being_said() -> None:
    core, inbox = Script(), Inbox(10)
    _loop, role, recorder = make(core, inbox)

    class Full:
        def append(self, record: bytes) -> None:
            raise OSError("no space left")

    role.journal = Full()
    core.actions = [Journal(b"one"), Publish(channels.ORDER, "supervisor", b"two")]
    with pytest.raises(OSError, match="no space left"):
        role.perform()
    assert recorder.did == []


class FullDisk:
    """A journal that takes no more."""

    def append(self, record: bytes) -> None:
        raise JournalError(f"no room for {record.decode()}")


def test_what_follows_a_record_that_cannot_be_written_is_decided_by_the_process() -> None:
    """Told once, in its place among the actions: it may hold back what would have to be written first."""
    core, inbox = Script(), Inbox(10)
    _loop, role, recorder = make(core, inbox)
    role.journal = FullDisk()
    word = Publish(channels.DELIVERIES, channels.VHUB, b"unwritten")
    with pytest.raises(JournalError, match="no room for one"):
        core.actions = [Journal(b"one"), word]
        role.perform()
    assert recorder.did == [], "nothing is spoken that was not written"
    told: list[str] = []

    def unwritten(error: JournalError) -> None:
        told.append(str(error))
        role.holds_back = lambda said: said.channel is channels.DELIVERIES
        core.actions.append(Publish(channels.HEARTBEAT, channels.VHUB, b"ends"))

    role.on_unwritten = unwritten
    core.actions = [Journal(b"one"), word, Journal(b"two")]
    role.perform()
    assert told == ["no room for one"] and core.actions == []
    assert recorder.did == [("put", channels.HEARTBEAT.key_for(channels.VHUB), "ends")]


# --- several roles ---------------------------------------------------------------------------------------------------


class Speaker(Script):
    """A core that answers each message that it reads with the next of its own."""

    def __init__(self, name: str, diary: list[tuple[str, str]], answers: list[list[Publish]]) -> None:
        super().__init__()
        self._name, self._diary, self._next = name, diary, answers

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        self._diary.append((self._name, payload.decode()))
        if self._next:
            self.actions += self._next.pop(0)


class Far:
    """Stands where a session is: nobody is connected to it."""

    is_open_router = False

    def __init__(self) -> None:
        self.did: list[tuple[str, str]] = []

    def subscribe(self, key: str, channel: str, inbox: Inbox) -> None:
        self.did.append(("subscribe", key))

    def publisher(self, key: str, blocking: bool) -> Far:
        return self

    def put(self, payload: bytes) -> None:
        self.did.append(("put", payload.decode()))

    def end_alive(self, key: str) -> None:
        self.did.append(("end alive", key))


def together(diary: list[tuple[str, str]], answers: dict[str, list[list[Publish]]]) -> tuple[Loop, Inbox, Far]:
    """A loop with a supervisor and the nodes blue and red, in this order, joined by a bus."""
    inbox, bus, far = Inbox(10), Bus(), Far()
    loop = Loop(inbox, LOG, bus)
    for name, reads in (("supervisor", channels.SUPERVISOR_READS), *((one, channels.NODE_READS) for one in NODES)):
        role = Role(name, Speaker(name, diary, answers.get(name, [])), LOG, lambda now_ns: LATER_NS)
        wire = Wire(far, Plane.SIMULATION, inbox, name, bus)  # type: ignore[arg-type]
        role.connect(wire)
        wire.read(reads, channels.NODE_WAITS)
        loop.add(role)
    inbox.wake()
    loop.go_round()
    return loop, inbox, far


NODES: Final = ("blue", "red")


def test_roles_of_a_process_get_each_others_messages_in_a_fixed_order_and_the_network_gets_them_too() -> None:
    diary: list[tuple[str, str]] = []
    parts = {name: [[Publish(channels.PART, name, f"part of {name}".encode())]] for name in NODES}
    loop, inbox, far = together(diary, parts)
    inbox.offer((channels.ORDER.key, "supervisor", b"order"))
    for _ in range(3):
        inbox.wake()
        loop.go_round()
    assert diary == [
        ("blue", "order"),
        ("red", "order"),
        ("supervisor", "part of blue"),
        ("supervisor", "part of red"),
        ("blue", "part of red"),
        ("red", "part of blue"),
    ]
    assert [did for did in far.did if did[0] == "put"] == [("put", "part of blue"), ("put", "part of red")]


def test_a_loop_with_messages_between_its_roles_does_not_sleep_and_works_when_none_is_left() -> None:
    diary: list[tuple[str, str]] = []
    loop, inbox, _ = together(diary, {"red": [[Publish(channels.WANT, "red", b"again")]]})
    left = ["first", "second"]

    def work(now_ns: int) -> bool:
        diary.append(("red", left.pop(0) if left else "no work"))
        return diary[-1][1] != "no work"

    loop.roles[2].work = work
    inbox.offer((channels.ORDER.key, "supervisor", b"order"))
    loop.go_round()
    assert diary == [("blue", "order"), ("red", "order")], "a message is on the bus"
    loop.go_round()  # would sleep for ever
    assert diary[2:] == [("supervisor", "again"), ("blue", "again"), ("red", "first")]
    for _ in range(2):
        loop.go_round()  # does not sleep either: there may be more work
    assert diary[5:] == [("red", "second"), ("red", "no work")]


def test_a_role_that_has_ended_gets_nothing_more_and_its_presence_ends() -> None:
    diary: list[tuple[str, str]] = []
    loop, inbox, far = together(diary, {})
    loop.remove(loop.roles[1])
    inbox.offer((channels.ORDER.key, "supervisor", b"order"))
    inbox.wake()
    loop.go_round()
    assert diary == [("red", "order")]
    assert ("end alive", ALIVE[Plane.SIMULATION].replace("{name}", "blue")) in far.did


def test_each_role_is_told_of_the_presence_that_it_watches() -> None:
    loop, inbox, _ = together([], {})
    seen: list[tuple[str, Plane, str, bool]] = []
    for role in loop.roles:
        role.on_alive = lambda plane, name, is_alive, who=role.name: seen.append((who, plane, name, is_alive))  # type: ignore[misc]
    inbox.offer((presence_channel(Plane.SIMULATION, "red"), "supervisor", b"-"))
    loop.go_round()
    assert seen == [("red", Plane.SIMULATION, "supervisor", False)]
