"""A process with several roles: which order they have, when it ends, and with which exit code."""

from __future__ import annotations

import logging
from typing import Any

import pytest

from foosim.common.errors import Failed
from foosim.protocol.channels import SUPERVISOR
from foosim.runtime.command import DONE, FAILED, REFUSED
from foosim.runtime.roles.role import Role
from foosim.runtime.roles.shell import Process

LATER_NS = 2**62


class Idle:
    """A core with nothing to do."""

    def __init__(self) -> None:
        self.actions: list[Any] = []

    def receive(self, *message: object) -> None: ...

    def wake(self, now_ns: int) -> None: ...


class Shell:
    """A role that is over after some rounds, or when it is stopped, and notes what becomes of it."""

    def __init__(self, name: str, diary: list[str], rounds: int, ends: int | Failed = DONE) -> None:
        self.role = Role(name, Idle(), logging.getLogger(name), lambda now_ns: now_ns)
        self._diary, self._rounds, self._ends = diary, rounds, ends
        self.role.turn = self._turn

    def _turn(self, now_ns: int) -> None:
        self._rounds -= 1

    def is_over(self) -> bool:
        return self._rounds <= 0

    def finish(self) -> int:
        self._diary.append(f"{self.role.name} ends")
        if isinstance(self._ends, Failed):
            raise self._ends
        return self._ends

    def leave(self) -> None:
        self._diary.append(f"{self.role.name} leaves")

    def stop(self) -> None:
        self._diary.append(f"{self.role.name} stops")
        self._rounds = 0


def run(diary: list[str], *shells: Shell) -> int:
    process = Process("test", is_shared=True)
    for shell in shells:
        process.add(shell)
    return process.run()


def test_a_process_ends_when_all_its_roles_are_over() -> None:
    diary: list[str] = []
    assert run(diary, Shell("vhub", diary, 9), Shell("red", diary, 3), Shell("blue", diary, 3)) == DONE
    assert diary == ["red ends", "blue ends", "vhub ends"]


def test_a_role_that_is_refused_takes_the_others_with_it() -> None:
    """Its launcher starts the process again, with all of them."""
    diary: list[str] = []
    assert run(diary, Shell("vhub", diary, 99), Shell("red", diary, 3, REFUSED)) == REFUSED
    assert diary == ["red ends", "vhub leaves"]


def test_beside_a_supervisor_the_run_ends_in_order() -> None:
    diary: list[str] = []
    assert run(diary, Shell("vhub", diary, 3, FAILED), Shell(SUPERVISOR, diary, 9)) == FAILED
    assert diary == ["vhub ends", "supervisor ends"]


def test_one_that_raises_at_its_end_lets_the_others_end_and_is_reported() -> None:
    diary: list[str] = []
    with pytest.raises(Failed, match="player-red failed at tick 5"):
        run(diary, Shell("player-red", diary, 2, Failed("player-red failed at tick 5")), Shell("red", diary, 9))
    assert diary == ["player-red ends", "red ends"]


def test_a_core_that_raises_ends_the_process_and_all_leave_their_files() -> None:
    diary: list[str] = []
    wrong = Shell("red", diary, 99)

    def turn(now_ns: int) -> None:
        raise AssertionError("this must not be")

    wrong.role.turn = turn
    with pytest.raises(AssertionError, match="this must not be"):
        run(diary, Shell("vhub", diary, 99), wrong)
    assert diary == ["vhub leaves", "red leaves"]


@pytest.mark.parametrize(("first", "stopped"), [("vhub", ["vhub", "red"]), (SUPERVISOR, [SUPERVISOR])])
def test_a_signal_stops_all_or_has_the_supervisor_end_the_run(first: str, stopped: list[str]) -> None:
    diary: list[str] = []
    process = Process("test", is_shared=True)
    for name in (first, "red"):
        process.add(Shell(name, diary, 99))
    process.stop()
    assert diary == [f"{name} stops" for name in stopped]
