"""The workshop: a robot on wheels fetches crates, and two cranes hand them over the border of two nodes, by jobs."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import dist
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import Settings, System
from foosim.world.frame import Frame
from tests.components.worlds import DEPLOY
from tests.frames import Frames

WORKSHOP: Final[Path] = DEPLOY / "workshop.yaml"
ROBOTS: Final = ("porter", "crane-west", "crane-east")
CRATES: Final = ("crate-1", "crate-2", "crate-3")
SHORT: Final = ("robots.porter.at.y=-1 m", "objects.crate.at.y=-1.6 m")
"""The first crate and the porter are nearer to the crane."""
TICKS: Final = 2_550


def run(nodes: int, prepare: Callable[[System], None] | None = None, **more: Any) -> Rehearsed:
    return rehearse(WORKSHOP.read_text(), WORKSHOP.name, TICKS, nodes, SHORT, prepare=prepare, folder=DEPLOY, **more)


@cache
def on_two() -> tuple[Rehearsed, list[Frame]]:
    frames = Frames()
    return run(2, settings=Settings(on_commit=frames)), frames.frames


def place(frame: Frame, name: str) -> tuple[float, float, float]:
    x, y, z = frame.vector(name, "position", 3)
    return x, y, z


def test_a_crate_is_fetched_and_handed_over_the_border() -> None:
    result, frames = on_two()
    crate = frames[0].layout["crate-1"].index
    holders = [[name for name in ROBOTS if frame.at(name, "gripper.held") == crate] for frame in frames]
    assert [its for its, before in zip(holders, [None, *holders], strict=False) if its != before] == [
        [], ["porter"], [], ["crane-west"], ["crane-west", "crane-east"], ["crane-east"], [],
    ]  # fmt: skip
    assert place(frames[-1], "crate-1") == pytest.approx((0.3, 0.0, 0.1), abs=0.01)
    assert result.json["zone east"]["in"] == 1 and result.json["handovers"] >= 1
    assert not any(frame.at(name, "quarantined") for frame in frames for name in (*ROBOTS, *CRATES))


@pytest.mark.campaign
def test_after_two_rounds_all_crates_are_where_they_were() -> None:
    with Simulation(WORKSHOP, agents=[], network=True) as simulation:
        start = simulation.frame
        simulation.step(ticks=38_000)
        left = [dist(place(start, name), place(simulation.frame, name)) for name in CRATES]
        print(*left)
        assert max(left) < 0.01 and not simulation.quarantined


def test_a_crate_that_is_missing_is_tried_again_until_it_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    with Simulation(WORKSHOP, agents=[], network=True, sets=SHORT) as simulation:
        simulation.set("crate-1", "at", "3,3")
        simulation.step(ticks=500)
        assert simulation.frame.at("porter", "gripper.failure") == 1.0
        simulation.add("crate-4", "-0.6,-1.61")
        simulation.step(ticks=150)
        assert simulation.frame.at("porter", "gripper.held") == simulation.frame.layout["crate-4"].index
        assert simulation.frame.at("porter", "gripper.failure") == 0.0
    out = capsys.readouterr().out.splitlines()
    assert len(out) >= 2 and all("porter/gripper: job" in line and "no object within reach" in line for line in out)
