"""What is set while a world goes on, by events and by requests: the same on any number of nodes, and in its capture."""

from __future__ import annotations

from functools import cache, partial
from math import nan
from pathlib import Path
from random import Random
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.common.errors import BadValue, DeploymentError, UnknownName
from foosim.deployment.loader import load_deployment
from foosim.runtime.roles.bus import Weather
from foosim.simulation.run import rehearse
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.world.assembly.event_times import events_by_tick
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.components.view import ComponentError
from foosim.world.edits import Set
from foosim.world.entity_rules.battery import Battery
from foosim.world.frame import Frame
from foosim.world.setting.settable import set_edits
from tests.kinematic_yard import yard_text

TICKS: Final = 300
SEED: Final = 7
NAME: Final = "yard.yaml"
RULES: Final = {"battery": {"kind": "battery", "capacity": "1 kJ", "idle": "5 W"}}
SENSORS: Final = {"pose": {"kind": "pose", "rate": "50 Hz"}}
BOX: Final = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg"}


def text(events: list[dict[str, Any]]) -> str:
    """A stack of three boxes, two robots on wheels and two that slide over the ground."""
    wheels = {"model": "differential_drive", "dynamics": "rigid"}
    robots = {
        "w-1": {**wheels, "at": {"x": "-3 m"}},
        "w-2": {**wheels, "at": {"x": "-3 m", "y": "2 m"}},
        "k-1": {"model": "holonomic", "at": {"x": "3 m"}, "rules": RULES},
        "k-2": {"model": "holonomic", "at": {"x": "3 m", "y": "2 m"}, "rules": RULES, "sensors": SENSORS},
    }
    objects = {f"b-{number}": {**BOX, "at": {"z": f"{10 + 20 * number} cm"}} for number in range(3)}
    return yard_text(robots, engine="mujoco", substeps=4, objects=objects, events=events)


def drawn_events() -> list[dict[str, Any]]:
    """Twenty events at drawn times, of all kinds."""
    draw = Random(SEED)
    events: list[dict[str, Any]] = []
    for number in range(20):
        when = {"at": f"{draw.uniform(0.0, 2.9):.3f} s"} if number % 3 else {"between": ["0.2 s", "2.5 s"]}
        pose = f"{draw.uniform(-9.0, 9.0):.2f},{draw.uniform(3.0, 9.0):.2f}"
        what: list[dict[str, Any]] = [
            {"entity": f"b-{draw.randrange(3)}", "set": {"at": {"x": f"{draw.uniform(-2, 2):.2f} m", "yaw": "30 deg"}}},
            {"choose": "1 of k-*" if number % 2 else "2 of w-*", "set": {"down": bool(number % 5)}},
            {"choose": "1 of k-*", "set": {"battery.charge": f"{draw.randrange(101)} %", "at": pose}},
            {"entity": f"w-{draw.randrange(1, 3)}", "set": {"at": pose, "motion.active": number % 3 == 0}},
        ]
        events.append({**when, **what[number % 4]})
    return events


@cache
def run(nodes: int) -> tuple[Frame, ...]:
    frames: list[Frame] = []
    print(f"seed {SEED}")
    rehearse(text(drawn_events()), NAME, TICKS, nodes, settings=Settings(on_commit=frames.append))
    return tuple(frames)


def test_events_are_the_same_on_three_nodes() -> None:
    """Below, requests are made of two."""
    assert [frame.digest for frame in run(3)] == [frame.digest for frame in run(1)]


def test_events_set_what_they_say_when_they_say_it() -> None:
    """Of each event the frame after its tick: who is down, where it is, what its charge is."""
    deployment = load_deployment(text(drawn_events()), NAME)
    frames = {frame.tick: frame for frame in run(1)}
    for tick, events in events_by_tick(deployment).items():
        after = frames[tick + 1]
        last = {(event.name, event.field): event.value for event in events}
        for (name, field), value in last.items():
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
    assert {name: chosen.count(name) > 30 for name in set(chosen)} == dict.fromkeys(
        ("b-0", "b-1", "b-2", "k-1", "k-2", "w-1", "w-2"), True
    )
    other = load_deployment(text(events).replace("seed: 1", "seed: 2"), NAME)
    assert events_by_tick(other) != found


def test_a_simulation_sets_what_an_event_sets(tmp_path: Path) -> None:
    sets: tuple[tuple[str, str, Any], ...] = (
        ("k-1", "at", "3,6"),
        ("k-1", "battery.charge", "40 %"),
        ("w-2", "down", True),
    )
    events = [{"at": "0.5 s", "entity": name, "set": {field: value}} for name, field, value in sets]
    digests = []
    for its in ([], events):
        file = tmp_path / f"{len(its)}.yaml"
        file.write_text(text(its))
        with Simulation(file, network=False) as simulation:
            simulation.step(ticks=50)
            for one in () if its else sets:
                simulation.set(*one)
            simulation.step(ticks=50)
            digests.append(simulation.frame.digest)
            with pytest.raises(BadValue, match="would be in k-2"):
                simulation.set("k-1", "at", "3,2")
            with pytest.raises(UnknownName, match=r"no entity .*, 'k-3', nearest is 'k-1'"):
                simulation.set("k-3", "down", True)
    assert digests[0] == digests[1]


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
    monkeypatch.setattr(Battery, "set", lambda self, field, value: gives)
    deployment = load_deployment(text([]), NAME)
    frame = initial_frame(deployment)
    with pytest.raises(ComponentError, match="battery of k-1 failed"):
        set_edits(deployment, frame.layout, frame.numbers, frame.layout["k-1"], "battery.charge", "20 %")


def test_what_leaned_on_what_is_put_elsewhere_falls() -> None:
    """The lowest of a stack at rest: those above it fall by its height."""
    events = [{"at": "2 s", "entity": "b-0", "set": {"at": "0,3"}}]
    frames: list[Frame] = []
    rehearse(text(events), NAME, TICKS, 1, settings=Settings(on_commit=frames.append))
    before, after = frames[199], frames[-1]
    for name, height in (("b-1", 0.3), ("b-2", 0.5)):
        assert before.at(name, "still_ticks") >= 50
        assert before.vector(name, "position", 3)[2] == pytest.approx(height, abs=0.002)
        assert after.vector(name, "position", 3)[2] == pytest.approx(height - 0.2, abs=0.002)


REQUESTS: Final = (
    (40, "b-2", "at", "0,4,0.1"),
    (60, "k-1", "down", True),
    (80, "k-2", "battery.charge", "20 %"),
    (90, "w-1", "at", {"x": "-5 m", "yaw": "90 deg"}),
    (120, "k-1", "down", False),
)
REFUSED: Final = (
    ("b-2", "at", "0,0,0.2", "at of b-2: a place that is occupied: b-2 would be in b-0, "),
    ("k-1", "at", "3,2", "would be in k-2"),
    ("k-1", "at", {"roll": "3 deg"}, "what stands upright has no roll"),
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
        "no field of k-1 that can be set (there are: down, at, motion.active, battery.charge), 'dwon'",
    ),
    ("k-1", "battery.charge", "120 %", "out of range 0 % to 100 %"),
    ("b-9", "at", "0,0", "no entity 'b-9'; there are b-0, "),
)


def test_requests_are_in_the_capture_and_refusals_change_nothing(tmp_path: Path) -> None:
    capture = tmp_path / "set.mcap"
    asked: list[str] = []
    refused: list[str] = []

    def prepare(system: System) -> None:
        for tick, name, field, value in REQUESTS:
            system.at_tick(tick, partial(ask, system, asked, name, field, value))
        for name, field, value, _ in REFUSED:
            system.at_tick(30, partial(ask, system, refused, name, field, value))

    settings = Settings(weather=Weather(SEED))
    run = rehearse(text([]), NAME, 200, 2, settings=settings, prepare=prepare, capture=capture)
    assert [run.answers[one].accepted for one in asked] == [True] * len(REQUESTS), run.answers
    for one, (*_, why) in zip(refused, REFUSED, strict=True):
        assert not run.answers[one].accepted and why in run.answers[one].text
    assert verify_capture(capture, 3).equal
    rows = open_capture(capture).captured_ticks()
    edits = [edit for row in rows for edit in row.edits if isinstance(edit, Set)]
    assert {edit.name for edit in edits} == {name for _, name, _, _ in REQUESTS}


def ask(system: System, asked: list[str], name: str, field: str, value: object) -> None:
    asked.append(system.request("set", name=name, field=field, value=value))


@pytest.mark.parametrize(
    ("event", "why"),
    [
        ({"at": "1 s", "entity": "c-*", "set": {"at": "0,0"}}, "events[0].entity: no entity matches"),
        ({"at": "1 s", "choose": "3 of w-*", "set": {"down": True}}, "events[0].choose: 2 entities match"),
        ({"at": "1 s", "choose": "w-1", "set": {"down": True}}, "no choice, such as `2 of rover-*`"),
        ({"at": "1 s", "entity": "b-*", "set": {"down": True}}, "events[0].set.down: no field of b-0 that can be set"),
        ({"at": "1 s", "entity": "k-1", "set": {"battery.charge": "2 J"}}, "events[0].set.battery.charge: not a"),
        ({"entity": "k-1", "set": {"down": True}}, "either `at` or `between`"),
        ({"between": ["2 s", "1 s"], "entity": "k-1", "set": {"down": True}}, "is before the first one"),
        ({"at": "1 s", "set": {"down": True}}, "either `entity` or `choose`"),
    ],
)
def test_an_event_that_cannot_be_is_refused_with_its_place(event: dict[str, Any], why: str) -> None:
    with pytest.raises(DeploymentError) as refused:
        load_deployment(text([event]), NAME)
    assert why in str(refused.value) and "yard.yaml:" in str(refused.value)
