"""The inbox: nothing lost or doubled between many writers and one reader, bounded, and never asleep over a message."""

import queue
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from foosim.runtime.transport.inbox import Inbox, Item

ALL = 1000
LONG_S = 600.0


class QueueSource:
    """A source in memory, as a session has one on the wire: messages and bells come through the same queue."""

    def __init__(self) -> None:
        self.queue: queue.SimpleQueue[Item | None] = queue.SimpleQueue()
        self.counts: list[int] = []

    def poll(self) -> list[Item]:
        items: list[Item] = []
        while True:
            try:
                item = self.queue.get_nowait()
            except queue.Empty:
                return items
            if item is not None:
                items.append(item)

    def wait(self, count: int) -> list[Item]:
        self.counts.append(count)
        items: list[Item] = []
        while len(items) < count and (item := self.queue.get()) is not None:
            items.append(item)
        return items + self.poll()

    def ring(self) -> None:
        self.queue.put(None)


@pytest.fixture(autouse=True)
def threads_change_often() -> Iterator[None]:
    """Let threads take turns after a few instructions instead of 5 ms, so that each meets the others half-way."""
    usual_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(usual_s)


class OfferedWhileLooking(list[Item]):
    """The offered items of an inbox, to which one comes at the reader's last look before it sleeps."""

    def __init__(self, inbox: Inbox, seen: bool) -> None:
        super().__init__()
        self.inbox = inbox
        self.seen = seen
        self.looks = 0

    def __bool__(self) -> bool:
        self.looks += 1
        before = len(self) > 0
        if self.looks == 2:
            self.inbox.offer(item("late"))
        return self.seen or before if self.looks == 2 else len(self) > 0


def item(name: str, number: int = 0) -> Item:
    return "part", name, number.to_bytes(4, "little")


def plain() -> Inbox:
    return Inbox(100 * ALL)


def with_source() -> Inbox:
    inbox = Inbox(100 * ALL)
    inbox.attach(QueueSource(), "part")
    return inbox


BOTH = pytest.mark.parametrize("make", [plain, with_source])


@BOTH
def test_without_a_message_it_returns_at_its_deadline(make: Callable[[], Inbox]) -> None:
    inbox = make()
    for _ in range(5):
        before_ns = time.monotonic_ns()
        assert inbox.take(0.004) == []
        assert time.monotonic_ns() - before_ns >= 4_000_000


@BOTH
def test_an_earlier_deadline_is_kept_after_a_later_one(make: Callable[[], Inbox]) -> None:
    """The thread that ends waits sleeps towards the deadline that it knows; a nearer one must wake it."""
    inbox = make()
    threading.Timer(0.05, inbox.offer, [item("a")]).start()
    assert inbox.take(2 * LONG_S) == [item("a")]
    before_s = time.monotonic()
    assert inbox.take(0.01) == []
    assert time.monotonic() - before_s < LONG_S


@BOTH
def test_nothing_is_lost_or_doubled_and_each_writers_order_is_kept(make: Callable[[], Inbox]) -> None:
    inbox = make()
    names = ["a", "b", "c", "d"]

    def write(name: str) -> None:
        for number in range(5 * ALL):
            assert inbox.offer(item(name, number))

    writers = [threading.Thread(target=write, args=(name,)) for name in names]
    for writer in writers:
        writer.start()
    read: list[Item] = []
    while len(read) < len(names) * 5 * ALL:
        items = inbox.take(LONG_S)
        assert items, "asleep over a message"
        read += items
    for name in names:
        assert [found for found in read if found[1] == name] == [item(name, number) for number in range(5 * ALL)]
    for writer in writers:
        writer.join()
    assert inbox.dropped == 0


@BOTH
def test_each_message_wakes_a_waiting_reader(make: Callable[[], Inbox]) -> None:
    """Ping-pong: an offer between the reader's last look and its sleep would stop it for the whole timeout."""
    inbox, back = make(), Inbox(1)

    def echo() -> None:
        for _ in range(5 * ALL):
            back.offer(inbox.take(LONG_S)[0])

    reader = threading.Thread(target=echo)
    reader.start()
    for number in range(5 * ALL):
        inbox.offer(item("a", number))
        assert back.take(LONG_S) == [item("a", number)]
    reader.join()


@BOTH
@pytest.mark.parametrize("seen", [False, True])
def test_an_offer_at_the_readers_last_look_is_not_slept_over(make: Callable[[], Inbox], seen: bool) -> None:
    """Whether the look just misses it or just sees it, in which case a ring stays behind."""
    inbox = make()
    for _ in range(3):
        inbox._items = OfferedWhileLooking(inbox, seen)
        assert inbox.take(None) == [item("late")]
    assert inbox.take(0.001) == []


def test_a_full_inbox_drops_the_newest_and_counts() -> None:
    inbox = Inbox(3)
    assert [inbox.offer(item("a", number)) for number in range(5)] == [True, True, True, False, False]
    assert inbox.take(0) == [item("a", 0), item("a", 1), item("a", 2)]
    assert inbox.offer(item("a", 5))
    assert inbox.take(0) == [item("a", 5)]
    assert inbox.dropped == 2


def test_more_from_the_source_than_the_limit_is_dropped_and_counted() -> None:
    inbox, source = Inbox(3), QueueSource()
    inbox.attach(source, "part")
    inbox.offer(item("timer"))
    for number in range(4):
        source.queue.put(item("wire", number))
    assert inbox.take(0) == [item("wire", 0), item("wire", 1), item("wire", 2)]
    assert inbox.dropped == 2 and not inbox.take(0)


@BOTH
def test_wake_ends_a_wait_or_the_next_one(make: Callable[[], Inbox]) -> None:
    inbox = make()
    inbox.wake()
    assert inbox.take(None) == []
    threading.Timer(0.02, inbox.wake).start()
    assert inbox.take(None) == []
    inbox.offer(item("a"))
    inbox.wake()
    assert inbox.take(None) == [item("a")]


def test_a_reader_that_never_waits_is_notified_and_misses_nothing() -> None:
    bell, read, names = threading.Semaphore(0), list[Item](), ("a", "b")
    inbox = Inbox(2 * ALL, bell.release)

    def write(name: str) -> None:
        for number in range(ALL):
            assert inbox.offer(item(name, number))

    writers = [threading.Thread(target=write, args=(name,)) for name in names]
    for writer in writers:
        writer.start()
    while len(read) < 2 * ALL:
        assert bell.acquire(timeout=LONG_S)
        read += inbox.take(0)
    for writer in writers:
        writer.join()
    assert sorted(read) == sorted(item(name, number) for name in names for number in range(ALL))
    while bell.acquire(blocking=False):  # of an item that a take for another one had taken
        assert inbox.take(0) == []
    inbox.offer(item("a"))
    inbox.offer(item("b"))
    assert bell.acquire(blocking=False) and not bell.acquire(blocking=False), "one take is for both"
    inbox.wake()
    assert bell.acquire(blocking=False)


def test_a_signal_handler_may_wake_the_reader_that_it_interrupts() -> None:
    inbox = Inbox(3)
    old = signal.signal(signal.SIGALRM, lambda number, frame: inbox.wake())
    try:
        for _ in range(20):
            signal.setitimer(signal.ITIMER_REAL, 0.002)
            assert inbox.take(None) == []
    finally:
        signal.signal(signal.SIGALRM, old)


def test_a_reader_goes_on_without_its_source() -> None:
    inbox = with_source()
    read: list[list[Item]] = []
    reader = threading.Thread(target=lambda: read.append(inbox.take(None)))
    reader.start()
    inbox.detach()
    assert inbox.offer(item("a"))
    reader.join()
    assert read == [[item("a")]]
    assert inbox.take(0.001) == []


def test_what_others_send_does_not_wake_a_reader_that_lacks_something() -> None:
    """It comes with the next take. `lacking` is a hint: one that has no queue of its own holds nothing back."""
    inbox, sources = Inbox(3 * ALL), {channel: QueueSource() for channel in ("order", "part", "deliveries")}
    for channel, source in sources.items():
        inbox.attach(source, channel)
    order, part, deliveries = (("order", "all", b""), ("part", "blue", b""), ("deliveries", "all", b""))
    sources["part"].queue.put(part)
    assert inbox.take(LONG_S, "deliveries") == [part]

    read: list[list[Item]] = []
    reader = threading.Thread(target=lambda: read.append(inbox.take(LONG_S, "deliveries")))
    reader.start()
    while not inbox._waiting:
        time.sleep(0)
    sources["order"].queue.put(order)
    sources["part"].queue.put(part)
    sources["deliveries"].queue.put(deliveries)
    reader.join()
    assert read == [[deliveries]]
    assert inbox.take(LONG_S, "deliveries") == [order, part]

    sources["order"].queue.put(order)
    assert inbox.take(LONG_S, "unknown") == [order]
    assert inbox.take(0.002, "part") == []


def test_fewer_than_the_reader_lacks_do_not_wake_it() -> None:
    inbox, source = Inbox(ALL), QueueSource()
    inbox.attach(source, "part")
    read: list[list[Item]] = []
    for wanted in (2, 3):
        reader = threading.Thread(target=lambda count=wanted: read.append(inbox.take(LONG_S, "part", count)))
        reader.start()
        while not inbox._waiting:
            time.sleep(0)
        for number in range(wanted):
            source.queue.put(item("a", number))
        reader.join()
    assert read == [[item("a", number) for number in range(wanted)] for wanted in (2, 3)]
    assert inbox.take(0.002) == inbox.take(0.002, "other", 4) == []
    assert source.counts[:2] == [2, 3]
    assert set(source.counts[2:]) == {1}


def test_what_there_is_of_the_lacking_comes_at_the_deadline_or_with_an_offer() -> None:
    inbox, source = Inbox(ALL), QueueSource()
    inbox.attach(source, "part")
    for end in (lambda: inbox.offer(item("timer")), inbox.wake, lambda: None):
        read: list[list[Item]] = []
        reader = threading.Thread(target=lambda read=read: read.append(inbox.take(0.1, "part", 2)))
        reader.start()
        while not inbox._waiting:
            time.sleep(0)
        source.queue.put(item("a"))
        end()
        reader.join()
        assert [*read[0], *inbox.take(0)][0] == item("a")
        assert inbox.take(0) == []


def test_an_offer_wakes_a_reader_whatever_it_lacks() -> None:
    inbox = Inbox(ALL)
    for channel in ("order", "part"):
        inbox.attach(QueueSource(), channel)
    for lacking in ("order", "part", "other", ""):
        threading.Timer(0.01, inbox.offer, [item("timer")]).start()
        assert inbox.take(LONG_S, lacking) == [item("timer")]
