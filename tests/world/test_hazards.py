"""Fires, what measures them and burns in them, and doors: against their formulas, and by events, requests and nodes."""

from __future__ import annotations

import re
from functools import cache, partial
from itertools import pairwise
from math import sqrt
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from foosim.common.errors import BadValue, DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.simulation.run import rehearse
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import Settings, System
from foosim.world.assembly.world import WorldMarks
from foosim.world.component_types.registry import find_model
from foosim.world.components.fitted import sensors_of
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import SensingView, View
from foosim.world.frame import Frame
from foosim.world.setting.settable import settable
from tests.kinematic_yard import TICK_S, yard_text

DOCS: Final = Path(__file__).parents[2] / "docs" / "reference" / "deployment.md"
NAME: Final = "yard.yaml"
FIRE: Final = {"model": "fire", "radius": "20 cm", "growth": "50 cm/s", "radius_max": "1 m"}
BASE: Final = {"model": "holonomic", "radius": "20 cm"}
AMBIENT, GAIN = 25.0, 200.0


def walker(start: str, end: str, **more: Any) -> dict[str, Any]:
    """Something round that goes along y = 0 with 1 m/s."""
    size = {"shape": "cylinder", "radius": "20 cm", "height": "50 cm"}
    return {"model": "mover", **size, "path": [{"x": start}, {"x": end}], "speed": "1 m/s", **more}


def frames_of(text: str, ticks: int, nodes: int = 1) -> list[Frame]:
    frames: list[Frame] = []
    rehearse(text, NAME, ticks, nodes, settings=Settings(on_commit=frames.append))
    return frames


def radius_at(tick: int, first: float = 0.2, growth: float = 0.5, most: float = 1.0) -> float:
    return min(first + growth * tick * TICK_S, most)


# --- fire ------------------------------------------------------------------------------------------------------------


def test_a_fire_grows_as_said_and_stops_at_its_greatest() -> None:
    frames = frames_of(yard_text({"k": BASE}, objects={"fire": FIRE}), 250)
    for frame in frames:
        radius = frame.at("fire", "radius")
        assert radius == pytest.approx(radius_at(frame.tick), rel=1e-12)
        assert frame.at("fire", "joint_positions") == pytest.approx(radius - 1.0, abs=1e-12)
    assert frames[-1].at("fire", "radius") == 1.0


def test_a_fire_that_is_put_out_stays_out_and_one_that_is_set_grows_on(tmp_path: Path) -> None:
    file = tmp_path / NAME
    file.write_text(yard_text({"k": BASE}, objects={"fire": FIRE}))
    with Simulation(file, network=False) as simulation:
        simulation.set("fire", "radius", "0 m")
        simulation.step(ticks=50)
        assert simulation.frame.at("fire", "radius") == 0.0
        simulation.set("fire", "radius", "30 cm")
        simulation.step(ticks=20)
        assert simulation.frame.at("fire", "radius") == pytest.approx(0.4)
        simulation.set("fire", "radius", "50 m")
        simulation.step(ticks=1)
        assert simulation.frame.at("fire", "radius") == 1.0
        simulation.set("fire", "at", "4,1")
        simulation.step(ticks=1)
        assert simulation.frame.vector("fire", "position", 3) == [4.0, 1.0, 0.0]
        with pytest.raises(BadValue, match="out of range 0 m to 100 m"):
            simulation.set("fire", "radius", "200 m")
        with pytest.raises(BadValue, match=r"\(there are: at, radius\)"):
            simulation.set("fire", "growth", "1 m/s")


def test_a_fire_is_in_nobodys_way() -> None:
    """Neither of a mover, nor of a ray."""
    text = yard_text({"m": walker("-2 m", "2 m")}, objects={"fire": FIRE})
    frames = frames_of(text, 400)
    assert frames[-1].vector("m", "position", 2) == pytest.approx((2.0, 0.0))
    deployment, last = load_deployment(text, NAME), frames[-1]
    hits = Surroundings(deployment, last.layout).rays(
        View(last.tick, last.numbers), np.array([[-3.0, 0.0, 0.1]]), np.array([[1.0, 0.0, 0.0]]), 4.5
    )
    assert hits.distances.tolist() == [np.inf]


def test_a_fire_breaks_out_at_a_time_and_a_place_that_are_drawn() -> None:
    fires = {f"fire-{n}": {**FIRE, "spare": True, "at": {"x": f"{n} m"}} for n in range(5)}
    event = {"between": ["0.5 s", "2 s"], "choose": "1 of fire-*", "add": True}
    found = set()
    for seed in range(1, 9):
        frames = frames_of(
            yard_text({"k": {**BASE, "at": {"y": "5 m"}}}, objects=fires, events=[event], seed=seed), 210
        )
        burning = {name: [f.tick for f in frames if f.at(name, "radius") > 0.0] for name in fires}
        (one,) = [name for name, ticks in burning.items() if ticks]
        assert 51 <= burning[one][0] <= 201
        assert frames[-1].at(one, "radius") == pytest.approx(radius_at(211 - burning[one][0]))
        found.add((one, burning[one][0]))
    assert len(found) == 8 and len({name for name, _ in found}) > 2


# --- what measures it, and burns in it -------------------------------------------------------------------------------


def test_the_temperature_is_that_of_the_formula_while_fires_grow() -> None:
    """ambient + sum of gain (r / max(d, r))^2; absent fires and those that are out add nothing."""
    objects = {
        "a": {**FIRE, "at": {"x": "3 m"}},
        "b": {**FIRE, "at": {"x": "-1 m", "y": "2 m", "z": "1 m"}, "growth": "0 m/s"},
        "gone": {**FIRE, "at": {"x": "50 cm"}, "spare": True},
        "out": {**FIRE, "at": {"x": "50 cm"}, "radius": "0 m"},
    }
    settings = {"kind": "thermometer", "rate": "100 Hz", "at": {"z": "30 cm"}}
    robots = {"m": walker("0 m", "4 m", sensors={"t": settings})}
    text = yard_text(robots, objects=objects)
    frames, deployment = frames_of(text, 350), load_deployment(text, NAME)
    (sensor,) = sensors_of(deployment, frames[0].layout, frames[0].layout["m"])
    met = 0
    for frame in frames:
        reading: Any = sensor.sensor.sample(SensingView(frame.tick, list(frame.numbers)))
        x, y, z = frame.vector("m", "position", 3)
        expected = AMBIENT
        for (fx, fy, fz), radius in (((3.0, 0.0, 0.0), radius_at(frame.tick)), ((-1.0, 2.0, 1.0), 0.2)):
            way = sqrt((x - fx) ** 2 + (y - fy) ** 2 + (z + 0.3 - fz) ** 2)
            expected += GAIN * (radius / max(way, radius)) ** 2
            met += way < radius
        assert reading.temperature == pytest.approx(expected, rel=1e-9)
    assert met > 20


def burning(start: str, end: str, **more: Any) -> list[Frame]:
    """Something that goes from a place to another one, through a fire of 1 m at 0 m, with 1 m/s."""
    fire = {**FIRE, "radius": "1 m", "growth": "0 m/s"}
    robot = walker(start, end, rules={"skin": {"kind": "burns", **more}})
    return frames_of(yard_text({"m": robot}, objects={"fire": fire}), 600)


def test_what_stays_in_a_fire_burns_after_the_time_and_is_marked() -> None:
    """It is in it from x = -1 m on, at 2 s."""
    frames = burning("-3 m", "0 m", after="1.5 s")
    burnt = [frame.tick for frame in frames if frame.at("m", "skin.burnt") > 0.0]
    assert burnt[0] == pytest.approx(350, abs=1) and len(burnt) == frames[-1].tick - burnt[0] + 1
    assert [frame.tick for frame in frames if frame.at("m", "down") > 0.0] == burnt
    deployment = load_deployment(yard_text({"m": walker("0 m", "1 m", rules={"skin": {"kind": "burns"}})}), NAME)
    marks = WorldMarks(deployment, frames[0].layout)
    told = [mark for one, other in pairwise(frames) for mark in marks.between(one, other)]
    assert told == [(burnt[0], "burnt", "m has burnt")]


def test_what_is_in_the_middle_of_a_fire_that_is_out_does_not_burn() -> None:
    robot = {**BASE, "rules": {"skin": {"kind": "burns", "after": "0 s"}}}
    for radius in ("0 m", "1 cm"):
        last = frames_of(yard_text({"k": robot}, objects={"fire": {**FIRE, "radius": radius}}), 5)[-1]
        assert last.at("k", "down") == float(radius != "0 m")


def test_what_passes_quickly_does_not_burn() -> None:
    """It is in the fire for 2 s."""
    assert not any(frame.at("m", "down") for frame in burning("-3 m", "3 m", after="2.1 s"))
    assert any(frame.at("m", "down") for frame in burning("-3 m", "3 m", after="1.9 s"))


@pytest.mark.parametrize("dynamics", ["kinematic", "rigid"])
def test_the_drives_of_what_has_burnt_stop_and_go_on_when_it_is_in_service_again(dynamics: str, tmp_path: Path) -> None:
    robot = {
        "model": "differential_drive",
        "dynamics": dynamics,
        "rules": {"skin": {"kind": "burns", "after": "0.5 s"}},
    }
    engine = {"engine": "mujoco", "substeps": 4} if dynamics == "rigid" else {}
    file = tmp_path / NAME
    fire = {**FIRE, "at": {"x": "1 m"}, "growth": "0 m/s", "radius": "50 cm"}
    file.write_text(yard_text({"k": robot}, objects={"fire": fire}, **engine))
    channel = next(iter(load_deployment(file.read_text(), NAME).robots["k"].actuators))
    with Simulation(file, network=False) as simulation:

        def drive(ticks: int) -> float:
            before = simulation.frame.vector("k", "position", 1)[0]
            simulation.step({"k": {channel: (0.5, 0.0)}}, ticks=ticks)
            return simulation.frame.vector("k", "position", 1)[0] - before

        drive(300)
        assert simulation.frame.at("k", "down") == 1.0
        drive(50)
        assert abs(drive(100)) < 1e-3
        simulation.set("k", "down", False)
        assert drive(40) > 0.05
        assert simulation.frame.at("k", "down") == 0.0
        drive(60)
        assert simulation.frame.at("k", "down") == 1.0


# --- doors -----------------------------------------------------------------------------------------------------------

DOOR: Final = {"model": "door", "closed": {"yaw": "90 deg"}, "length": "96 cm", "travel": "1 m", "speed": "1 m/s"}


def shed(robots: dict[str, Any], events: list[dict[str, Any]], door: dict[str, Any] = DOOR, **more: Any) -> str:
    wall = {"shape": "box", "z": "1 m", "length": "20 cm", "width": "4 m", "height": "2 m"}
    walls = {"north": {**wall, "y": "2.5 m"}, "south": {**wall, "y": "-2.5 m"}}
    objects = {"door": door, **more.pop("objects", {})}
    return yard_text(robots, scenery=walls, objects=objects, events=events, **more)


@pytest.mark.parametrize("lifts", [False, True])
def test_a_robot_passes_a_door_that_has_opened_and_not_before(lifts: bool) -> None:
    door = {**DOOR, "lifts": lifts, "travel": "-1 m" if not lifts else "1 m"}
    frames = frames_of(
        shed({"m": walker("-2 m", "2 m")}, [{"at": "3 s", "entity": "door", "set": {"open": True}}], door), 700
    )
    assert frames[0].tick == 1
    for frame in frames[:300]:
        assert frame.vector("m", "position", 1)[0] < -0.2 and frame.at("door", "opened") == 0.0
    assert frames[299].vector("m", "position", 1)[0] > -0.24, "the leaf is no cylinder"
    for frame in frames[299:399]:
        assert frame.at("door", "opened") == pytest.approx((frame.tick - 300) * TICK_S, abs=1e-9)
    last = frames[-1]
    assert last.vector("m", "position", 1)[0] == pytest.approx(2.0)
    assert last.vector("door", "position", 3) == pytest.approx((0.0, 0.0, 1.0) if lifts else (0.0, -1.0, 0.0))
    assert last.vector("door", "linear_velocity", 3) == [0.0, 0.0, 0.0]


def test_a_door_opens_by_request() -> None:
    asked: list[str] = []
    frames: list[Frame] = []

    def ask(system: System, value: object) -> None:
        asked.append(system.request("set", name="door", field="open", value=value))

    def prepare(system: System) -> None:
        for tick, value in ((10, "1"), (20, "50 %"), (150, False), (30, "120 %"), (30, "far")):
            system.at_tick(tick, partial(ask, system, value))

    run = rehearse(
        shed({"k": {**BASE, "at": {"x": "3 m"}}}, []), NAME, 300, 2,
        settings=Settings(on_commit=frames.append), prepare=prepare,
    )  # fmt: skip
    assert [run.answers[one].accepted for one in asked] == [True, True, False, False, True]
    assert max(frame.at("door", "opened") for frame in frames) == pytest.approx(0.5)
    assert frames[-1].at("door", "opened") == 0.0


def test_a_door_waits_for_who_stands_in_it_and_shuts_when_he_has_gone() -> None:
    """It begins to close when the walker is in the doorway; he is never in the leaf."""
    events = [{"at": "1.7 s", "entity": "door", "set": {"open": False}}]
    frames = frames_of(shed({"m": walker("-2 m", "2 m")}, events, {**DOOR, "open": "100 %"}), 600)
    blocked = [frame.tick for frame in frames if frame.at("door", "blocked")]
    assert blocked and frames[-1].at("door", "opened") == 0.0
    for frame in frames:
        assert gap(frame) >= -1e-6
    assert frames[-1].vector("m", "position", 1)[0] == pytest.approx(2.0)


def gap(frame: Frame) -> float:
    """How far the walker's hull is from the leaf, seen from above."""
    (x, y), (_, leaf) = frame.vector("m", "position", 2), frame.vector("door", "position", 2)
    beside, behind = abs(x) - 0.025, abs(y - leaf) - 0.48
    return sqrt(max(beside, 0.0) ** 2 + max(behind, 0.0) ** 2) - 0.2


def test_a_door_and_who_comes_towards_it_never_overlap() -> None:
    """Both go with 3 m/s along one line, so that they meet within a tick; others see the leaf as narrow as it is."""
    robot = {**walker("0 m", "0 m"), "path": [{"y": "-3 m"}, {"y": "3 m"}], "speed": "3 m/s"}
    door = {**DOOR, "open": "100 %", "speed": "3 m/s"}
    events = [{"at": "0.55 s", "entity": "door", "set": {"open": False}}]
    frames = frames_of(yard_text({"m": robot}, objects={"door": door}, events=events), 200)
    gaps = [gap(frame) for frame in frames]
    assert -1e-6 <= min(gaps) < 0.06 and frames[-1].at("door", "blocked") == 1.0


def test_a_door_waits_for_a_box_and_keeps_boxes_and_rays_out() -> None:
    box = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "surface": "frictionless"}
    objects = {"in": {**box, "at": {"z": "10 cm", "yaw": "30 deg"}}}
    events = [{"at": "0.1 s", "entity": "door", "set": {"open": False}}]
    robots = {"k": {**BASE, "at": {"x": "3 m", "y": "3 m"}}}
    text = shed(robots, events, {**DOOR, "open": "100 %"}, objects=objects, engine="mujoco", substeps=4)
    frames = frames_of(text, 200)
    assert frames[-1].at("door", "blocked") == 1.0 and 0.4 < frames[-1].at("door", "opened") < 0.65
    assert frames[-1].vector("in", "position", 2) == pytest.approx((0.0, 0.0), abs=2e-3)

    thrown = {"in": {**box, "at": {"x": "-1 m", "z": "10 cm"}}}
    wind = {"wind": {"kind": "wind", "x": "20 m/s"}}
    for is_open in (False, True):
        door = {**DOOR, "open": "100 %" if is_open else "0 %"}
        text = shed(robots, [], door, objects=thrown, rules=wind, engine="mujoco", substeps=4)
        last = frames_of(text, 300)[-1]
        assert (last.vector("in", "position", 1)[0] > 0.5) is is_open
        hits = Surroundings(load_deployment(text, NAME), last.layout).rays(
            View(last.tick, last.numbers), np.array([[-0.5, 0.4, 1.0]]), np.array([[1.0, 0.0, 0.0]]), 2.0
        )
        assert hits.distances.tolist() == ([np.inf] if is_open else [pytest.approx(0.475)])


# --- all of it -------------------------------------------------------------------------------------------------------


def in_the_docs(*changes: tuple[str, str]) -> str:
    """The deployment in the docs, with replaced texts."""
    (text,) = re.findall(
        r"^## Fire, doors and wind$.*?^```yaml\n(.*?)^```$", DOCS.read_text(), re.MULTILINE | re.DOTALL
    )
    for one, other in changes:
        assert one in text
        text = text.replace(one, other)
    return str(text)


SOON: Final = (
    ("between: [10 s, 60 s]", "between: [0.1 s, 0.5 s]"),
    ("at: 12 s", "at: 0.2 s"),
    ("at: 20 s", "at: 0.9 s"),
    ("growth: 2 cm/s", "growth: 5 m/s, radius_max: 10 m"),
    ("after: 3 s", "after: 0.2 s"),
)
TICKS: Final = 200


@cache
def docs_frames() -> tuple[Frame, ...]:
    return tuple(frames_of(in_the_docs(*SOON), TICKS))


def test_the_docs_world_does_what_they_say_as_it_is() -> None:
    frames = frames_of(in_the_docs(), 100)
    assert frames[-1].vector("carton", "position", 1)[0] > 3.01


def test_all_of_it_happens() -> None:
    last = docs_frames()[-1]
    fires = [name for name in ("fire-1", "fire-2", "fire-3") if last.at(name, "radius") > 0.0]
    assert len(fires) == 1 and last.at("scout", "burns.burnt") == 1.0
    assert last.at("door-1", "opened") > 0.5 and last.at("world", "breeze.x") == -5.0


def test_what_can_be_set_is_told() -> None:
    deployment, layout = load_deployment(in_the_docs(), NAME), docs_frames()[0].layout
    assert settable(deployment, layout, layout["door-1"]) == {"open": "0 % to 100 %, or true or false"}
    assert settable(deployment, layout, layout["fire-1"])["radius"] == "0 m to 100 m"
    assert [*settable(deployment, layout, layout["world"])] == ["breeze.x", "breeze.y", "breeze.z"]
    assert find_model("fire").tags == ("fire",)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (("travel: 1 m", "travel: 0 m"), "slides by at least 0.01 m"),
        (("radius: 20 cm", "radius: 3 m"), "above the greatest one, 2 m"),
        (("set: {open: true}", "set: {opened: true}"), "no field of door-1 that can be set (there are: open)"),
        (("entity: world", "entity: wolrd"), "no entity matches"),
        (("breeze.x: -5 m/s", "breeze.w: -5 m/s"), "that can be set (there are: breeze.x"),
        (
            ("breeze: {kind: wind, x: 5 m/s}", "breeze: {kind: wind}\n  gale: {kind: wind}"),
            "a second wind beside breeze",
        ),
        (("seed: 1\n", "seed: 1\nengine: pure\n"), "engine 'pure' has no air"),
    ],
)
def test_what_cannot_be_is_refused(change: tuple[str, str], why: str) -> None:
    with pytest.raises(DeploymentError, match=re.escape(why)):
        load_deployment(in_the_docs(change), NAME)
