"""What comes and goes in a world: the same on any number of nodes, whoever crashes, in captures and behind them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.capture.start_frame import read_branch
from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.rehearsal.run import rehearse
from foosim.rehearsal.simulation import Simulation
from foosim.rehearsal.system import Settings, System
from foosim.replay.verify import verify_capture
from foosim.runtime.roles.bus import Weather
from foosim.world.frame import Frame
from foosim.world.sensors.laser_scanner import Scan
from tests.kinematic_yard import yard_text

TICKS: Final = 300
SEED: Final = 11
NAME: Final = "yard.yaml"
RULES: Final = {"battery": {"kind": "battery", "capacity": "1 kJ", "idle": "5 W"}}
NOISE: Final = [{"kind": "gaussian_noise", "std": {"position": "1 cm"}}]
SENSORS: Final = {
    "pose": {"kind": "pose", "rate": "50 Hz", "modifiers": NOISE},
    "scan": {
        "kind": "laser_scanner",
        "rate": "10 Hz",
        "rays": 9,
        "angle": "180 deg",
        "range": "8 m",
        "at": {"z": "10 cm"},
    },
}
BOX: Final = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg"}


def text(events: list[dict[str, Any]], **more: Any) -> str:
    """A stack of three boxes and two spare ones, two robots on wheels and two that slide, with two spares of each."""
    wheels = {"model": "differential_drive", "dynamics": "rigid", "at": {"x": "-3 m", "y": "-4 m"}}
    robots = {
        "w": {**wheels, "count": 2, "spare": 2, "spacing": {"y": "2 m"}, "sensors": SENSORS},
        "k": {
            "model": "holonomic",
            "at": {"x": "3 m", "y": "-4 m"},
            "count": 2,
            "spare": 2,
            "spacing": {"y": "2 m"},
            "rules": RULES,
            "sensors": SENSORS,
        },
    }
    objects = {"b": {**BOX, "at": {"z": "10 cm"}, "count": 3, "spare": 2, "spacing": {"z": "20 cm"}}}
    return yard_text(robots, engine="mujoco", substeps=4, objects=objects, events=events, **more)


def frames_of(its: str, nodes: int, **settings: Any) -> tuple[Frame, ...]:
    frames: list[Frame] = []
    print(f"seed {SEED}")
    rehearse(its, NAME, TICKS, nodes, settings=Settings(on_commit=frames.append), **settings)
    return tuple(frames)


def test_what_leaned_on_what_is_removed_falls_and_it_comes_back() -> None:
    events: list[dict[str, Any]] = [
        {"at": "1.5 s", "entity": "b-1", "remove": True},
        {"at": "2 s", "entity": "b-1", "add": "4,4"},
    ]
    frames = frames_of(text(events), 1)
    assert frames[149].at("b-2", "still_ticks") >= 50
    assert frames[-1].vector("b-2", "position", 3)[2] == pytest.approx(0.1, abs=0.002)
    assert frames[-1].vector("b-1", "position", 2) == pytest.approx([4.0, 4.0], abs=1e-6)
    assert frames[199].at("b-1", "absent") == 1.0 and frames[200].at("b-1", "absent") == 0.0


def test_scanners_see_what_is_there() -> None:
    """A box comes 1 m before a scanner, and goes again."""
    events: list[dict[str, Any]] = [
        {"at": "0 s", "entity": "w-1", "set": {"at": {"x": "-6 m", "y": "6 m", "yaw": "0 deg"}}},
        {"at": "1 s", "entity": "b-4", "add": "-5,6,0.1"},
        {"at": "2 s", "entity": "b-4", "remove": True},
    ]
    with Simulation(load_deployment(text(events), NAME)) as simulation:
        seen = []
        for _ in range(3):
            simulation.step(ticks=90)
            seen.append(middle_ray(simulation))
            simulation.step(ticks=10)
    assert seen[1] < 1.0 < min(seen[0], seen[2]), seen


def middle_ray(simulation: Simulation) -> float:
    scan = simulation.readings["w-1", "scan"].value
    assert isinstance(scan, Scan)
    return min(scan.distances[3:6])


REQUESTS: Final = (
    (40, "add", {"name": "b", "at": "0,4,0.1"}),
    (41, "add", {"name": "k", "at": {"x": "6 m", "yaw": "90 deg"}, "node": "n1"}),
    (60, "remove", {"name": "b-1"}),
    (61, "remove", {"name": "k-1"}),
    (90, "add", {"name": "b-1", "at": "-4,4"}),
    (91, "add", {"name": "k-1", "at": "6,6"}),
    (92, "set", {"name": "k-1", "field": "battery.charge", "value": "20 %"}),
    (93, "remove", {"name": "w-2"}),
)


def test_requests_are_in_the_capture_and_a_run_begins_right_behind_one(tmp_path: Path) -> None:
    capture = tmp_path / "spares.mcap"
    asked: list[str] = []

    def prepare(system: System) -> None:
        for tick, verb, arguments in REQUESTS:
            system.at_tick(tick, partial(ask, system, verb, arguments))
        system.at_tick(61, partial(system.kill, "n2"))
        system.at_tick(62, partial(system.kill_hub, "torn"))
        system.at_tick(93, partial(system.start, "n2"))

    def ask(system: System, verb: str, arguments: dict[str, Any]) -> None:
        asked.append(system.request(verb, **arguments))

    its = text([], capture={"frames_every": "1 tick"})
    run = rehearse(its, NAME, 150, 2, settings=Settings(weather=Weather(SEED)), prepare=prepare, capture=capture)
    assert [run.answers[one].accepted for one in asked] == [True] * len(REQUESTS), run.answers
    assert verify_capture(capture, 3).equal
    effective = run.answers[asked[0]].tick
    at_s = (effective + 1) * 0.01
    start = read_branch(f"{capture}@{at_s:g}s", load_deployment(its, NAME)).start
    frames: list[Frame] = []
    rehearse(its, NAME, 1, 2, settings=Settings(on_commit=frames.append), start=start)
    captured = open_capture(capture).frames
    behind = frames[-1]
    assert behind.tick == effective + 2 and behind.at("b-4", "absent") == 0.0
    assert behind.vector("b-4", "position", 3) == pytest.approx([0.0, 4.0, 0.1], abs=0.001)
    absent = captured.column("b-4", "position", 3)[: effective + 1]
    assert all(str(number) == "nan" for row in absent.tolist() for number in row)


def test_a_robot_that_is_added_on_a_node_stays_there_when_its_own_is_back() -> None:
    """It was adopted by that node already, when its own was lost."""
    owners: list[str] = []

    def begin(system: System) -> None:
        owners.append(system.supervisor.state.owners["k-3"])
        system.kill(owners[0])

    def add(system: System) -> None:
        (other,) = system.supervisor.state.members
        asked.append(system.request("add", name="k-3", node=other))

    def prepare(system: System) -> None:
        for tick, do in ((20, begin), (40, add), (80, lambda system: system.start(owners[0]))):
            system.at_tick(tick, partial(do, system))
        system.at_tick(160, lambda: owners.append(system.supervisor.state.owners["k-3"]))

    asked: list[str] = []
    run = rehearse(text([]), NAME, 200, 2, prepare=prepare)
    assert run.answers[asked[0]].accepted and sorted(owners) == ["n1", "n2"]
    assert [entry["what"] for entry in run.json["recoveries"]] == ["node", "join"]


def test_a_simulation_adds_what_an_event_adds(tmp_path: Path) -> None:
    events: list[dict[str, Any]] = [
        {"at": "0.5 s", "entity": "k-3", "add": "3,6"},
        {"at": "0.5 s", "entity": "w-1", "remove": True},
    ]
    found = []
    for its in ([], events):
        with Simulation(load_deployment(text(its), NAME)) as simulation:
            simulation.step(ticks=50)
            if not its:
                assert simulation.add("k", "3,6") == "k-3"
                simulation.remove("w-1")
            simulation.step(ticks=50)
            found.append(simulation.frame.digest)
    assert found[0] == found[1]


def bad_events() -> Iterator[tuple[dict[str, Any], str]]:
    at = {"at": "1 s"}
    yield {**at, "entity": "k-9", "add": True}, "events[0].entity: no entity matches"
    yield {**at, "entity": "k-3", "add": "3"}, "valid are X,Y or X,Y,Z"
    yield {**at, "entity": "k-3", "add": {"roll": "3 deg"}}, "what stands upright has no roll"
    yield {**at, "entity": "k-3", "add": True, "remove": True}, "an event does one thing"
    yield {**at, "entity": "k-3"}, "an event does one thing"
    yield {**at, "entity": "k-3", "remove": False}, "events[0].remove"


@pytest.mark.parametrize(("event", "why"), [*bad_events()])
def test_an_event_that_cannot_add_or_remove_is_refused_with_its_place(event: dict[str, Any], why: str) -> None:
    with pytest.raises(DeploymentError) as refused:
        load_deployment(text([event]), NAME)
    assert why in str(refused.value) and "yard.yaml:" in str(refused.value)
