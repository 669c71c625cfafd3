"""Players whose own code raises: the run ends in order and says who, when, what, and where in the user's own files."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from foosim.cli.capture.command import app as replay_app
from foosim.cli.rehearse import app
from foosim.world.component_types.failures import failure_of
from tests.turns import BY_PERIOD

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
SOURCE = """
import json
import sys

from foosim import Player

class Base(Player):
    def act(self, tick, samples):
        print("at", tick)
        return {} if tick < 50 else self.fails()

class Leaves(Base):
    def fails(self):
        sys.exit(0)

class Misses(Base):
    def fails(self):
        return {}["a"]  # there is none

class InLibrary(Base):
    def fails(self):
        return json.loads("{")

class Unmade(Player):
    def __init__(self, deployment, parameters):
        raise SystemExit("no \\n" * 2)

    def act(self, tick, samples):
        return {}
"""
LINES = SOURCE.splitlines()


def place(code: str) -> str:
    (line,) = [number for number, text in enumerate(LINES, 1) if text.strip() == code]
    return f"(own_failing.py:{line})"


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A module of somebody's own, on the path."""
    (tmp_path / "own_failing.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_failing", raising=False)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "when", "what", "code"),
    [
        ("Leaves", "at tick 50", "SystemExit: 0", "sys.exit(0)"),
        ("Misses", "at tick 50", "KeyError: 'a'", 'return {}["a"]  # there is none'),
        ("InLibrary", "at tick 50", "JSONDecodeError: Expecting property name", 'return json.loads("{")'),
        ("Unmade", "before its first tick", "SystemExit: no no", 'raise SystemExit("no \\n" * 2)'),
    ],
)
def test_a_rehearsal_ends_in_order_and_says_where(own: Path, name: str, when: str, what: str, code: str) -> None:
    capture = own / "run.mcap"
    arguments = [str(TABLE), "--for", "0.3 s", "--engine", "pure", "--json", "--capture", str(capture)]
    sets = (*BY_PERIOD, f"players.player-blue.class=own_failing:{name}")
    ran = CliRunner().invoke(app, [*arguments, *(word for text in sets for word in ("--set", text))])
    assert ran.exit_code == 1
    result = json.loads(ran.stdout)  # it has nothing else, whatever players print
    assert result["failed"] and result["ticks"] == (51 if when == "at tick 50" else 0)
    assert result["reason"].startswith(f"player-blue failed {when}: {what}")
    assert result["reason"].endswith(place(code))
    told = f"player-blue: error: {result['reason']}"
    assert "Traceback (most recent call last):" in ran.stderr and told in ran.stderr
    assert ("at 45\n" in ran.stderr) == (when == "at tick 50"), "what it prints"
    told = CliRunner().invoke(replay_app, ["info", str(capture)]).stdout
    assert "finished" not in told and "whole, of a run that failed" in told and f"reason: {result['reason']}" in told


class Silent(Exception):
    """One that cannot even say what it is."""

    def __str__(self) -> str:
        raise ValueError


def test_whatever_an_error_says_it_is_one_line() -> None:
    assert failure_of(Silent(), "own") == "Silent: its text cannot be read"
    assert failure_of(ValueError("a\n b" * 1000), "own").endswith("...")
    assert failure_of(KeyboardInterrupt(), "own") == "KeyboardInterrupt"
