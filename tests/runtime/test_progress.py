"""The progress file: what a probe makes of it, and that a loop writes it only while it goes round."""

import logging
import os
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from foosim.common.errors import BadValue, Failed
from foosim.protocol.actions import Action
from foosim.protocol.channels import Channel
from foosim.runtime.health import EVERY_NS, NoProgress, ProgressFile, age_ns, probe_file
from foosim.runtime.roles.loop import Loop
from foosim.runtime.roles.role import Role
from foosim.runtime.transport.inbox import Inbox

S = 1_000_000_000


def test_the_age_is_counted_on_the_monotonic_clock(tmp_path: Path) -> None:
    path = tmp_path / "progress"
    path.write_text("what was left by a longer text " * 9)
    file = ProgressFile(path)
    file.write(100 * S)
    assert age_ns(path, 103 * S) == 3 * S
    file.write(104 * S)
    assert age_ns(path, 104 * S) == 0
    os.utime(path, (0, 0))
    assert age_ns(path, 105 * S) == S, "the wall time of the file says nothing"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "no progress file, No such file or directory"),
        (b"", "not a progress file"),
        (b"1" * 20, "not a progress file"),
        (b"-" + b"1" * 19 + b"\n", "not a progress file"),
        (b"%020d\n" % (200 * S), "written before this machine was booted"),
    ],
)
def test_what_is_no_sign_is_told(tmp_path: Path, content: bytes | None, says: str) -> None:
    path = tmp_path / "progress"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(NoProgress, match=says):
        age_ns(path, 100 * S)


def test_a_probe_says_no_when_the_last_sign_is_too_old(tmp_path: Path) -> None:
    path = tmp_path / "progress"
    file = ProgressFile(path)
    assert probe_file(path, "1 h") < 3600 * S
    file.write(time.monotonic_ns() - 10 * S)
    assert probe_file(path, "1 h") >= 10 * S
    with pytest.raises(NoProgress, match=r"the last progress is \d\d+\.\d s old, more than 5s"):
        probe_file(path, "5s")
    with pytest.raises(BadValue, match="--within"):
        probe_file(path, "0 s")


def test_a_file_that_cannot_be_written_ends_the_start(tmp_path: Path) -> None:
    with pytest.raises(Failed, match=r"--progress-file .*/none/progress: cannot be written, No such file or directory"):
        ProgressFile(tmp_path / "none" / "progress")


class Idle:
    """A core with nothing to do."""

    def __init__(self) -> None:
        self.actions: list[Action] = []

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        raise AssertionError("nobody sends anything")

    def wake(self, now_ns: int) -> None: ...


def make_loop(*arguments: Any) -> Loop:
    log = logging.getLogger("idle")
    loop = Loop(Inbox(8), log)
    loop.add(Role("idle", Idle(), log, lambda now_ns: now_ns + 3600 * S))
    return loop


def test_a_loop_with_nothing_to_do_goes_on_giving_signs_and_one_that_hangs_does_not(tmp_path: Path) -> None:
    path, loop = tmp_path / "progress", make_loop()
    loop.go_round()  # the first round finds its own deadline
    loop.show_progress(path)
    signs: set[bytes] = set()
    while len(signs) < 3:  # the core's deadline is an hour away
        loop.go_round()
        signs.add(path.read_bytes())
    times = sorted(map(int, signs))
    assert all(later - sooner >= EVERY_NS for sooner, later in pairwise(times[1:]))

    hung_ns = 0

    def hang(now_ns: int) -> None:
        nonlocal hung_ns
        while hung_ns <= EVERY_NS:
            hung_ns = age_ns(path, time.monotonic_ns())

    loop.roles[0].turn = hang
    loop.go_round()
    assert hung_ns > EVERY_NS, "else the turn would not have ended"


def test_signs_that_cannot_be_written_harm_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    loop = make_loop()
    loop.show_progress(tmp_path / "progress")
    assert loop._progress is not None
    with open(os.devnull) as unwritable:
        os.dup2(unwritable.fileno(), loop._progress._file)
    with caplog.at_level(logging.WARNING):
        loop.go_round()
    assert "the progress file could not be written: Bad file descriptor" in caplog.text
