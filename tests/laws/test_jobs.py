"""Jobs over links that lose, repeat and delay: each begins once, also while robots leave and come back."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any, ClassVar, Final, NamedTuple

import pytest
from msgspec import structs

from foosim.capture.reader import open_capture
from foosim.client.jobs import Job, Jobs
from foosim.client.player import Commands, Player, Samples
from foosim.deployment.schema import Deployment
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.simulation.verify import verify_capture
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import find_component
from foosim.world.frame import Frame
from tests.heads import folder, head
from tests.kinematic_yard import yard_text

NAME: Final = "yard.yaml"
TICKS: Final = 1500
SEED: Final = 7
PLAYERS: Final = ("ann", "ben")
KINDS: Final = {
    "arm": "joint_trajectory",
    "base": "go_to",
    "craft": "waypoint",
    "eye": "look_at",
    "head": "pan_tilt",
    "wheels": "go_to",
}
ROBOTS: Final = tuple(KINDS)
ASKED: Final = {"arm": "positions", "head": "set_point"}
"""The slot whose first two numbers are of the last command; `target` of all others."""
WORST: Final = {
    "loss": "50 %",
    "duplicate": "30 %",
    "delay": "10 ms",
    "order": "free",
    "jitter": {"shape": "uniform", "width": "800 ms"},
}
EVENTS: Final = (
    {"at": "2.505 s", "entity": "base", "remove": True},
    {"at": "3.5 s", "entity": "base", "add": "-2,0"},
    {"at": "4.2 s", "entity": "*", "set": {"down": True}},
    {"at": "5 s", "entity": "*", "set": {"down": False}},
    {"at": "14 s", "entity": "wheels", "remove": True},
)


class Said(NamedTuple):
    """What a player came to know of a job."""

    robot: str
    number: int
    command: Any
    state: JobState


class Dispatcher(Player):
    """Gives its robots one job after the other: it waits for some, cancels some, and preempts some by the next one."""

    said: ClassVar[dict[str, list[Said]]] = {}

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self._name = parameters["name"]
        self._jobs = [Jobs(deployment, self._name, robot, "go") for robot in ROBOTS]
        self._called: dict[str, list[Job]] = {robot: [] for robot in ROBOTS}
        self._until = dict.fromkeys(ROBOTS, 0)
        self._draw = Random(f"{SEED} {self._name}")

    def act(self, tick: int, samples: Samples) -> Commands:
        commands: dict[str, Any] = {}
        for jobs in self._jobs:
            jobs.hear(samples)
            robot, called = jobs.robot, self._called[jobs.robot]
            if tick >= self._until[robot] and self._draw.random() < 0.3:
                called[-1].cancel() if called and self._draw.random() < 0.3 else called.append(self._call(jobs))
                self._until[robot] = tick + self._draw.randrange(1, self._draw.choice((40, 300)))
            commands |= jobs.commands(tick)
        Dispatcher.said[self._name] = [
            Said(robot, job.number, job.command, job.state)
            for robot, called in self._called.items()
            for job in called
            if job.number is not None
        ]
        return commands

    def _call(self, jobs: Jobs) -> Job:
        x, y = self._draw.uniform(-2.0, 2.0), self._draw.uniform(-0.5, 0.5)
        if jobs.robot == "arm":  # some are too fast
            first, last = self._draw.uniform(0.2, 1.0), self._draw.uniform(1.1, 1.5)
            return jobs.call(times=[first, last], positions=[[x, y], [y, x / 2.0]])
        return jobs.call(x, y, *{"craft": (1.0, 0.0), "eye": (1.0,)}.get(jobs.robot, ()))


def text(**network: Any) -> str:
    """Robots that two players send to places, and others that these let turn to them."""
    robots: dict[str, Any] = {
        "base": {"model": "holonomic", "at": {"x": "-2 m"}, "actuators": {"go": {"kind": "go_to"}}},
        "wheels": {
            "model": "differential_drive",
            "at": {"x": "2 m"},
            "actuators": {"go": {"kind": "go_to", "feelers": "80 cm", "patience": "1 s"}},
        },
        "craft": {"model": "rotorcraft", "actuators": {"go": {"kind": "waypoint"}}},
        "arm": head("joint_trajectory", {"y": "3 m"}, patience="0.1 s", tolerance=1e-4),
        "eye": head("look_at", {"y": "4 m"}, patience="0.5 s"),
        "head": head("pan_tilt", {"y": "5 m"}),
    }
    sensor = {"jobs": {"kind": "job", "actuator": "go", "rate": "10 Hz"}}
    player = {"class": f"{__name__}:Dispatcher", "rate": "50 Hz", "robots": {robot: ["jobs"] for robot in ROBOTS}}
    return yard_text(
        {name: {**robot, "sensors": sensor} for name, robot in robots.items()},
        players={name: {**player, "parameters": {"name": name}} for name in PLAYERS},
        network={"links": [{"id": "all", "from": "*", "to": "*", **network}]},
        events=EVENTS,
        engine="mujoco",
        assets="models",
        capture={"frames_every": "1 tick"},
    )


class Ran(NamedTuple):
    """A run: its frames, and what its players said at the end."""

    frames: tuple[Frame, ...]
    said: dict[str, list[Said]]


@cache
def ran() -> Ran:
    frames: list[Frame] = []
    Dispatcher.said = {}
    found = rehearse(text(**WORST), NAME, TICKS, 1, settings=Settings(on_commit=frames.append), folder=folder())
    assert not found.json["failed"], found.json["reason"]
    return Ran(tuple(frames), Dispatcher.said)


def known(frame: Frame, robot: str) -> list[tuple[int, JobState]]:
    """Number and state of the last job of each sender."""
    numbers, states = frame.vector(robot, "go.jobs_numbers", 2), frame.vector(robot, "go.jobs_states", 2)
    return [(int(number), JobState(int(state))) for number, state in zip(numbers, states, strict=True)]


def steps(frames: tuple[Frame, ...], robot: str, row: int) -> list[tuple[int, JobState]]:
    """What was known of a sender's jobs, each time that it changed."""
    found = [known(frame, robot)[row] for frame in frames]
    return [found[0], *(after for before, after in pairwise(found) if before != after)]


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("row", [0, 1])
def test_a_job_begins_once_and_ends_once(robot: str, row: int) -> None:
    """Numbers only grow, and what has ended stays so, also while its robot leaves and comes back."""
    seen = steps(ran().frames, robot, row)
    assert len(seen) > 8
    for (number, state), (next_number, next_state) in pairwise(seen):
        assert next_number >= number
        assert next_number > number or (state == JobState.RUNNING and next_state.has_ended), seen


def test_what_runs_is_running() -> None:
    """One job of a robot at most, and the one that its actuator names."""
    for frame in ran().frames:
        for robot in ROBOTS:
            running = int(frame.at(robot, "go.jobs_running"))
            rows = [row for row, (_, state) in enumerate(known(frame, robot), 1) if state == JobState.RUNNING]
            assert rows == ([running] if running else [])
            assert not (running and frame.at(robot, "down")), "who is out of service does nothing"


def test_all_ends_are_met() -> None:
    ends = {state for robot in ROBOTS for row in (0, 1) for _, state in steps(ran().frames, robot, row)}
    assert ends == {*JobState}


def test_players_know_how_their_jobs_ended() -> None:
    """A job of which another of the same sender followed too soon to be told of is taken for preempted."""
    run = ran()
    taken = 0
    for row, name in enumerate(PLAYERS):
        for robot in ROBOTS:
            ends = dict(steps(run.frames, robot, row))
            told = [one for one in run.said[name] if one.robot == robot and one.state.has_ended]
            for one in told:
                assert one.state in (ends.get(one.number), JobState.PREEMPTED), one
                taken += one.state == ends.get(one.number)
    assert taken > 40


def test_a_late_repeat_sends_nobody_back(tmp_path: Path) -> None:
    """Packets come again after a later job has begun, and no robot is told its place a second time."""
    path = tmp_path / "run.mcap"
    Dispatcher.said = {}
    digests = rehearse(text(**WORST), NAME, TICKS, 2, capture=path, folder=folder()).digests
    assert digests == [frame.digest for frame in ran().frames]
    assert Dispatcher.said == ran().said
    assert verify_capture(path, 3).equal
    packets = open_capture(path).packets
    late = 0
    for row, name in enumerate(PLAYERS):
        mine = packets.where((packets.source == name) & (packets.fate == "delivered"))
        for robot, payload, tick in zip(mine.destination, mine.payload, mine.arrival_tick, strict=True):
            job = codec_of(find_component("actuator", KINDS[robot])).decode(payload).job
            frame = ran().frames[tick - ran().frames[0].tick]
            late += 0 < job < known(frame, robot)[row][0]
    assert late > 20
    for robot in ROBOTS:
        slot = f"go.{ASKED.get(robot, 'target')}"
        targets = [tuple(frame.vector(robot, slot, 2)) for frame in ran().frames]
        begun = [after for before, after in pairwise(targets) if after != before]
        called = [one.command for name in PLAYERS for one in ran().said[name] if one.robot == robot]
        asked = {tuple(one.positions[0]) if robot == "arm" else structs.astuple(one)[:2] for one in called}
        places = [place for place in begun if place in asked]
        assert len(places) == len(set(places)) > 8
