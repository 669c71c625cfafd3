"""Quarantine: what an engine gives that cannot be is not taken, and the rest of the world goes on.

The island keeps its edited state for that tick, the bad entities are marked in the frame and copied from then on. That
is part of `step`: the same on any number of nodes, and again in a replay.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import inf, nan
from pathlib import Path
from typing import Final

import pytest

from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.launcher.outcome import Outcome
from foosim.library.table.settings import table_of
from foosim.node.physics.interface import Island
from foosim.node.physics.pure_engine import PureEngine
from foosim.node.tick import Stepper, Work
from foosim.simulation.run import Rehearsed, rehearse, with_nodes
from foosim.simulation.stepped_world import SteppedWorld, deal_robots
from foosim.simulation.system import Settings, System
from foosim.vhub.state.records import Closing
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout, build_layout
from tests.kinematic_yard import Yard, yard_text
from tests.placing import place_ball

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT: Final = TABLE.read_text()
DEPLOYMENT: Final = load_deployment(TEXT, TABLE.name)
LAYOUT: Final = build_layout(DEPLOYMENT)
STEPPER: Final = Stepper(DEPLOYMENT, LAYOUT)
BALL: Final = LAYOUT["ball"]
SPEED: Final = table_of(DEPLOYMENT).ball.speed_limit
TICK_S: Final = DEPLOYMENT.tick_ns / 1e9
EMPTY_LOG: Final = [0.0, 0.0, -1.0]


class Faulty(PureEngine):
    """The pure engine, but what it reads of one body is `spoiled`: a field and its number."""

    victim = "ball"
    field = "position"
    offset = 0
    value = nan
    is_due: Callable[[Sequence[float]], bool] = staticmethod(lambda state: True)
    _now = False

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        super().load(entities, state)
        self.loaded = {entity.name for entity in entities}
        self._now = self.is_due(state)

    def read(self, entities: Sequence[Entity], state: list[float]) -> None:
        super().read(entities, state)
        for entity in entities:
            if entity.name == self.victim and self._now:
                state[entity.offsets[self.field] + self.offset] = self.value


def faulty(victim: str, field: str, offset: int, value: float) -> Faulty:
    engine = Faulty(DEPLOYMENT, LAYOUT)
    engine.victim, engine.field, engine.offset, engine.value = victim, field, offset, value
    return engine


def start() -> list[float]:
    """The ball rolls beside red.attack's feet; red.attack and red.goal shall move."""
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    place_ball(numbers, BALL, (0.18, 0.05, 0.0175), (1.0, 0.5, 0.0))
    for name in ("red.attack", "red.goal"):
        numbers[LAYOUT[name].offsets["position.set_point"]] = 0.1
        numbers[LAYOUT[name].offsets["contacts"]] = 5.0
        numbers[LAYOUT[name].offsets["joint_efforts"] + 1] = 7.0
    return numbers


def work_on(numbers: list[float]) -> Work:
    islands = ((BALL, LAYOUT["red.attack"]), (LAYOUT["red.goal"],))
    solved = tuple(sorted(entity.index for island in islands for entity in island))
    return Work(3, LAYOUT, islands, solved, numbers, {})


def slots(numbers: Sequence[float], name: str) -> list[float]:
    entity = LAYOUT[name]
    return list(numbers[entity.start : entity.split])


def but_for(values: list[float], name: str, **fields: Sequence[float]) -> list[float]:
    """An entity's slots with some fields replaced."""
    entity = LAYOUT[name]
    for field, new in fields.items():
        at = entity.offsets[field] - entity.start
        values[at : at + len(new)] = new
    return values


STROKE: Final = table_of(DEPLOYMENT).lines["attack"].half_stroke
DRIVE: Final = table_of(DEPLOYMENT).drive
BAD: Final[dict[str, tuple[str, str, int, float]]] = {
    "no number": ("ball", "position", 1, nan),
    "no number in the orientation": ("ball", "orientation", 0, nan),
    "no number in the log": ("ball", "contacts", 1, nan),
    "without end": ("ball", "linear_velocity", 2, -inf),
    "a spin without end": ("ball", "angular_velocity", 2, inf),
    "too fast": ("ball", "linear_velocity", 1, SPEED * 1.001),
    "too far": ("ball", "position", 0, 0.18 + SPEED * TICK_S * 1.01),
    "out of the world": ("ball", "position", 1, 2.0),
    "under the world": ("ball", "position", 2, -3.0),
    "a rod that is no number": ("red.attack", "joint_positions", 1, nan),
    "a rod too fast": ("red.attack", "joint_velocities", 0, DRIVE.slide.speed * 1.51),
    "a rod that spins too fast": ("red.attack", "joint_velocities", 1, -DRIVE.spin.speed * 1.51),
    "a rod beyond its stroke": ("red.attack", "joint_positions", 0, STROKE + 0.011),
    "a rod too far": ("red.attack", "joint_positions", 0, DRIVE.slide.speed * 1.52 * TICK_S),
    "a rod turned too far": ("red.attack", "joint_positions", 1, DRIVE.spin.speed * 1.52 * TICK_S),
}


@pytest.mark.parametrize("what", BAD)
def test_the_island_keeps_its_edited_state_and_the_bad_one_is_marked(what: str) -> None:
    victim = BAD[what][0]
    edited = start()
    work = work_on(edited.copy())
    STEPPER.solve(faulty(*BAD[what]), work)
    for name in ("ball", "red.attack"):
        marked = {"quarantined": [1.0]} if name == victim else {}
        unmoved = {"joint_efforts": [0.0, 0.0]} if name == "red.attack" else {}
        expected = but_for(slots(edited, name), name, contacts=EMPTY_LOG, **marked, **unmoved)
        assert slots(work.numbers, name) == expected, name
    sound = work_on(edited.copy())
    STEPPER.solve(PureEngine(DEPLOYMENT, LAYOUT), sound)
    assert slots(work.numbers, "red.goal") == slots(sound.numbers, "red.goal") != slots(edited, "red.goal")


@pytest.mark.parametrize("what", BAD)
def test_it_is_copied_from_then_on_and_the_others_go_on(what: str) -> None:
    victim = BAD[what][0]
    other = "red.attack" if victim == "ball" else "ball"
    work = work_on(start())
    engine = faulty(*BAD[what])
    STEPPER.solve(engine, work)
    held = slots(work.numbers, victim)
    for _ in range(3):
        before = slots(work.numbers, other)
        work = work_on(work.numbers.copy())
        STEPPER.solve(engine, work)
        assert engine.loaded == {other, "red.goal"}, "what is in quarantine is no longer solved"
        assert slots(work.numbers, victim) == held
        assert slots(work.numbers, other) != before, "its island goes on without it"


def test_who_was_bad_when_edited_holds_nobody_else_up() -> None:
    """A ball that is pushed beyond its limit keeps that speed while in quarantine: its island goes on all the same."""
    numbers = start()
    at = BALL.offsets["linear_velocity"]
    numbers[at] = 470.0
    work = work_on(numbers)
    STEPPER.solve(PureEngine(DEPLOYMENT, LAYOUT), work)
    assert work.numbers[BALL.offsets["quarantined"]] == 1.0 and work.numbers[at] == 470.0
    for _ in range(5):
        before = slots(work.numbers, "red.attack")
        work = work_on(work.numbers.copy())
        STEPPER.solve(PureEngine(DEPLOYMENT, LAYOUT), work)
        assert slots(work.numbers, "red.attack") != before
        assert work.numbers[LAYOUT["red.attack"].offsets["quarantined"]] == 0.0


def test_a_contact_is_not_logged_again_by_who_was_not_solved() -> None:
    work = work_on(start())
    STEPPER.solve(faulty("red.attack", "joint_positions", 0, nan), work)
    assert work.numbers[LAYOUT["red.attack"].offsets["contacts"]] == 0.0
    work.numbers[LAYOUT["red.attack"].offsets["contacts"]] = 2.0
    work.numbers[LAYOUT["red.attack"].offsets["joint_efforts"]] = 2.0
    STEPPER.solve(PureEngine(DEPLOYMENT, LAYOUT), work)
    assert work.numbers[LAYOUT["red.attack"].offsets["contacts"]] == 0.0
    assert work.numbers[LAYOUT["red.attack"].offsets["joint_efforts"]] == 0.0, "its motors did nothing"


# --- in a whole run --------------------------------------------------------------------------------------------------

TICKS: Final = 700
SETS: Final = ("engine=pure", "table.rules.kickoff_delay=20 ms", "table.rules.off_table_after=200 ms")


def is_off_the_middle(state: Sequence[float]) -> bool:
    """When the fault comes: a function of the frame, so that it does not depend on who computes."""
    return 0.10 < abs(state[BALL.offsets["position"]]) < 0.11


def spoiling(deployment: Deployment, layout: Layout) -> Faulty:
    engine = Faulty(deployment, layout)
    engine.is_due = is_off_the_middle
    return engine


def spoiled_run(nodes: int) -> tuple[Rehearsed, list[Frame], list[Closing]]:
    frames: list[Frame] = []
    closings: list[Closing] = []

    def rebuild(system: System) -> None:
        for tick in (60, 130, 131, 300):
            for solver in system.solvers.values():
                system.at_tick(tick, solver.rebuild)

    settings = Settings(factory=spoiling, on_commit=frames.append, on_closing=closings.append)
    return rehearse(TEXT, TABLE.name, TICKS, nodes, SETS, settings, prepare=rebuild), frames, closings


def test_quarantine_is_part_of_the_step() -> None:
    """One node or three, engines rebuilt within: the same frames; and again from orders and deliveries alone."""
    alone, frames, closings = spoiled_run(1)
    assert alone.json["ticks"] == TICKS and alone.json["failed"] is False
    marks = [frame.at("ball", "quarantined") for frame in frames]
    assert 50 < sum(marks) < TICKS - 50, "it was in quarantine, and it was free"
    assert any(a == 1.0 and b == 0.0 for a, b in pairwise(marks)), "a kick-off let it go"
    rod = [frame.vector("red.attack", "joint_positions", 2) for frame in frames]
    assert all(rod[i] != rod[i - 1] for i in range(1, TICKS) if marks[i] and marks[i - 1] and i > 60), "rods went on"
    many, _, _ = spoiled_run(3)
    assert many.digests == alone.digests
    deployment = load_deployment(with_nodes(TEXT, TABLE.name, 2, SETS), TABLE.name)
    world = SteppedWorld(deployment, initial_frame(deployment), deal_robots(deployment, 2), spoiling)
    for closing in closings[1:]:
        assert world.step(closing.delivered, closing.edits).digest == closing.digest, closing.frame.tick
    world.close()


# --- bodies of any kind ----------------------------------------------------------------------------------------------

POST: Final = {"post": {"model": "holonomic", "at": {"x": "-9 m"}}}
BOX: Final = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "speed_limit": "2 m/s"}


class Apart(Yard):
    """Each body is an island."""

    def step(self, ticks: int = 1) -> None:
        islands = tuple([(entity,) for entity in self.layout.entities])
        solved = tuple(range(len(islands)))
        for _ in range(ticks):
            self.stepper.solve(self.engine, Work(self.tick, self.layout, islands, solved, self.numbers, {}))
            self.tick += 1


def test_a_body_is_solved_again_three_times_and_then_stays_out() -> None:
    """Each time it stands still for a second, where it was; what fell from high is no failure, however fast it is."""
    objects = {"a": {**BOX, "at": {"z": "40 m"}}, "b": {**BOX, "at": {"x": "3 m", "z": "1 m"}}}
    yard = Apart(yard_text(POST, engine="mujoco", objects=objects))
    yard.step(200)
    assert yard.vector("a", "quarantined") == [0.0] and yard.vector("a", "linear_velocity")[2] < -19.0
    solve = yard.engine.solve  # type: ignore[union-attr]

    def failing(island: Island, numbers: list[float], start: Sequence[float]) -> None:
        solve(island, numbers, start)
        if island.bodies[0].name == "a":
            yard.put("a", "position", nan)

    yard.engine.solve = failing  # type: ignore[method-assign, union-attr]
    marks, places, at = [], [], yard.vector("a", "position")
    for _ in range(450):
        yard.step()
        marks.append(yard.vector("a", "quarantined")[0])
        places.append(yard.vector("a", "position"))
    assert all(place == at for place in places) and yard.vector("a", "linear_velocity") == [0.0] * 3
    assert marks[-1] == 4.0 and len(yard.stepper.quarantined) == 4
    assert "for 1 s, then it is solved again (3 of 3): its new position is nan" in yard.stepper.quarantined[2]
    assert "is in quarantine until it is put elsewhere or removed" in yard.stepper.quarantined[3]
    assert yard.vector("b", "position")[2] == pytest.approx(0.1, abs=0.001), "the others go on"


def test_a_body_that_can_be_solved_again_goes_on() -> None:
    yard = Apart(yard_text(POST, engine="mujoco", objects={"a": {**BOX, "at": {"z": "2 m"}}}))
    yard.put("a", "linear_velocity", 0.0, 0.0, 2_000.0)
    yard.step(101)
    assert yard.vector("a", "quarantined") == [-1.0]
    yard.step(200)
    assert yard.vector("a", "position")[2] == pytest.approx(0.1, abs=0.001)
    assert "a part of it moves at up to 1999.9 m/s, at most 1000 m/s are computed" in yard.stepper.quarantined[0]


class Spoiling:
    """An engine of islands that finds each body nowhere."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        pass

    def solve(self, island: Island, numbers: list[float], start: Sequence[float]) -> None:
        for entity in island.bodies:
            numbers[entity.offsets["position"]] = nan

    def close(self) -> None:
        """It holds nothing."""


def test_the_end_of_a_run_says_who_is_out() -> None:
    """By name, in its last lines and its exit code; the log has it once, and nothing of the small run of engines."""
    text = yard_text(POST, engine="mujoco", objects={"a": {**BOX, "at": {"z": "2 m"}}})
    lines: list[str] = []
    settings = Settings(factory=Spoiling, on_log=lambda *line: lines.append(line[2]))  # type: ignore[arg-type]
    out = rehearse(text, "yard.yaml", 50, 1, settings=settings).json
    assert out["quarantined"] == ["a"] and out["summary"] == ["in quarantine: a"] and not out["failed"]
    assert Outcome(out, ()).failed
    (logged,) = [line for line in lines if "is in quarantine" in line]
    assert logged.startswith("tick 0: a is in quarantine for 1 s, ") and "its new position is nan" in logged
    sound = rehearse(text, "yard.yaml", 50, 1).json
    assert sound["quarantined"] == [] and sound["summary"] == [] and not Outcome(sound, ()).failed
