"""Matches: the figures against tables, a game's sides and network, the picture."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.table.players import OF_THE_TABLE
from foosim.simulation.match.figures import chance, draw, figures
from foosim.simulation.match.game import Fixture, Game, Link, Played, played, points_of, run_of, sets_of
from foosim.simulation.study.run import ran

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
CLASSES = OF_THE_TABLE["team"], OF_THE_TABLE["passive"]
SECOND_TICKS = 500


def fixture(*, ticks: int = SECOND_TICKS, worse: tuple[int, ...] = (0,), sets: tuple[str, ...] = ()) -> Fixture:
    text = apply_sets(TABLE.read_text(), TABLE.name, ["engine=pure", *sets])
    return Fixture(text, TABLE.name, TABLE.parent, CLASSES, ticks, worse)


def play(chosen: Fixture, game: Game) -> Played:
    return played(chosen, game, ran(run_of(chosen, game)))


def test_chance_is_two_sided_and_leaves_equals_alone() -> None:
    assert chance(2, 10) == chance(8, 10) == pytest.approx(112 / 1024)
    assert chance(5, 10) == chance(0, 0) == 1.0
    assert chance(0, 8) == pytest.approx(2 / 256)


def test_figures_count_for_the_first_player_whatever_its_side() -> None:
    games = [
        Played(1, False, (3, 1), 2, 30_000, ""),
        Played(2, True, (0, 4), 0, 30_000, ""),
        Played(3, False, (2, 2), 1, 30_000, ""),
        Played(4, True, (5, 0), 0, 30_000, ""),
    ]
    found = figures(games, 2_000_000)
    assert (found.won, found.drawn, found.lost, found.points, found.minutes) == (2, 1, 1, (10, 7), 4.0)
    assert found.wins is not None and found.wins.value == pytest.approx(2 / 3)
    assert (found.difference.value, found.away_per_minute.value) == (0.75, 0.75)


def test_a_swapped_game_has_the_first_player_in_blue() -> None:
    chosen = fixture()
    text = apply_sets(chosen.text, chosen.name, sets_of(chosen, Game(7, is_swapped=True)))
    deployment = load_deployment(text, chosen.name)
    assert deployment.seed == 7
    assert deployment.players["player-red"].class_ == OF_THE_TABLE["passive"]
    assert deployment.players["player-blue"].class_ == OF_THE_TABLE["team"]


def test_points_are_those_of_the_players_whatever_their_sides() -> None:
    score = {"red": 3, "blue": 1}
    assert (points_of(score, is_swapped=False), points_of(score, is_swapped=True)) == ((3, 1), (1, 3))


@pytest.mark.parametrize(("worse", "names"), [((0,), ["player-blue"]), ((0, 1), ["player-blue", "player-red"])])
def test_a_worse_network_is_that_of_whom_it_is_for(worse: tuple[int, ...], names: list[str]) -> None:
    chosen = fixture(worse=worse)
    text = apply_sets(chosen.text, chosen.name, sets_of(chosen, Game(7, is_swapped=True, link=Link(20_000_000, 0.1))))
    rules = yaml.safe_load(text)["network"]["links"]
    own = [rule for rule in rules if rule["id"].startswith("match-")]
    assert rules[len(own) :] == yaml.safe_load(chosen.text)["network"]["links"], "the deployment's own come after them"
    assert {rule["delay"] for rule in own} == {"20 ms"} and {rule["loss"] for rule in own} == {"10 %"}
    ends = {(rule["from"], rule["to"]) for rule in own}
    assert ends == {pair for name in names for pair in (("*", name), (name, "*"))}


def test_a_game_is_repeated_by_its_seed_and_a_network_changes_it() -> None:
    chosen = fixture(ticks=SECOND_TICKS // 2)
    game = Game(3, is_swapped=False)
    first, again = play(chosen, game), play(chosen, game)
    assert first == again and not first.failed and first.ticks == SECOND_TICKS // 2
    late = play(chosen, Game(3, is_swapped=False, link=Link(50_000_000, 0.2)))
    assert late.digest != first.digest


def test_a_ball_that_leaves_the_table_is_counted() -> None:
    """Each kick-off is faster than the table's ball can be: it is in quarantine, and counts as off the table."""
    sets = ("table.ball.speed_limit=5 m/s", "table.rules.kickoff_speed=10 m/s", "table.rules.kickoff_delay=20 ms")
    chosen = fixture(ticks=2 * SECOND_TICKS, sets=(*sets, "table.rules.off_table_after=100 ms"))
    assert play(chosen, Game(1, is_swapped=False)).away >= 5


def test_a_game_ends_when_the_rules_say_so() -> None:
    chosen = fixture(ticks=4 * SECOND_TICKS, sets=("table.rules.match={duration: 1 s}",))
    found = play(chosen, Game(1, is_swapped=False))
    assert not found.failed and 1.5 * SECOND_TICKS <= found.ticks <= 2 * SECOND_TICKS, "500 ms of kick-off, 1 s of play"


def test_a_player_that_fails_ends_its_game_with_the_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "tripping.py").write_text(
        "from foosim import Player\n"
        "class Tripping(Player):\n"
        "    def act(self, tick, samples): raise RuntimeError('fell over')\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    chosen = fixture()
    failing = Fixture(chosen.text, chosen.name, chosen.folder, ("tripping:Tripping", CLASSES[1]), SECOND_TICKS)
    found = play(failing, Game(1, is_swapped=False))
    assert "fell over" in found.failed and "player-red" in found.failed


def test_the_picture_has_a_mark_and_an_interval_for_each_row() -> None:
    from matplotlib.figure import Figure  # each worker that collects would take 0.4 s

    cells = []
    for delay_ms in (0, 20, 50):
        for loss in (0.0, 0.1):
            link = Link(delay_ms * 1_000_000, loss)
            games = [Played(seed, False, (3 - delay_ms // 20, seed), 0, 30_000, "", link=link) for seed in (1, 2)]
            cells.append((link, figures(games, 2_000_000)))
    figure = Figure()
    draw(figure, cells, ("team & co (A)", "team (B)"), "team & co against team")
    left, right = figure.axes
    assert left.get_legend_handles_labels()[1] == ["loss 0 %", "loss 10 %"]
    assert [len(axes.containers) for axes in (left, right)] == [2, 4], "a line for each loss, of both on the right"
    line, _, (bars,) = left.containers[0]
    assert line.get_xdata().tolist() == [0.0, 20.0, 50.0]
    assert line.get_ydata().tolist() == [found.difference.value for link, found in cells if not link.loss]
    ends = [(segment[0][1], segment[1][1]) for segment in bars.get_segments()]
    assert ends == [pytest.approx((one.difference.low, one.difference.high)) for link, one in cells if not link.loss]
