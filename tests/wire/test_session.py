"""Sessions over real sockets: what arrives, what is refused, who is there, and what an error says.

Nothing here waits and hopes: what has to happen is waited for with a generous end, and where a subscriber might not yet
be known to a publisher, the publisher repeats.
"""

import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field

import pytest

from foosim.protocol import channels
from foosim.runtime.roles.bus import Bus
from foosim.runtime.roles.wire import Wire
from foosim.runtime.transport.inbox import Inbox, Item
from foosim.runtime.transport.session import Publisher, Session
from tests.wire.test_run import free_port

LONG_S = 900.0
ANY_PORT = "tcp/127.0.0.1:0"


@dataclass
class Plane:
    """A router and what joins it; all are closed at the end of the test."""

    stack: ExitStack
    router: Session = field(init=False)

    def __post_init__(self) -> None:
        self.router = self.stack.enter_context(Session.router(ANY_PORT))

    def client(self) -> Session:
        return self.stack.enter_context(Session.client(self.router.locator, LONG_S))


@pytest.fixture
def plane() -> Iterator[Plane]:
    with ExitStack() as stack:
        yield Plane(stack)


@pytest.fixture
def inbox() -> Inbox:
    return Inbox(1000)


def put_until_heard(publisher: Publisher, *inboxes: Inbox, channel: str = "") -> None:
    """Repeat a message until all have it, then wait until all have had the last of the repeats."""
    for inbox in inboxes:
        tries = 0
        while not inbox.take(0.02, channel):
            publisher.put(b"hear me")
            tries += 1
            assert tries < LONG_S / 0.02, "not heard"
    publisher.put(b"the last")
    for inbox in inboxes:
        while (items := inbox.take(LONG_S, channel)) and items[-1][2] != b"the last":
            pass
        assert items, "not heard"


def take_all(inbox: Inbox, count: int, channel: str = "") -> list[Item]:
    """Take this many items, however many come at a time."""
    items: list[Item] = []
    while len(items) < count:
        more = inbox.take(LONG_S, channel)
        assert more, f"{len(items)} of {count} came"
        items += more
    return items


def read_key(key: str) -> tuple[str, str] | None:
    """Channel and name of w/CHANNEL/NAME; a channel `bad` is not known, one `wrong` is an error of ours."""
    _, channel, name = key.split("/")
    assert channel != "wrong", "a key that the table does not have"
    return None if channel == "bad" else (channel, name)


def test_roles_beside_the_router_wait_in_one_queue_for_all_that_others_publish(plane: Plane, inbox: Inbox) -> None:
    """In the order of arrival, over all channels; what one of these roles publishes does not come back."""
    bus = Bus()
    supervisor, hub = (
        Wire(plane.router, channels.Plane.SIMULATION, inbox, name, bus) for name in ("supervisor", "vhub")
    )
    supervisor.read(channels.SUPERVISOR_READS)
    hub.read(channels.VHUB_READS)
    assert not [thread.name for thread in threading.enumerate() if thread.name.startswith("receive")]
    node = plane.client()
    part, samples = (node.publisher(channel.key_for("red")) for channel in (channels.PART, channels.SAMPLES))
    put_until_heard(part, inbox)
    samples.put(b"samples")
    part.put(b"part")
    node.publisher("foosim/simulation/nothing/red").put(b"unknown")
    hub.put(channels.DELIVERIES, "vhub", b"deliveries")
    samples.put(b"more")
    assert take_all(inbox, 3) == [
        (channels.SAMPLES.key, "red", b"samples"),
        (channels.PART.key, "red", b"part"),
        (channels.SAMPLES.key, "red", b"more"),
    ]
    assert sum(receiver.refused for receiver in plane.router.receivers) == 1
    assert bus.pop()[2:4] == ("supervisor", channels.DELIVERIES)


def test_a_message_comes_with_its_channel_and_the_name_in_its_key(plane: Plane, inbox: Inbox) -> None:
    plane.client().subscribe("w/part/*", "part", inbox)
    publisher = plane.client().publisher("w/part/blue")
    put_until_heard(publisher, inbox)
    for number in range(500):
        publisher.put(bytes([number % 256]) * 1200)
    assert take_all(inbox, 500) == [("part", "blue", bytes([number % 256]) * 1200) for number in range(500)]
    assert inbox.dropped == 0


def test_a_session_does_not_hear_itself(plane: Plane, inbox: Inbox) -> None:
    """Not a subscriber, and not the reader that waits itself."""
    own = Inbox(1000)
    plane.router.subscribe("w/*/*", "all", inbox)
    plane.router.receive("w/part/*", "part", read_key, own)
    other = plane.client().publisher("w/part/other")
    plane.router.publisher("w/part/own").put(b"own")
    put_until_heard(other, inbox, own)
    plane.router.publisher("w/part/own").put(b"own")
    other.put(b"other")
    assert own.take(LONG_S) == [("part", "other", b"other")]
    assert inbox.take(LONG_S) == [("all", "other", b"other")]


def test_the_reader_waits_for_its_channels_itself(plane: Plane, inbox: Inbox) -> None:
    """Also for one whose key has no name in it."""
    reader, sender = plane.client(), plane.client()
    names = [("part", "blue"), ("order", "node"), ("commit", "vhub")]
    reader.receive("w/part/*", "part", read_key, inbox)
    reader.receive("w/order", "order", lambda key: ("order", "node") if key == "w/order" else None, inbox)
    reader.receive("w/commit/vhub", "commit", read_key, inbox)
    publishers = [sender.publisher(key) for key in ("w/part/blue", "w/order", "w/commit/vhub")]
    for (channel, _), publisher in zip(names, publishers, strict=True):
        put_until_heard(publisher, inbox, channel=channel)
    other = sender.publisher("w/commit/blue")
    for number in range(200):
        other.put(b"for another")
        for publisher in publishers:
            publisher.put(bytes([number]))
    items = take_all(inbox, 200, "part")
    while len(items) < 600:
        items += inbox.take(LONG_S, "commit" if ("commit", "vhub", bytes([199])) not in items else "order")
    for name in names:
        assert [item for item in items if item[:2] == name] == [(*name, bytes([number])) for number in range(200)]


def test_the_reader_sleeps_until_what_it_lacks_has_come(plane: Plane, inbox: Inbox) -> None:
    reader, sender = plane.client(), plane.client()
    for channel in ("part", "order"):
        reader.receive(f"w/{channel}/*", channel, read_key, inbox)
    part, order = sender.publisher("w/part/blue"), sender.publisher("w/order/all")
    put_until_heard(part, inbox, channel="part")
    put_until_heard(order, inbox, channel="order")
    read: list[list[Item]] = []
    reading = threading.Thread(target=lambda: read.append(inbox.take(LONG_S, "order", 2)))
    reading.start()
    while not inbox._waiting:
        time.sleep(0)
    part.put(b"other")
    for payload in (b"1", b"2"):
        order.put(payload)
    reading.join()
    assert read == [[("order", "all", b"1"), ("order", "all", b"2")]]
    assert inbox.take(LONG_S, "part") == [("part", "blue", b"other")]


def test_a_key_with_wildcards_is_refused_and_counted(plane: Plane, inbox: Inbox) -> None:
    """Zenoh delivers a message that is put on `w/part/*` to whoever reads `w/part/blue`."""
    reader = plane.client()
    other = Inbox(1000)
    reader.subscribe("w/part/*", "part", inbox)
    reader.receive("w/order/*", "order", read_key, other)
    sender = plane.client()
    part, named = sender.publisher("w/part/blue"), sender.publisher("w/order/blue")
    put_until_heard(part, inbox)
    put_until_heard(named, other)
    for key in ("w/part/*", "w/part/b$*", "w/order/*", "w/order/b$*"):
        sender.publisher(key).put(b"to everyone")
    part.put(b"end")
    named.put(b"end")
    assert inbox.take(LONG_S) == [("part", "blue", b"end")]
    assert other.take(LONG_S) == [("order", "blue", b"end")]
    assert sum(receiver.refused for receiver in reader.receivers) == 4


def test_an_unknown_key_and_an_error_of_ours_are_counted_and_end_nothing(plane: Plane, inbox: Inbox) -> None:
    reader = plane.client()
    reader.receive("w", "all", read_key, inbox)
    sender = plane.client()
    good = sender.publisher("w/order/all")
    put_until_heard(good, inbox)
    for key in ("w/bad/blue", "w/wrong/blue", "w/wrong/blue", "w/short"):
        sender.publisher(key).put(b"")
    good.put(b"end")
    assert inbox.take(LONG_S) == [("order", "all", b"end")]
    (receiver,) = reader.receivers
    assert (receiver.refused, receiver.errors) == (1, 3)
    assert "a key that the table does not have" in receiver.error


class Fragile(Inbox):
    """An inbox with a fault of ours, which some payload meets."""

    def offer(self, item: Item) -> bool:
        assert item[2] != b"fault", "a fault of ours"
        return super().offer(item)


def test_an_error_in_a_receiving_thread_is_counted_and_silences_nothing(plane: Plane) -> None:
    inbox = Fragile(1000)
    reader = plane.client()
    reader.subscribe("w/*", "w", inbox)
    publisher = plane.client().publisher("w/a")
    put_until_heard(publisher, inbox)
    for payload in (b"fault", b"fault", b"end"):
        publisher.put(payload)
    assert inbox.take(LONG_S) == [("w", "a", b"end")]
    (receiver,) = reader.receivers
    assert (receiver.errors, receiver.refused) == (2, 0)
    assert "a fault of ours" in receiver.error


def test_a_reader_that_does_not_read_loses_the_newest_and_nobody_waits_for_it(plane: Plane) -> None:
    slow, quick = Inbox(10), Inbox(1000)
    plane.client().subscribe("w/*", "w", slow)
    plane.client().subscribe("w/*", "w", quick)
    publisher = plane.client().publisher("w/a")
    put_until_heard(publisher, quick, slow)
    for number in range(200):
        publisher.put(bytes([number]))
    assert take_all(quick, 200) == [("w", "a", bytes([number])) for number in range(200)]
    while slow.dropped < 190:
        assert not quick.take(0.01)
    assert [payload for _, _, payload in slow.take(0)] == [bytes([number]) for number in range(10)]


def test_presence_is_told_to_those_who_come_later_and_ends_with_the_session(plane: Plane, inbox: Inbox) -> None:
    blue, red = plane.client(), plane.client()
    blue.declare_alive("w/alive/blue")
    while plane.router.alive("w/alive/*") != {"blue"}:
        pass
    plane.client().watch_alive("w/alive/*", "alive", inbox)
    assert inbox.take(LONG_S) == [("alive", "blue", b"+")]
    red.declare_alive("w/alive/red")
    assert inbox.take(LONG_S) == [("alive", "red", b"+")]
    assert red.alive("w/alive/*") == {"blue", "red"}
    blue.close()
    assert inbox.take(LONG_S) == [("alive", "blue", b"-")]
    assert red.alive("w/alive/*") == {"red"}


BE_PRESENT = """
import sys
from foosim.runtime.transport.session import Publisher, Session
session = Session.client(sys.argv[1], 900.0)
session.declare_alive("w/alive/blue")
session.publisher("w/part/blue").put(b"")
print("present", flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_a_process_that_is_gone_is_told_and_the_others_go_on(plane: Plane, inbox: Inbox, end: signal.Signals) -> None:
    """A killed one at once, a stopped one after its lease."""
    heard = Inbox(1000)
    plane.router.watch_alive("w/alive/*", "alive", inbox)
    plane.client().subscribe("w/part/*", "part", heard)
    publisher = plane.client().publisher("w/part/red")
    command = [sys.executable, "-c", BE_PRESENT, plane.router.locator]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        try:
            assert inbox.take(LONG_S) == [("alive", "blue", b"+")]
            assert child.stdout is not None
            child.stdout.readline()
            child.send_signal(end)
            assert inbox.take(LONG_S) == [("alive", "blue", b"-")]
        finally:
            child.kill()
    put_until_heard(publisher, heard)


def test_garbage_on_the_port_harms_nobody(plane: Plane, inbox: Inbox) -> None:
    plane.router.subscribe("w/*", "w", inbox)
    publisher = plane.client().publisher("w/a")
    put_until_heard(publisher, inbox)
    host, _, port = plane.router.locator.removeprefix("tcp/").partition(":")
    frames = [b"GET / HTTP/1.1\r\n\r\n", bytes(70_000), b"\xff" * 70_000, bytes(range(256)) * 300, b"\x05\x00\x01"]
    idle = [socket.create_connection((host, int(port))) for _ in range(20)]
    for frame in frames:
        with socket.create_connection((host, int(port))) as garbage:
            try:
                garbage.sendall(frame)
            except OSError:  # it closed before it had read all
                continue
    publisher.put(b"still here")
    assert inbox.take(LONG_S) == [("w", "a", b"still here")]
    put_until_heard(plane.client().publisher("w/newcomer"), inbox)
    for connection in idle:
        connection.close()


RUN_A_ROUTER = """
import sys
from foosim.runtime.transport.session import Publisher, Session
session = Session.router(sys.argv[1])
print("listening", flush=True)
sys.stdin.read()
"""


def test_links_presence_and_subscriptions_come_back_with_the_router(inbox: Inbox) -> None:
    locator = f"tcp/127.0.0.1:{free_port()}"

    def start() -> subprocess.Popen[bytes]:
        command = [sys.executable, "-c", RUN_A_ROUTER, locator]
        router = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert router.stdout is not None
        assert router.stdout.readline() == b"listening\n"
        return router

    def stop(router: subprocess.Popen[bytes]) -> None:
        with router:
            router.kill()

    router = start()
    try:
        with Session.client(locator, LONG_S) as blue, Session.client(locator, LONG_S) as red:
            heard = Inbox(1000)
            red.subscribe("w/*", "w", heard)
            red.watch_alive("alive/*", "alive", inbox)
            blue.declare_alive("alive/blue")
            publisher = blue.publisher("w/blue")
            put_until_heard(publisher, heard)
            assert inbox.take(LONG_S) == [("alive", "blue", b"+")]
            stop(router)
            assert inbox.take(LONG_S) == [("alive", "blue", b"-")]
            router = start()
            put_until_heard(publisher, heard)
            assert inbox.take(LONG_S) == [("alive", "blue", b"+")]
    finally:
        stop(router)
