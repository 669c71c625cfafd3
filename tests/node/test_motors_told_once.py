"""Bullet's motors are told anew only what they do not follow already: no bit depends on what they were told before."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final, TypeAlias

import pytest

from foosim.deployment.loader import load_deployment
from foosim.node.physics.bullet_engine import BulletEngine
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.layout import Entity

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT: Final = load_deployment(TABLE.read_text(), TABLE.name)
FRAME: Final = initial_frame(DEPLOYMENT)
RODS: Final = FRAME.layout.of("rod")
Asked: TypeAlias = tuple[tuple[float, float], ...]
HELD: Final[Asked] = ((0.5, 90.0), (3.0, 2.0))


@pytest.fixture
def engines() -> Iterator[tuple[BulletEngine, BulletEngine]]:
    """Two engines: one with a past, and one without."""
    pair = BulletEngine(DEPLOYMENT, FRAME.layout), BulletEngine(DEPLOYMENT, FRAME.layout)
    yield pair
    for engine in pair:
        engine.close()


def tick(engine: BulletEngine, entities: list[Entity], asked: dict[str, Asked], numbers: list[float]) -> None:
    """Compute one tick of some rods, with the motors of those that are named."""
    engine.load(entities, numbers)
    told = [entity for entity in entities if entity.name in asked]
    engine.command(told, [asked[entity.name] for entity in told])
    engine.step(DEPLOYMENT.substeps)
    engine.read(entities, numbers)


@pytest.mark.parametrize(
    "between",
    [
        (list(RODS), {rod.name: HELD for rod in RODS}),
        (list(RODS), {rod.name: HELD for rod in RODS[1:]}),
        (list(RODS[1:]), {rod.name: HELD for rod in RODS[1:]}),
        (list(RODS), {RODS[0].name: ((-0.5, 90.0), (3.0, 2.0))}),
    ],
    ids=["told the same", "told nothing", "away", "told something else"],
)
def test_what_a_rod_was_told_before_counts_for_nothing(
    engines: tuple[BulletEngine, BulletEngine], between: tuple[list[Entity], dict[str, Asked]]
) -> None:
    """A rod is told the same in the first tick and the last; in the tick between it is not, or is away."""
    held = {rod.name: HELD for rod in RODS}
    past, fresh = engines
    tick(past, list(RODS), held, FRAME.numbers.copy())
    tick(past, *between, FRAME.numbers.copy())
    ours, theirs = FRAME.numbers.copy(), FRAME.numbers.copy()
    tick(past, list(RODS), held, ours)
    tick(fresh, list(RODS), held, theirs)
    assert ours == theirs
    assert ours[RODS[0].offsets["joint_positions"]] > 0.0


def test_zeros_of_either_sign_are_told_apart(engines: tuple[BulletEngine, BulletEngine]) -> None:
    past, fresh = engines
    for first, last in ((0.0, -0.0), (-0.0, 0.0)):
        ours, theirs = FRAME.numbers.copy(), FRAME.numbers.copy()
        before: dict[str, Asked] = {rod.name: ((first, 90.0), (first, 2.0)) for rod in RODS}
        after: dict[str, Asked] = {rod.name: ((last, 90.0), (last, 2.0)) for rod in RODS}
        tick(past, list(RODS), before, ours.copy())
        tick(past, list(RODS), after, ours)
        tick(fresh, list(RODS), after, theirs)
        assert list(map(float.hex, ours)) == list(map(float.hex, theirs))
