"""The console as a client, in a rehearsal: it gives jobs over ideal links, and another one takes up where it died."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any, Final

from foosim.capture.reader import open_capture
from foosim.capture.rows import PACKETS, PacketRow
from foosim.client.client import Client
from foosim.common.units import Pace
from foosim.console.live.sending import Desk
from foosim.deployment.loader import load_deployment
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.simulation.verify import verify_capture
from foosim.world.component_types.jobs import JobState
from foosim.world.layout import build_layout
from tests.client.scripted import Program, refused
from tests.frames import Frames
from tests.kinematic_yard import yard_text

JOBS: Final = {"kind": "job", "actuator": "drive", "rate": "5 Hz"}
ROBOTS: Final[dict[str, Any]] = {
    "scout": {"model": "holonomic", "actuators": {"drive": {"kind": "go_to"}}, "sensors": {"a": JOBS, "b": JOBS}},
    "drone": {"model": "rotorcraft", "at": {"x": "-1 m", "z": "1 m"}, "actuators": {"drive": {"kind": "waypoint"}},
              "sensors": {"jobs": JOBS}},
    "tug": {"model": "differential_drive", "at": {"x": "-5 m"}, "speed": "2 m/s", "turn_rate": "90 deg/s",
            "acceleration": "50 m/s2"},
    "mute": {"model": "holonomic", "at": {"x": "-3 m"}, "actuators": {"drive": {"kind": "go_to"}}},
}  # fmt: skip
DEAF: Final = [
    {"id": "hand", "between": ["hand", "*"]},
    {"id": "all", "from": "*", "to": "*", "loss": "100 %", "delay": "1 s"},
]
"""Links over which nothing comes from or to whom no rule names."""
CLIENTS: Final = {"desk": {"console": True}, "hand": {}}
TEXT: Final = yard_text(ROBOTS, clients=CLIENTS, network={"links": DEAF})


def desk_of(client: Client) -> Desk:
    return Desk(client, DEPLOYMENT, build_layout(DEPLOYMENT))


DEPLOYMENT: Final = load_deployment(TEXT, "yard.yaml")


def until(desk: Desk, robot: str, state: str) -> str:
    """Take turns until the job of a robot is in a state; return what is told of it."""
    while True:
        for job in desk.jobs():
            if (job["robot"], job["state"]) == (robot, state):
                return str(job["text"])
        desk.turn()


def test_the_console_sends_robots_and_a_new_one_takes_up_the_last_job(tmp_path: Path) -> None:
    told: list[str] = []

    def first(client: Client) -> None:
        desk = desk_of(client)
        assert desk.send("drone", "drive", {"x": 0.0, "y": 1.0, "z": 2.0, "yaw": 0.0}) == (
            "drone/drive: x 0 m, y 1 m, z 2 m, yaw 0 rad"
        )
        assert [job["text"] for job in desk.jobs()] == [
            "job to x 0 m, y 1 m, z 2 m, yaw 0 rad: not sent: the robot's job sensor has not been received"
        ]
        desk.send("scout", "drive", {"x": 1.0, "y": 0.5})
        told.extend((until(desk, "scout", "done"), until(desk, "drone", "done")))
        told.extend(refused(partial(desk.send, robot, "drive", numbers)) for robot, numbers, *_ in WRONG)
        told.append(refused(lambda: desk.cancel("scout", "drive")))
        assert [job["state"] for job in desk.jobs()] == ["done", "done"], "what is refused changes nothing"
        desk.send("scout", "drive", {"x": 9.0, "y": 0.0})
        until(desk, "scout", "running")
        told.append(until(desk, "scout", "preempted"))
        desk.send("scout", "drive", {"x": 9.0, "y": 0.0})
        until(desk, "scout", "running")

    def second(client: Client) -> None:
        desk = desk_of(client)
        told.append(until(desk, "scout", "running"))
        desk.cancel("scout", "drive")
        told.append(until(desk, "scout", "cancelled"))

    def hand(client: Client) -> None:
        client.listen([("scout", "a")])
        drive = client.robots["scout"].actuators["drive"]
        while len(told) < 2 + len(WRONG) + 1:
            client.receive()
        for _ in range(2):
            client.receive()
        job = drive.call(9.0, 9.0)
        while job.state == JobState.NONE:
            client.receive()

    programs = {"desk": Program(first, second), "hand": Program(hand)}
    capture = tmp_path / "run.mcap"
    rehearse(TEXT, "yard.yaml", 500, 2, settings=Settings(clients=programs), pace=Pace("realtime"), capture=capture)
    assert programs["desk"].is_over
    words = [NUMBER.sub("job N", text) for text in told]
    assert words == [
        "job N to x 1 m, y 0.5 m: done",
        "job N to x 0 m, y 1 m, z 2 m, yaw 0 rad: done",
        *(f"{error}: {text}" for *_, error, text in WRONG),
        "BadValue: scout/drive: no job of desk to cancel",
        "job N to x 9 m, y 0 m: preempted by hand",
        "job N: running",
        "job N: cancelled",
    ]
    rows = [row for row in open_capture(capture).rows(PACKETS) if isinstance(row, PacketRow)]
    its = [row for row in rows if "desk" in {row.source, row.destination}]
    assert {(row.rule, row.fate) for row in its} == {("ideal", "delivered")}
    assert verify_capture(capture).equal


NUMBER: Final = re.compile("job [0-9]+")
WRONG: Final = (
    ("mute", {"x": 0.0, "y": 0.0}, "UnknownName",
     "no actuator with a job sensor (there are: drone/drive, scout/drive), 'mute/drive', "
     "nearest is 'scout/drive'"),
    ("scout", {"x": 0.0}, "BadValue", "scout/drive takes x (m), y (m): x given"),
    ("scout", {"x": 0.0, "y": "far"}, "BadValue", "scout/drive takes x (m), y (m): y is not a number, 'far'"),
    ("scout", {"x": 0.0, "y": 1e6}, "BadValue",
     "scout/drive takes x (m), y (m): y is beyond its limit of 100000 m, 1000000.0"),
    ("drone", {"x": 0.0, "y": 0.0, "z": 300.0, "yaw": 0.0}, "BadValue",
     "drone/drive takes x (m), y (m), z (m), yaw (rad): z is beyond its limit of 120 m, 300.0"),
)  # fmt: skip


def test_the_console_drives_a_robot_by_keys() -> None:
    """Ahead with all of its speed, to the right with half of its turn rate; then it stands."""
    frames, told = Frames(), list[str]()

    def drive(client: Client) -> None:
        desk = desk_of(client)
        told.append(desk.drive("tug", 1, -1))
        while client.tick < 100:
            desk.turn()
        told.append(desk.drive("tug", 0, 0))
        told.extend(refused(partial(desk.drive, robot, ahead, 0)) for robot, ahead in (("scout", 1), ("tug", 2)))
        assert desk.jobs() == []

    settings = Settings(clients={"desk": Program(drive)}, on_commit=frames)
    rehearse(TEXT, "yard.yaml", 300, 1, settings=settings, pace=Pace("realtime"))
    half, end = (frames.frames[tick] for tick in (50, 299))
    assert half.at("tug", "wheel_speeds") == 2.0 and half.at("tug", "angular_velocity", 2) < 0.0
    assert end.vector("tug", "wheel_speeds", 2) == [0.0, 0.0]
    assert told == [
        "tug/motion: linear 2, angular -0.785398",
        "tug/motion: linear 0, angular 0",
        "UnknownName: no robot that is driven by speeds (there are: tug), 'scout'",
        "BadValue: ahead and left are 1, 0 or -1, '2, 0'",
    ]
