"""What a player foresees of its rods, by their readings and its own commands, against what they do."""

from __future__ import annotations

from random import Random
from typing import Final

import pytest

from foosim.library.table.encoder import RodPosition
from foosim.library.table.players.motors import Motion, Motors
from foosim.library.table.players.senses import rods_of
from foosim.library.table.rod_drives import RodLimits
from foosim.library.table.rod_position import Command
from foosim.library.table.settings import table_of
from foosim.simulation.simulation import Simulation
from foosim.world.components.entities import mounting_of
from foosim.world.layout import build_layout
from tests.deployed import DEPLOYMENT, TABLE

PERIOD: Final = 5
LATE: Final = 5
"""Ticks that a reading is old, and that a command takes."""
TURNS: Final = 60
SEED: Final = 3


def motors(name: str) -> Motors:
    layout = build_layout(DEPLOYMENT)
    limits = RodLimits(mounting_of(DEPLOYMENT, layout, layout[name]))
    return Motors(table_of(DEPLOYMENT).drive, limits, DEPLOYMENT.tick_ns)


@pytest.mark.parametrize("name", ["red.goal", "blue.midfield"])
def test_a_rod_is_where_its_player_foresees_it(name: str) -> None:
    """Random set-points every 10 ms; readings are 10 ms old, and a command is there 10 ms later."""
    random, foreseen = Random(SEED), motors(name)
    most = table_of(DEPLOYMENT).lines[name.split(".")[1]].half_stroke  # type: ignore[index]
    coming: dict[int, Command] = {}
    places: dict[int, tuple[float, float]] = {}
    expected: dict[int, tuple[float, float]] = {}
    with Simulation(TABLE) as simulation:
        for _ in range(TURNS * PERIOD):
            tick = simulation.frame.tick
            slide, spin = simulation.frame.vector(name, "joint_positions", 2)
            places[tick] = slide, spin
            if tick % PERIOD == 0 and tick >= LATE:
                foreseen.see(tick - LATE, *places[tick - LATE])
                found = foreseen.at(tick + LATE)
                expected[tick + LATE] = found[0].at, found[1].at
                command = Command(random.uniform(-most, most), random.uniform(-1.5, 1.5))
                foreseen.note(tick + LATE, command.slide, command.spin)
                coming[tick + LATE] = command
            simulation.step({name: coming.pop(tick)} if tick in coming else {})
    compared = [(expected[tick], places[tick]) for tick in expected if tick in places]
    assert len(compared) > TURNS // 2
    slides = [abs(there[0] - at[0]) for there, at in compared]
    spins = [abs(there[1] - at[1]) for there, at in compared]
    read = max([abs(places[tick][1] - places[tick - 2 * LATE][1]) for tick in expected if tick in places])
    print(f"seed {SEED}: off by {1e3 * max(slides):.2f} mm, {max(spins):.3f} rad; the newest reading by {read:.2f} rad")
    assert max(slides) < 1e-3
    assert max(spins) < 0.06 < 0.1 * read


def test_a_reading_that_is_not_newer_changes_nothing() -> None:
    found = motors("red.goal")
    found.see(10, 0.01, 0.2)
    found.see(10, 0.05, 1.0)
    found.see(5, 0.05, 1.0)
    assert found.at(10) == (Motion(0.01, 0.0), Motion(0.2, 0.0))
    assert found.at(20) == found.at(10), "nobody has told it to move"


def test_how_long_a_swing_takes() -> None:
    """As many ticks as its motor needs step by step, and never more than what is asked for."""
    (rod,) = rods_of(DEPLOYMENT, "red", ["midfield"])
    rod.see(RodPosition(0.0, 0.7), 0)
    rod.note(rod.command(0.0, 1.25), 0)
    tick_s, tick = DEPLOYMENT.tick_ns * 1e-9, 0
    while rod.swing < 0.0:
        tick += 1
        rod.foresee(tick)
    time_s = rod.swing_s(Motion(-0.7, 0.0), 0.0, 1.25 * rod.spin_gain)
    assert (tick - 1) * tick_s < time_s <= tick * tick_s
    assert rod.swing_s(Motion(-0.7, 0.0), 0.0, -10.0) == 0.1, "never there"
