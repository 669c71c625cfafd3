"""The command lines of ssh: what a user says holds, but for two things; words arrive as they were."""

from __future__ import annotations

import shlex

import pytest

from foosim.deployment.hosts import Host
from foosim.launcher.hosts import Remote


def test_a_users_options_come_before_ours_but_ssh_never_asks() -> None:
    """ssh takes the first of several values of an option."""
    line = Remote("left", Host(address="a.lan", ssh="me@b", ssh_options=["-o", "ConnectTimeout=1"])).ssh(["true"])
    assert line[0] == "ssh" and line[-2:] == ["me@b", "true"]
    options = [word for word in line if "=" in word]
    assert options[0] == "BatchMode=yes"
    assert options.index("ConnectTimeout=1") < options.index("ConnectTimeout=10")


@pytest.mark.parametrize("words", [["a b", "c'd", "$HOME", "*", "", "--", "ü"]])
def test_words_go_through_the_shell_there_unchanged(words: list[str]) -> None:
    remote = Remote("left", Host(address="a.lan", commands="/opt/foo sim/bin"))
    sent = remote.guarded("run-1", "red", words)[-1]
    assert shlex.split(sent)[:2] == ["/opt/foo sim/bin/foosim", "guard"]
    assert shlex.split(sent)[-len(words) - 2 :] == ["run-1", "red", *words]


@pytest.mark.parametrize(
    ("code", "said", "expected"),
    [
        (255, "ssh: connect to host a.lan: No route to host", "host left (a.lan) cannot be reached: ssh: connect to"),
        (255, "Timeout, server a.lan not responding.", "cannot be reached: Timeout, server a.lan not responding."),
        (
            255,
            "root@a.lan: Permission denied (publickey).",
            "(a.lan): root@a.lan: Permission denied (publickey).",
        ),
        (126, "", "foosim cannot be run on host left"),
        (137, "", "was killed by signal 9 on host left"),
        (3, "refused", "ended with exit code 3 on host left"),
    ],
)
def test_an_end_names_the_host_and_what_to_do(code: int, said: str, expected: str) -> None:
    remote = Remote("left", Host(address="a.lan"))
    assert expected in remote.why(code, [said])
    assert remote.is_away(code, [said]) == ("cannot be reached" in expected)
