"""Law 1 at the engines: several that each load and step only what they solve, against one that solves everything.

Owners change at random, engines are thrown away and built anew at random ticks, and after every tick all numbers are
equal to the last bit. Replicas that all step everything would share one past and prove nothing. Each rule of the Bullet
engine (design, section 1) is then broken, and the same comparison must see it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from foosim.node.actuators.position import PositionActuator
from foosim.node.engines.bullet import BulletEngine
from foosim.node.engines.interface import Engine, EngineFactory
from foosim.node.engines.pure import PureEngine
from foosim.protocol.assign import islands_of, reach_of
from foosim.protocol.deployment import Deployment
from foosim.protocol.deployment_file import apply_sets, load_deployment
from foosim.protocol.draws import draw_key, draw_words, unit_interval
from foosim.protocol.layout import Entity, Layout, build_layout
from foosim.protocol.scene import Body, Shape
from foosim.protocol.start import initial_numbers, place_ball

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
KEY = draw_key(20, "partition")


def draw(purpose: int, tick: int, low: float = 0.0, high: float = 1.0) -> float:
    return low + (high - low) * unit_interval(draw_words(KEY, tick, purpose)[0])


@dataclass
class Outcome:
    """What happened: ticks at which a number differed, and that there was something to see."""

    ticks: int = 0
    differing: list[int] = field(default_factory=list)
    rod_touches: float = 0.0
    wall_touches: float = 0.0
    handovers: int = 0
    rebuilt: int = 0
    bodies_loaded_max: int = 0


Launch = Callable[[Layout, list[float], int], None]


def launch_ball(layout: Layout, numbers: list[float], tick: int) -> None:
    """Throw the ball from somewhere above the field: at rods, walls, ramps and goals."""
    if tick % 120 == 0:
        place = (draw(1, tick, -0.55, 0.55), draw(2, tick, -0.3, 0.3), draw(3, tick, 0.0175, 0.05))
        place_ball(numbers, layout["ball"], place, (draw(4, tick, -9, 9), draw(5, tick, -4, 4), 0.0))


def launch_piles(layout: Layout, numbers: list[float], tick: int) -> None:
    """Drop piles of balls between the rods, in islands of their own."""
    if tick % 300 == 0:
        for index, ball in enumerate(layout.balls):
            pile, height = index % 4, index // 4
            x = (-0.4475, -0.1495, 0.1495, 0.4475)[pile] + draw(10 + index, tick, -0.008, 0.008)
            y = draw(50 + pile, tick, -0.2, 0.2) + draw(90 + index, tick, -0.008, 0.008)
            place_ball(numbers, ball, (x, y, 0.0175 + 0.036 * height), (0.0, draw(130 + index, tick, -1, 1), 0.0))


class Comparison:
    """One world, computed twice at every tick from the same numbers."""

    def __init__(self, factory: EngineFactory, sets: Sequence[str] = (), balls: int = 1, parts: int = 3) -> None:
        text = apply_sets(TABLE.read_text(), "table.yaml", sets)
        self.deployment = load_deployment(text, "table.yaml")
        added = [(f"extra{index}", "ball") for index in range(balls - 1)]
        self.layout = build_layout(self.deployment, added)
        self.numbers = initial_numbers(self.deployment, self.layout)
        self.reach = reach_of(self.deployment, self.layout)
        self.actuators = {rod.index: PositionActuator(self.deployment, rod) for rod in self.layout.rods}
        self.bodies = [entity for entity in self.layout.entities if entity.has_body]
        self.factory = factory
        self.one = factory(self.deployment, self.layout)
        self.parts = [factory(self.deployment, self.layout) for _ in range(parts)]
        self.owners: dict[str, int] = {}
        self.balls_solver = -1
        self.outcome = Outcome()

    def close(self) -> None:
        for engine in (self.one, *self.parts):
            engine.close()

    def run(self, ticks: int, launch: Launch, until_it_differs: bool = False) -> Outcome:
        outcome = self.outcome
        for tick in range(ticks):
            launch(self.layout, self.numbers, tick)
            self._want(tick)
            whole, shared = self.numbers.copy(), self.numbers.copy()
            self._solve(self.one, self.bodies, whole)
            self._solve_in_parts(tick, shared)
            outcome.ticks += 1
            if whole != shared:
                outcome.differing.append(tick)
            self._count(whole)
            self.numbers = whole
            if outcome.differing and until_it_differs:
                break
        return outcome

    def _want(self, tick: int) -> None:
        """Give every rod another wanted position and angle every 100 ms."""
        for rod in self.layout.rods:
            if tick % max(1, 100_000_000 // self.deployment.tick_ns) == 0:
                start = rod.offsets["wanted"]
                self.numbers[start] = draw(200 + rod.index, tick, -0.11, 0.11)
                self.numbers[start + 1] = draw(300 + rod.index, tick, -7.0, 7.0)

    def _solve(self, engine: Engine, bodies: Sequence[Entity], numbers: list[float]) -> None:
        rods = [entity for entity in bodies if entity.model == "rod"]
        engine.load(bodies, numbers)
        engine.command(rods, [self.actuators[rod.index].command(numbers) for rod in rods])
        engine.step(self.deployment.substeps)
        engine.read(bodies, numbers)

    def _solve_in_parts(self, tick: int, numbers: list[float]) -> None:
        parts, outcome = len(self.parts), self.outcome
        if tick % 23 == 0:
            self.owners = {rod.name: int(draw(400 + rod.index, tick, 0, parts)) for rod in self.layout.rods}
        if draw(500, tick) < 0.02:
            spot = int(draw(501, tick, 0, parts))
            self.parts[spot].close()
            self.parts[spot] = self.factory(self.deployment, self.layout)
            outcome.rebuilt += 1
        shares: dict[int, list[Entity]] = {}
        for island in islands_of(numbers, self.layout, self.reach):
            solver = self.owners[island.nearest] if island.nearest else 0
            if self.layout["ball"].index in island.entities:
                outcome.handovers += solver != self.balls_solver
                self.balls_solver = solver
            shares.setdefault(solver, []).extend(self.layout.entities[index] for index in island.entities)
        for solver, bodies in shares.items():
            outcome.bodies_loaded_max = max(outcome.bodies_loaded_max, len(bodies))
            self._solve(self.parts[solver], bodies, numbers)

    def _count(self, numbers: Sequence[float]) -> None:
        self.outcome.rod_touches += sum(numbers[rod.offsets["contacts"]] for rod in self.layout.rods)
        self.outcome.wall_touches += sum(numbers[ball.offsets["contacts"]] for ball in self.layout.balls)


PILE = ("tick=0.5 ms", "substeps=1", "table.ball.speed_limit=5 m/s")


def compare(factory: EngineFactory, ticks: int, sets: Sequence[str] = (), pile: bool = False, **how: Any) -> Outcome:
    """Run one comparison and free its engines."""
    sets = (*sets, *PILE) if pile else sets
    comparison = Comparison(factory, sets, balls=16 if pile else 1)
    try:
        return comparison.run(ticks, launch_piles if pile else launch_ball, **how)
    finally:
        comparison.close()


@pytest.mark.parametrize("factory", [BulletEngine, PureEngine])
@pytest.mark.parametrize("sets", [(), ("tick=3 ms", "substeps=3")], ids=["four substeps", "three substeps"])
def test_who_computes_what_changes_nothing(factory: EngineFactory, sets: Sequence[str]) -> None:
    outcome = compare(factory, 3000, sets)
    assert outcome.differing == []
    assert outcome.rod_touches >= 40 and outcome.wall_touches >= 100, outcome
    assert outcome.handovers >= 100 and outcome.rebuilt >= 30, outcome


@pytest.mark.parametrize("factory", [BulletEngine, PureEngine])
def test_piles_in_islands_of_their_own_change_nothing(factory: EngineFactory) -> None:
    outcome = compare(factory, 900, pile=True)
    assert outcome.differing == []
    assert outcome.wall_touches >= 500 and outcome.handovers >= 10 and outcome.rebuilt >= 5, outcome
    assert outcome.bodies_loaded_max < 24


class NoLoad(BulletEngine):
    """Goes on from where it was when it is asked for the same bodies again."""

    _before: Sequence[Entity] = ()

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        if list(entities) != list(self._before):
            super().load(entities, state)
        self._before = list(entities)


class NoCollisionDetection(BulletEngine):
    """Parks the ball, but lets Bullet keep its pairs."""

    def _end_pairs(self) -> None:
        pass


class MultibodyRamps(BulletEngine):
    """Makes the tilted ramps multibodies."""

    def _make_scenery(self, shape: Shape, rigid: bool = True) -> int:
        return super()._make_scenery(shape, rigid=shape.surface != "ramps")


class DefaultIslands(BulletEngine):
    """Lets small islands share a solver call."""

    def _settings(self) -> dict[str, Any]:
        ours = super()._settings()
        del ours["minimumSolverIslandSize"], ours["solverResidualThreshold"]
        return ours


class SomeOtherOrder(BulletEngine):
    """Makes the bodies in another order in every second engine."""

    _made = 0

    def _build_order(self, names: list[str]) -> list[str]:
        SomeOtherOrder._made += 1
        return sorted(names, reverse=SomeOtherOrder._made % 2 == 0)


class RigidBall(BulletEngine):
    """Makes balls rigid bodies."""

    def _make_ball(self, body: Body, rigid: bool = False) -> int:
        return super()._make_ball(body, rigid=True)


class StillAsleep(BulletEngine):
    """Uses fetched rods before Bullet has noticed that they woke."""

    def _wake_fetched(self) -> None:
        pass


@pytest.mark.parametrize(
    ("broken", "sets", "pile"),
    [
        (NoLoad, (), False),
        (NoCollisionDetection, (), False),
        (MultibodyRamps, ("tick=3 ms", "substeps=3"), False),
        (DefaultIslands, (), True),
        (SomeOtherOrder, (), True),
        (RigidBall, (), False),
        (StillAsleep, (), False),
    ],
)
def test_a_broken_rule_is_seen(broken: Callable[[Deployment, Layout], Engine], sets: Sequence[str], pile: bool) -> None:
    outcome = compare(broken, 6000, sets, pile, until_it_differs=True)
    assert outcome.differing, outcome
