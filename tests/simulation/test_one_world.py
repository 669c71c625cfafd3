"""One deployment, seed and inputs are one world, however it is computed; parameters are drawn by seed.

A run on one node is compared with a run on several nodes whose processes die, whose robots move between nodes and whose
engines are made anew; that one's capture with the world simulated again, from its start and from a frame within, and
with its packets judged again; and the run with a `Simulation`. `make play` has further seeds.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import pytest

from foosim.capture.reader import open_capture
from foosim.protocol import channels
from foosim.simulation.journals import ENDINGS
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.settings import Settings
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import System
from foosim.simulation.verify import Between, verify_capture
from foosim.simulation.what_if import what_if
from tests.simulation.test_verify import messages_of
from tests.swarm.faults import Dice

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
TICKS: Final = {"table": 160, "table_sensors": 100, "warehouse": 60, "yard": 100, "workshop": 60}
SETS: Final = {"table": ("table.rules.kickoff_delay=20 ms",), "table_sensors": ("table.rules.kickoff_delay=20 ms",)}
BACK_NS: Final = 20_000_000
OF_THE_WORLD: Final = ("/tick", "/frame", "/packets", "/clients", "/ages", "/tf", "/scene", "/layout")
"""Topics that do not name nodes."""


def run(name: str, seed: int, nodes: int, capture: Path, prepare: Callable[[System], None] | None = None) -> Rehearsed:
    file, sets = DEPLOY / f"{name}.yaml", (*SETS.get(name, ()), f"seed={seed}")
    settings = Settings(keeps_journals=True)
    return rehearse(
        file.read_text(), file.name, TICKS[name], nodes, sets, settings, prepare=prepare, capture=capture, folder=DEPLOY
    )


@dataclass
class Disturbed:
    """Faults and moves at drawn ticks, none of which changes the world."""

    dice: Dice
    nodes: int
    ticks: int
    done: Counter[str]

    def prepare(self, system: System) -> None:
        dice, names = self.dice, [f"n{number + 1}" for number in range(self.nodes)]
        robots = sorted(system.supervisor.state.owners)
        for _ in range(3):
            self._at(system, "move", partial(_move, system, dice.one_of(robots), dice.one_of(names)))
            self._at(system, "rebuild", partial(_rebuild, system, dice.one_of(names)))
        self._at(system, "node", partial(_lose, system, dice.one_of(names)))
        self._at(system, "supervisor", partial(_lose, system, channels.SUPERVISOR))
        self._at(system, "hub", partial(system.kill_hub, dice.one_of(ENDINGS), BACK_NS))

    def _at(self, system: System, what: str, do: Callable[[], object]) -> None:
        def act() -> None:
            self.done[what] += 1
            do()

        system.at_tick(self.dice.between(5, self.ticks - 15), act)


def _move(system: System, robot: str, node: str) -> None:
    system.request("move", again_ns=BACK_NS, robot=robot, node=node)


def _rebuild(system: System, node: str) -> None:
    if node in system.solvers:
        system.solvers[node].rebuild()


def _lose(system: System, name: str) -> None:
    """Kill a process, and start it again a little later."""
    if name in system.processes:
        system.kill(name)
        system.later(BACK_NS, partial(system.start, name))


@pytest.mark.parametrize("name", TICKS)
@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(2, 21))])
def test_a_world_is_the_same_however_it_is_computed(name: str, seed: int, tmp_path: Path) -> None:
    dice, ticks = Dice(seed, f"one world, {name}"), TICKS[name]
    nodes, others = dice.between(2, 4), dice.between(2, 4)
    usual = run(name, seed, 1, tmp_path / "usual.mcap")
    assert not usual.json["failed"] and len(usual.digests) == ticks
    disturbed = Disturbed(dice, nodes, ticks, Counter())
    many = run(name, seed, nodes, tmp_path / "many.mcap", disturbed.prepare)
    assert disturbed.done == {"move": 3, "rebuild": 3, "node": 1, "supervisor": 1, "hub": 1}
    assert many.digests == usual.digests and many.json["digest"] == usual.json["digest"], f"on {nodes} nodes"
    assert many.json["packets"] == usual.json["packets"] and many.json["summary"] == usual.json["summary"]
    assert {entry["what"] for entry in many.json["recoveries"]} >= {"node", "supervisor", "vhub"}

    one, two = messages_of(tmp_path / "usual.mcap"), messages_of(tmp_path / "many.mcap")
    for topic in OF_THE_WORLD:
        assert one.get(topic) == two.get(topic), topic
    verified = verify_capture(tmp_path / "many.mcap", others)
    assert verified.equal and verified.ticks == ticks and verified.other_arithmetic == ()
    assert verified.chain.hex() == usual.json["digest"]["chain"]
    capture = open_capture(tmp_path / "many.mcap")
    judged = what_if(capture)
    assert (judged.changed, judged.inputs_changed) == (0, 0) and judged.packets == len(capture.packets) > 50

    frames, inputs, between = list(capture.each_frame()), list(capture.captured_ticks()), Between(capture.about)
    for start in (dice.one_of(frames), dice.one_of(frames), frames[0]):
        until = dice.between(start.tick, ticks)
        found = between(start, inputs[start.tick + 1 : until + 1])
        assert found is not None and found.digest == capture.digests[until].tobytes(), f"from {start.tick} to {until}"
    between.close()
    with Simulation(DEPLOY / f"{name}.yaml", agents=[], network=True, sets=SETS.get(name, ()), seed=seed) as simulation:
        for tick in range(ticks):
            simulation.step()
            assert simulation.frame.digest == usual.digests[tick], f"stepped, at tick {tick + 1}"
