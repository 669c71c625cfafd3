"""Commands as a person types them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest


class Done(NamedTuple):
    """What a command left."""

    code: object
    out: str
    err: str


Command = Callable[..., Done]
Typed = Callable[[str, Callable[[], None]], Command]


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Typed:
    """Makes what runs a program, by its name and entry point, with arguments in an empty folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.chdir(tmp_path)

    def make(program: str, main: Callable[[], None]) -> Command:
        def run(*arguments: str | Path) -> Done:
            monkeypatch.setattr(sys, "argv", [program, *map(str, arguments)])
            with pytest.raises(SystemExit) as ended:
                main()
            printed = capsys.readouterr()
            return Done(ended.value.code, printed.out, printed.err)

        return run

    return make
