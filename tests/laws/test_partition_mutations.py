"""Faults that law 1 must catch, planted one at a time: what the partition may not touch, touched.

The first test sees the law hold in the same runs; then each plants its fault and sees it fail. Faults of the engines
are planted in `test_engine_partition.py`, faults of speaking and committing in `test_trace_laws.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from foosim.common.batched.noise import NoiseKeys
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.node.physics.pure_engine import PureEngine
from foosim.node.tick import Stepper, Work
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.world.assembly.islands import Assignment, Island, Reach, Share, islands_of, table_reach_of, touching_of
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.parameters.table import table_of
from tests.placing import place_ball

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS = 250


def differs() -> bool:
    """Whether some tick differs between one node and two, in a run in which rods touch the ball."""
    touched = 0

    def count(frame: Frame) -> None:
        nonlocal touched
        touched += any(frame.numbers[rod.offsets["contacts"]] for rod in frame.layout.of("rod"))

    text = TABLE.read_text()
    sets = ["engine=pure", "table.rules.kickoff_delay=20 ms", "table.rules.kickoff_speed=2 m/s"]
    one = rehearse(text, TABLE.name, TICKS, 1, sets, Settings(on_commit=count))
    two = rehearse(text, TABLE.name, TICKS, 2, sets)
    assert one.json["ticks"] == two.json["ticks"] == TICKS and touched > 0
    return one.digests != two.digests


def test_a_draw_from_a_running_generator_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not differs()
    dice = np.random.default_rng(1)
    monkeypatch.setattr(NoiseKeys, "normal", lambda self, counter, width, slot=0: dice.normal(size=(len(self), width)))
    assert differs()


def test_an_island_split_between_two_solvers_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    divide = Assignment._divide

    def split(self: Assignment, islands: tuple[Island, ...]) -> dict[str, Share]:
        """Give the ball to the last node, its rods to their owners."""
        parts: list[Island] = []
        for island in islands:
            names = {index: self.layout.entities[index].name for index in island.entities}
            parts += [Island((index,), name if name in self.owners else "") for index, name in names.items()]
        return divide(self, tuple(parts))

    monkeypatch.setattr(Assignment, "_divide", split)
    assert differs()


def kicked_towards_the_next_rod() -> tuple[Stepper, list[float]]:
    """The table at ticks of 10 ms: a resting ball before a turning foot, the other team's rod 99 mm ahead of it."""
    text = apply_sets(TABLE.read_text(), TABLE.name, ["engine=pure", "tick=10 ms", "substeps=20"])
    deployment = load_deployment(text, TABLE.name)
    layout = build_layout(deployment)
    numbers = initial_numbers(deployment, layout)
    radius_m = table_of(deployment).ball.radius
    place_ball(numbers, layout["ball"], (-table_of(deployment).lines["midfield"].x - 0.05, 0.0, radius_m))
    kicker = layout["blue.midfield"]
    numbers[kicker.offsets["joint_velocities"] + 1] = 140.0
    numbers[kicker.offsets["position.set_point"] + 1] = 100.0
    return Stepper(deployment, layout), numbers


def solve(stepper: Stepper, numbers: Sequence[float], reach: Reach) -> list[float]:
    """Solve each island of a tick in an engine of its own; return the numbers after it."""
    after = list(numbers)
    entities = stepper.layout.entities
    for island in islands_of(numbers, reach, touching_of(numbers, reach)):
        bodies = tuple(entities[index] for index in island.entities)
        work = Work(0, stepper.layout, (bodies,), island.entities, list(numbers), {})
        stepper.solve(PureEngine(stepper.deployment, stepper.layout), work)
        for body in bodies:
            after[body.start : body.split] = work.numbers[body.start : body.split]
    return after


def test_reach_from_present_speed_is_caught() -> None:
    """A resting ball has no present speed, and reaches the next rod within the tick in which it is kicked."""
    stepper, numbers = kicked_towards_the_next_rod()
    absent = [entity.index for entity in stepper.layout.entities if entity.is_absent(numbers)]
    declared = table_reach_of(stepper.deployment, stepper.layout).without(absent)
    present = replace(declared, ball_m=table_of(stepper.deployment).ball.radius)
    together = list(numbers)
    bodies = tuple(entity for entity in stepper.layout.present(numbers) if entity.is_solved)
    work = Work(0, stepper.layout, (bodies,), tuple(body.index for body in bodies), together, {})
    stepper.solve(PureEngine(stepper.deployment, stepper.layout), work)
    for name in ("red.midfield", "blue.midfield"):
        assert together[stepper.layout[name].offsets["contacts"]] > 0, name
    assert solve(stepper, numbers, declared) == together
    assert solve(stepper, numbers, present) != together
