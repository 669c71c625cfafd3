"""What comes and goes in a world: the same on any number of nodes, whoever crashes, in captures and behind them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.capture.start_frame import read_branch
from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.runtime.roles.bus import Weather
from foosim.simulation.run import rehearse
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.world.assembly.event_times import events_by_tick
from foosim.world.edits import counters, parked
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
FLEETS: Final = ("b", "w", "k")


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


def drawn_events() -> list[dict[str, Any]]:
    """Forty events at drawn times: what comes, goes, is put elsewhere, is taken out of service."""
    draw = Random(SEED)
    events: list[dict[str, Any]] = []
    for number in range(40):
        when = {"at": f"{draw.uniform(0.0, 2.9):.3f} s"} if number % 3 else {"between": ["0.2 s", "2.5 s"]}
        pose = f"{draw.uniform(-9.0, 9.0):.2f},{draw.uniform(-9.0, 9.0):.2f}"
        fleet = FLEETS[number % 3]
        what: list[dict[str, Any]] = [
            {"choose": f"2 of {fleet}-*", "add": True if fleet == "b" else pose},
            {"entity": f"{fleet}-{draw.randrange(1, 5)}", "remove": True},
            {"choose": f"1 of {fleet}-*", "add": {"x": f"{draw.uniform(-2, 2):.2f} m", "yaw": "30 deg"}},
            {"choose": f"1 of {fleet}-*", "set": {"at": pose}},
        ]
        events.append({**when, **what[number // 3 % 4]})
    return events


def frames_of(its: str, nodes: int, **settings: Any) -> tuple[Frame, ...]:
    frames: list[Frame] = []
    print(f"seed {SEED}")
    rehearse(its, NAME, TICKS, nodes, settings=Settings(on_commit=frames.append), **settings)
    return tuple(frames)


@cache
def alone() -> tuple[Frame, ...]:
    return frames_of(text(drawn_events()), 1)


def digests(frames: tuple[Frame, ...]) -> dict[int, bytes]:
    return {frame.tick: frame.digest for frame in frames}


def test_comings_and_goings_are_the_same_on_two_nodes() -> None:
    assert digests(frames_of(text(drawn_events()), 2)) == digests(alone())


def test_comings_and_goings_are_the_same_on_three_whoever_crashes() -> None:
    """Nodes and the vHub are killed at the ticks of events and beside them, and robots move."""
    ticks = sorted(events_by_tick(load_deployment(text(drawn_events()), NAME)))
    draw = Random(SEED)

    def prepare(system: System) -> None:
        for number, tick in enumerate(ticks):
            system.at_tick(tick + draw.randrange(2), partial(disturb, system, number))

    def disturb(system: System, number: int) -> None:
        node = f"n{1 + number % 3}"
        if number % 7 == 3:
            system.kill_hub("torn")
        elif node not in system.processes:
            system.start(node)
        elif number % 3 == 1 and len(system.supervisor.state.members) > 1:
            system.kill(node)
        else:
            robots = sorted(system.supervisor.state.owners)
            system.request("move", robot=robots[number % len(robots)], node=node)

    frames = frames_of(text(drawn_events()), 3, prepare=prepare)
    assert frames[-1].tick == TICKS and digests(frames) == digests(alone())


def test_who_is_absent_is_nowhere_and_remembers_nothing() -> None:
    """Its slots are those of any absent entity, but for the counters of its samples, which never go back."""
    layout = alone()[0].layout
    seen = 0
    counted = dict.fromkeys((at for entity in layout.entities for at in counters(entity)), 0.0)
    for frame in alone():
        for entity in layout.entities:
            for at in counters(entity):
                assert frame.numbers[at] >= counted[at]
                counted[at] = frame.numbers[at]
            if entity.is_absent(frame.numbers):
                seen += 1
                places = [at for at in range(entity.start, entity.stop) if at not in counters(entity)]
                of_absent = parked(layout, entity)
                assert [frame.numbers[at] for at in places] == [of_absent[at - entity.start] for at in places]
                assert entity.index not in frame.outboxes
    assert seen > 1000


def test_an_addition_changes_no_draw_of_anybody_else() -> None:
    """Of a robot that comes far from all others, these see nothing: what never rests is as it would be."""
    comes = {"at": "0.5 s", "entity": "k-4", "add": "90,90"}
    goes = {"at": "1.5 s", "entity": "k-4", "remove": True}
    without, beside = frames_of(text([]), 1), frames_of(text([comes, goes]), 1)
    assert beside[100].at("k-4", "absent") == 0.0
    for here, there in zip(without, beside, strict=True):
        for robot in here.layout.robots:
            if robot.name in ("k-1", "k-2", "k-3"):
                assert here.entity_digest(robot) == there.entity_digest(robot), (here.tick, robot.name)


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
