"""Training, and the command around it: what is learned from, that it repeats, and what is written."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from foosim.players.learning.exercises import DEFEND
from foosim.players.learning.learned import SHIPPED, read_policy
from foosim.rehearsal.learning import main
from foosim.rehearsal.learning.chart import Point, curve_svg
from foosim.rehearsal.learning.main import app
from foosim.rehearsal.learning.shots import Network, Range, size_of
from foosim.rehearsal.learning.training import POLICIES, TEST_EVERY, Measured, train

SVG = "{http://www.w3.org/2000/svg}"


def test_training_repeats_and_each_generation_meets_other_shots() -> None:
    told: list[Measured] = []
    first = train(1, 3, 1, shots=1, tests=2, report=told.append)
    assert first.curve == told and [(one.generation, one.shots) for one in told] == [(0, 0), (1, POLICIES)]
    again = train(1, 3, 1, shots=1, tests=2)
    assert again == first and len(first.file.weights) == size_of(DEFEND.untrained)


def test_the_time_ends_training_between_generations() -> None:
    curve = train(9, 1, 1, shots=1, tests=1, goes_on=lambda: False).curve
    assert [one.generation for one in curve] == [0, 1] and TEST_EVERY > 1


def test_what_was_shipped_saves_more_than_who_stands_still() -> None:
    shots = range(12, 26)
    there = Range(DEFEND)
    file = read_policy(SHIPPED)
    still, learned = sum(there.wins([0.0] * size_of(file), shots)), sum(there.wins(file.weights, shots))
    there.close()
    assert learned >= still + 4, (still, learned)


def test_delay_costs_saves() -> None:
    saved = []
    for delay_ms in (0.0, 80.0):
        there = Network(DEFEND, delay_ms)
        saved.append(sum(there.wins(range(100, 108))))
        there.close()
    assert saved[0] > saved[1], saved


def test_the_command_counts_and_draws(tmp_path: Path) -> None:
    picture = tmp_path / "curve.svg"
    arguments = ["delays", "--delay", "0 ms, 20 ms", "--shots", "2", "--picture", str(picture)]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    lines = done.stdout.splitlines()
    assert [line.partition(":")[0] for line in lines] == ["0 ms", "20 ms"] and "of 2 shots" in lines[0]
    assert len(ElementTree.fromstring(picture.read_text()).findall(f"{SVG}circle")) == 2
    told = CliRunner().invoke(app, [*arguments[:-2], "--json"]).stdout
    assert [row["delay_ms"] for row in json.loads(told)] == [0, 20]


def test_the_command_refuses_what_is_not_valid(tmp_path: Path) -> None:
    for arguments, words in (
        (["delays", "--delay", "3"], "--delay: "),
        (["delays", str(tmp_path / "no.json"), "--shots", "1"], "a policy that cannot be read"),
        (["train", str(tmp_path / "no" / "policy.json")], "cannot be written: its folder is not there"),
        (["delays", "--picture", str(tmp_path / "no" / "curve.svg")], "cannot be written: its folder is not there"),
    ):
        done = CliRunner().invoke(app, arguments)
        assert words in str(done.exception), (arguments, done.exception)


def test_who_lacks_a_library_is_told_which(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(main, "LIBRARIES", ("cma", "no_such_library"))
    done = CliRunner().invoke(app, ["delays"])
    assert "not installed: no_such_library; pip install 'foosim[learn]'" in str(done.exception)


def test_a_curve_shows_each_point_at_its_share() -> None:
    tree = ElementTree.fromstring(curve_svg("A <b>", "x", "y", [Point(0.0, 0.0, 0.1), Point(10.0, 1.0, 0.0)]))
    first, last = tree.findall(f"{SVG}circle")
    assert (first.get("cx"), first.get("cy")) == ("60.0", "290.0")
    assert (last.get("cx"), last.get("cy")) == ("620.0", "40.0")
    assert "A <b>" in [text.text for text in tree.findall(f"{SVG}text")]


@pytest.mark.campaign
def test_training_improves_a_player(tmp_path: Path) -> None:
    """Sixteen generations: some minutes on two slow cores."""
    curve = train(16).curve
    assert curve[0].saved < 0.5 and max(one.saved for one in curve) > 0.8, curve
