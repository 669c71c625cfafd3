"""`spare:` of fleets and of single robots and objects: who is absent at the start, and what is no spare."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.world.layout import build_layout
from foosim.world.models.rover import RoverRobot
from tests.deployment.halls import PATROL, ROVER, hall
from tests.kinematic_yard import yard_text

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
FLEET: Final = "{like: rover, x: -15 m, y: 10 m, spacing: {x: 2 m}"
BOX: Final = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "at": {"z": "10 cm"}}


def rovers(entries: str) -> dict[str, tuple[float, bool]]:
    """Return where along x the rovers of a small hall start, and whether each is a spare."""
    found = {}
    for name, robot in load_deployment(hall(f"{ROVER}robots:\n  {entries}\n"), "hall").robots.items():
        assert isinstance(robot, RoverRobot)
        found[name] = robot.x, robot.spare
    return found


def test_a_fleet_has_spares_behind_its_count() -> None:
    present, spares = {"r-1": (-15.0, False), "r-2": (-13.0, False)}, {"r-3": (-11.0, True), "r-4": (-9.0, True)}
    assert rovers(f"r: {FLEET}, count: 2, spare: 2}}") == {**present, **spares}


def test_a_fleet_may_be_of_spares_alone() -> None:
    assert rovers(f"r: {FLEET}, spare: 2}}") == {"r-1": (-15.0, True), "r-2": (-13.0, True)}


def test_one_may_be_a_spare_and_so_may_a_whole_fleet() -> None:
    alone = "one: {like: rover, x: 1 m, y: 1 m, spare: true}"
    assert rovers(f"{alone}\n  two: {{like: rover, x: 3 m, y: 1 m, spare: false}}") == {
        "one": (1.0, True),
        "two": (3.0, False),
    }
    assert rovers(f"r: {FLEET}, count: 2, spare: true}}") == {"r-1": (-15.0, True), "r-2": (-13.0, True)}


def test_what_is_written_of_one_of_a_fleet_counts() -> None:
    own = "r-1: {spare: true}\n  r-3: {x: 7 m}\n  r-4: {spare: false}"
    assert rovers(f"r: {FLEET}, count: 2, spare: 2}}\n  {own}") == {
        "r-1": (-15.0, True),
        "r-2": (-13.0, False),
        "r-3": (7.0, True),
        "r-4": (-9.0, False),
    }


def test_objects_have_spares_too_and_a_set_changes_how_many() -> None:
    text = yard_text({"w": {"model": "holonomic"}}, engine="mujoco", objects={"b": {**BOX, "spare": 2}})
    assert build_layout(load_deployment(text, "y")).spares == {"b-1", "b-2"}
    more = apply_sets(text, "y", ["objects.b.count=1", "objects.b.spare=3", "robots.w.spare=true"])
    layout = build_layout(load_deployment(more, "y"))
    assert layout.spares == {"b-2", "b-3", "b-4", "w"} and "b-1" in layout
    assert apply_sets(more, "y", []) == more


def test_nodes_and_players_have_the_spares_of_a_fleet() -> None:
    pilots = (
        f"players:\n  p-$1: {{each: '*', class: '{PATROL}', rate: 10 Hz, on: $robot, robots: {{$robot: [pose]}}}}\n"
    )
    nodes = "nodes:\n  a: {robots: ['*-1']}\n  b: {robots: ['*-2']}\n"
    text = hall(f"{ROVER}robots:\n  r: {FLEET}, count: 1, spare: 1}}\n{nodes}{pilots}")
    deployment = load_deployment(text, "hall")
    assert deployment.owners() == {"r-1": "a", "r-2": "b"}
    assert {player.on for player in deployment.players.values()} == {"r-1", "r-2"}


@pytest.mark.parametrize("fixed", [True, False])
def test_what_is_fixed_is_no_spare(fixed: bool) -> None:
    """Whether it moves freely follows from its file: it is refused when that is there."""
    arm = {"model": "urdf", "file": "arm.urdf", "at": {"z": "1 m"}, "fixed": fixed, "spare": True}
    text = yard_text({"arm": arm | ({} if fixed else {"speed_limit": "9 m/s"})}, engine="mujoco", assets="models")
    if not fixed:
        pinned, files = pin_assets(text, "y", DEPLOY)
        assert build_layout(load_deployment(pinned, "y").with_assets(files)).spares == {"arm"}
        return
    line = 1 + next(number for number, its in enumerate(text.splitlines()) if "spare: true" in its)
    with pytest.raises(DeploymentError) as refused:
        pin_assets(text, "y", DEPLOY)
    (told,) = refused.value.problems
    assert told.startswith(f"y:{line}:") and told.endswith(
        "robots.arm.spare: a spare that could not be absent: an urdf without a place of its own, true"
    )
