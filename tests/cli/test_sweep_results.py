"""The commands `foosim sweep table` and `foosim sweep plot`: what they print and draw, and what they refuse."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from foosim.simulation.study.table import Table, write_table
from tests.conftest import Typed

DELAY, TEAM = "network.links.0.delay", "players.red.class"
COUNTS = {f"packets.{name}": 7 for name in ("offered", "delivered", "dropped", "in_flight", "refused")}


def row(delay: str, team: str, seed: int, score: float | None, message: str = "") -> dict[str, Any]:
    figures = {} if message else {"players.red.saves": 2.0, "ticks": 500, **COUNTS, "digest": "ab"}
    figures |= {} if score is None else {"score.red": score}
    ends = {"message": message, "study": "s", "foosim": "0.2.0"}
    return {DELAY: delay, TEAM: team, "seed": seed, **figures, **ends}


ROWS = [
    row("0ms", "a:B", 1, 1.0),
    row("0ms", "a:B", 2, 3.0),
    row("0ms", "[c, d]", 1, 5.0),
    row("0ms", "[c, d]", 2, None, "--set:1:3: out of range"),
    row("0ms", "[c, d]", 3, None, "--set:1:3: out of range"),
    row("10ms", "a:B", 1, None),
    row("10ms", "a:B", 2, 4.0),
]


@pytest.fixture
def results(tmp_path: Path) -> Path:
    write_table(tmp_path / "results.csv", Table((DELAY, TEAM), ROWS))
    return tmp_path / "results.csv"


def test_a_table_has_a_row_for_each_group_and_names_what_it_leaves_out(typed: Typed, results: Path) -> None:
    done = typed("sweep", "table")(results)
    assert done.code == 0, done.err
    assert done.out.splitlines() == [
        f"{results}: 7 runs, 2 failed, means with 95 % in brackets",
        "network.links.0.delay  players.red.class  runs  failed          score.red",
        "                  0ms                a:B     2       0  2 [-10.71, 14.71]",
        "                  0ms             [c, d]     3       2                  5",
        "                 10ms                a:B     2       0             4 of 1",
        "not shown: 1 of 2 metrics, equal in all runs (--metric NAME)",
        "2 failed: --set:1:3: out of range",
    ]


def test_json_has_what_the_table_has(typed: Typed, results: Path) -> None:
    words = ("--by", TEAM, "--metric", "players.red.saves", "--metric", "score.red", "--json")
    done = typed("sweep", "table")(results, *words)
    found = json.loads(done.out)
    first, second = found["groups"]
    assert (first["parameters"], first["runs"], first["failed"]) == ({TEAM: "a:B"}, 4, 0)
    assert first["metrics"]["players.red.saves"] == {"value": 2.0, "low": 2.0, "high": 2.0}
    assert first["values"] == {"players.red.saves": 4, "score.red": 3}
    assert first["metrics"]["score.red"]["value"] == pytest.approx(8 / 3)
    assert second["metrics"]["score.red"] == {"value": 5.0, "low": None, "high": None}
    assert (found["not_shown"], found["messages"]) == (0, {"--set:1:3: out of range": 2})


def test_a_plot_has_the_names_of_what_it_shows_and_is_the_same_again(typed: Typed, results: Path) -> None:
    plot = typed("sweep", "plot")
    assert plot(results, "--metric", "score.red", "--metric", "players.red.saves").code == 0
    text = results.with_suffix(".svg").read_text()
    for label in (f"{DELAY}, ms", f"{TEAM}=[c, d]", "score.red", "players.red.saves", "7 runs, 2 failed"):
        assert label in text
    again = results.with_name("again.svg")
    assert plot(results, "--metric", "score.red", "--metric", "players.red.saves", "--out", again).code == 0
    assert again.read_text() == text
    other = results.with_name("other.svg")
    assert plot(results, "--metric", "score.red", "--x", TEAM, "--out", other).code == 0
    assert f"{DELAY}=10ms" in other.read_text()
    assert plot(results, "--metric", "score.red").code == 3, "results.svg is there"


@pytest.mark.parametrize(
    ("verb", "words", "problem"),
    [
        ("table", ["none.csv"], "none.csv: cannot be read, No such file"),
        ("table", ["results.txt"], "results.txt"),
        ("table", ["other.csv"], "other.csv"),
        ("table", ["empty.csv"], "empty.csv"),
        ("table", ["results.csv", "--metric", "score.rde"], "no such metric (there are: packets.delivered, "),
        ("table", ["results.csv", "--by", "players.red.clas"], "no such parameter (there are: "),
        ("plot", ["results.csv", "--metric", "score.rde"], "'score.rde', nearest is 'score.red'"),
        ("plot", ["results.csv", "--metric", "score.red", "--x", "seed"], "no such parameter (there are: "),
        (
            "plot",
            ["results.csv", "--metric", "score.red", "--out", "a.jpg"],
            "--out: the name of the picture ends with",
        ),
        ("plot", ["seeds.csv", "--metric", "score.red"], "seeds.csv: no parameter is varied"),
    ],
)
def test_bad_input_is_refused_and_draws_nothing(
    typed: Typed, results: Path, verb: str, words: list[str], problem: str
) -> None:
    folder = results.parent
    (folder / "other.csv").write_text("a,b\n1,2\n")
    (folder / "results.txt").write_text("")
    (folder / "empty.csv").write_text(results.read_text().splitlines()[0] + "\n")
    write_table(
        folder / "seeds.csv",
        Table((), [{name: one[name] for name in one if name not in (DELAY, TEAM)} for one in ROWS[:2]]),
    )
    done = typed("sweep", verb)(*words)
    assert done.code == (1 if words == ["none.csv"] else 2) and problem in done.err and "Traceback" not in done.err
    assert not [*folder.glob("*.svg")]
