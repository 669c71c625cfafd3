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

import numpy as np
import pytest

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.node.physics.bullet_client import p
from foosim.node.physics.bullet_islands import CompositionEngine
from foosim.world.assembly.volumes import overlapping
from foosim.world.components.drives import Drives, Motor
from foosim.world.layout import Entity
from foosim.world.scene import Body, Box, Capsule, Cylinder, Link, Vector
from tests.solids import TICK_S, Solids, box, shape

SEED: Final = 20
KEY: Final = draw_key(SEED, "islands")
PLACES_M: Final = (0.0, 0.5, 8.0, 12.0)
"""Of the arms along x: the first two hit each other."""
JOINTS: Final = 7
AXES: Final[tuple[Vector, ...]] = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
REACH_M: Final = 1.2
SEEN_TICKS: Final = 600
HEAPED_TICKS: Final = 240


def draw(purpose: int, tick: int, low: float = 0.0, high: float = 1.0) -> float:
    return low + (high - low) * unit_interval(draw_words(KEY, tick, purpose)[0])


def arm(name: str, x: float) -> Body:
    """Seven links on the floor, whose axes are across one another in turns: their motors couple."""
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
            at = self.world.get(name, "joint_positions")
            speeds = [min(max(6.0 * (to - now), -4.0), 4.0) for to, now in zip(wanted, at, strict=True)]
            self.world.drives[name] = Drives(tuple(Motor(speed, 60.0) for speed in speeds))


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
    assert outcome.arms_met >= 100, "arms hit each other"
    assert outcome.differing == []


def test_islands_have_the_same_bits_whatever_engine_solves_them() -> None:
    check(compared(1_200), contacts=50, handovers=100)


@pytest.mark.campaign
def test_islands_have_the_same_bits_over_twenty_thousand_ticks() -> None:
    check(compared(20_000), contacts=200, handovers=100)


# --- mutations -------------------------------------------------------------------------------------------------------


class WithoutParking(CompositionEngine):
    def _wipe(self) -> None:
        pass


class OnlyParked(CompositionEngine):
    """Leaves pairs to Bullet, which ends few of them at a time."""

    def _wipe(self) -> None:
        for made in self._made:
            self._park(made)
        p.performCollisionDetection(physicsClientId=self._client)


class Untied(OnlyParked):
    """Nor are bodies tied into one island."""

    def _tie(self) -> None:
        pass


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
    [of_engine(WithoutParking), InOneSolve, InAnotherOrder, HoldsAnothers],
    ids=["no parking", "one solve", "order", "another's body"],
)
def test_a_rule_that_is_broken_is_seen(kind: type[Comparison]) -> None:
    outcome = compared(SEEN_TICKS, kind, until_it_differs=True)
    assert outcome.differing, outcome


def crowd() -> Solids:
    """Two arms out of each other's reach, and boxes around each."""
    boxes = [box(f"box{number}", (0.08, 0.08, 0.08), 0.3) for number in range(6)]
    return Solids([arm("arm0", 0.0), arm("arm1", 1.6), *boxes])


def crowded(kind: type[CompositionEngine], loads: int) -> Outcome:
    """Solve a crowd, drawn anew at each load, by one engine that is kept and by a new one at each load.

    Three boxes overlap with each arm: which of them Bullet names the arm's island after depends on the order in which
    the overlaps are found. One load of a past is enough to change it.
    """
    made, outcome = crowd(), Outcome()
    kept = make_of(kind, made, made.bodies)
    for load in range(loads):
        for number in range(6):
            x, y = draw(10 + number, load, -0.25, 0.25), draw(20 + number, load, -0.25, 0.25)
            made.put(f"box{number}", (1.6 * (number % 2) + x, y, draw(30 + number, load, 0.1, 1.2)))
        for number in range(2):
            name, of = f"arm{number}", [100 * number + joint for joint in range(JOINTS)]
            made.set(name, "joint_positions", *[draw(1000 + at, load, -0.3, 0.3) for at in of])
            made.set(name, "joint_velocities", *[draw(2000 + at, load, -1.0, 1.0) for at in of])
            made.drives[name] = Drives(tuple(Motor(draw(3000 + at, load, -1.0, 1.0), 60.0) for at in of))
        by_kept, by_new, new = made.numbers.copy(), made.numbers.copy(), make_of(kind, made, made.bodies)
        made.solve(kept, made.entities, by_kept)
        made.solve(new, made.entities, by_new)
        new.close()
        outcome.ticks, outcome.rebuilt = outcome.ticks + 1, outcome.rebuilt + 1
        if by_kept != by_new:
            outcome.differing.append(load)
            break
    kept.close()
    made.close()
    return outcome


def test_the_order_in_which_overlaps_are_found_is_not_remembered() -> None:
    assert crowded(CompositionEngine, 100).differing == []


def test_without_ties_it_is_remembered() -> None:
    assert crowded(Untied, 200).differing != []


def table(name: str) -> Body:
    """A plate on four discs: a link of five shapes."""
    discs = [shape(Cylinder(0.08, 0.02), position=(x, y, 0.04)) for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
    plate = shape(Box((0.06, 0.06, 0.05)))
    link = Link(name, "free", (plate, *discs), 1.5, (0.02, 0.02, 0.03))
    return Body(name, "table", (0.0, 0.0, 0.0), (link,), speed_limit=10.0)


def heaped(kind: type[CompositionEngine]) -> int | None:
    """Return the first tick at which a heap differs between an engine that is kept and a new one at each tick."""
    bodies = [box(f"box{number}", (0.15, 0.1, 0.05), 0.5) for number in range(5)]
    made = Solids([*bodies, *[table(f"table{number}") for number in range(5)]], substeps=2)
    kept, differing = make_of(kind, made, made.bodies), None
    for tick in range(HEAPED_TICKS):
        if tick % 60 == 0:
            for number, body in enumerate(made.bodies):
                x, y = draw(10 + number, tick, -0.3, 0.3), draw(30 + number, tick, -0.3, 0.3)
                spin = draw(50 + number, tick, -9.0, 9.0), draw(70 + number, tick, -9.0, 9.0), 1.0
                made.put(body.name, (x, y, 0.2 + 0.15 * number), spin=spin)
        by_kept, by_new, new = made.numbers.copy(), made.numbers.copy(), make_of(kind, made, made.bodies)
        made.solve(kept, made.entities, by_kept)
        made.solve(new, made.entities, by_new)
        new.close()
        if by_kept != by_new:
            differing = tick
            break
        made.numbers = by_kept
    kept.close()
    made.close()
    return differing


def test_a_heap_has_the_same_bits_whatever_was_solved_before() -> None:
    assert heaped(CompositionEngine) is None


def test_pairs_that_bullet_ends_by_itself_are_remembered() -> None:
    assert heaped(OnlyParked) is not None


@pytest.mark.parametrize(("kind", "count"), [(CompositionEngine, 1), (Untied, 8)], ids=["tied", "untied"])
def test_an_island_is_one_of_bullets_islands(kind: type[CompositionEngine], count: int) -> None:
    """Bullet reports each island that it solves: with ties one, without them one of each arm and box."""
    made = crowd()
    for number in range(6):
        made.put(f"box{number}", (0.5 * number - 1.0, 1.0, 0.0799))
    for number in range(2):
        made.drives[f"arm{number}"] = Drives((Motor(0.0, 60.0),) * JOINTS)
    engine = make_of(kind, made, made.bodies)
    made.solve(engine, made.entities, made.numbers)
    p.setPhysicsEngineParameter(reportSolverAnalytics=1, physicsClientId=engine._client)
    assert len(p.stepSimulation(engine._client)) == count
    engine.close()
    made.close()


def test_at_a_load_nothing_is_near_anything() -> None:
    """Parked, the bodies of an engine have no pair: all of Bullet's memory of pairs ends."""
    made = world()
    for _ in range(20):
        made.run(1)
    made.engine._wipe()
    assert p.getContactPoints(physicsClientId=made.engine._client) == ()
    low, high = (
        np.array([p.getAABB(one.id, -1, made.engine._client) for one in made.engine._made]).min(axis=(0, 1)),
        0,
    )
    assert low[2] > 500.0 and high == 0
    made.close()
