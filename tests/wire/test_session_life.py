"""How sessions begin and end: routers that are not there, closing, processes that forget to, forks, settings."""

import re
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest
import zenoh

from foosim.client.control import Control
from foosim.common.errors import BadValue
from foosim.protocol import channels
from foosim.protocol.channels import SUPERVISOR, Plane
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Answer, Request
from foosim.runtime.roles.wire import Wire
from foosim.runtime.transport import session as sessions
from foosim.runtime.transport.inbox import Inbox, Item
from foosim.runtime.transport.session import ConnectError, ListenError, Session
from tests.wire.test_run import free_port

LONG_S = 900.0
ANY_PORT = "tcp/127.0.0.1:0"


@pytest.fixture
def router() -> Iterator[Session]:
    with Session.router(ANY_PORT) as session:
        yield session


@pytest.fixture
def client(router: Session) -> Iterator[Session]:
    with Session.client(router.locator, LONG_S) as session:
        yield session


def run_python(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=2 * LONG_S, check=False)


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


def test_an_attempt_is_given_up_at_once_and_leaves_no_session(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "ATTEMPTS_S", (LONG_S,))
    port, asked = free_port(), iter((False, False, True))
    with pytest.raises(ConnectError, match="gave up"):
        Session.client(f"127.0.0.1:{port}", LONG_S, give_up=lambda: next(asked))
    (attempt,) = [thread for thread in threading.enumerate() if thread.name == "connect"]
    with Session.router(f"tcp/127.0.0.1:{port}"):
        attempt.join(LONG_S)
        assert not attempt.is_alive(), "it has connected after all, and closed its session"


def test_what_cannot_be_listened_on_is_said(router: Session) -> None:
    with pytest.raises(ListenError) as caught:
        Session.router(router.locator)
    assert str(caught.value) == f"cannot listen on {router.locator}: Address already in use"
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
    client: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[int] = []
    wait = sessions._Source.wait

    def counted(source: sessions._Source, count: int) -> list[Item]:
        waits.append(count)
        return wait(source, count)

    monkeypatch.setattr(sessions._Source, "wait", counted)
    inbox = Inbox(1000)
    client.receive("w/part/*", "part", lambda key: ("part", key), inbox)
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


def test_a_close_that_hangs_is_left_to_itself(client: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    """Zenoh's own close hung for 10 s when packets were lost."""
    hang = threading.Event()
    close = client._close
    monkeypatch.setattr(client, "_close", lambda: (hang.wait(), close()))
    monkeypatch.setattr(sessions, "CLOSE_S", 0.01)
    assert client.close() is False
    hang.set()


LEAVE_IT_OPEN = """
import sys, time
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import Session
session = Session.client(sys.argv[1], 900.0)
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
def test_a_process_that_forgets_to_close_ends_with_its_own_code(router: Session, code: int) -> None:
    done = run_python(LEAVE_IT_OPEN, router.locator, str(code))
    assert (done.returncode, done.stderr) == (code, "")


CLOSE_AT_A_STANDSTILL = """
import atexit, os, signal, sys, time, typer
from foosim.runtime.command import new_app, run_app
from foosim.runtime.transport import session as sessions

app = new_app()

@app.command()
def main(address: str, router: int, way: str) -> None:
    atexit.register(print, "at exit")
    session = sessions.Session.client(address, 900.0)
    os.kill(router, signal.SIGSTOP)
    sessions.CLOSE_S = 0.0
    if way == "closes":
        assert not session.close()
    else:
        asked = iter([False, True])
        try:
            sessions.Session.client(address, 900.0, give_up=lambda: next(asked))
        except sessions.ConnectError:
            pass
    raise typer.Exit(5)

class Lingering:
    def __del__(self, sleep=time.sleep):
        sleep(0.8)  # the interpreter is ending: a thread that returns to it from Zenoh now aborts the process

sys.modules["lingering"] = Lingering()
run_app(app, "main")
"""
STANDS_STILL = """
import os, sys
from foosim.runtime.transport.session import Session
with Session.router("tcp/127.0.0.1:0") as session:
    print(session.locator, os.getpid(), flush=True)
    sys.stdin.read()
"""


@pytest.mark.parametrize("way", ["closes", "gives up"])
def test_a_command_whose_router_stands_still_ends_with_its_own_code(way: str) -> None:
    """A thread of it is inside Zenoh still, which aborts a process that Python ends."""
    command = [sys.executable, "-c", STANDS_STILL]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as router:
        assert router.stdout is not None
        try:
            done = run_python(CLOSE_AT_A_STANDSTILL, *router.stdout.readline().split(), way)
        finally:
            router.kill()
    assert (done.returncode, done.stdout, done.stderr) == (5, "at exit\n", "")


FORK = """
import os, sys
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import Session
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
import os, sys, time
from foosim.runtime.transport.session import CLIENT_RUNTIME, ROUTER_RUNTIME, Session, use_client_runtime
if sys.argv[1] == "client":
    use_client_runtime()
with Session.router("tcp/127.0.0.1:0") as router, Session.client(router.locator, 900.0) as client:
    assert client.alive("nobody/*") == set()
    wanted = [f"rx-{number}" for number in range(int(sys.argv[2]))]
    while True:  # a thread gives itself its name when it first runs
        names = [open(f"/proc/self/task/{task}/comm").read().strip() for task in os.listdir("/proc/self/task")]
        receiving = sorted(name for name in names if name.startswith("rx"))
        if set(receiving) >= set(wanted):  # a further one may wait for what blocks, such as the resolver of names
            break
        time.sleep(0.01)
print(receiving[: len(wanted)] if wanted else receiving, os.environ.get("ZENOH_RUNTIME"))
try:
    use_client_runtime()
except AssertionError:
    print("too late")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads the names of threads in /proc")
@pytest.mark.parametrize(("kind", "receiving"), [("client", 0), ("router", sessions.ROUTER_THREADS)])
def test_a_router_has_a_receiving_thread_for_each_stuck_link(kind: str, receiving: int) -> None:
    """With two, one stuck client stopped healthy ones for seconds."""
    done = run_python(CLIENT_RUNTIME, kind, str(receiving))
    threads = [f"rx-{number}" for number in range(receiving)]
    assert done.stdout.splitlines() == [f"{threads} None", "too late"], done.stderr


def test_settings_that_zenoh_does_not_take_as_they_are_stop_us() -> None:
    with pytest.raises(zenoh.ZError):
        sessions._open({"transport/link/tx/leese": 1000})
    undone = {"adminspace/permissions": {"read": True, "write": False}, "adminspace/permissions/write": True}
    with pytest.raises(AssertionError, match="adminspace/permissions"):
        sessions._open(undone)


def test_a_second_control_of_a_process_comes_and_goes_beside_the_first(router: Session) -> None:
    """As in a notebook that holds one open, and calls the functions that open one each."""
    inbox, ended = Inbox(100), threading.Event()
    wire = Wire(router, Plane.SIMULATION, inbox, SUPERVISOR)
    wire.read([(channels.REQUEST, False)])

    def answer() -> None:
        while not ended.is_set():
            for _, name, payload in inbox.take(LONG_S):
                request = decode(Request, payload, channels.REQUEST.bytes_max)
                wire.put(channels.ANSWER, name, encode(Answer(SUPERVISOR, request.id, True, 0, request.verb, b"{}")))

    thread = threading.Thread(target=answer)
    thread.start()
    try:
        with Control(router.locator) as first:
            for turn in range(5):
                with Control(router.locator) as second:
                    assert second.request("pause", LONG_S).text == "pause"
                    assert first.request("resume", LONG_S).text == "resume", turn
                assert first.status(LONG_S) == {}
    finally:
        ended.set()
        inbox.wake()
        thread.join()
