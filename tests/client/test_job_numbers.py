"""The commands of jobs: which number they have, when they are sent again, and what a reading makes of them."""

from __future__ import annotations

import re
from pathlib import Path
from runpy import run_path
from typing import Any, Final

import numpy as np
import pytest

from foosim.client.commands import CommandEncoder
from foosim.client.jobs import Jobs
from foosim.client.player import Sample
from foosim.client.vectors import CommandVector
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.loader import load_deployment
from foosim.library.mobile.go_to import Place
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import find_component
from foosim.world.components.job_reading import Jobs as Reading
from tests.kinematic_yard import yard_text

GUIDE: Final = Path(__file__).parents[2] / "docs" / "how-to" / "give_jobs.md"
SCOUT: Final[dict[str, Any]] = {
    "model": "holonomic",
    "actuators": {"drive": {"kind": "go_to"}},
    "sensors": {"jobs": {"kind": "job", "actuator": "drive", "rate": "5 Hz"}},
}
PLAYER: Final = {"class": "foosim.client.player:Player", "rate": "10 Hz"}
TWICE: Final = {
    **SCOUT,
    "at": {"y": "2 m"},
    "sensors": {"a": SCOUT["sensors"]["jobs"], "b": SCOUT["sensors"]["jobs"]},
}
PLAIN: Final = {"model": "holonomic", "at": {"x": "1 m"}, "sensors": {}}
SILENT: Final = {**SCOUT, "at": {"y": "1 m"}, "sensors": {}}
DEPLOYMENT: Final = load_deployment(
    yard_text({"scout": SCOUT, "plain": PLAIN, "silent": SILENT}, clients={"a": {}, "hand": {}, "z": {}}), "yard.yaml"
)
PLAYERS: Final = load_deployment(
    yard_text(
        {"scout": SCOUT, "twice": TWICE},
        players={"deaf": PLAYER | {"robots": {"scout": []}}, "one": PLAYER | {"robots": {"twice": ["b"]}}},
    ),
    "yard.yaml",
)
RUNNING: Final = JobState.RUNNING


def jobs() -> Jobs:
    return Jobs(DEPLOYMENT, "hand", "scout", "drive")


def hear(its: Jobs, number: float, state: float, running: float = 0.0, others: float = 0.0) -> None:
    """Tell it of its last job, and of the numbers of the others."""
    reading = Reading(running, 0.0, (others, number, others), (0.0, state, 0.0))
    its.hear({its.heard: Sample(*its.heard, 1, 0, 0, reading)})


def sent(its: Jobs, ticks: range) -> list[tuple[int, float]]:
    """At which ticks a command is sent, with its job."""
    found = [(tick, its.due(tick)) for tick in ticks]
    return [(tick, command.job) for tick, command in found if command is not None]


def test_nothing_is_sent_before_a_reading_tells_the_last_number() -> None:
    its = jobs()
    job = its.call(1.0, 2.0)
    assert sent(its, range(50)) == []
    assert job.number is None
    hear(its, 0.0, 0.0)
    assert sent(its, range(50, 51)) == [(50, 51.0)]
    assert job.number == 51


def test_a_number_is_above_the_tick_and_above_all_that_were_told_of() -> None:
    """A command of a life before, which no reading has told of yet, has a number of a tick before."""
    its = jobs()
    hear(its, 900.0, JobState.DONE, others=5000.0)
    its.call(1.0, 2.0)
    assert sent(its, range(20, 21)) == [(20, 901.0)]
    its.call(1.0, 2.0)
    assert sent(its, range(20, 21)) == [(20, 902.0)]
    its.call(1.0, 2.0)
    assert sent(its, range(7000, 7001)) == [(7000, 7001.0)]


def test_it_is_sent_each_100_ms_until_it_was_taken() -> None:
    its = jobs()
    hear(its, 0.0, 0.0)
    job = its.call(1.0, 2.0)
    assert sent(its, range(25)) == [(0, 1.0), (10, 1.0), (20, 1.0)]
    hear(its, 1.0, RUNNING, 2.0)
    assert (job.state, its.running) == (RUNNING, "hand")
    assert sent(its, range(25, 100)) == []
    job.cancel()
    assert sent(its, range(100, 115)) == [(100, -1.0), (110, -1.0)]
    hear(its, 1.0, JobState.DONE)
    assert job.check(), "it was done before it could be cancelled"
    assert sent(its, range(115, 200)) == []


def test_a_job_that_nobody_was_told_of_is_cancelled_at_once() -> None:
    its = jobs()
    job = its.call(1.0, 2.0)
    job.cancel()
    hear(its, 0.0, 0.0)
    assert job.state == JobState.CANCELLED
    assert sent(its, range(50)) == []


def test_commands_are_those_that_a_player_returns() -> None:
    its = jobs()
    hear(its, 0.0, 0.0)
    its.call(x=1.0, y=2.0)
    commands = its.commands(3)
    assert commands == {"scout": {"drive": Place(1.0, 2.0, 4.0)}}
    ((channel, payload),) = CommandEncoder(DEPLOYMENT).encode("scout", commands["scout"])
    assert (channel, len(payload)) == ("drive", 24)
    assert its.commands(4) == {}


@pytest.mark.parametrize(
    "reading",
    [
        Reading(4.0, 0.0, (0.0, 1.0, 0.0), (0.0, 1.0, 0.0)),
        Reading(0.5, 0.0, (0.0, 1.0, 0.0), (0.0, 1.0, 0.0)),
        Reading(2.0, 0.0, (0.0, 1.0, 0.0), (0.0, 9.0, 0.0)),
        Reading(2.0, 0.0, (1.0,), (1.0,)),
    ],
)
def test_a_reading_that_the_network_has_changed_is_passed_over(reading: Reading) -> None:
    its = jobs()
    its.hear({its.heard: Sample(*its.heard, 1, 0, 0, reading)})
    assert its.job is None
    assert its.running == ""


@pytest.mark.parametrize(
    ("about", "error", "text"),
    [
        (("hand", "plain", "motion"), BadValue, "plain/motion has no jobs"),
        (("hand", "silent", "drive"), BadValue, "silent has no sensor of the kind job"),
        (("foot", "scout", "drive"), UnknownName, r"takes no jobs from it \(there are: a, hand, z\)"),
        (("hand", "scout", "arm"), UnknownName, "scout has no such actuator"),
    ],
)
def test_what_takes_no_jobs_says_why(about: tuple[str, str, str], error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        Jobs(DEPLOYMENT, *about)


def test_a_player_reads_the_sensor_that_it_hears() -> None:
    assert Jobs(PLAYERS, "one", "twice", "drive").heard == ("twice", "b")
    with pytest.raises(BadValue, match="deaf does not hear jobs of scout"):
        Jobs(PLAYERS, "deaf", "scout", "drive")


def test_the_guides_simulation_comes_to_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    blocks = re.findall(r"```\w+\n# (\S+)\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    for name, text in blocks:
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    assert [name for name, _ in blocks] == ["scout.yaml", "send.py", "walk.py"]
    run_path("walk.py")
    assert re.fullmatch(r"there at [2-6]\.\d s\n", capsys.readouterr().out)


def test_what_learns_gives_plain_commands() -> None:
    """The number of a job is neither a column of an action nor in the packet."""
    vector = CommandVector(DEPLOYMENT, ["scout"])
    assert [column.field for column in vector.columns] == ["x", "y"]
    (packet,) = vector.packets(np.array([1.0, 2.0]))
    assert codec_of(find_component("actuator", "go_to")).decode(packet.payload) == Place(1.0, 2.0)
