"""What is set, added and removed during a run, by events and by requests, and in its capture."""

from __future__ import annotations

from functools import cache, partial
from math import nan
from pathlib import Path
from random import Random
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.capture.start_frame import read_branch
from foosim.common.errors import BadValue, DeploymentError, UnknownName
from foosim.deployment.loader import load_deployment
from foosim.library.generic.laser_scanner import Scan
from foosim.library.mobile.battery import BatteryRule
from foosim.runtime.roles.bus import Weather
from foosim.simulation.run import rehearse
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.world.assembly.event_times import events_by_tick
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.components.view import ComponentError
from foosim.world.frame import Frame
from foosim.world.setting.settable import set_edits
from tests.kinematic_yard import yard_text

TICKS: Final = 300
SEED: Final = 7
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


def drawn_events() -> list[dict[str, Any]]:
    """Twenty events at drawn times, of all kinds."""
    draw = Random(SEED)
    events: list[dict[str, Any]] = []
    for number in range(20):
        when = {"at": f"{draw.uniform(0.0, 2.9):.3f} s"} if number % 3 else {"between": ["0.2 s", "2.5 s"]}
        pose = f"{draw.uniform(-9.0, 9.0):.2f},{draw.uniform(4.0, 9.0):.2f}"
        what: list[dict[str, Any]] = [
            {
                "entity": f"b-{number % 3 + 1}",
                "set": {"at": {"x": f"{draw.uniform(-2, 2):.2f} m", "yaw": "30 deg"}},
            },
            {"choose": "1 of k-*" if number % 2 else "2 of w-*", "set": {"down": bool(number % 5)}},
            {"choose": "1 of k-*", "set": {"battery.charge": f"{draw.randrange(101)} %", "at": pose}},
            {"entity": f"w-{draw.randrange(1, 3)}", "set": {"at": pose, "motion.active": number % 3 == 0}},
        ]
        events.append({**when, **what[number % 4]})
    return events


@cache
def run() -> tuple[Frame, ...]:
    print(f"seed {SEED}")
    return frames_of(drawn_events())


def frames_of(events: list[dict[str, Any]]) -> tuple[Frame, ...]:
    frames: list[Frame] = []
    rehearse(text(events), NAME, TICKS, 1, settings=Settings(on_commit=frames.append))
    return tuple(frames)


def test_events_set_what_they_say_when_they_say_it() -> None:
    """Of each event the frame after its tick: who is down, where it is, what its charge is."""
    deployment = load_deployment(text(drawn_events()), NAME)
    frames = {frame.tick: frame for frame in run()}
    for tick, events in events_by_tick(deployment).items():
        after = frames[tick + 1]
        last = {(event.name, event.field): event.value for event in events}
        for (name, field), value in last.items():
            if after.at(name, "absent"):
                continue
            if field == "down":
                assert after.at(name, "down") == float(value is True)
            elif field == "battery.charge":
                assert after.at(name, field) == pytest.approx(10.0 * float(str(value).split()[0]), abs=0.051)
            elif isinstance(value, str):
                place = [float(number) for number in value.split(",")]
                assert after.vector(name, "position", 2) == pytest.approx(place, abs=0.01)


def test_times_and_entities_are_drawn_by_the_seed() -> None:
    events = [{"between": ["1 s", "2 s"], "choose": "2 of *", "set": {"at": "5,5"}} for _ in range(200)]
    found = events_by_tick(load_deployment(text(events), NAME))
    chosen = [event.name for its in found.values() for event in its]
    assert len(chosen) == 400 and min(found) >= 100 and max(found) <= 200
    assert {name for name in chosen if chosen.count(name) > 15} == {
        f"{fleet}-{number}" for fleet, count in (("b", 5), ("k", 4), ("w", 4)) for number in range(1, count + 1)
    }
    other = load_deployment(text(events).replace("seed: 1", "seed: 2"), NAME)
    assert events_by_tick(other) != found


def test_a_simulation_does_what_an_event_does() -> None:
    events: list[dict[str, Any]] = [
        {"at": "0.5 s", "entity": "k-1", "set": {"at": "3,6"}},
        {"at": "0.5 s", "entity": "k-1", "set": {"battery.charge": "40 %"}},
        {"at": "0.5 s", "entity": "w-2", "set": {"down": True}},
        {"at": "0.5 s", "entity": "k-3", "add": "6,6"},
        {"at": "0.5 s", "entity": "w-1", "remove": True},
    ]
    found = []
    for its in ([], events):
        with Simulation(load_deployment(text(its), NAME)) as simulation:
            simulation.step(ticks=50)
            for event in () if its else events:
                for field, value in event.get("set", {}).items():
                    simulation.set(event["entity"], field, value)
            if not its:
                assert simulation.add("k", "6,6") == "k-3"
                simulation.remove("w-1")
            simulation.step(ticks=50)
            found.append(simulation.frame.digest)
            with pytest.raises(BadValue, match="would be in k-2"):
                simulation.set("k-1", "at", "3,-2")
            with pytest.raises(UnknownName, match=r"no entity .*, 'k-9', nearest is 'k-"):
                simulation.set("k-9", "down", True)
    assert found[0] == found[1]


def test_a_component_that_is_switched_off_does_nothing_until_it_is_switched_on() -> None:
    """The drive holds and refuses commands, the sensor does not measure; each alone."""
    moves = {"k-2": {"x": 0.5, "y": 0.0, "angular": 0.0}}
    with Simulation(load_deployment(text([]), NAME)) as simulation:
        for field, is_moving, is_measured in (
            ("", True, True),
            ("motion.active", False, True),
            ("pose.active", False, False),
        ):
            if field:
                simulation.set("k-2", field, False)
                simulation.step(ticks=100)
            before = state_of(simulation)
            simulation.step(moves, ticks=10)
            after = state_of(simulation)
            assert [one > other for one, other in zip(after, before, strict=True)] == [
                is_moving,
                not is_moving,
                is_measured,
            ]
        simulation.set("k-2", "motion.active", True)
        simulation.set("k-2", "pose.active", True)
        before = state_of(simulation)
        simulation.step(moves, ticks=1)
        simulation.step(moves, ticks=9)
        after = state_of(simulation)
        assert after[0] > before[0] and after[2] > before[2] and simulation.frame.at("k-2", "inactive") == 0.0


def state_of(simulation: Simulation) -> tuple[float, float, int]:
    """The x of a robot, how many commands it has refused, the number of its newest reading."""
    frame = simulation.frame
    return frame.at("k-2", "position"), frame.at("k-2", "refused"), simulation.readings["k-2", "pose"].sequence


@pytest.mark.parametrize("gives", [{"charge": [1.0, 2.0]}, {"charge": [nan]}, {"full": [1.0]}, None])
def test_a_component_that_gives_no_numbers_of_its_slots_is_an_error_of_it(
    gives: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(BatteryRule, "set", lambda self, field, value: gives)
    deployment = load_deployment(text([]), NAME)
    frame = initial_frame(deployment)
    with pytest.raises(ComponentError, match="battery of k-1 failed"):
        set_edits(deployment, frame.layout, frame.numbers, frame.layout["k-1"], "battery.charge", "20 %")


@pytest.mark.parametrize("verb", [{"set": {"at": "0,3"}}, {"remove": True}])
def test_what_leaned_on_what_goes_falls_and_it_comes_back(verb: dict[str, Any]) -> None:
    """The lowest of a stack at rest: those above it fall by its height."""
    events = [{"at": "1.5 s", "entity": "b-1", **verb}, {"at": "2 s", "entity": "b-1", "add": "4,4"}]
    frames = frames_of(events)
    before, after = frames[149], frames[-1]
    for name, height in (("b-2", 0.3), ("b-3", 0.5)):
        assert before.at(name, "still_ticks") >= 50
        assert before.vector(name, "position", 3)[2] == pytest.approx(height, abs=0.002)
        assert after.vector(name, "position", 3)[2] == pytest.approx(height - 0.2, abs=0.002)
    is_removed = "remove" in verb
    assert after.vector("b-1", "position", 2) == pytest.approx([4.0, 4.0] if is_removed else [0.0, 3.0], abs=1e-6)
    assert frames[198].at("b-1", "absent") == float(is_removed) and frames[200].at("b-1", "absent") == 0.0


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


@pytest.mark.parametrize("tick", [2, 3])
def test_a_robot_that_goes_counts_what_it_measured_in_its_last_tick(tick: int) -> None:
    """Noise is drawn by the number of a sample: that of the next one, when it is back, is another one."""
    found = []
    for events in ([], [{"at": f"{tick * 10} ms", "entity": "k-1", "remove": True}]):
        with Simulation(load_deployment(text(events), NAME)) as simulation:
            simulation.step(ticks=tick + 1)
            found.append(simulation.frame.at("k-1", "pose.samples"))
    assert found[0] == found[1] > 0.0


def middle_ray(simulation: Simulation) -> float:
    scan = simulation.readings["w-1", "scan"].value
    assert isinstance(scan, Scan)
    return min(scan.distances[3:6])


REQUESTS: Final[tuple[tuple[int, str, dict[str, Any]], ...]] = (
    (35, "set", {"name": "b-3", "field": "at", "value": "0,4,0.1"}),
    (40, "add", {"name": "b", "at": "0,6,0.1"}),
    (41, "add", {"name": "k", "at": {"x": "6 m", "yaw": "90 deg"}, "node": "n1"}),
    (45, "set", {"name": "k-2", "field": "down", "value": True}),
    (50, "set", {"name": "w-1", "field": "at", "value": {"x": "-5 m", "yaw": "90 deg"}}),
    (60, "remove", {"name": "b-1"}),
    (61, "remove", {"name": "k-1"}),
    (90, "add", {"name": "b-1", "at": "-4,4"}),
    (91, "add", {"name": "k-1", "at": "6,6"}),
    (92, "set", {"name": "k-1", "field": "battery.charge", "value": "20 %"}),
    (93, "remove", {"name": "w-2"}),
)
REFUSED: Final = (
    ("b-3", "at", "0,0,0.2", "at of b-3: a place that is occupied: b-3 would be in b-1, "),
    ("k-1", "at", "3,-2", "would be in k-2"),
    ("k-1", "at", {"roll": "3 deg"}, "an upright body has no roll"),
    ("k-1", "at", "3", "valid are X,Y or X,Y,Z"),
    (
        "k-1",
        "at",
        {"x": "3 s"},
        "at of k-1: x: not a length (a number and one of m, cm, mm, um, km); s measures a time, '3 s'",
    ),
    ("k-1", "at", {"u": "3 m"}, "valid are X,Y or X,Y,Z, or some of x, y, z, roll, pitch, yaw"),
    ("k-1", "down", "yes", "neither true nor false"),
    (
        "k-1",
        "dwon",
        True,
        "that can be set (there are: down, at, motion.active, pose.active, scan.active, battery.charge), 'dwon'",
    ),
    ("k-1", "battery.charge", "120 %", "out of range 0 % to 100 %"),
    ("b-9", "at", "0,0", "no entity 'b-9'; there are b-1, "),
)


def test_requests_are_in_the_capture_and_a_run_begins_right_behind_one(tmp_path: Path) -> None:
    capture = tmp_path / "spares.mcap"
    asked: list[str] = []
    refused: list[str] = []

    def prepare(system: System) -> None:
        for tick, verb, arguments in REQUESTS:
            system.at_tick(tick, partial(ask, system, asked, verb, arguments))
        for name, field, value, _ in REFUSED:
            about = {"name": name, "field": field, "value": value}
            system.at_tick(30, partial(ask, system, refused, "set", about))
        system.at_tick(61, partial(system.kill, "n2"))
        system.at_tick(62, partial(system.kill_hub, "torn"))
        system.at_tick(93, partial(system.start, "n2"))

    def ask(system: System, answers: list[str], verb: str, arguments: dict[str, Any]) -> None:
        answers.append(system.request(verb, **arguments))

    its = text([], capture={"frames_every": "1 tick"})
    run = rehearse(its, NAME, 150, 2, settings=Settings(weather=Weather(SEED)), prepare=prepare, capture=capture)
    assert [run.answers[one].accepted for one in asked] == [True] * len(REQUESTS), run.answers
    for one, (*_, why) in zip(refused, REFUSED, strict=True):
        assert not run.answers[one].accepted and why in run.answers[one].text
    assert verify_capture(capture, 3).equal
    rows = open_capture(capture).captured_ticks()
    asked_of = {str(what.get("name")) for _, _, what in REQUESTS}
    assert {getattr(edit, "name", "") for row in rows for edit in row.edits} == asked_of - {"b", "k"} | {"b-4", "k-3"}
    effective = run.answers[asked[1]].tick
    at_s = (effective + 1) * 0.01
    start = read_branch(f"{capture}@{at_s:g}s", load_deployment(its, NAME)).start
    frames: list[Frame] = []
    rehearse(its, NAME, 1, 2, settings=Settings(on_commit=frames.append), start=start)
    captured = open_capture(capture).frames
    behind = frames[-1]
    assert behind.tick == effective + 2 and behind.at("b-4", "absent") == 0.0
    assert behind.vector("b-4", "position", 3) == pytest.approx([0.0, 6.0, 0.1], abs=0.001)
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


@pytest.mark.parametrize(
    ("event", "why"),
    [
        ({"at": "1 s", "entity": "c-*", "set": {"at": "0,0"}}, "events[0].entity: no entity matches"),
        ({"at": "1 s", "choose": "5 of w-*", "set": {"down": True}}, "events[0].choose: 4 entities match"),
        ({"at": "1 s", "choose": "w-1", "set": {"down": True}}, "no choice, such as `2 of rover-*`"),
        ({"at": "1 s", "entity": "b-*", "set": {"down": True}}, "events[0].set.down: no field of b-1 that can be set"),
        ({"at": "1 s", "entity": "k-1", "set": {"battery.charge": "2 J"}}, "events[0].set.battery.charge: not a"),
        ({"entity": "k-1", "set": {"down": True}}, "either `at` or `between`"),
        ({"between": ["2 s", "1 s"], "entity": "k-1", "set": {"down": True}}, "is before the first one"),
        ({"at": "1 s", "set": {"down": True}}, "either `entity` or `choose`"),
        ({"at": "1 s", "entity": "k-9", "add": True}, "events[0].entity: no entity matches"),
        ({"at": "1 s", "entity": "k-3", "add": "3"}, "valid are X,Y or X,Y,Z"),
        ({"at": "1 s", "entity": "k-3", "add": {"roll": "3 deg"}}, "an upright body has no roll"),
        ({"at": "1 s", "entity": "k-3", "add": True, "remove": True}, "an event does one thing"),
        ({"at": "1 s", "entity": "k-3"}, "an event does one thing"),
        ({"at": "1 s", "entity": "k-3", "remove": False}, "events[0].remove"),
    ],
)
def test_an_event_that_cannot_be_is_refused_with_its_place(event: dict[str, Any], why: str) -> None:
    with pytest.raises(DeploymentError) as refused:
        load_deployment(text([event]), NAME)
    assert why in str(refused.value) and "yard.yaml:" in str(refused.value)
