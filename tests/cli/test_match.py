"""The command `foosim match`: what it prints, what it refuses, exit codes."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.cli.match import command as match
from foosim.simulation.match.game import Game
from foosim.simulation.study.run import Ran, Run
from tests.conftest import Command, Typed

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
WAREHOUSE: Final = TABLE.with_name("warehouse.yaml")
RED: Final = "players.player-red"
UNKNOWN: Final = (
    "A: no such player (there are: keeper, passive, striker, team, or module:Class of your own), 'teem', "
    "nearest is 'team'"
)
SHORT: Final = ("--deployment", TABLE, "--minutes", "0.01", "--set", "engine=pure", "--jobs", "1")


@pytest.fixture
def command(typed: Typed) -> Command:
    """Runs `foosim match`."""
    return typed("match")


def test_a_match_has_a_line_for_each_game_and_a_table(command: Command, tmp_path: Path) -> None:
    done = command("team", "passive", "--games", "2", "--seed", "5", "--captures", tmp_path / "games", *SHORT)
    assert done.code == 0, done.err
    lines = done.err.splitlines()
    assert lines[0].startswith("game 1 of 2: seed 5, team red, passive blue: team ")
    assert lines[1].startswith("game 2 of 2: seed 6, passive red, team blue: team ")
    assert "team against passive: 2 games of 0.01 min" in done.out
    assert "share of wins" in done.out and "away a minute" in done.out
    assert sorted(path.name for path in (tmp_path / "games").iterdir()) == ["seed-5.mcap", "seed-6.mcap"]
    assert open_capture(tmp_path / "games" / "seed-6.mcap").deployment.seed == 6
    again = command("team", "passive", "--games", "2", "--seed", "5", "--captures", tmp_path / "games", *SHORT)
    assert again.code == 3 and "seed-5.mcap: exists already" in again.err


def test_worse_networks_have_a_row_each_and_a_picture(command: Command, tmp_path: Path) -> None:
    drawing = tmp_path / "cost.svg"
    words = ("--games", "1", "--delay", "0,20ms", "--loss", "0,10%", "--picture", drawing, "--json")
    done = command("team", "team", *words, *SHORT)
    assert done.code == 0, done.err
    found = json.loads(done.out.splitlines()[-1])
    assert [(cell["link"]["delay_ns"], cell["link"]["loss"]) for cell in found["figures"]] == [
        (delay, loss) for delay in (0, 20_000_000) for loss in (0.0, 0.1)
    ]
    assert found["worse_for"] == "a" and len(found["games"]) == 4
    assert len({game["digest"] for game in found["games"]}) == 4, "each network gives another game"
    assert [game["metrics"]["network.encoder.loss"] > 0.03 for game in found["games"]] == [False, True] * 2
    assert "loss 10 %" in drawing.read_text()


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["teem", "passive"], UNKNOWN),
        (["team", "nowhere:Class"], "B: there is no module nowhere"),
        (["team", "foosim.library.table.players.football:Taem"], "B: "),
        (["team", "passive", "--games", "0"], "--games"),
        (["team", "passive", "--minutes", "0"], "--minutes"),
        (["team", "passive", "--jobs", "0"], "--jobs"),
        (["team", "passive", "--worse-for", "c"], "--worse-for: not a side (there are: a, b, both), 'c'"),
        (["team", "passive", "--delay", "fast"], "--delay"),
        (["team", "passive", "--delay", "0,,5ms"], "--delay: a list with commas is needed"),
        (["team", "passive", "--delay", "5,5ms"], "--delay: a value is there twice"),
        (["team", "passive", "--loss", "100%"], "--loss: out of range"),
        (["team", "passive", "--picture", "cost.svg"], "--picture: there is nothing to draw"),
        (["team", "passive", "--delay", "1ms", "--picture", "cost.jpg"], "--picture: the name of the picture ends"),
        (["team", "passive", "--deployment", "none.yaml"], "none.yaml: there is no such file"),
        (["team", "passive", "--deployment", str(WAREHOUSE)], "a world with a rule that keeps the score of two sides"),
        (["team", "passive", "--set", f"{RED}.parameters.team=blue"], "the parameter `team: red`; there are: none"),
        (
            ["team", "passive", *(f"--set={RED}.{key}" for key in ("lockstep=false", "act=period", "arrivals={}"))],
            "a match is played in lockstep",
        ),
        (["team", "passive", "--set", "table.ball.mass=heavy"], "mass"),
    ],
)  # fmt: skip
def test_bad_input_is_refused_without_a_traceback(command: Command, words: list[str], problem: str) -> None:
    given = [*words] if "--deployment" in words else [*words, "--deployment", str(TABLE)]
    done = command(*given)
    assert done.code == 2, (done.code, done.err)
    assert problem in done.err and "Traceback" not in done.err


def test_a_player_that_raises_ends_the_match_with_its_place(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "stumbling.py").write_text(
        "from foosim import Player\n"
        "class Stumbling(Player):\n"
        "    def __init__(self, deployment, parameters):\n"
        "        if deployment.seed == 2:\n"
        "            raise RuntimeError('no shoes')\n"
        "    def act(self, tick, samples):\n"
        "        return {}\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    done = command("passive", "stumbling:Stumbling", "--games", "3", *SHORT)
    assert done.code == 1
    assert "seed 2, stumbling:Stumbling red, passive blue: " in done.err and "no shoes" in done.err
    assert "passive against stumbling:Stumbling: 1 of 3 games" in done.out, "what was played before is shown"


def test_an_interrupted_match_shows_what_has_been_played(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """The third game is interrupted, as by Ctrl-C."""

    def outcomes(runs: Mapping[Game, Run], *_: Any) -> Iterator[tuple[Game, Ran]]:
        for number, game in enumerate(runs):
            if number == 2:
                raise KeyboardInterrupt
            red, blue = (1, 2) if game.is_swapped else (2, 1)
            yield game, Ran({"score.red": red, "score.blue": blue, "ticks": 5, "digest": "", "marks.out": 0}, "")

    monkeypatch.setattr(match, "outcomes", outcomes)
    done = command("team", "passive", "--games", "9", *SHORT)
    assert done.code == 130
    assert "interrupted after 2 of 9 games" in done.err
    assert done.out.startswith("team against passive: 2 of 9 games of 0.01 min, figures of team")
    assert done.out.splitlines()[-1].split()[:3] == ["2", "0", "0"]


@pytest.mark.campaign
def test_results_come_in_the_order_of_the_games_from_several_processes(command: Command) -> None:
    words = ("passive", "passive", "--games", "3", "--json", *SHORT[:-1])
    found: list[Any] = []
    for jobs in ("1", "2"):
        done = command(*words, jobs)
        assert done.code == 0, done.err
        found.append(json.loads(done.out.splitlines()[-1])["games"])
    assert found[0] == found[1]
    assert [game["seed"] for game in found[0]] == [1, 2, 3]


@pytest.fixture(autouse=True)
def _from_no_folder_of_players(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Modules of a test are forgotten."""
    import sys

    before = set(sys.modules)
    yield
    for name in ("stumbling",):
        if name not in before:
            sys.modules.pop(name, None)
