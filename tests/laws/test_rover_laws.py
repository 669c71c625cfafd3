"""Laws 1 and 3 for a hall: any number of nodes, any moves, nodes that are lost: the same world, to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

import pytest

from foosim.protocol.draws import draw_key, draw_words
from foosim.protocol.frame import Frame
from foosim.rehearsal.bus import Weather
from foosim.rehearsal.rehearse import Rehearsed, rehearse
from foosim.rehearsal.swarm import fly
from foosim.rehearsal.system import Settings, System

TICKS: Final = 250
ROVERS: Final = 6
MOVES: Final = 60
NARROW: Final = (
    "hall.length=9 m",
    "hall.width=7 m",
    "scenery={shelf: {shape: box, z: 1 m, length: 2 m, width: 50 cm, height: 2 m, yaw: 20 deg}}",
    "robots.base.x=-4 m",
    "hall.station.charge_radius=1.6 m",
    "robots.rover01.charge=24 %",
    *(f"robots.rover0{number}.x={x} m" for number, x in enumerate((-2.5, 0, 2.5, -2.5, 0, 2.5), 1)),
    *(f"robots.rover0{number}.y={y} m" for number, y in enumerate((2.4, 2.4, 2.4, -2.4, -2.4, -2.4), 1)),
    *(f"players.pilot0{number}.parameters.cell_m=1.2" for number in range(1, ROVERS + 1)),
    "players.dispatch.parameters={cell_m: 1.2}",
)
"""Six rovers that meet all the time."""


@pytest.fixture(scope="module")
def text(fleet_text: Callable[..., str]) -> str:
    return fleet_text(ROVERS, *NARROW)


@pytest.fixture(scope="module")
def alone(text: str) -> Rehearsed:
    """The world on one node; its rovers drive, and meet."""
    frames: list[Frame] = []
    run = rehearse(text, "hall.yaml", TICKS, 1, settings=Settings(on_commit=frames.append))
    names = [rover.name for rover in frames[0].layout.rovers]
    drive = sum(any(frame.vector(name, "wheel_speeds", 2)) for frame in frames for name in names)
    assert drive > 0.5 * len(names) * TICKS
    near = 0
    for frame in frames:
        places = [frame.vector(name, "position", 2) for name in names]
        near += sum(0.0 < (x - u) * (x - u) + (y - v) * (y - v) < 1.44 for x, y in places for u, v in places)
    assert near > 50, "rovers that never meet prove nothing"
    return run


def shuffle(system: System) -> None:
    """Move random robots to random nodes, and rebuild random engines, at ticks that are drawn."""
    robots, nodes = sorted(system.supervisor.owners), sorted(system.solvers)

    def move(robot: str, word: int) -> None:
        others = [node for node in nodes if node != system.supervisor.owners[robot]]
        system.request("move", robot=robot, node=others[word % len(others)])

    for number in range(MOVES):
        robot, word, at, other, when, *_ = draw_words(draw_key(5, "moves"), number)
        system.at_tick(1 + at % (TICKS - 10), partial(move, robots[robot % len(robots)], word))
        system.at_tick(1 + when % (TICKS - 10), system.solvers[nodes[other % len(nodes)]].rebuild)


@pytest.mark.parametrize("nodes", [2, 3])
def test_nodes_moves_and_rebuilds_change_nothing(text: str, alone: Rehearsed, nodes: int) -> None:
    many = rehearse(text, "hall.yaml", TICKS, nodes, prepare=shuffle)
    assert many.digests == alone.digests and many.json["digest"] == alone.json["digest"]
    assert many.json["moves"] > MOVES // 2 and many.json["packets"] == alone.json["packets"]


def test_nodes_that_are_lost_and_come_back_change_nothing(text: str, alone: Rehearsed) -> None:
    def prepare(system: System) -> None:
        for tick, what in ((40, "kill n2"), (80, "start n2"), (120, "kill n1"), (130, "kill n3"), (160, "start n1")):
            verb, name = what.split()
            system.at_tick(tick, partial(getattr(system, verb), name))

    weather = Weather(11, delay_ns=100_000, spread_ns=2_000_000, loss=0.01, repeat=0.05)
    patient = [f"deadlines.{name}=1 h" for name in ("heartbeat", "tick_named", "tick_lost", "lockstep_fast")]
    run = rehearse(text, "hall.yaml", TICKS, 3, patient, Settings(weather=weather), prepare=prepare)
    assert run.digests == alone.digests
    told = [(entry["what"], entry["name"]) for entry in run.json["recoveries"]]
    assert told == [("node", "n2"), ("join", "n2"), ("node", "n1"), ("node", "n3"), ("join", "n1")]


@pytest.mark.parametrize("seed", [1])
def test_the_swarm_flies_a_hall(text: str, seed: int) -> None:
    """All kinds of faults, every law looked at in every tick: also that no rover is in anything."""
    flown = fly(text, "hall.yaml", seed)
    assert flown.broken == "" and flown.ticks >= 208 and flown.packets["delivered"] > 1000
