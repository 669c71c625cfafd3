"""A node's engines: built between ticks a step at a time, kept while they may be needed, rebuilt when they are."""

from pathlib import Path
from typing import Any

import pytest

from foosim.deployment.loader import load_deployment
from foosim.node.core import NodeCore
from foosim.node.engines_pool import ENGINES_KEPT, Solver, engine_fingerprint
from foosim.node.physics.bullet_engine import BulletEngine
from foosim.node.tick import Stepper, Work
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Build, Prepare, Ready
from foosim.world.assembly.world import initial_numbers
from foosim.world.layout import Layout, build_layout
from foosim.world.start import AddedEntity

TEXT = (Path(__file__).parent.parent.parent / "deploy" / "table.yaml").read_text()
DEPLOYMENT = load_deployment(TEXT, "table.yaml")
ZERO = bytes(32)


@pytest.fixture
def core() -> NodeCore:
    """A node that was told what to build."""
    made = NodeCore("red", "b1", ZERO, 0)
    build = Build("red", "b1", "first", "run", "table.yaml", TEXT, "fast", [])
    made.receive(channels.BUILD, "red", encode(build), 0)
    return made


def prepare(core: NodeCore, *balls: str) -> Layout:
    """Have the core want a layout with these balls added."""
    message = Prepare([AddedEntity(ball, "ball") for ball in balls])
    core.receive(channels.PREPARE, "supervisor", encode(message), 0)
    return build_layout(DEPLOYMENT, [(ball, "ball") for ball in balls])


def told(core: NodeCore) -> list[bytes]:
    """Digests of the layouts that the core has said to be ready for, and forget them."""
    said = [action.payload for action in core.actions if isinstance(action, Publish)]
    core.actions.clear()
    return [decode(Ready, payload).layout for payload in said]


def work_on(layout: Layout, tick: int = 0) -> Work:
    """A tick in which the ball flies at a rod."""
    numbers = initial_numbers(DEPLOYMENT, layout)
    velocity = layout["ball"].offsets["linear_velocity"]
    numbers[velocity : velocity + 3] = [-2.0, 0.1, 0.0]
    bodies = tuple(entity for entity in layout.entities if entity.is_solved)
    return Work(tick, layout, (bodies,), tuple(entity.index for entity in bodies), numbers, {})


def solved_by(engine: Any, layout: Layout, ticks: int = 80) -> list[float]:
    """The numbers after some ticks, in which the ball meets a rod."""
    stepper = Stepper(DEPLOYMENT, layout)
    work = work_on(layout)
    touches = 0.0
    for tick in range(ticks):
        stepper.solve(engine, Work(tick, layout, work.islands, work.solved, work.numbers, {}))
        touches += work.numbers[layout["red.midfield"].offsets["contacts"]]
    assert touches > 0
    return work.numbers


def test_an_engine_is_built_a_body_at_a_time(core: NodeCore) -> None:
    solver = Solver(core)
    steps = 0
    while solver.build_some():
        steps += 1
        assert solver.is_building == (told(core) == [])
    assert steps > len(DEPLOYMENT.robots) + 20, "bodies and scenery, each a step"
    assert not solver.is_building
    solver.close()


def test_the_core_is_told_of_each_layout_once_and_in_order(core: NodeCore) -> None:
    solver = Solver(core)
    layouts = [build_layout(DEPLOYMENT), prepare(core, "ball2"), prepare(core, "ball2", "ball3")]
    solver.build_wanted()
    assert told(core) == [layout.digest for layout in layouts]
    assert not solver.build_some()
    assert told(core) == []
    solver.close()


def test_few_engines_are_kept_and_one_that_went_is_built_again_when_it_is_needed(core: NodeCore) -> None:
    made: list[Layout] = []
    closed: list[Layout] = []

    class Counted(BulletEngine):
        def __init__(self, deployment: Any, layout: Layout) -> None:
            super().__init__(deployment, layout)
            self.layout = layout
            made.append(layout)

        def close(self) -> None:
            super().close()
            closed.append(self.layout)

    solver = Solver(core, Counted)
    first = build_layout(DEPLOYMENT)
    for number in range(ENGINES_KEPT + 2):
        prepare(core, *(f"ball{ball}" for ball in range(2, 2 + number)))
        solver.build_wanted()
        assert len(made) - len(closed) <= ENGINES_KEPT
    assert closed[0].digest == first.digest, "the one that was not used for longest"
    core.stepper(first).solve(solver.engine_for(first), work_on(first))
    assert made[-1].digest == first.digest
    solver.close()
    assert len(made) == len(closed)


def test_an_engine_in_a_client_that_others_used_before_gives_the_same_bits() -> None:
    layout = build_layout(DEPLOYMENT)
    with_balls = build_layout(DEPLOYMENT, [("ball2", "ball"), ("ball3", "ball")])
    first = BulletEngine(DEPLOYMENT, layout)
    expected = solved_by(first, layout)
    for _ in range(3):
        other = BulletEngine(DEPLOYMENT, with_balls)
        solved_by(other, with_balls)
        other.close()
        steps = BulletEngine.in_steps(DEPLOYMENT, layout)
        again = finish(steps)
        assert solved_by(again, layout) == expected
        again.close()
    first.close()


def finish(steps: Any) -> BulletEngine:
    """What a generator of steps returns at its end."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            engine = end.value
            assert isinstance(engine, BulletEngine)
            return engine


@pytest.mark.parametrize("added", [(), ("ball2",)])
def test_the_fingerprint_is_that_of_a_fixed_run(added: tuple[str, ...]) -> None:
    layout = build_layout(DEPLOYMENT, [(ball, "ball") for ball in added])
    engine = BulletEngine(DEPLOYMENT, layout)
    digests = {engine_fingerprint(engine, Stepper(DEPLOYMENT, layout)) for _ in range(2)}
    assert len(digests) == 1
    engine.close()
