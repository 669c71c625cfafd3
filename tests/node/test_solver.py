"""A node's engine: built once, rebuilt when it is asked for, with the same bits; the fingerprint of a small run."""

from pathlib import Path
from typing import Any

import pytest

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.core import NodeCore
from foosim.node.engines_pool import Solver, engine_fingerprint
from foosim.node.physics.bullet_engine import BulletEngine
from foosim.node.tick import Stepper, Work
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Build, Ready
from foosim.world.assembly.world import initial_numbers
from foosim.world.layout import Layout, build_layout
from tests.placing import place_ball

TEXT = (Path(__file__).parent.parent.parent / "deploy" / "table.yaml").read_text()
DEPLOYMENT = load_deployment(TEXT, "table.yaml")
SPARES = load_deployment(apply_sets(TEXT, "table.yaml", ["table.spare_balls=2"]), "table.yaml")
ZERO = bytes(32)


@pytest.fixture
def core() -> NodeCore:
    """A node that was told what to build."""
    made = NodeCore("red", "b1", ZERO, 0)
    build = Build("red", "b1", "first", "run", "table.yaml", TEXT, "fast")
    made.receive(channels.BUILD, "red", encode(build), 0)
    return made


def told(core: NodeCore) -> list[bytes]:
    """Digests of the layouts that the core has said to be ready for, and forget them."""
    said = [action.payload for action in core.actions if isinstance(action, Publish)]
    core.actions.clear()
    return [decode(Ready, payload).layout for payload in said]


def solved_by(engine: Any, deployment: Deployment, layout: Layout, balls: int = 1, ticks: int = 80) -> list[float]:
    """The numbers after some ticks, in which the ball meets a rod, with so many balls."""
    stepper, numbers = Stepper(deployment, layout), initial_numbers(deployment, layout)
    for number, ball in enumerate(layout.of("ball")[:balls]):
        place_ball(numbers, ball, (0.0, 0.1 * number, 0.0175), (-2.0, 0.1, 0.0))
    bodies = tuple(entity for entity in layout.present(numbers) if entity.is_solved)
    touches = 0.0
    for tick in range(ticks):
        stepper.solve(engine, Work(tick, layout, (bodies,), tuple(entity.index for entity in bodies), numbers, {}))
        touches += numbers[layout["red.midfield"].offsets["contacts"]]
    assert touches > 0
    return numbers


def test_the_engine_is_built_once_and_the_core_is_told(core: NodeCore) -> None:
    made: list[BulletEngine] = []
    closed: list[BulletEngine] = []

    class Counted(BulletEngine):
        def __init__(self, deployment: Deployment, layout: Layout) -> None:
            super().__init__(deployment, layout)
            made.append(self)

        def close(self) -> None:
            super().close()
            closed.append(self)

    solver = Solver(core, Counted)
    solver.build()
    assert told(core) == [build_layout(DEPLOYMENT).digest] and len(made) == 1
    solver.build()
    assert told(core) == [] and len(made) == 1
    solver.rebuild()
    assert told(core) == [] and len(made) == 2 and closed == made[:1]
    solver.close()
    assert closed == made


def test_an_engine_in_a_client_that_others_used_before_gives_the_same_bits() -> None:
    layout, with_balls = build_layout(DEPLOYMENT), build_layout(SPARES)
    first = BulletEngine(DEPLOYMENT, layout)
    expected = solved_by(first, DEPLOYMENT, layout)
    for _ in range(3):
        other = BulletEngine(SPARES, with_balls)
        solved_by(other, SPARES, with_balls, balls=3)
        other.close()
        again = BulletEngine(DEPLOYMENT, layout)
        assert solved_by(again, DEPLOYMENT, layout) == expected
        again.close()
    first.close()


@pytest.mark.parametrize("deployment", [DEPLOYMENT, SPARES], ids=["none", "spares"])
def test_the_fingerprint_is_that_of_a_fixed_run(deployment: Deployment) -> None:
    layout = build_layout(deployment)
    engine = BulletEngine(deployment, layout)
    digests = {engine_fingerprint(engine, Stepper(deployment, layout)) for _ in range(2)}
    assert len(digests) == 1
    engine.close()
