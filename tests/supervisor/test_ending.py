"""How a process ended, in words: who killed it, whether memory was short, what it said last."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

from foosim.supervisor import memory
from foosim.supervisor.ending import Ending
from foosim.supervisor.memory import oom_kills

REFUSED: Final = "2026-03-01T12:00:00.000Z ERROR   red: refused by the supervisor: a node red is already here"


@pytest.mark.parametrize(
    ("ending", "text"),
    [
        (Ending(-9, "SIGKILL"), "was killed by SIGKILL, not by foosim"),
        (Ending(-9, "SIGKILL", killed_by_us="it had no answer"), "was killed by up: it had no answer"),
        (Ending(-9, "SIGKILL", out_of_memory=True), "was killed by SIGKILL: too little memory"),
        (
            Ending(-6, "SIGABRT", ["memory allocation of 4096 bytes failed"]),
            "was killed by SIGABRT: too little memory",
        ),
        (Ending(-11, "SIGSEGV", ["anything"]), "was killed by SIGSEGV, not by foosim"),
        (Ending(1, "", ["  File ...", "MemoryError"]), "ended with exit code 1: too little memory"),
        (Ending(1, "", ["RuntimeError: can't start new thread"]), "ended with exit code 1: too little memory"),
        (Ending(1, "", ["no journal of this version"]), "ended with exit code 1"),
        (
            Ending(3, "", ["before", REFUSED]),
            "ended with exit code 3, refused: refused by the supervisor: a node red is already here",
        ),
        (Ending(3, "", ["a.mcap: exists already"]), "ended with exit code 3, refused: a.mcap: exists already"),
        (Ending(3), "ended with exit code 3"),
    ],
)
def test_a_reason_names_who_ended_a_process(ending: Ending, text: str) -> None:
    assert ending.text == text


def test_a_signal_is_known_on_another_machine_too() -> None:
    assert Ending(-9, "SIGKILL").is_by_signal and Ending(137, is_remote=True).is_by_signal
    assert not Ending(137).is_by_signal and not Ending(1, is_remote=True).is_by_signal


def test_the_kernel_says_how_many_it_has_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "vmstat").write_text("pgfault 12\noom_kill 3\n")
    (tmp_path / "group").write_text("0::/user/run\n")
    (tmp_path / "user" / "run").mkdir(parents=True)
    (tmp_path / "user" / "run" / "memory.events").write_text("low 0\noom 9\noom_kill 2\n")
    for name, place in (("_VMSTAT", "vmstat"), ("_OWN_GROUP", "group"), ("_GROUPS", "")):
        monkeypatch.setattr(memory, name, tmp_path / place)
    assert oom_kills() == 5
    (tmp_path / "user" / "run" / "memory.events").unlink()
    (tmp_path / "vmstat").unlink()
    assert oom_kills() == 0, "where it does not say"
