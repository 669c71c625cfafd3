"""What every process does around its loop: told to end, it does, also while it connects; its log is dated lines."""

import logging
import re
import signal
import socket
import subprocess
import sys
from typing import IO

import pytest

from foosim.runtime import process
from foosim.runtime.process import start_log

LIMIT_S = 900.0
ROLE = "import sys; sys.argv[1:1] = ['role', '{}']; from foosim.cli import main; main()"
NODE, PLAYER = ROLE.format("node"), ROLE.format("player")
ASLEEP = """
import threading, time
from foosim.runtime.process import Stop
stop = Stop()
told = threading.Event()
if {late}:
    stop.then(told.set)
print("ready", flush=True)
while not stop.is_set():
    time.sleep(0.01)
stop.then(told.set)
print("told" if told.is_set() else "not told", flush=True)
while {stays}:
    time.sleep(0.01)
"""


def start(program: str, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", program, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def line_of(stream: IO[str] | None) -> str:
    assert stream is not None
    return stream.readline().strip()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
@pytest.mark.parametrize("late", [False, True])
def test_whoever_is_to_be_told_is_told_once_also_later(number: signal.Signals, late: bool) -> None:
    child = start(ASLEEP.format(late=late, stays=False))
    assert line_of(child.stdout) == "ready"
    child.send_signal(number)
    assert line_of(child.stdout) == "told"
    assert child.wait(LIMIT_S) == 0
    child.communicate()


def test_a_second_ctrl_c_ends_a_process_at_once() -> None:
    child = start(ASLEEP.format(late=False, stays=True))
    assert line_of(child.stdout) == "ready"
    child.send_signal(signal.SIGTERM)
    assert line_of(child.stdout) == "told"
    child.send_signal(signal.SIGTERM)
    child.send_signal(signal.SIGINT)
    assert child.wait(LIMIT_S) == 130
    child.communicate()


@pytest.mark.parametrize("program", [NODE, PLAYER])
def test_it_can_be_ended_while_nobody_answers(program: str) -> None:
    """The address is listened on, so that the process is known to be connecting, and nothing is ever said there."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        port = listening.getsockname()[1]
        child = start(program, "--name", "red", "--connect", f"tcp/127.0.0.1:{port}")
        connection, _ = listening.accept()
        with connection:
            child.send_signal(signal.SIGTERM)
            _, err = child.communicate(timeout=LIMIT_S)
    assert (child.returncode, err) == (1, f"gave up before a router answered at tcp/127.0.0.1:{port}\n")


def test_a_player_writes_its_stack_when_it_is_asked_for_it() -> None:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        address = f"tcp/127.0.0.1:{listening.getsockname()[1]}"
        child = start(PLAYER, "--name", "red", "--connect", address)
        connection, _ = listening.accept()
        with connection:
            child.send_signal(process.STACK_SIGNAL)
            _, err = child.communicate(timeout=LIMIT_S)
    assert child.returncode == -process.STACK_SIGNAL and "in run_players\n" in err


def test_a_child_whose_launcher_is_gone_does_not_even_start() -> None:
    program = "from foosim.runtime.process import die_with_parent; die_with_parent(); print('alive')"
    environment = {process.PARENT_VARIABLE: "1:0"}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")


def test_a_line_of_the_log_has_its_time_in_utc(capsys: pytest.CaptureFixture[str]) -> None:
    log = start_log("red")
    log.info("tick %d", 7)
    (line,) = capsys.readouterr().err.splitlines()
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z INFO    red: tick 7", line), line
    assert start_log("red").handlers != [] and len(logging.getLogger("red").handlers) == 1


def test_a_process_starts_with_what_it_needs() -> None:
    """Most runs have no certificates, and few vHubs read a capture. What was imported, no garbage collection visits.

    A model of the deployment has no validator before it is used.
    """
    program = """
import atexit, gc, sys
from foosim.client import main as player
from foosim.node import main as node
from foosim.vhub import main as vhub
print([name for name in ("ssl", "cryptography", "foosim.capture.reader") if name in sys.modules])
from foosim.deployment.schema import Deployment
from foosim.library.table.settings import Table
from foosim.cli import control, up, verbs
print([name for name in ("ssl", "cryptography") if name in sys.modules])
print([model.__name__ for model in (Deployment, Table) if model.__pydantic_complete__])
atexit.register(lambda: print(gc.get_freeze_count() > len(gc.get_objects())))
sys.argv = ["foosim", "--version"]
verbs.main()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    *nothing, version, is_left_out = done.stdout.splitlines()
    assert (nothing, is_left_out) == (["[]"] * 3, "True"), version
