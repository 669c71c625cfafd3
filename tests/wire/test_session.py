"""Sessions over real sockets: what arrives, what is refused, who is there, and what an error says.

Nothing here waits and hopes: what has to happen is waited for with a generous end, and where a subscriber might not yet
be known to a publisher, the publisher repeats.
"""

import os
import re
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
import zenoh

from foosim.protocol import session as sessions
from foosim.protocol.errors import BadValue
from foosim.protocol.inbox import Inbox, Item
from foosim.protocol.session import ConnectError, ListenError, Publisher, Session

LONG_S = 30.0
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


def run_python(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=2 * LONG_S, check=False)


def test_a_message_comes_with_its_channel_and_the_name_in_its_key(plane: Plane, inbox: Inbox) -> None:
    plane.client().subscribe("w/part/*", "part", inbox)
    publisher = plane.client().publisher("w/part/blue")
    put_until_heard(publisher, inbox)
    for number in range(500):
        publisher.put(bytes([number % 256]) * 1200)
    assert take_all(inbox, 500) == [("part", "blue", bytes([number % 256]) * 1200) for number in range(500)]
    assert inbox.statistics().dropped == 0


def test_messages_of_a_megabyte_arrive_whole(plane: Plane, inbox: Inbox) -> None:
    plane.client().subscribe("w/commit/*", "commit", inbox)
    publisher = plane.client().publisher("w/commit/all", express=False)
    put_until_heard(publisher, inbox)
    payload = os.urandom(1 << 20)
    publisher.put(payload)
    assert take_all(inbox, 1) == [("commit", "all", payload)]


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


def test_offers_wakes_and_deadlines_end_a_wait_on_the_wire(plane: Plane, inbox: Inbox) -> None:
    plane.client().receive("w/part/*", "part", read_key, inbox)
    threading.Timer(0.02, inbox.offer, [("timer", "one", b"")]).start()
    assert inbox.take(None) == [("timer", "one", b"")]
    threading.Timer(0.02, inbox.wake).start()
    assert inbox.take(None) == []
    assert [inbox.take(0.002) for _ in range(10)] == [[]] * 10


def test_a_signal_wakes_the_reader_that_waits_on_the_wire(plane: Plane, inbox: Inbox) -> None:
    plane.client().receive("w/part/*", "part", read_key, inbox)
    old = signal.signal(signal.SIGALRM, lambda number, frame: inbox.wake())
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.02)
        assert inbox.take(None) == []
    finally:
        signal.signal(signal.SIGALRM, old)


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
    assert reader.statistics().refused == 4


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
    statistics = reader.statistics()
    assert (statistics.refused, statistics.errors) == (1, 3)
    assert "a key that the table does not have" in statistics.error


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
    statistics = reader.statistics()
    assert (statistics.errors, statistics.refused) == (2, 0)
    assert "a fault of ours" in statistics.error


def test_a_reader_that_does_not_read_loses_the_newest_and_nobody_waits_for_it(plane: Plane) -> None:
    slow, quick = Inbox(10), Inbox(1000)
    plane.client().subscribe("w/*", "w", slow)
    plane.client().subscribe("w/*", "w", quick)
    publisher = plane.client().publisher("w/a")
    put_until_heard(publisher, quick, slow)
    for number in range(200):
        publisher.put(bytes([number]))
    assert take_all(quick, 200) == [("w", "a", bytes([number])) for number in range(200)]
    while slow.statistics().dropped < 190:
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
import sys, time
from foosim.protocol.session import Session
session = Session.client(sys.argv[1], 30.0)
session.declare_alive("w/alive/blue")
session.publisher("w/part/blue").put(b"")
print("present", flush=True)
time.sleep(600)
"""


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_a_process_that_is_gone_is_told_and_the_others_go_on(plane: Plane, inbox: Inbox, end: signal.Signals) -> None:
    """A killed one at once, a stopped one after its lease."""
    heard = Inbox(1000)
    plane.router.watch_alive("w/alive/*", "alive", inbox)
    plane.client().subscribe("w/part/*", "part", heard)
    publisher = plane.client().publisher("w/part/red")
    command = [sys.executable, "-c", BE_PRESENT, plane.router.locator]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as child:
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


def test_a_client_waits_for_a_router_that_starts_later() -> None:
    port = free_port()
    routers: list[Session] = []

    def start_the_router_after_one_attempt() -> bool:
        asked.append(len(routers))
        if len(asked) == 2:
            routers.append(Session.router(f"tcp/127.0.0.1:{port}"))
        return False

    asked: list[int] = []
    with Session.client(f"127.0.0.1:{port}", LONG_S, give_up=start_the_router_after_one_attempt) as client:
        assert client.locator == routers[0].locator == f"tcp/127.0.0.1:{port}"
    assert asked[:2] == [0, 0]
    routers[0].close()


RUN_A_ROUTER = """
import sys, time
from foosim.protocol.session import Session
session = Session.router(sys.argv[1])
print("listening", flush=True)
time.sleep(600)
"""


def test_links_presence_and_subscriptions_come_back_with_the_router(inbox: Inbox) -> None:
    locator = f"tcp/127.0.0.1:{free_port()}"

    def start() -> subprocess.Popen[bytes]:
        router = subprocess.Popen([sys.executable, "-c", RUN_A_ROUTER, locator], stdout=subprocess.PIPE)
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


def test_what_cannot_be_listened_on_is_said(plane: Plane) -> None:
    with pytest.raises(ListenError) as caught:
        Session.router(plane.router.locator)
    assert str(caught.value) == f"cannot listen on {plane.router.locator}: Address already in use"
    with pytest.raises(ListenError, match=r"cannot listen on tcp/192\.0\.2\.1:7447: Cannot assign requested address"):
        Session.router("192.0.2.1:7447")
    with pytest.raises(BadValue, match="not an address"):
        Session.router("udp/127.0.0.1:7447")


def test_a_router_that_does_not_answer_is_named() -> None:
    address = f"tcp/127.0.0.1:{free_port()}"
    with pytest.raises(ConnectError) as caught:
        Session.client(address, 0.1)
    assert str(caught.value) == (
        f"no router answers at {address} within 0.1 s: it is not started, listens elsewhere, or a firewall is between"
    )
    with pytest.raises(ConnectError, match=re.escape(f"gave up before a router answered at {address}")):
        Session.client(address, LONG_S, give_up=lambda: True)
    for wrong in (ANY_PORT, "0.0.0.0:7447", "127.0.0.1"):
        with pytest.raises(BadValue, match="not an address to connect to"):
            Session.client(wrong, LONG_S)


def test_closing_is_prompt_and_repeatable_and_the_reader_sleeps_on(
    plane: Plane, inbox: Inbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[int] = []
    wait = sessions._Source.wait

    def counted(source: sessions._Source, count: int) -> list[Item]:
        waits.append(count)
        return wait(source, count)

    monkeypatch.setattr(sessions._Source, "wait", counted)
    client = plane.client()
    client.receive("w/part/*", "part", read_key, inbox)
    client.subscribe("w/s/*", "w", inbox)
    client.declare_alive("alive/blue")
    read: list[list[Item]] = []
    reader = threading.Thread(target=lambda: read.append(inbox.take(None)))
    reader.start()
    assert client.close()
    assert client.close()
    assert inbox.offer(("timer", "one", b""))
    reader.join()
    assert read == [[("timer", "one", b"")]]
    assert len(waits) <= 1, "the reader went round and round in a queue that is gone"
    with pytest.raises(AssertionError, match="closed"):
        client.subscribe("w/s/*", "w", inbox)


def test_a_close_that_hangs_is_left_to_itself(plane: Plane, monkeypatch: pytest.MonkeyPatch) -> None:
    """Zenoh's own close hung for 10 s when packets were lost."""
    client, hang = plane.client(), threading.Event()
    close = client._close
    monkeypatch.setattr(client, "_close", lambda: (hang.wait(), close()))
    monkeypatch.setattr(sessions, "CLOSE_S", 0.01)
    assert client.close() is False
    hang.set()


LEAVE_IT_OPEN = """
import sys, time
from foosim.protocol.inbox import Inbox
from foosim.protocol.session import Session
session = Session.client(sys.argv[1], 30.0)
inbox = Inbox(10)
session.subscribe("w/*", "w", inbox)
session.receive("n/*", "n", lambda key: ("n", key), inbox)
session.watch_alive("alive/*", "alive", Inbox(10))
session.declare_alive("alive/blue")
assert inbox.take(0.001) == []

class Lingering:
    def __del__(self, sleep=time.sleep):
        sleep(0.3)  # the interpreter is ending: a thread that returns to it from Zenoh now aborts the process

sys.modules["lingering"] = Lingering()
sys.exit(int(sys.argv[2]))
"""


@pytest.mark.parametrize("code", [0, 3])
def test_a_process_that_forgets_to_close_ends_with_its_own_code(plane: Plane, code: int) -> None:
    done = run_python(LEAVE_IT_OPEN, plane.router.locator, str(code))
    assert (done.returncode, done.stderr) == (code, "")


FORK = """
import os, sys
from foosim.protocol.inbox import Inbox
from foosim.protocol.session import Session
session = Session.router("tcp/127.0.0.1:0")
publisher = session.publisher("w/a")
uses = [lambda: publisher.put(b""), lambda: session.subscribe("w/*", "w", Inbox(1)), session.close]
child = os.fork()
if child == 0:
    for use in uses:
        try:
            use()
        except AssertionError as error:
            assert "fork" in str(error)
        else:
            os._exit(1)
    os._exit(7)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def test_a_session_is_not_used_in_a_forked_child() -> None:
    """There a put returns, and nothing arrives."""
    done = run_python(FORK)
    assert (done.returncode, done.stderr) == (7, "")


CLIENT_RUNTIME = """
import os, sys
from foosim.protocol.session import CLIENT_RUNTIME, ROUTER_RUNTIME, Session, use_client_runtime
if sys.argv[1] == "client":
    use_client_runtime()
with Session.router("tcp/127.0.0.1:0") as router, Session.client(router.locator, 30.0) as client:
    assert client.alive("nobody/*") == set()
    threads = {open(f"/proc/self/task/{task}/comm").read().strip() for task in os.listdir("/proc/self/task")}
print(sorted(thread for thread in threads if thread.startswith("rx")), os.environ.get("ZENOH_RUNTIME"))
try:
    use_client_runtime()
except AssertionError:
    print("too late")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads the names of threads in /proc")
@pytest.mark.parametrize(("kind", "receiving"), [("client", 0), ("router", sessions.ROUTER_THREADS)])
def test_a_router_has_a_receiving_thread_for_each_stuck_link(kind: str, receiving: int) -> None:
    """With two, one stuck client stopped healthy ones for seconds."""
    done = run_python(CLIENT_RUNTIME, kind)
    threads = [f"rx-{number}" for number in range(receiving)]
    assert done.stdout.splitlines() == [f"{threads} None", "too late"], done.stderr


def test_settings_that_zenoh_does_not_take_as_they_are_stop_us() -> None:
    with pytest.raises(zenoh.ZError):
        sessions._open({"transport/link/tx/leese": 1000})
    undone = {"adminspace/permissions": {"read": True, "write": False}, "adminspace/permissions/write": True}
    with pytest.raises(AssertionError, match="adminspace/permissions"):
        sessions._open(undone)


def free_port() -> int:
    """Return a port that was free a moment ago."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])
