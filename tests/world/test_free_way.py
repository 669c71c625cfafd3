"""Robots that move by kinematics enter nothing: no scenery, no other robot, no rigid body."""

from __future__ import annotations

from math import hypot
from typing import Any, Final

import pytest
import yaml

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.node.tick import Stepper
from foosim.world.components.entities import made_model
from foosim.world.moving.solids import scenery_of
from foosim.world.moving.upright import upright_of
from foosim.world.rays.outlines import Outline, outline
from foosim.world.scene import shape_box
from tests.components.worlds import TABLE
from tests.kinematic_yard import Yard, drawn, yard_text

COMMANDS: Final = {
    "differential_drive": (1.0, 3.0),
    "holonomic": (0.7, 0.7, 3.0),
    "rotorcraft": (4.0, 4.0, 0.0, 3.0),
}


def crowd(seed: int, count: int) -> str:
    """Return a deployment of robots of all kinds with little room, among boxes that are turned anyhow."""
    robots: dict[str, Any] = {}
    side = 1.3
    for number in range(count):
        x, y = (number % 5 - 2) * side, (number // 5 - (count // 5 - 1) / 2) * side
        model = ("differential_drive", "holonomic", "rotorcraft", "mover")[number % 4]
        at = {"x": f"{x:.6g} m", "y": f"{y:.6g} m"}
        if model == "mover":
            path = [at, {"x": f"{-x:.6g} m", "y": f"{0.3 - y:.6g} m", "yaw": "90 deg"}]
            its: dict[str, Any] = {"shape": "box", "length": "30 cm", "width": "20 cm", "height": "40 cm"}
            robots[f"r{number}"] = {"model": model, **its, "path": path, "speed": "900 mm/s", "loop": True}
        else:
            its = {"speed": "8 m/s", "climb": "4 m/s", "acceleration": "20 m/s2"} if model == "rotorcraft" else {}
            robots[f"r{number}"] = {"model": model, "at": at, **its}
    boxes: dict[str, Any] = {}
    for number in range(12):
        dx, dy, yaw, pitch = drawn(f"box{seed}.{number}", 0, (0.2, 0.2, 90.0, 10.0))
        place = {"x": f"{(number % 4 - 1.5) * side + dx / 4} m", "y": f"{(number // 4 - 1) * side + dy / 4} m"}
        turned = {"yaw": f"{yaw} deg"} | ({"pitch": f"{pitch} deg", "z": "40 cm"} if number % 3 == 0 else {})
        boxes[f"b{number}"] = {
            "at": place | turned,
            "length": "30 cm",
            "width": "12 cm",
            "height": f"{0.2 + number / 9} m",
        }
    return yard_text(robots, scene={"kind": "boxes", "boxes": boxes})


def command_all(yard: Yard) -> None:
    """Give each robot another command now and then."""
    for robot in yard.layout.robots:
        bounds = COMMANDS.get(robot.model)
        if bounds is not None and (yard.tick + robot.index) % 40 == 0:
            numbers = drawn(robot.name, yard.tick, bounds)
            if robot.model == "rotorcraft":
                numbers[2] = 0.75 + drawn(f"{robot.name}z", yard.tick, (0.7,))[0]
                yard.put(robot.name, "pilot.has_target", 1.0, *numbers)
            else:
                yard.put(robot.name, "motion.set_point", *numbers)


class Bounds:
    """What everybody must stay out of, by arithmetic of its own."""

    def __init__(self, yard: Yard) -> None:
        self.yard = yard
        self.shapes: list[tuple[Outline, float, float]] = []
        for shape in scenery_of(yard.deployment):
            low, high = shape_box(shape)
            self.shapes.append((outline(shape), low[2], high[2]))
        self.robots = [
            (robot.name, upright_of(made_model(yard.deployment, yard.layout, robot))) for robot in yard.layout.robots
        ]

    def overlaps(self) -> list[str]:
        """Return who is in what."""
        found: list[str] = []
        placed: list[tuple[str, float, float, float, float, float]] = []
        for name, its in self.robots:
            x, y, z = self.yard.vector(name, "position")
            low, high = z + its.low, z + its.high
            for shape, bottom, top in self.shapes:
                if bottom < high and top > low and not shape.is_clear(x, y, its.radius * (1.0 - 1e-12)):
                    found.append(f"{name} in {shape}")
            for other, there_x, there_y, radius, bottom, top in placed:
                if bottom < high and top > low and hypot(x - there_x, y - there_y) < its.radius + radius:
                    found.append(f"{name} in {other}")
            placed.append((name, x, y, its.radius, low, high))
        return found


def campaign(seed: int, count: int, ticks: int) -> int:
    """Step a crowd; return how often somebody was stopped."""
    yard = Yard(crowd(seed, count))
    bounds, stopped = Bounds(yard), 0
    assert bounds.overlaps() == []
    for _ in range(ticks):
        command_all(yard)
        yard.step()
        stopped += sum(yard.vector(robot.name, "blocked") == [1.0] for robot in yard.layout.robots)
        if yard.tick % 5 == 0:
            assert bounds.overlaps() == [], (seed, yard.tick)
    return stopped


def test_twenty_robots_among_boxes_enter_nothing() -> None:
    assert campaign(1, 20, 300) > 300


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(2, 22))
def test_twenty_robots_among_boxes_enter_nothing_for_long(seed: int) -> None:
    assert campaign(seed, 20, 3_000) > 1_000


@pytest.mark.parametrize(("yaw", "gap"), [(0.0, 1.5), (45.0, 2.0 - 2**0.5 / 2)])
def test_it_stops_at_a_box_and_goes_back(yaw: float, gap: float) -> None:
    box = {"at": {"x": "2 m", "yaw": f"{yaw} deg"}, "length": "1 m", "width": "1 m", "height": "1 m"}
    yard = Yard(yard_text({"r": {"model": "holonomic"}}, scene={"kind": "boxes", "boxes": {"box": box}}))
    yard.put("r", "motion.set_point", 1.0, 0.0, 0.0)
    yard.step(300)
    x = yard.vector("r", "position")[0]
    assert gap - 1e-3 < x + 0.25 <= gap and yard.vector("r", "linear_velocity") == [0.0] * 3
    yard.put("r", "motion.set_point", -1.0, 0.0, 0.0)
    yard.step(300)
    assert yard.vector("r", "position")[0] < x - 0.5


def test_what_is_above_or_below_its_band_of_heights_is_not_in_the_way() -> None:
    beam = {"at": {"x": "2 m", "z": "36 cm"}, "length": "1 m", "width": "4 m", "height": "20 cm"}
    robots = {
        "below": {"model": "differential_drive"},
        "tall": {"model": "differential_drive", "at": {"y": "-1 m"}, "antenna_height": "40 cm"},
        "above": {"model": "rotorcraft", "at": {"y": "1 m", "z": "56 cm"}},
    }
    yard = Yard(yard_text(robots, scene={"kind": "boxes", "boxes": {"beam": beam}}))
    for name in ("below", "tall"):
        yard.put(name, "motion.set_point", 1.0, 0.0)
    yard.put("above", "pilot.has_target", 1.0, 4.0, 1.0, 0.56, 0.0)
    yard.step(500)
    assert yard.vector("below", "position")[0] > 4.0 and yard.vector("above", "position")[0] == pytest.approx(4.0)
    assert yard.vector("tall", "position")[0] == pytest.approx(1.25, abs=1e-3)


def test_a_rotorcraft_lands_on_a_box_and_on_another_one() -> None:
    box = {"length": "2 m", "width": "2 m", "height": "1 m"}
    robots = {"low": {"model": "rotorcraft", "at": {"z": "2 m"}}, "high": {"model": "rotorcraft", "at": {"z": "3 m"}}}
    yard = Yard(yard_text(robots, scene={"kind": "boxes", "boxes": {"box": box}}))
    for name in robots:
        yard.put(name, "pilot.has_target", 1.0, 0.0, 0.0, 0.0, 0.0)
    yard.step(600)
    low, high = (yard.vector(name, "position")[2] for name in robots)
    top = 0.15 + 0.15 / 8
    assert 1.0 <= low < 1.01 and low + 0.15 < high < low + top + 0.01


def test_a_thin_wall_stops_what_is_fast() -> None:
    """A way of one tick is longer than robot and wall."""
    wall = {"at": {"x": "5 m"}, "length": "1 cm", "width": "4 m", "height": "1 m"}
    fast = {"model": "holonomic", "radius": "3 cm", "speed": "50 m/s", "acceleration": "100 m/s2"}
    yard = Yard(yard_text({"r": fast}, scene={"kind": "boxes", "boxes": {"wall": wall}}))
    yard.put("r", "base_velocity", 49.0, 0.0, 0.0)
    yard.put("r", "motion.set_point", 50.0, 0.0, 0.0)
    yard.step(100)
    assert 4.5 < yard.vector("r", "position")[0] + 0.03 <= 4.995


def test_a_mover_waits_on_its_path_and_goes_on() -> None:
    mover = {"model": "mover", "shape": "cylinder", "radius": "20 cm", "height": "1 m", "speed": "1 m/s"}
    robots = {
        "m": {**mover, "path": [{"x": "-1 m"}, {"x": "3 m"}, {"x": "3 m", "y": "2 m"}]},
        "r": {"model": "holonomic", "at": {"x": "1 m"}},
    }
    yard = Yard(yard_text(robots))
    yard.step(300)
    assert yard.vector("m", "position")[0] == pytest.approx(1.0 - 0.45, abs=0.01) and yard.vector("m", "blocked") == [
        1.0
    ]
    clock = yard.vector("m", "motion.clock")[0]
    assert clock == pytest.approx(1.55, abs=0.01)
    yard.put("r", "position", 1.0, -3.0, 0.0)
    yard.step(200)
    assert yard.vector("m", "motion.clock")[0] == pytest.approx(clock + 2.0)
    assert yard.vector("m", "position")[0] == pytest.approx(clock + 1.0)


def test_it_stops_at_rigid_bodies_and_leaves_one_that_was_pushed_into_it() -> None:
    data = TABLE.with_(
        ("robots", "craft"), {"model": "rotorcraft", "at": {"x": "0 m", "z": "30 cm"}, "radius": "2 cm"}
    ).data
    data = {**data, "players": {}}
    yard = Yard(yaml.safe_dump(data))
    craft = (yard.layout["craft"],)
    ball = yard.vector("ball", "position")
    yard.put("craft", "pilot.has_target", 1.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(1500):
        yard.solve(craft, yard.numbers, yard.stepper)
    top = ball[2] * 2.0
    assert top <= yard.vector("craft", "position")[2] < top + 0.005 and yard.vector("craft", "blocked") == [1.0]
    yard.put("ball", "position", 0.0, 0.0, ball[2] + 0.01)
    yard.put("craft", "pilot.target", 0.0, 0.0, 0.3, 0.0)
    for _ in range(700):
        yard.solve(craft, yard.numbers, yard.stepper)
    assert yard.vector("craft", "position")[2] == pytest.approx(0.3), "up it is in it less"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"r": {"model": "holonomic", "at": {"x": "2 m"}}},
            "robots.r.at: the robot starts in the box, '2 m, 0 m, 0 m'",
        ),
        (
            {"a": {"model": "holonomic"}, "r": {"model": "rotorcraft", "at": {"x": "50 cm"}}},
            "robots.r.at: the robot starts in the robot a, '0.5 m, 0 m, 0 m'",
        ),
        (
            {"r": {"model": "differential_drive", "track": "60 cm"}},
            "robots.r: the wheels would be outside of the robot: its track is more than twice its radius",
        ),
        (
            {"r": {"model": "holonomic", "at": {"roll": "3 deg"}}},
            "robots.r.at: an upright body has no roll",
        ),
        (
            {"r": {"model": "mover", "radius": "1 m", "path": [{}, {"x": "1 m"}], "speed": "1 m/s"}},
            "robots.r: a box has length and width and height: length is missing",
        ),
        (
            {"r": {"model": "mover", "shape": "sphere", "radius": "1 m", "path": [{}, {"x": "1 m", "time": "1 s"}]}},
            "robots.r.path: point 2 differs: give all points of a path a time, or none",
        ),
    ],
)
def test_bad_settings_are_refused_with_their_place(change: dict[str, Any], said: str) -> None:
    box = {"at": {"x": "2 m"}, "length": "1 m", "width": "1 m", "height": "1 m"}
    with pytest.raises(DeploymentError) as error:
        load_deployment(yard_text(change, scene={"kind": "boxes", "boxes": {"box": box}}), "yard.yaml")
    assert said in str(error.value)


def test_what_is_kept_of_who_may_meet_whom_changes_nothing() -> None:
    """A crowd that is computed anew at each tick is as one that goes on, also where somebody is put elsewhere."""
    yard, nowhere = Yard(crowd(2, 80)), 0
    for tick in range(90):
        command_all(yard)
        if tick % 30 == 29:
            robots = [robot for robot in yard.layout.robots if robot.model != "mover"]
            one, other = robots[tick % len(robots)], robots[(tick + 40) % len(robots)]
            x, y, z = yard.vector(other.name, "position")
            yard.put(one.name, "position", x + 0.4, y, z + 0.05 * (tick % 2))
        fresh = yard.numbers.copy()
        yard.solve(yard.layout.robots, fresh, Stepper(yard.deployment, yard.layout))
        yard.step()
        nowhere += fresh == yard.numbers
    assert nowhere == 90
