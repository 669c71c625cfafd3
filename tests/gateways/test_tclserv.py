"""TCLserv: answers and events as MORSE writes them, jobs with events of their own, and programs that send garbage."""

from __future__ import annotations

import random
from collections.abc import Iterator

import pytest

from foosim.gateways.lines import LINE_BYTES_MAX
from foosim.gateways.tclserv import Tclserv
from tests.gateways.serving import Served, Wire
from tests.gateways.test_socket import TEXT as SOCKET

TEXT = SOCKET.replace("{kind: socket, listen: '127.0.0.1:0', streams: 0}", "{kind: tclserv, listen: '127.0.0.1:0'}")
ANSWERS = {
    "RQST ::Cat_001.motion::set_speed 0.5 0": ["OK 0", "0 ::Cat_001.motion::set_speed TERM OK"],
    "RQST ::mouse.go::get_status": ["OK 1", "1 ::mouse.go::get_status TERM OK Stop"],
    "RQST ::mouse.go::get_configurations": [
        "OK 2",
        "2 ::mouse.go::get_configurations TERM OK configurations  {object_to_robot {rotation "
        "{{1.0 0.0 0.0} {0.0 1.0 0.0} {0.0 0.0 1.0}} translation {0.0 0.0 0.0}}}",
    ],
    "RQST ::Cat_001.motion::stop now": ["ERROR 1 wrong # args"],
    "RQST ::Cat_001.motion::set_speed": ["ERROR 1 wrong # args"],
    "RQST ::Cat_001.motion::set_speed fast 0": ["ERROR 1 wrong type in args"],
    "RQST ::Cat_001.motion::fly 1": ['ERROR 1 invalid command name \\"flySend\\"'],
    "RQST": ['ERROR 1 invalid command name \\"Send\\"'],
    "ABORT 17": ["ERROR 1 no running request 17"],
    "REPLYTO 9": ["ERROR 1 no client 9"],
    "cs::lsmbox": [
        "OK Cat_001.radio Cat_001.received Cat_001.Pose Cat_001.motion mouse.radio mouse.received mouse.pose mouse.go"
    ],
    "info commands mouse.radio::*": [
        "OK "
        + " ".join(
            f"::mouse.radio::{one}Send" for one in ("get_properties", "set_property", "get_configurations", "send")
        )
    ],
    "info body": ["ERROR 0 command info not implemented!"],
    "LM go": ["OK "],
    "posterRead a": ["ERROR 0 command posterRead not implemented! Posters are absent: request get_local_data"],
}


def program(served: Served, greeting: str = "HELLO\r\n") -> Wire:
    assert isinstance(served.gateway, Tclserv)
    wire = Wire(served, served.gateway.port)
    wire.write(greeting)
    return wire


def told(wire: Wire, count: int) -> list[str]:
    """Return lines that a program gets, without their ends."""
    lines = wire.lines(count)
    assert all(line.endswith("\r") for line in lines)
    return [line[:-1] for line in lines]


def test_answers_and_events_are_those_of_morse() -> None:
    found: dict[str, list[str]] = {}
    read: list[str] = []

    def script(served: Served) -> Iterator[int]:
        wire = program(served)
        assert told(wire, 1) == ["HELLO 0"]
        for request, lines in ANSWERS.items():
            wire.write(request[:4])
            wire.write(f"{request[4:]}\r\n")
            found[request] = told(wire, len(lines))
        wire.write("RQST ::mouse.pose::get_local_data\n")
        yield served.run.tick + 10
        wire.write("RQST ::mouse.pose::get_local_data\nBYE\nLM\n")
        read.extend(told(wire, 4))
        assert wire.lines() == []
        assert not wire.is_open

    Served(TEXT, "morse", script).rehearse(60)
    assert found == ANSWERS
    assert read[:2] == ["OK 8", "8 ::mouse.pose::get_local_data TERM S_mouse.pose_mouse.pose_has_measured_nothing_yet"]
    words = read[3].removeprefix("9 ::mouse.pose::get_local_data TERM OK ").split("  ")
    assert words[::2] == ["timestamp", "x", "y", "z", "yaw", "pitch", "roll"]
    assert float(words[3]) == 1.0


def test_a_job_has_events_for_the_client_that_is_named_and_may_be_aborted() -> None:
    answers: list[str] = []
    events: list[str] = []

    def script(served: Served) -> Iterator[int]:
        wire, other = program(served), program(served)
        assert told(wire, 1) + told(other, 1) == ["HELLO 0", "HELLO 1"]
        wire.write("REPLYTO 1\nRQST ::mouse.go::goto 2.0 0.0 0.0 0.1\n")
        yield served.run.tick + 300
        wire.write("RQST ::mouse.go::goto 4 0 0\n")
        yield served.run.tick + 20
        wire.write("RQST ::mouse.go::goto -4 0 0\n")
        yield served.run.tick + 20
        wire.write("ABORT 2\n")
        yield served.run.tick + 20
        answers.extend(told(wire, 5))
        events.extend(told(other, 6))

    Served(TEXT, "morse", script).rehearse(500)
    end = "TERM S_mouse.go_stdGenoM_ACTIVITY_INTERRUPTED"
    assert answers == ["OK 1", "OK 0", "OK 1", "OK 2", "OK "]
    assert [event.replace(" ::mouse.go::goto", "") for event in events] == [
        *("0 ACK 0", "0 TERM OK Arrived", "1 ACK 0", "2 ACK 0", f"1 {end}", f"2 {end}")
    ]


@pytest.mark.parametrize("seed", range(3))
def test_garbage_ends_nothing_else(seed: int, caplog: pytest.LogCaptureFixture) -> None:
    draws = random.Random(seed)
    good: list[str] = []
    pieces = [
        *(
            b"HELLO\n",
            b"RQST ",
            b"::Cat_001.motion::",
            b"::::",
            b"set_speed ",
            b"1e999 ",
            b"\xff\x00",
            b"\r\n",
            b"[" * 5000,
        ),
        *(b"ABORT ", b"REPLYTO ", b"info commands ", b"9" * 6000, b"cs::lsmbox\n", b"get_local_data"),
    ]

    def script(served: Served) -> Iterator[int]:
        for _ in range(40):
            wire = program(served, draws.choice(("HELLO\n", "", "HELL")))
            for _ in range(draws.randrange(6)):
                wire.write(b"".join(draws.choices(pieces, k=draws.randrange(8))))
            if draws.random() < 0.7:
                wire.close()
        long = program(served)
        for _ in range(LINE_BYTES_MAX // 50_000 + 2):
            long.write(b"x" * 50_000)
        assert told(long, 1)[0].startswith("HELLO") and not long.lines() and not long.is_open
        wire = program(served)
        wire.write("RQST ::mouse.go::get_status\n")
        good.extend(told(wire, 3))
        yield 0

    result = Served(TEXT, "morse", script).rehearse(60)
    assert good[2].endswith("::mouse.go::get_status TERM OK Stop")
    assert not result.json["failed"]
    messages = [record.getMessage() for record in caplog.records if record.name == "morse"]
    assert any("a line of more than 1048576 bytes: it is closed" in message for message in messages)
    assert any("not with HELLO: it is closed" in message for message in messages)
