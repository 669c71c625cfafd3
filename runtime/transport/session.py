"""A session on a plane; the only file that uses Zenoh.

The supervisor's session is the router of the simulation plane, the vHub's second one that of the radio plane. All
others are clients, which connect to one address and never listen. Scouting is off, so no links bypass a router.
Receiving threads only fill inboxes; they never decide, publish or call Zenoh.

Zenoh reports no loss to a sender and accepts many settings silently. So the settings that matter are set here, read
back and compared, and every message has the number of its tick or sequence.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import queue
import re
import threading
import time
import weakref
from collections.abc import Callable, Collection, Iterator
from itertools import chain, repeat
from typing import Any, Final

import zenoh

from foosim.common import limits
from foosim.common.addresses import parse_address, reachable
from foosim.common.closable import Closable
from foosim.common.errors import BadValue, Failed, show
from foosim.runtime.transport.inbox import Inbox, Item
from foosim.runtime.transport.settings import QUERY_S, Security, client_settings, holds, router_settings

KeyReader = Callable[[str], tuple[str, str] | None]
"""Returns the channel and the name in a key, or None for an unknown key."""

CLOSE_S: Final = 2.0
ATTEMPTS_S: Final = (0.5, 1.0, 2.0, 4.0, 8.0)
"""The times of attempts to connect, the last one repeated: a link with a long delay needs several round trips."""
GIVE_UP_S: Final = 0.1
"""The interval at which `give_up` is called, and signals are handled, during an attempt."""
ROUTER_THREADS: Final = 8
"""Each sender whose message waits for a stuck reader holds one receiving thread of the router. With Zenoh's two, a
stuck client stopped healthy ones for 9 s; with eight for 1.3 s, and nothing of theirs was lost."""
KEYS_KEPT: Final = 4096
BELL: Final = "-"
"""Last chunk of a bell's key, invalid as a name."""

ROUTER_RUNTIME: Final = f"(rx: (worker_threads: {ROUTER_THREADS}), acc: (handover: rx))"
"""The threads that receive also watch the sockets, so a message wakes one thread instead of two."""
CLIENT_RUNTIME: Final = "(rx: (handover: app), acc: (handover: app))"
_RUNTIME_VARIABLE: Final = "ZENOH_RUNTIME"
_runtime = ROUTER_RUNTIME
_opened = False


class ListenError(Failed):
    """The address cannot be listened on."""


class ConnectError(Failed):
    """No router answers at the address."""


def use_client_runtime() -> None:
    """Let the thread that watches the sockets receive, too: for a process that opens clients only, before it does.

    That spares a change of threads for each message. In a router, one stuck reader would stop that thread for all.
    """
    global _runtime  # noqa: PLW0603  # Zenoh has one runtime for the process, too
    assert not _opened, "Zenoh reads its runtime's settings at the first session"
    _runtime = CLIENT_RUNTIME


class _Attempt:
    """One attempt to connect. It has a thread of its own: Zenoh's call can neither be interrupted nor cancelled."""

    def __init__(self, settings: dict[str, Any]) -> None:
        self._settings = settings
        self._outcome: queue.SimpleQueue[zenoh.Session | BaseException] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._is_abandoned = False

    def session(self, give_up: Callable[[], bool]) -> zenoh.Session | None:
        """Return the session, or None as soon as `give_up` returns True. Raises ZError when there is none."""
        if give_up():
            return None
        _start_inside(self._connect, "connect")
        try:
            while True:
                with contextlib.suppress(queue.Empty):
                    outcome = self._outcome.get(timeout=GIVE_UP_S)
                    break
                if give_up():
                    self._abandon()
                    return None
        except BaseException:  # a signal's
            self._abandon()
            raise
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome

    def _connect(self) -> None:
        try:
            outcome: zenoh.Session | BaseException = _open(self._settings)
        except BaseException as error:  # noqa: BLE001  # it is raised where the session is waited for
            outcome = error
        with self._lock:
            if not self._is_abandoned:
                self._outcome.put(outcome)
                return
        _discard(outcome)

    def _abandon(self) -> None:
        with self._lock:
            self._is_abandoned = True
        with contextlib.suppress(queue.Empty):
            _discard(self._outcome.get_nowait())


class Publisher:
    """Puts payloads on one key."""

    def __init__(self, declared: zenoh.Publisher) -> None:
        self.undeclare = declared.undeclare
        self._put = declared.put
        self._pid = os.getpid()

    def put(self, payload: bytes) -> None:
        """Publish. A stuck reader blocks a blocking publisher for at most half a second; a loss is not reported."""
        assert os.getpid() == self._pid, "a session does not survive a fork: spawn processes"
        self._put(payload)


class Session(Closable):
    """One session of a process. Use it in `with`; its declarations live as long as it does."""

    def __init__(self, session: zenoh.Session, locator: str, *, is_open_router: bool = False) -> None:
        self.locator: Final = locator
        """Where this router listens, or where this client dials: `tcp/HOST:PORT`."""
        self.is_open_router: Final = is_open_router
        """Whether it is a router without certificates. With them clients learn of no subscriber to a whole plane, since
        Zenoh passes on to each only declarations within its grants."""
        self._session = session
        self.pid: Final = os.getpid()
        self._closed = False
        self.receivers: Final[list[_Receiver]] = []
        self._threads: list[threading.Thread] = []
        self._inboxes: list[Inbox] = []
        self._declared: list[Any] = []
        self._tokens: dict[str, Any] = {}
        _sessions.add(self)

    @classmethod
    def router(
        cls, listen: str, message_bytes_max: int = limits.MESSAGE_BYTES_MAX, security: Security | None = None
    ) -> Session:
        """Listen as the router of a plane; with port 0 the system chooses. Raises ListenError.

        With `security` only authenticated identities are admitted, with their grants.
        """
        address = parse_address(listen, security is not None)
        try:
            session = _open(router_settings(address, message_bytes_max, security))
        except zenoh.ZError as error:
            raise ListenError(f"cannot listen on {address}: {_reason(error)}") from None
        locators = _locators(session)
        if not locators:
            session.close()  # type: ignore[no-untyped-call]
            raise ListenError(f"cannot listen on {address}: no answer about the port that was chosen")
        return cls(session, reachable(locators, address), is_open_router=security is None)

    @classmethod
    def client(
        cls,
        connect: str,
        timeout_s: float,
        message_bytes_max: int = limits.MESSAGE_BYTES_MAX,
        give_up: Callable[[], bool] = lambda: False,
        security: Security | None = None,
    ) -> Session:
        """Connect to a router, which may start later. Raises ConnectError at the timeout, or if `give_up` returns True.

        Raises NotAuthorised as soon as the other side, or its certificate, shows a refusal. A link that is lost later
        is restored as soon as the router is back.
        """
        address = parse_address(connect, security is not None)
        if address.port == 0 or address.is_wildcard:
            raise BadValue("not an address to connect to (tcp/HOST:PORT)", connect)
        begun_ns = time.monotonic_ns()
        for longest_s in chain(ATTEMPTS_S, repeat(ATTEMPTS_S[-1])):
            left_s = timeout_s - (time.monotonic_ns() - begun_ns) / 1e9
            try:
                settings = client_settings(address, message_bytes_max, min(left_s, longest_s), security)
                session = _Attempt(settings).session(give_up)
            except zenoh.ZError:  # its text is the address alone, for every cause
                from foosim.runtime.transport.tls_probe import probe  # brings ssl, which few processes need

                probe(address, None if security is None else security.credentials, left_s <= longest_s)
                if left_s <= longest_s:
                    raise ConnectError(
                        f"no router answers at {address} within {timeout_s:g} s: "
                        "it is not started, listens elsewhere, or a firewall is between"
                    ) from None
                continue
            if session is None:
                break
            return cls(session, str(address))
        raise ConnectError(f"gave up before a router answered at {address}")

    def publisher(self, key: str, blocking: bool = True) -> Publisher:
        """Return a publisher on one key, without batching, which does not reach subscribers of this session.

        `blocking`: a slow reader holds the sender; otherwise a message that cannot be sent within 1 ms is lost.
        """
        self._check()
        declared = self._session.declare_publisher(
            key,
            congestion_control=zenoh.CongestionControl.BLOCK if blocking else zenoh.CongestionControl.DROP,
            express=True,
            reliability=zenoh.Reliability.RELIABLE,
            allowed_destination=zenoh.Locality.REMOTE,
        )
        publisher = Publisher(declared)
        self._declared.append(publisher)
        return publisher

    def subscribe(self, key_expr: str, channel: str, inbox: Inbox) -> None:
        """Offer messages on these keys to the inbox as (channel, last chunk of the key, payload)."""
        self._check()
        if inbox.on_offer is None:
            self._drain(self._session.declare_subscriber(key_expr, _queue(inbox)), channel, inbox, _payload)
            return
        drain = _Drain(None, channel, inbox, _payload)
        self.receivers.append(drain)
        direct = zenoh.handlers.Callback(drain.offer, indirect=False)
        self._declared.append(self._session.declare_subscriber(key_expr, direct))

    def receive(self, key_expr: str, channel: str, read_key: KeyReader, inbox: Inbox) -> None:
        """Let the inbox's reader itself wait for these keys: the fastest path, for messages of every tick.

        Once for a channel, by the reader itself or before the inbox's first take. When the reader leaves more than the
        inbox's limit waiting, the link waits, too.
        """
        self._check()
        stem = key_expr.removesuffix("/*")
        subscriber = self._session.declare_subscriber(f"{stem}/**", _queue(inbox))
        key = f"{stem}/{BELL}"
        bell = self._session.declare_publisher(key, express=True, allowed_destination=zenoh.Locality.SESSION_LOCAL)
        self._declared += [subscriber, bell]
        source = _Source(subscriber.handler, read_key, key, bell, inbox.limit)
        self.receivers.append(source)
        self._inboxes.append(inbox)
        inbox.attach(source, channel)

    def declare_alive(self, key: str) -> None:
        """Declare presence under this key until `end_alive`, or until the session or its process ends."""
        self._check()
        self._tokens[key] = self._session.liveliness().declare_token(key)

    def end_alive(self, key: str) -> None:
        """End the presence under this key, if it was declared."""
        token = self._tokens.pop(key, None)
        if token is not None:
            token.undeclare()

    def watch_alive(self, key_expr: str, channel: str, inbox: Inbox) -> None:
        """Offer (channel, name, b"+" or b"-") for all present names, and then for each change.

        Duplicates can occur.
        """
        self._check()
        subscriber = self._session.liveliness().declare_subscriber(key_expr, _queue(inbox), history=True)
        self._drain(subscriber, channel, inbox, _presence)

    def alive(self, key_expr: str) -> set[str]:
        """Query the present names, to check those of `watch_alive`."""
        self._check()
        replies = self._session.liveliness().get(key_expr, timeout=QUERY_S)
        return {_name(str(reply.ok.key_expr)) for reply in replies if reply.ok is not None}

    def close(self) -> bool:
        """Undeclare everything and close; False when that takes more than `CLOSE_S` and continues in the background."""
        assert os.getpid() == self.pid, "a session does not survive a fork: spawn processes"
        if self._closed:
            return True
        self._closed = True
        for inbox in self._inboxes:
            inbox.detach()
        closer = _start_inside(self._close, "close")
        closer.join(CLOSE_S)
        return not closer.is_alive()

    def _close(self) -> None:
        for declared in (*self._declared, *self._tokens.values()):
            # Undeclared already, or borrowed by a thread that puts at this moment: then the session's close ends it.
            with contextlib.suppress(zenoh.ZError, RuntimeError):
                declared.undeclare()
        self._session.close()  # type: ignore[no-untyped-call]
        for thread in self._threads:
            thread.join()

    def _check(self) -> None:
        assert os.getpid() == self.pid, "a session does not survive a fork: spawn processes"
        assert not self._closed, "the session is closed"

    def _drain(self, subscriber: Any, channel: str, inbox: Inbox, content: Callable[[zenoh.Sample], bytes]) -> None:
        drain = _Drain(subscriber.handler, channel, inbox, content)
        self._declared.append(subscriber)
        self.receivers.append(drain)
        thread = threading.Thread(target=drain.run, name=f"receive {channel}", daemon=True)
        self._threads.append(thread)
        thread.start()


_sessions: weakref.WeakSet[Session] = weakref.WeakSet()
_inside: weakref.WeakSet[threading.Thread] = weakref.WeakSet()


class _Receiver:
    """The counters of a receiving thread."""

    def __init__(self, handler: Any) -> None:
        self.refused = 0
        self.errors = 0
        self.error = ""
        self._handler = handler

    def _concrete_key(self, sample: zenoh.Sample) -> str | None:
        """Return the key; None, and counted, for one with wildcards, which Zenoh lets pass."""
        key = str(sample.key_expr)
        if "*" in key or "$" in key:
            self.refused += 1
            return None
        return key

    def _count_error(self, error: Exception) -> None:
        """Keep the first error, and count the others: raised, it would end the thread and silence its channel."""
        self.errors += 1
        self.error = self.error or show(f"{type(error).__name__}: {error}", 200)


class _Drain(_Receiver):
    """The thread between a subscriber's queue and an inbox.

    A plain callback of Zenoh would also have a thread and a queue, but one of 256 messages (full, it stops the link
    while Python is busy) and one that keeps a process from ending. For an inbox with `on_offer`, whose process may have
    hundreds of clients, the receiving thread of Zenoh calls `offer` itself.
    """

    def __init__(self, handler: Any, channel: str, inbox: Inbox, content: Callable[[zenoh.Sample], bytes]) -> None:
        super().__init__(handler)
        self._channel = channel
        self._inbox = inbox
        self._content = content

    def run(self) -> None:
        """Offer samples until the subscriber is undeclared."""
        for sample in self._handler:
            self.offer(sample)

    def offer(self, sample: zenoh.Sample) -> None:
        """Offer a sample to the inbox."""
        try:
            key = self._concrete_key(sample)
            if key is not None:
                self._inbox.offer((self._channel, _name(key), self._content(sample)))
        except Exception as error:  # noqa: BLE001
            self._count_error(error)


class _Source(_Receiver):
    """A subscriber's queue as an inbox's source. Its bell is a message on a key of it that stays in this session."""

    def __init__(self, handler: Any, read_key: KeyReader, bell_key: str, bell: zenoh.Publisher, limit: int) -> None:
        """`limit` is the number of messages that are taken at a time, so that a flood does not block the reader."""
        super().__init__(handler)
        self._limit = limit
        self._read_key = read_key
        self._bell_key = bell_key
        self._bell = bell
        self._keys: dict[str, tuple[str, str]] = {}

    def poll(self) -> list[Item]:
        """Return the messages, without waiting."""
        items: list[Item] = []
        try:
            while len(items) < self._limit and (sample := self._handler.try_recv()) is not None:
                self._read(sample, items)
        except zenoh.ZError:  # the subscriber was undeclared
            pass
        return items

    def wait(self, count: int) -> list[Item]:
        """Wait for `count` messages or the bell, and return the messages."""
        items: list[Item] = []
        try:
            for expected in range(1, count + 1):
                self._read(self._handler.recv(), items)
                if len(items) < expected:
                    break
        except zenoh.ZError:  # the subscriber was undeclared
            return items
        return items + self.poll()

    def ring(self) -> None:
        """End a wait."""
        with contextlib.suppress(zenoh.ZError):  # undeclared, which ends a wait as well
            self._bell.put(b"")

    def _read(self, sample: zenoh.Sample, items: list[Item]) -> None:
        key = str(sample.key_expr)
        known = self._keys.get(key)
        if known is None:
            if key == self._bell_key or self._concrete_key(sample) is None:
                return
            known = self._learn(key)
            if known is None:
                return
        items.append((*known, sample.payload.to_bytes()))

    def _learn(self, key: str) -> tuple[str, str] | None:
        try:
            known = self._read_key(key)
        except Exception as error:  # noqa: BLE001
            self._count_error(error)
            return None
        if known is None:
            self.refused += 1
        elif len(self._keys) < KEYS_KEPT:
            self._keys[key] = known
        return known


def _queue(inbox: Inbox) -> Any:
    return zenoh.handlers.FifoChannel(inbox.limit)


def _payload(sample: zenoh.Sample) -> bytes:
    return sample.payload.to_bytes()


def _presence(sample: zenoh.Sample) -> bytes:
    return b"+" if sample.kind == zenoh.SampleKind.PUT else b"-"


def _name(key: str) -> str:
    return key.rpartition("/")[2]


def _discard(outcome: zenoh.Session | BaseException) -> None:
    """Close the session of an attempt that was given up."""
    if isinstance(outcome, zenoh.Session):
        outcome.close()  # type: ignore[no-untyped-call]


def _open(settings: dict[str, Any]) -> zenoh.Session:
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    for key, value in settings.items():  # earlier versions took misspelt keys silently, and a later line could undo one
        assert holds(json.loads(config.get_json(key)), value), f"Zenoh has not taken {key}"
    with _runtime_variable():
        return zenoh.open(config)


@contextlib.contextmanager
def _runtime_variable() -> Iterator[None]:
    """Set the variable for the one time that Zenoh reads it: left there, processes that we start would inherit it."""
    global _opened
    first, _opened = not _opened, True
    if not first or _RUNTIME_VARIABLE in os.environ:
        yield
        return
    os.environ[_RUNTIME_VARIABLE] = _runtime
    try:
        yield
    finally:
        del os.environ[_RUNTIME_VARIABLE]


def _locators(session: zenoh.Session) -> list[str]:
    """Ask the session's own admin space where it listens."""
    for reply in session.get(f"@/{session.zid()}/router", timeout=QUERY_S):
        if reply.ok is not None:
            locators = json.loads(reply.ok.payload.to_bytes())["locators"]
            return [str(locator) for locator in locators]
    return []


def _start_inside(target: Callable[[], None], name: str) -> threading.Thread:
    """Start a thread whose call of Zenoh may last longer than the process."""
    thread = threading.Thread(target=target, name=name, daemon=True)
    _inside.add(thread)
    thread.start()
    return thread


def sessions() -> frozenset[Session]:
    """Return the sessions that are open."""
    return frozenset(_sessions)


def end_all(but: Collection[Session]) -> bool:
    """Close all sessions but these; False when a thread is inside Zenoh still: a process ends by `os._exit` then.

    A thread that Python ends inside Zenoh, as it does at exit, aborts the process.
    """
    _close_all(but)
    return not any(thread.is_alive() for thread in _inside)


def _close_all(but: Collection[Session] = ()) -> None:
    for session in list(_sessions):
        if session.pid == os.getpid() and session not in but:
            session.close()


def _reason(error: zenoh.ZError) -> str:
    """Return the system's error, out of a text that names Zenoh's source files."""
    text = str(error)
    found = re.search(r"([A-Z][^:()\[\]]*) \(os error \d+\)", text)
    return found[1] if found is not None else text.partition(" at /")[0][:160]


atexit.register(_close_all)
