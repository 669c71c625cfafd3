"""Law 1 at the engines of islands: bodies of any kind, coupled joints too, by engines with different pasts.

Three nodes solve the islands of a world with arms, boxes and a stack, whoever has an island at a tick being drawn;
their engines are thrown away at random. A fourth one solves all islands with engines that are never rebuilt. All
numbers are equal at every tick. Then each rule of the engines is broken, and the same comparison must see it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import pi
from typing import Final

import mujoco
import numpy as np
import pytest

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.node.physics.mujoco_islands import CompositionEngine, Seats
from foosim.node.physics.mujoco_model import ModelBuilder, warnings
from foosim.world.assembly.volumes import overlapping
from foosim.world.components.drives import FREE, Drives, Motor
from foosim.world.layout import Entity
from foosim.world.scene import Body, Box, Capsule, Link, Mimic, Vector
from tests.solids import TICK_S, Solids, box, shape

SEED: Final = 20
KEY: Final = draw_key(SEED, "islands")
PLACES_M: Final = (0.0, 0.5, 8.0, 12.0)
"""Of the arms along x: the first two hit each other."""
JOINTS: Final = 7
AXES: Final[tuple[Vector, ...]] = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
REACH_M: Final = 1.2
SEEN_TICKS: Final = 600


def draw(purpose: int, tick: int, low: float = 0.0, high: float = 1.0) -> float:
    return low + (high - low) * unit_interval(draw_words(KEY, tick, purpose)[0])


def arm(name: str, x: float) -> Body:
    """Seven links on the floor, whose axes are across one another in turns: their motors couple. Two fingers on the
    last one, of which the second follows the first."""
    links = []
    for number in range(JOINTS):
        links.append(
            Link(
                f"{name}/{number}",
                "revolute",
                (shape(Capsule(0.04, 0.1), position=(0.0, 0.0, 0.08)),),
                1.5 - 0.15 * number,
                (0.01, 0.01, 0.003),
                centre_of_mass=(0.0, 0.01, 0.08),
                axis=AXES[number % 2],
                limits=(-pi, pi),
                parent=number - 1,
                position=(0.0, 0.0, 0.1 if number == 0 else 0.16),
            )
        )
    for side in (1.0, -1.0):
        links.append(
            Link(
                f"{name}/finger{side:g}",
                "prismatic",
                (shape(Box((0.01, 0.01, 0.03)), position=(0.0, side * 0.05, 0.0)),),
                0.1,
                (1e-4, 1e-4, 1e-4),
                axis=(0.0, 1.0, 0.0),
                limits=(-0.03, 0.03),
                parent=JOINTS - 1,
                position=(0.0, 0.0, 0.2),
                mimic=None if side > 0.0 else Mimic(JOINTS, -1.0),
            )
        )
    return Body(name, "arm", (x, 0.0, 0.0), tuple(links))


def world() -> Solids:
    """Two arms whose reaches overlap, six boxes around them, and farther away two arms and a stack."""
    bodies = [arm(f"arm{number}", place) for number, place in enumerate(PLACES_M)]
    bodies += [box(f"box{number}", (0.08, 0.08, 0.08), 0.3, speed_limit=4.0) for number in range(6)]
    bodies += [box(f"stack{number}", (0.1, 0.1, 0.1), 1.0, speed_limit=4.0) for number in range(4)]
    made = Solids(bodies)
    scatter(made, 0)
    for number in range(4):
        made.put(f"stack{number}", (5.0 + 0.01 * number, 0.0, 0.1 + 0.2 * number))
    return made


def scatter(made: Solids, tick: int) -> None:
    """Drop the boxes around the arms anew."""
    for number in range(6):
        x, y = draw(10 + number, tick, -0.6, 2.2), draw(20 + number, tick, -0.6, 0.6)
        z = draw(30 + number, tick, 0.3, 1.2)
        made.put(f"box{number}", (x, y, z), velocity=(0.0, draw(40 + number, tick, -1.0, 1.0), 0.0))


@dataclass
class Outcome:
    """What happened: ticks at which a number differed, and that there was something to see."""

    ticks: int = 0
    differing: list[int] = field(default_factory=list)
    contacts: float = 0.0
    arms_met: int = 0
    """Ticks in which an arm touched another one."""
    handovers: int = 0
    rebuilt: int = 0
    largest: int = 0


Solve = Callable[[CompositionEngine, Sequence[Entity], list[float]], None]
Make = Callable[[Sequence[Body]], CompositionEngine]


class Comparison:
    """One world, computed twice at every tick from the same numbers."""

    def __init__(self, make: Make | None = None) -> None:
        self.world = world()
        self.make = make or self.world.make
        self.whole: dict[tuple[int, ...], CompositionEngine] = {}
        self.parts: list[dict[tuple[int, ...], CompositionEngine]] = [{}, {}, {}]
        self.solver: dict[int, int] = {}
        self.outcome = Outcome()

    def close(self) -> None:
        for engine in (*self.whole.values(), *(one for part in self.parts for one in part.values())):
            engine.close()
        self.world.close()

    def islands(self) -> list[tuple[int, ...]]:
        """Entities that could touch: arms by their reach, boxes by their sizes and speed limits."""
        boxes = np.zeros((len(self.world.entities), 2, 3))
        for row, (entity, body) in enumerate(zip(self.world.entities, self.world.bodies, strict=True)):
            place = np.array(self.world.get(entity.name, "position") if body.is_free else body.position)
            grown = 0.18 + 4.0 * TICK_S if body.is_free else REACH_M
            boxes[row] = place - grown, place + grown
        group = list(range(len(boxes)))
        for one, other in overlapping(boxes):
            low, high = sorted((group[one], group[other]))
            group = [low if number == high else number for number in group]
        return [tuple(row for row in range(len(group)) if group[row] == root) for root in sorted(set(group))]

    def engine(self, kept: dict[tuple[int, ...], CompositionEngine], rows: tuple[int, ...]) -> CompositionEngine:
        if rows not in kept:
            kept[rows] = self.make([self.world.bodies[row] for row in rows])
        return kept[rows]

    def run(self, ticks: int, until_it_differs: bool = False) -> Outcome:
        outcome = self.outcome
        for tick in range(ticks):
            if tick % 100 == 0:
                scatter(self.world, tick)
            self._drive(tick)
            whole, shared = self.world.numbers.copy(), self.world.numbers.copy()
            islands = self.islands()
            self.solve_whole(islands, whole)
            for number, rows in enumerate(islands):
                self._solve_part(tick, number, rows, shared)
            outcome.ticks += 1
            outcome.largest = max(outcome.largest, *map(len, islands))
            if whole != shared:
                outcome.differing.append(tick)
            self.world.numbers = whole
            outcome.contacts += sum(self.world.get(one.name, "contacts")[0] for one in self.world.entities)
            outcome.arms_met += self._do_arms_touch()
            if outcome.differing and until_it_differs:
                break
        return outcome

    def _do_arms_touch(self) -> bool:
        arms = [one for one in self.world.entities if one.name.startswith("arm")]
        return any(
            {int(met) for met in self.world.get(one.name, "partners")} & {arm.index for arm in arms} for one in arms
        )

    def solve_whole(self, islands: Sequence[tuple[int, ...]], numbers: list[float]) -> None:
        for rows in islands:
            self._solve(self.engine(self.whole, rows), rows, numbers)

    def _solve_part(self, tick: int, number: int, rows: tuple[int, ...], numbers: list[float]) -> None:
        node = int(draw(1000 + rows[0], tick // 7, 0, 3))
        self.outcome.handovers += self.solver.get(rows[0], node) != node
        self.solver[rows[0]] = node
        part = self.parts[node]
        if rows in part and draw(2000 + number, tick) < 0.05:
            part.pop(rows).close()
            self.outcome.rebuilt += 1
        while len(part) > 3:
            part.pop(next(iter(part))).close()
        self._solve(self.engine(part, rows), rows, numbers)

    def _solve(self, engine: CompositionEngine, rows: Sequence[int], numbers: list[float]) -> None:
        self.world.solve(engine, [self.world.entities[row] for row in rows], numbers)

    def _drive(self, tick: int) -> None:
        """Swing the arms about, each joint to another angle every 0.4 s."""
        for number in range(len(PLACES_M)):
            name = f"arm{number}"
            wanted = [draw(100 + 10 * number + joint, tick // 40, -1.2, 1.2) for joint in range(JOINTS)]
            *at, finger, _ = self.world.get(name, "joint_positions")
            speeds = [min(max(6.0 * (to - now), -4.0), 4.0) for to, now in zip(wanted, at, strict=True)]
            motors = [Motor(speed, 60.0) for speed in speeds]
            motors.append(Motor(6.0 * (draw(200 + number, tick // 40, -0.03, 0.03) - finger), 20.0))
            self.world.drives[name] = Drives((*motors, FREE))


def compared(ticks: int, kind: type[Comparison] = Comparison, *, until_it_differs: bool = False) -> Outcome:
    one = kind()
    try:
        return one.run(ticks, until_it_differs)
    finally:
        one.close()


def check(outcome: Outcome, contacts: float, handovers: int) -> None:
    print(f"seed {SEED}: {outcome}")
    assert outcome.contacts >= contacts and outcome.handovers >= handovers and outcome.rebuilt > 0
    assert outcome.largest >= 3, "arms and boxes share islands"
    assert outcome.arms_met >= 50, "arms hit each other"
    assert outcome.differing == []


def test_islands_have_the_same_bits_whatever_engine_solves_them() -> None:
    check(compared(1_000), contacts=50, handovers=100)


@pytest.mark.campaign
def test_islands_have_the_same_bits_over_twenty_thousand_ticks() -> None:
    check(compared(20_000), contacts=200, handovers=100)


# --- mutations -------------------------------------------------------------------------------------------------------


class KeepsWarmStart(CompositionEngine):
    """The solver starts from the accelerations of the tick before, of whichever island that was."""

    def load(self, seats: Seats, drives: Sequence[Drives], numbers: Sequence[float], start: Sequence[float]) -> None:
        warm = self.d.qacc_warmstart.copy()
        super().load(seats, drives, numbers, start)
        self.d.qacc_warmstart[:] = warm


class KeepsMotors(CompositionEngine):
    """Motors go on with the speeds that they were told first."""

    def _command(self, everybody: Sequence[Drives]) -> None:
        if not self._forces:
            super()._command(everybody)


class KeepsVelocities(CompositionEngine):
    """The velocities of joints are not those of the frame."""

    def load(self, seats: Seats, drives: Sequence[Drives], numbers: Sequence[float], start: Sequence[float]) -> None:
        kept = self.d.qvel.copy()
        super().load(seats, drives, numbers, start)
        for placed in self._placed:
            self.d.qvel[placed.vs] = kept[placed.vs]


def make_of(kind: type[CompositionEngine], made: Solids, bodies: Sequence[Body]) -> CompositionEngine:
    return kind(made.feel, made.tick_s / made.substeps, made.substeps, made.scenery, bodies, ())


def of_engine(kind: type[CompositionEngine]) -> type[Comparison]:
    """Comparisons whose engines are of a kind."""

    class Mutant(Comparison):
        def __init__(self) -> None:
            super().__init__(self._made)

        def _made(self, bodies: Sequence[Body]) -> CompositionEngine:
            return make_of(kind, self.world, bodies)

    return Mutant


class InOneSolve(Comparison):
    """All islands in one solve of an engine that has all bodies: what an engine of a layout does."""

    def solve_whole(self, islands: Sequence[tuple[int, ...]], numbers: list[float]) -> None:
        everybody = tuple(range(len(self.world.entities)))
        self._solve(self.engine(self.whole, everybody), everybody, numbers)


class InAnotherOrder(Comparison):
    """One side makes the bodies of an island in the order of their names backwards."""

    def solve_whole(self, islands: Sequence[tuple[int, ...]], numbers: list[float]) -> None:
        for rows in islands:
            back = rows[::-1]
            self._solve(self.engine(self.whole, back), back, numbers)


class HoldsAnothers(Comparison):
    """Each engine of one side has a body of another island besides, where that is: solved, and not read."""

    def solve_whole(self, islands: Sequence[tuple[int, ...]], numbers: list[float]) -> None:
        before = numbers.copy()
        for rows, others in zip(islands, [*islands[1:], islands[0]], strict=True):
            held, solved = tuple(sorted({*rows, others[0]})), before.copy()
            self._solve(self.engine(self.whole, held), held, solved)
            for entity in (self.world.entities[row] for row in rows):
                numbers[entity.start : entity.stop] = solved[entity.start : entity.stop]


@pytest.mark.parametrize(
    "kind",
    [*map(of_engine, (KeepsWarmStart, KeepsMotors, KeepsVelocities)), InOneSolve, InAnotherOrder, HoldsAnothers],
    ids=["warm start", "motors", "velocities", "one solve", "order", "another's body"],
)
def test_a_rule_that_is_broken_is_seen(kind: type[Comparison]) -> None:
    outcome = compared(SEEN_TICKS, kind, until_it_differs=True)
    assert outcome.differing, outcome


def test_a_full_arena_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo would drop contacts and go on."""
    options = ModelBuilder._set_options

    def with_little_memory(self: ModelBuilder) -> None:
        options(self)
        self._spec.memory = 60_000

    monkeypatch.setattr(ModelBuilder, "_set_options", with_little_memory)
    made = world()
    for number in range(4):
        made.put(f"stack{number}", (5.0, 0.0, 0.1 + 0.2 * number))
    with pytest.raises((AssertionError, mujoco.FatalError), match=r"has warned: |out of memory"):
        made.run(20)
    warnings.clear()
