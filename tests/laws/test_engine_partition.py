"""Law 1 at the engines: several that each load and step only what they solve, against one that solves everything.

Owners change at random, engines are thrown away and built anew at random ticks, and after every tick all numbers are
equal to the last bit. Replicas that all step everything would share one past and prove nothing. Each rule of the Bullet
engine (design, section 1) is then broken, and the same comparison must see it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import cos, pi, sin
from typing import Any

import pytest

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.library.table.rod import RodRobot, figure_ys
from foosim.library.table.rod_voltage import VoltageActuator
from foosim.library.table.settings import table_of
from foosim.node.physics.bullet_engine import BulletEngine
from foosim.node.physics.interface import Engine, EngineFactory
from foosim.node.physics.pure_engine import PureEngine
from foosim.world.assembly.islands import Assignment, table_reach_of
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.fitted import actuators_of
from foosim.world.components.view import View
from foosim.world.layout import Entity, Layout, build_layout
from foosim.world.scene import Body, Shape
from tests.deployed import TEXT
from tests.placing import place_ball

KEY = draw_key(20, "partition")
RODS_X = (-0.522, -0.373, -0.224, -0.075, 0.075, 0.224, 0.373, 0.522)


def draw(purpose: int, tick: int, low: float = 0.0, high: float = 1.0) -> float:
    return low + (high - low) * unit_interval(draw_words(KEY, tick, purpose)[0])


@dataclass
class Outcome:
    """What happened: ticks at which a number differed, and that there was something to see."""

    ticks: int = 0
    differing: list[int] = field(default_factory=list)
    rod_touches: float = 0.0
    ball_touches: float = 0.0
    handovers: int = 0
    rebuilt: int = 0
    bodies_loaded_max: int = 0
    island_max: int = 0


Launch = Callable[[Layout, list[float], int], None]


def launch_ball(layout: Layout, numbers: list[float], tick: int) -> None:
    """Throw the ball over the field, drop it at a rod's feet or let it roll over a ramp, in turns."""
    if tick % 80:
        return
    aside = draw(2, tick, -0.3, 0.3)
    place, velocity = [
        (
            (draw(1, tick, -0.55, 0.55), aside, draw(3, tick, 0.0175, 0.05)),
            (draw(4, tick, -9, 9), draw(5, tick, -4, 4)),
        ),
        (
            (RODS_X[tick // 80 % 8] + draw(1, tick, -0.04, 0.04), aside, 0.02),
            (draw(4, tick, -1, 1), draw(5, tick, -1, 1)),
        ),
        ((-0.53, 0.27 if aside > 0 else -0.27, 0.03), (draw(4, tick, -2, 2), draw(5, tick, -2, 2))),
    ][tick // 80 % 3]
    place_ball(numbers, layout["ball"], place, (*velocity, 0.0))


def launch_piles(layout: Layout, numbers: list[float], tick: int) -> None:
    """Pile balls up in all corners: four touch one another and the walls, the fifth drops on them."""
    if tick % 300:
        return
    for index, ball in enumerate(layout.of("ball")):
        pile, number = index % 4, index // 4
        out, aside, up = (
            (0.0, 0.0, 0.0),
            (0.0355, 0.0, 0.0),
            (0.0, 0.0355, 0.0),
            (0.036, 0.036, 0.0),
            (0.018, 0.018, 0.03),
        )[number]
        x = (0.582 - out - draw(10 + index, tick, 0, 0.0005)) * (1 if pile % 2 else -1)
        y = (0.322 - aside - draw(90 + index, tick, 0, 0.0005)) * (1 if pile // 2 else -1)
        velocity = (draw(130 + index, tick, -0.2, 0.2), draw(170 + index, tick, -0.2, 0.2), 0.0)
        place_ball(numbers, ball, (x, y, 0.028 + up), velocity)


class Comparison:
    """One world, computed twice at every tick from the same numbers."""

    def __init__(self, factory: EngineFactory, sets: Sequence[str] = (), balls: int = 1, parts: int = 3) -> None:
        text = apply_sets(TEXT, "table.yaml", [*sets, f"table.spare_balls={balls - 1}"])
        self.deployment = load_deployment(text, "table.yaml").with_assets(FILES)
        self.layout = build_layout(self.deployment)
        self.numbers = initial_numbers(self.deployment, self.layout)
        self.reach = table_reach_of(self.deployment, self.layout)
        self.actuators = {
            rod.index: fitted.actuator
            for rod in self.layout.of("rod")
            for fitted in actuators_of(self.deployment, self.layout, rod)
        }
        self.is_of_voltages = any(isinstance(one, VoltageActuator) for one in self.actuators.values())
        lines = table_of(self.deployment).lines
        self.figures = {
            name: figure_ys(lines[robot.line])
            for name, robot in self.deployment.robots.items()
            if isinstance(robot, RodRobot)
        }
        self.bodies = [entity for entity in self.layout.entities if entity.is_solved]
        self.factory = factory
        self.one = factory(self.deployment, self.layout)
        self.parts = [factory(self.deployment, self.layout) for _ in range(parts)]
        self.roster = [f"n{index}" for index in range(parts)]
        self.assignment = self._deal(0)
        self.balls_solver = ""
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
            self._solve(self.one, self.bodies, whole, tick)
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
        """Let every rod follow the ball with its nearest figure, and kick every 100 ms.

        Motors at voltages, which are no positions, go to and fro, into their stops as well.
        """
        along, around = (200.0, 6.0) if self.is_of_voltages else (1.0, 1.0)
        ball = self.numbers[self.layout["ball"].offsets["position"] + 1]
        for rod in self.layout.of("rod"):
            start = rod.offsets["position.set_point"]
            if tick % 10 == 0:
                side = min((ball - y for y in self.figures[rod.name]), key=abs)
                wanted = min(max(side + draw(200 + rod.index, tick, -0.02, 0.02), -0.11), 0.11)
                self.numbers[start] = along * wanted
            if tick % max(1, 100_000_000 // self.deployment.tick_ns) == 0:
                turn = draw(300 + rod.index, tick, -1.0, 1.0) * draw(350 + rod.index, tick, 0.2, 7.0)
                self.numbers[start + 1] = around * turn

    def _solve(self, engine: Engine, bodies: Sequence[Entity], numbers: list[float], tick: int) -> None:
        rods = [entity for entity in bodies if entity.model == "rod"]
        engine.load(bodies, numbers)
        view = View(tick, numbers)
        engine.command(rods, [self.actuators[rod.index].command(view) for rod in rods])
        engine.step(self.deployment.substeps)
        engine.read(bodies, numbers)

    def _deal(self, tick: int) -> Assignment:
        """Give every rod an owner by draw."""
        parts = len(self.parts)
        owners = {rod.name: self.roster[int(draw(400 + rod.index, tick, 0, parts))] for rod in self.layout.of("rod")}
        return Assignment(self.layout, self.reach, self.roster, owners)

    def _solve_in_parts(self, tick: int, numbers: list[float]) -> None:
        outcome = self.outcome
        if tick % 23 == 0:
            self.assignment = self._deal(tick)
        if draw(500, tick) < 0.02:
            spot = int(draw(501, tick, 0, len(self.parts)))
            self.parts[spot].close()
            self.parts[spot] = self.factory(self.deployment, self.layout)
            outcome.rebuilt += 1
        start = numbers.copy()
        for part, (node, share) in zip(self.parts, self.assignment.shares(numbers).items(), strict=True):
            bodies = [self.layout.entities[index] for island in share.islands for index in island]
            outcome.island_max = max([outcome.island_max, *map(len, share.islands)])
            if self.layout["ball"] in bodies:
                outcome.handovers += node != self.balls_solver
                self.balls_solver = node
            if bodies:
                outcome.bodies_loaded_max = max(outcome.bodies_loaded_max, len(bodies))
                own = start.copy()
                self._solve(part, bodies, own, tick)
                for body in bodies:
                    numbers[body.start : body.split] = own[body.start : body.split]

    def _count(self, numbers: Sequence[float]) -> None:
        self.outcome.rod_touches += sum(numbers[rod.offsets["contacts"]] for rod in self.layout.of("rod"))
        self.outcome.ball_touches += sum(numbers[ball.offsets["contacts"]] for ball in self.layout.of("ball"))


def dome() -> bytes:
    """A flat dome as an OBJ file, radius 1, height 0.5: 24 segments and 8 rings, and so many small triangles."""
    lines = ["v 0 0 0.5"]
    for ring, segment in product(range(1, 9), range(24)):
        radius, angle = ring / 8, segment * pi / 12
        lines.append(f"v {radius * cos(angle):.6f} {radius * sin(angle):.6f} {0.5 * (1 - radius * radius):.6f}")
    for segment in range(24):
        lines.append(f"f 1 {2 + segment} {2 + (segment + 1) % 24}")
        for ring in range(7):
            near, far = 2 + 24 * ring, 26 + 24 * ring
            lines.append(f"f {near + segment} {far + segment} {far + (segment + 1) % 24} {near + (segment + 1) % 24}")
    return "\n".join(lines).encode()


FILES = {"dome.obj": dome()}
DOMES = (
    "scenery={"
    + ", ".join(
        f"d{x}{y}: {{shape: mesh, file: dome.obj, x: {x * 149 - 149} mm, y: {y * 180 + 90} mm, yaw: {17 * x} deg, "
        "scale: 0.05, surface: walls}"
        for x, y in product(range(-1, 3), range(-1, 2))
    )
    + "}"
)
"""Domes between the rods, as meshes."""


VOLTAGES = tuple(
    f"robots.{team}.{line}.actuators={{position: {{kind: rod_voltage}}}}"
    for team, line in product(("red", "blue"), ("goal", "defence", "midfield", "attack"))
)
"""Motors whose force falls with the speed."""
POSTS = (
    "scenery={"
    + ", ".join(
        f"p{x}{y}: {{shape: cylinder, radius: 2 cm, length: 8 cm, x: {x * 149 - 149} mm, "
        f"y: {y * 180 + 90} mm, z: -1 cm, roll: {20 * y} deg, pitch: {15 * x} deg, surface: walls}}"
        for x, y in product(range(-1, 3), range(-1, 2))
    )
    + "}"
)
"""Posts between the rods, most of them aslant."""

TICKS = 1300
PILE_TICKS = 300
"""Enough for each broken rule to be seen; the rules are held to as many."""
PILE = ("tick=0.5 ms", "substeps=1", "table.ball.speed_limit=5 m/s")


def compare(factory: EngineFactory, ticks: int, sets: Sequence[str] = (), pile: bool = False, **how: Any) -> Outcome:
    """Run one comparison and free its engines."""
    sets = (*sets, *PILE) if pile else sets
    comparison = Comparison(factory, sets, balls=20 if pile else 1)
    try:
        return comparison.run(ticks, launch_piles if pile else launch_ball, **how)
    finally:
        comparison.close()


CASES = {
    "four substeps": ((), 7, 14),
    "five substeps": (("substeps=5",), 7, 14),
    "meshes": ((DOMES,), 7, 20),
    "cylinders": ((POSTS,), 7, 17),
    "motors at voltages": (VOLTAGES, 3, 8),
}
"""Settings, and the least touches of rods and of balls. The pure engine has no meshes."""


@pytest.mark.parametrize(
    ("factory", "case"),
    [(factory, case) for factory, case in product((BulletEngine, PureEngine), CASES)
     if factory is BulletEngine or case != "meshes"],
)  # fmt: skip
def test_who_computes_what_changes_nothing(factory: EngineFactory, case: str) -> None:
    """No node knows whether another one's rod is driven at each substep: near the ball, or near its stop."""
    sets, rod_touches, ball_touches = CASES[case]
    outcome = compare(factory, TICKS, sets)
    assert outcome.differing == []
    assert outcome.rod_touches >= rod_touches and outcome.ball_touches >= ball_touches, outcome
    assert outcome.handovers >= 33 and outcome.rebuilt >= 10, outcome
    assert case not in ("four substeps", "five substeps") or outcome.island_max == 4, "the ball and at most three rods"


@pytest.mark.parametrize("factory", [BulletEngine, PureEngine])
def test_piles_in_islands_of_their_own_change_nothing(factory: EngineFactory) -> None:
    outcome = compare(factory, PILE_TICKS, pile=True)
    assert outcome.differing == []
    assert outcome.ball_touches >= 100 and outcome.handovers >= 7 and outcome.rebuilt >= 3, outcome
    assert outcome.bodies_loaded_max < 28


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
    """Makes the tilted ramps multibodies: of some tilts, 12.3 mm for one, the quaternion has no stable last bit."""

    def _make_scenery(self, shape: Shape, rigid: bool = True) -> int:
        return super()._make_scenery(shape, rigid=shape.surface != "ramps")


class DefaultIslands(BulletEngine):
    """Lets small islands share a solver call, with the defaults of btContactSolverInfo and of pybullet."""

    def _settings(self) -> dict[str, Any]:
        return {**super()._settings(), "minimumSolverIslandSize": 128, "solverResidualThreshold": 1e-7}


class ContactOrder(BulletEngine):
    """Sums impulses in the order in which Bullet lists contacts."""

    def _log(self, substep: int, touched: dict[str, list[float]]) -> None:
        super()._log(substep, {name: [sum(impulses)] for name, impulses in touched.items()})


class SomeOtherOrder(BulletEngine):
    """Makes the bodies in another order in every second engine."""

    _made = 0

    def _build_order(self, names: list[str]) -> list[str]:
        SomeOtherOrder._made += 1
        return sorted(names, reverse=SomeOtherOrder._made % 2 == 0)


class RigidSpheres(BulletEngine):
    """Makes free bodies rigid ones."""

    def _make_free(self, body: Body, rigid: bool = False) -> int:
        return super()._make_free(body, rigid=True)


class StillAsleep(BulletEngine):
    """Uses fetched rods before Bullet has noticed that they woke."""

    def _wake_fetched(self) -> None:
        pass


@pytest.mark.parametrize(
    ("broken", "sets", "pile"),
    [
        (NoLoad, (), False),
        (NoCollisionDetection, (), False),
        (MultibodyRamps, ("substeps=5", "table.ramps.height=12.3 mm"), False),
        (DefaultIslands, (), True),
        (SomeOtherOrder, (), True),
        (ContactOrder, ("table.surfaces.balls.restitution=0.4",), True),
        (RigidSpheres, (), True),
        (StillAsleep, (), False),
    ],
)
def test_a_broken_rule_is_seen(broken: Callable[[Deployment, Layout], Engine], sets: Sequence[str], pile: bool) -> None:
    outcome = compare(broken, 2 * PILE_TICKS if pile else 3 * TICKS, sets, pile, until_it_differs=True)
    assert outcome.differing, outcome
