"""The command `foosim role roles`: which options its roles need."""

from __future__ import annotations

import pytest

from tests.conftest import Typed


@pytest.mark.parametrize(
    ("options", "code", "problem"),
    [
        ((), 2, "a role is missing: --run, --vhub-listen, --node or --player, 'main'"),
        (("--node", "red"), 2, "one of --run and --connect is needed: where the supervisor is"),
        (
            ("--player", "player-red"),
            2,
            "--radio is missing: the address of the vHub, which players need, 'player-red'",
        ),
        (("--vhub-listen", "0.0.0.0:1", "--connect", "tcp/127.0.0.1:1"), 3, "--insecure"),
        (
            ("--vhub-listen", "127.0.0.1:0", "--connect", "tcp/127.0.0.1:1", "--capture", "a.mcap", "--no-capture"),
            2,
            "--no-capture and --capture exclude each other, 'a.mcap'",
        ),
        (("--run", "nope"), 1, "no run 'nope'"),
    ],
)
def test_a_process_without_what_its_roles_need_is_refused(
    typed: Typed, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], code: int, problem: str
) -> None:
    done = typed("role", "roles")("main", *options)
    assert done.code == code and problem in done.err
