"""Cat and Mouse: caught at each level of abstraction, with the same bits on any number of nodes."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import pytest

from foosim.simulation.run import rehearse
from foosim.simulation.simulation import Simulation
from tests.deployed import DEPLOY

FILE: Final[Path] = DEPLOY / "cat_and_mouse.yaml"
LEVELS: Final = ("by-pixels", "by-depth", "by-name", "by-destination")
GUIDE: Final = DEPLOY.parent / "docs" / "tutorials" / "cat_and_mouse.md"
TICKS_MAX: Final = 400
BOTH: Final = (("cat", "left"), ("cat", "right"))


def hunt(*sets: str) -> tuple[int, float | None, bytes]:
    """Return the first tick that is a multiple of ten and after the catch, the time of that (s) and the digest."""
    with Simulation(FILE, agents=[], network=True, sets=sets) as simulation:
        caught_s = None
        while caught_s is None and simulation.tick < TICKS_MAX:
            simulation.step(ticks=10)
            caught_s = simulation.status["catch mouse"]["caught_s"]
        return simulation.tick, caught_s, simulation.frame.digest


@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("level", LEVELS)
def test_the_mouse_is_caught_with_equal_bits_on_any_number_of_nodes(level: str, seed: int) -> None:
    """Of the three levels that share the code of the first one, one seed goes to nodes."""
    sets = (f"robots.cat.like={level}", f"seed={seed}")
    ticks, caught_s, digest = hunt(*sets)
    assert caught_s is not None
    (row,) = [line.split(" | ") for line in GUIDE.read_text().splitlines() if line.startswith(f"| `{level}`")]
    assert seed > 3 or f"{caught_s:g} s" == row[3 + seed].rstrip(" |"), "the guide's figures"
    counts = (1, 2, 3) if level == "by-name" else (3,) if seed == 2 else ()
    runs = [rehearse(FILE.read_text(), FILE.name, ticks, nodes, sets) for nodes in counts]
    assert {run.digests[-1] for run in runs} <= {digest}
    assert {run.json["catch mouse"]["caught_s"] for run in runs} <= {caught_s}


@pytest.mark.parametrize("level", LEVELS)
def test_a_cat_that_looks_away_first_looks_for_the_mouse(level: str) -> None:
    _, caught_s, _ = hunt(f"robots.cat.like={level}", "seed=2", "robots.cat.at.yaw=120 deg")
    assert caught_s is not None


def test_over_a_slow_link_names_catch_and_pictures_do_not() -> None:
    link = 'network={links: [{id: air, from: "*", to: "*", delay: 5 ms, rate: 1 Mbit/s}]}'
    caught = [hunt(f"robots.cat.like={level}", "players.player-cat.on=null", link)[1] for level in LEVELS[::2]]
    assert caught == [None, 5.525], "the guide's figures"


def test_nose_to_nose_both_eyes_see_the_mouse_however_it_is_turned() -> None:
    """The middle of the mouse is below the view, and most corners of its box are out of it."""
    for yaw in range(0, 90, 15):
        with Simulation(FILE, sets=("players={}", f"robots.mouse.at={{x: -4.855 m, yaw: {yaw} deg}}")) as simulation:
            simulation.step(ticks=4)
            looks: list[Any] = [simulation.readings[eye].value for eye in BOTH]
            seen = [[one.name for one in look.objects] for look in looks]
            assert seen == [["mouse"], ["mouse"]], yaw


def test_a_catch_counts_once_and_needs_who_is_there() -> None:
    with Simulation(FILE, sets=("players={}", "robots.mouse.spare=true", "robots.mouse.at.x=3 m")) as simulation:
        found = []
        for change in ("", "add", "away"):
            if change == "add":
                simulation.add("mouse", "-4.85,0")
            elif change == "away":
                simulation.set("mouse", "at", "3,0")
            simulation.step(ticks=4)
            found.append(simulation.status["catch mouse"]["caught_s"])
        first = found[1]
        assert found == [None, first, first] and first == 0.1
