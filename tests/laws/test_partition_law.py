"""Law 1: one node or many, any owner, any schedule of moves, any engine's past: equal digests at every tick.

In rehearsal, each node with an engine of its own that steps only what it solves, engines rebuilt at random ticks. Every
test asserts that there were contacts and hand-overs: without them nothing is proved.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from foosim.common.keyed_random import draw_key, draw_words
from foosim.runtime.roles.bus import Weather
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings, System
from foosim.world.frame import Frame

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
SEEDS = settings(max_examples=2, phases=[Phase.explicit, Phase.generate])
"""A run takes seconds, and a seed has nothing to shrink."""
TICKS = 250
MOVES = 60
REBUILDS = 8


@dataclass
class Contacts:
    """Counts ticks in which a rod touched a ball."""

    count: int = 0
    frames: list[Frame] = field(default_factory=list)

    def __call__(self, frame: Frame) -> None:
        if any(frame.numbers[rod.offsets["contacts"]] for rod in frame.layout.of("rod")):
            self.count += 1


def shuffle(system: System, seed: int, moves: int = MOVES, rebuilds: int = REBUILDS) -> None:
    """Move random robots to random nodes and rebuild random engines, at ticks drawn by the seed."""
    robots = sorted(system.supervisor.state.owners)
    nodes = sorted(system.solvers)
    key = draw_key(seed, "moves")
    for number in range(moves):
        words = draw_words(key, number)
        robot = robots[words[0] % len(robots)]

        def move(robot: str = robot, word: int = words[1]) -> None:
            others = [node for node in nodes if node != system.supervisor.state.owners[robot]]
            if others:
                system.request("move", robot=robot, node=others[word % len(others)])

        system.at_tick(1 + words[2] % (TICKS - 10), move)
    key = draw_key(seed, "rebuilds")
    for number in range(rebuilds):
        words = draw_words(key, number)
        system.at_tick(1 + words[0] % (TICKS - 10), system.solvers[nodes[words[1] % len(nodes)]].rebuild)


def run(engine: str, seed: int, nodes: int, shuffled: bool, weather: Weather | None = None) -> tuple[Rehearsed, int]:
    """Rehearse the table; return the result and the ticks with a rod's contact."""
    contacts = Contacts()
    rehearsal = Settings(on_commit=contacts)
    if weather is not None:
        rehearsal.weather = weather
    prepare = (lambda system: shuffle(system, seed)) if shuffled else None
    sets = [f"engine={engine}", f"seed={seed}", "table.rules.kickoff_delay=20 ms", "table.rules.kickoff_speed=2 m/s"]
    if weather is not None:
        sets += [f"deadlines.{name}=1 h" for name in ("heartbeat", "tick_named", "tick_lost", "lockstep_fast")]
    result = rehearse(TABLE.read_text(), TABLE.name, TICKS, nodes, sets, rehearsal, prepare=prepare)
    assert result.json["ticks"] == TICKS, result.json["reason"]
    return result, contacts.count


def first_difference(one: Rehearsed, other: Rehearsed) -> int | None:
    return next((i + 1 for i, (a, b) in enumerate(zip(one.digests, other.digests, strict=True)) if a != b), None)


@pytest.mark.parametrize("engine", ["bullet", "pure"])
@pytest.mark.parametrize("seed", [2024, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(1, 11))])
def test_nodes_owners_moves_and_rebuilds_change_nothing(engine: str, seed: int) -> None:
    alone, contacts = run(engine, seed, 1, shuffled=False)
    assert contacts > 0
    handovers = 0
    for nodes in (1, 2, 3, 8):
        many, _ = run(engine, seed, nodes, shuffled=True)
        assert first_difference(alone, many) is None, f"seed {seed}, {nodes} nodes"
        assert many.json["digest"] == alone.json["digest"]
        handovers += many.json["handovers"]
        assert nodes == 1 or many.json["moves"] >= MOVES - 5, "moves of one robot may meet in one tick"
    assert handovers > 0


@SEEDS
@given(seed=st.integers(0, 2**31))
def test_a_bad_bus_changes_nothing(seed: int) -> None:
    """Messages late, reordered, repeated and lost: what is missing is asked for again, and the world is the same."""
    alone, contacts = run("pure", seed, 1, shuffled=False)
    weather = Weather(seed, delay_ns=100_000, spread_ns=3_000_000, loss=0.02, repeat=0.05)
    many, _ = run("pure", seed, 3, shuffled=True, weather=weather)
    assert contacts > 0 and many.json["handovers"] > 0
    assert first_difference(alone, many) is None, f"seed {seed}"
