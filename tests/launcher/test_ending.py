"""How a process ended, in words: who killed it, whether memory was short, what it said last."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import pytest

from foosim.launcher import processes
from foosim.launcher.processes import Child, Ending, OomKills, oom_kills

REFUSED: Final = "2026-03-01T12:00:00.000Z ERROR   red: refused by the supervisor: a node red is already here"
ERROR = "2026-11-23T18:22:43.352Z ERROR   supervisor: the run does not go on"
WARNING = "2026-11-23T18:22:43.354Z WARNING vhub: leaves its capture run.mcap unfinished"
"""Of two roles of one process, the one that was refused and one that leaves with it."""


@pytest.mark.parametrize(
    ("ending", "text"),
    [
        (Ending(-9), "was killed by SIGKILL, not by foosim"),
        (Ending(-9, killed_by_us="it had no answer"), "was killed by up: it had no answer"),
        (
            Ending(-9, oom_killed="on this machine"),
            "was killed by SIGKILL, not by foosim; "
            "too little memory: the kernel has killed for that on this machine while it ran",
        ),
        (Ending(-6, ["memory allocation of 4096 bytes failed"]), "was killed by SIGABRT: too little memory"),
        (Ending(-11, ["anything"]), "was killed by SIGSEGV, not by foosim"),
        (Ending(1, ["  File ...", "MemoryError"]), "ended with exit code 1: too little memory"),
        (Ending(1, ["RuntimeError: can't start new thread"]), "ended with exit code 1: too little memory"),
        (Ending(1, ["no journal of this version"]), "ended with exit code 1"),
        (
            Ending(3, ["before", REFUSED]),
            "ended with exit code 3, refused: refused by the supervisor: a node red is already here",
        ),
        (Ending(3, ["a.mcap: exists already"]), "ended with exit code 3, refused: a.mcap: exists already"),
        (Ending(3, [ERROR, WARNING]), "ended with exit code 3, refused: the run does not go on"),
        (Ending(3), "ended with exit code 3"),
    ],
)
def test_a_reason_names_who_ended_a_process(ending: Ending, text: str) -> None:
    assert ending.text == text


def test_a_signal_is_known_on_another_machine_too() -> None:
    assert Ending(-9).is_by_signal and Ending(137, is_remote=True).is_by_signal
    assert not Ending(137).is_by_signal and not Ending(1, is_remote=True).is_by_signal


def test_the_kernel_says_where_it_has_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the process's own control group it may have been this one, elsewhere on the machine anybody."""
    group = tmp_path / "user" / "run"
    group.mkdir(parents=True)
    (tmp_path / "vmstat").write_text("pgfault 12\noom_kill 3\n")
    (tmp_path / "group").write_text("4:memory:/other\n0::/user/run\n")
    (group / "memory.events").write_text("low 0\noom 9\noom_kill 2\n")
    for name, place in (("_VMSTAT", "vmstat"), ("_OWN_GROUP", "group"), ("_GROUPS", "")):
        monkeypatch.setattr(processes, name, tmp_path / place)
    begun = oom_kills()
    assert begun == OomKills(2, 3) and oom_kills().since(begun) == ""
    (tmp_path / "vmstat").write_text("oom_kill 4\n")
    assert oom_kills().since(begun) == "on this machine"
    (group / "memory.events").write_text("oom_kill 3\n")
    assert oom_kills().since(begun) == "in its control group"
    (group / "memory.events.local").write_text("oom_kill 2\n")
    assert oom_kills().since(begun) == "on this machine", "the one that was killed was in a group below"
    for path in (*group.iterdir(), tmp_path / "vmstat"):
        path.unlink()
    assert oom_kills() == OomKills(0, 0), "where it does not say"


def test_what_is_killed_on_a_machine_after_its_end_is_not_held_against_a_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts = [OomKills(0, 5), OomKills(0, 6)]
    monkeypatch.setattr(processes, "oom_kills", lambda: counts.pop(0))
    ended: Any = SimpleNamespace(poll=lambda: -9)
    child = Child("red", ("foosim", "role", "node"), tmp_path / "log", ended, oom_kills=OomKills(0, 5))
    for _ in range(2):
        assert child.ending == "was killed by SIGKILL, not by foosim"
