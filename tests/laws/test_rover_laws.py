"""Laws 1 and 3 for a hall: any number of nodes, any moves, nodes that are lost: the same world, to the last bit."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.client.player import Player, Samples
from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.deployment.schema import Deployment
from foosim.runtime.roles.bus import Weather
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.world.actuators.wheel_speeds import Drive
from foosim.world.frame import Frame
from tests.swarm.campaign import fly

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
    *(f"players.pilot0{number}.class=blind_rovers:Blind" for number in range(4, ROVERS + 1)),
)
"""Six rovers with little room, three of which look at nothing and run into everything."""


class Blind(Player):
    """Drives at random."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self.rover = parameters["rover"]
        self.key = draw_key(deployment.seed, "blind", self.rover)

    def act(self, tick: int, samples: Samples) -> Mapping[str, Drive]:
        words = draw_words(self.key, tick // 60)
        return {self.rover: Drive(*(0.7 * unit_interval(word) + 0.5 for word in words[:2]))}


@pytest.fixture(scope="module", autouse=True)
def blind_rovers() -> Iterator[None]:
    """Makes the class one that a deployment can name."""
    module = ModuleType("blind_rovers")
    module.Blind = Blind  # type: ignore[attr-defined]
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "blind_rovers", module)
        yield


@pytest.fixture(scope="module")
def text(fleet_text: Callable[..., str]) -> str:
    return fleet_text(ROVERS, *NARROW)


@pytest.fixture(scope="module")
def alone(text: str) -> Rehearsed:
    """The world on one node; its rovers drive, and meet."""
    frames: list[Frame] = []
    run = rehearse(text, "hall.yaml", TICKS, 1, settings=Settings(on_commit=frames.append))
    names = [rover.name for rover in frames[0].layout.of("rover")]
    drive = sum(any(frame.vector(name, "wheel_speeds", 2)) for frame in frames for name in names)
    assert drive > 0.5 * len(names) * TICKS
    blocked = sum(frame.at(name, "blocked") for frame in frames for name in names)
    assert blocked > 50, "rovers that never run into anything prove nothing"
    return run


def shuffle(system: System) -> None:
    """Move random robots to random nodes, and rebuild random engines, at ticks that are drawn."""
    robots, nodes = sorted(system.supervisor.state.owners), sorted(system.solvers)

    def move(robot: str, word: int) -> None:
        others = [node for node in nodes if node != system.supervisor.state.owners[robot]]
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


def test_a_hall_is_captured_and_simulated_again(text: str, alone: Rehearsed, tmp_path: Path) -> None:
    path = tmp_path / "hall.mcap"
    run = rehearse(text, "hall.yaml", 100, 2, capture=path)
    assert run.digests == alone.digests[: len(run.digests)]
    assert verify_capture(path, 3).equal
    capture = open_capture(path)
    poses, frames = capture.poses("rover04"), capture.frames
    assert poses.positions.tolist() == frames.column("rover04", "position", 3).tolist()
    assert {tuple(place) for place in capture.poses("base").positions.tolist()} == {(-4.0, 0.0, 0.0)}


def test_the_rovers_of_a_node_that_is_lost_can_brake_and_wait_for_it(text: str) -> None:
    frames: list[Frame] = []

    def prepare(system: System) -> None:
        system.at_tick(40, partial(system.kill, "n2"))
        system.at_tick(150, partial(system.start, "n2"))

    run = rehearse(
        text, "hall.yaml", TICKS, 2, ["on_node_loss=freeze"], Settings(on_commit=frames.append), prepare=prepare
    )
    lost = [name for name in run.json["nodes"]["n2"]["owned"] if name.startswith("rover")]
    assert len(lost) == 3

    def speeds(tick: int, names: Sequence[str]) -> list[float]:
        return [abs(speed) for name in names for speed in frames[tick].vector(name, "wheel_speeds", 2)]

    assert max(speeds(35, lost)) > 0.3
    assert set(speeds(140, lost)) == {0.0} and all(frames[140].at(name, "down") for name in lost)
    assert max(speeds(140, [rover.name for rover in frames[0].layout.of("rover") if rover.name not in lost])) > 0.3
    assert max(speeds(240, lost)) > 0.3 and not any(frames[240].at(name, "down") for name in lost)


REFUSED: Final[tuple[tuple[str, dict[str, Any]], ...]] = (
    ("add", {"name": "ball"}),
    ("push", {"impulse": [0.1, 0.0, 0.0]}),
    ("remove", {"name": "base"}),
)


def test_what_is_of_a_table_is_refused_in_a_hall(text: str) -> None:
    systems: list[System] = []
    asked: list[str] = []

    def prepare(system: System) -> None:
        systems.append(system)
        for verb, arguments in REFUSED:
            system.at_tick(20, partial(lambda v, a: asked.append(system.request(v, **a)), verb, arguments))

    assert not rehearse(text, "hall.yaml", 60, 2, prepare=prepare).json["failed"]
    refused = [systems[0].answers[identity] for identity in asked]
    assert not any(answer.accepted for answer in refused)
    assert [answer.text for answer in refused] == [
        f"nothing to add (there are: {', '.join(f'rover{number:02}' for number in range(1, ROVERS + 1))}), 'ball'",
        "nothing can be pushed: this world has no free bodies",
        "base is always in the world: what is fixed, or belongs to a kit, neither comes nor goes",
    ]


@pytest.mark.parametrize("seed", [1])
def test_the_swarm_flies_a_hall(text: str, seed: int) -> None:
    """All kinds of faults, every law looked at in every tick: also that no rover is in anything."""
    flown = fly(text, "hall.yaml", seed)
    assert flown.broken == "" and flown.ticks >= 208 and flown.packets["delivered"] > 1000
