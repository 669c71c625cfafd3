"""Robots that drive by their cameras: where they turn, and the same run on one and two nodes."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Final

import pytest

from foosim.simulation.run import rehearse
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import Settings
from tests.deployed import DEPLOY
from tests.frames import Frames

EYES: Final[Path] = DEPLOY / "eyes.yaml"
FEW: Final = ("robots.north.count=2", "robots.south.count=1")


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_robot_turns_to_where_more_floor_is_seen(side: float) -> None:
    """A wall is ahead, aslant: more of it is on the side to which the robot heads."""
    at = f"{{x: 0 m, y: {6.0 * side} m, yaw: {60.0 * side} deg}}"
    sets = ("robots.north.count=1", "robots.south.count=1", f"robots.north.at={at}", "robots.south.at={x: -9 m}")
    with Simulation(EYES, agents=[], network=True, sets=sets) as simulation:
        start = simulation.frame
        simulation.step(ticks=300)
        turned = simulation.frame.at("north-1", "heading") - start.at("north-1", "heading")
        assert -pi < turned * side < -pi / 4
        assert simulation.frame.vector("north-1", "position", 3)[0] > 1.0, "it drives along the wall"


def test_what_is_driven_by_pictures_is_equal_on_one_node_and_on_two() -> None:
    text, frames = EYES.read_text(), Frames()
    one = rehearse(text, EYES.name, 100, 1, FEW, Settings(on_commit=frames))
    assert one.digests == rehearse(text, EYES.name, 100, None, FEW).digests, "the declared nodes are two"
    first, last = frames.frames[0], frames.frames[-1]
    for name in ("north-1", "north-2", "south-1"):
        assert first.vector(name, "position", 3) != last.vector(name, "position", 3)
        assert not last.at(name, "blocked")
