"""Jobs of the client library: they are called, waited for, cancelled, found again, and answered within two ticks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final, Literal

import numpy as np
import pytest

from foosim.client.client import Client
from foosim.client.errors import JobCancelled, JobFailed, JobPreempted, JobUnfinished, RunEnded
from foosim.common.units import Pace
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.world.component_types.jobs import JobState
from foosim.world.frame import Frame
from tests.client.scripted import Program, refused
from tests.heads import folder, head
from tests.kinematic_yard import yard_text

NAME: Final = "yard.yaml"
SCOUT: Final[dict[str, Any]] = {
    "model": "holonomic",
    "actuators": {"drive": {"kind": "go_to", "patience": "1 s"}},
    "sensors": {"jobs": {"kind": "job", "actuator": "drive", "rate": "5 Hz"}},
}
LOSSY: Final = {"links": [{"id": "all", "from": "*", "to": "*", "loss": "50 %", "duplicate": "20 %"}]}


def run(
    ticks: int,
    programs: dict[str, Program],
    pace: Literal["fast", "realtime"] = "fast",
    scout: Mapping[str, Any] = SCOUT,
    **sections: Any,
) -> list[Frame]:
    """Rehearse a scout and these clients, which are in lockstep if the pace is fast; return the frames."""
    waited: dict[str, Any] = {"lockstep": True, "rate": "100 Hz"} if pace == "fast" else {}
    clients = {"other": {}, **dict.fromkeys(programs, waited)}
    frames: list[Frame] = []
    text = yard_text({"scout": scout}, clients=clients, **sections)
    settings = Settings(clients=programs, on_commit=frames.append)
    found = rehearse(text, NAME, ticks, 1, settings=settings, pace=Pace(pace), folder=folder())
    assert not found.json["failed"], found.json["reason"]
    assert all(program.is_over for program in programs.values()), "the programs have come to their ends"
    return frames


def joined(script: Callable[[Client], None], *, lockstep: bool = True) -> Program:
    """A program that subscribes, joins, and runs a script at its first tick, or after `listen`."""

    def whole(client: Client) -> None:
        client.subscribe("scout", "jobs")
        if not lockstep:
            client.listen()
            script(client)
            return
        for _ in client.lockstep(100):
            script(client)
            return

    return Program(whole)


@pytest.mark.parametrize("lockstep", [True, False])
@pytest.mark.parametrize("network", [{}, {"network": LOSSY}])
def test_a_job_is_called_and_waited_for(lockstep: bool, network: dict[str, Any]) -> None:
    ends: list[tuple[int, JobState]] = []

    def script(client: Client) -> None:
        job = client.robots["scout"].actuators["drive"].call(x=1.0, y=0.5)
        assert job.state == JobState.NONE
        job.result()
        ends.append((client.tick, job.state))

    pace: Literal["fast", "realtime"] = "fast" if lockstep else "realtime"
    frames = run(800, {"hand": joined(script, lockstep=lockstep)}, pace, **network)
    assert [state for _, state in ends] == [JobState.DONE]
    x, y, _ = frames[-1].vector("scout", "position", 3)
    assert abs(x - 1.0) < 0.1
    assert abs(y - 0.5) < 0.1


def test_an_answer_comes_two_ticks_later() -> None:
    """In lockstep at each tick, on ideal links: sent at k, taken in tick k + 1, told by the frame k + 2."""
    seen: list[tuple[int, JobState]] = []

    def script(client: Client) -> None:
        job = client.robots["scout"].actuators["drive"].call(5.0, 0.0)
        first = client.tick
        for _ in range(4):
            with pytest.raises(JobUnfinished, match="job 1 has not ended"):
                job.result(0.01)
            seen.append((client.tick - first, job.state))

    run(50, {"hand": joined(script)})
    none, running = JobState.NONE, JobState.RUNNING
    assert seen == [(1, none), (2, running), (3, running), (4, running)]


def test_what_ends_otherwise_raises_and_says_what_is_known() -> None:
    said: list[str] = []

    def script(client: Client) -> None:
        drive = client.robots["scout"].actuators["drive"]
        first = drive.call(3.0, 0.0)
        with pytest.raises(JobUnfinished):
            first.result(0.1)
        second = drive.call(0.0, 3.0)
        with pytest.raises(JobPreempted, match="scout/drive: job 1 has been preempted by hand"):
            first.result()
        second.cancel()
        with pytest.raises(JobCancelled, match="has been cancelled") as caught:
            second.result()
        assert caught.value.number == second.number
        third = drive.call(0.0, 0.0)
        drive.set(1.0, 1.0)
        said.append(refused(third.result))
        unsent = drive.call(0.0, 0.0)
        drive.call(0.1, 0.0).result()
        with pytest.raises(JobPreempted, match="job that was not sent has been preempted by hand"):
            unsent.result()
        said.append(refused(lambda: drive.call(1.0)))
        said.append(refused(lambda: drive.call(x=1.0, y=0.0, job=3.0)))

    run(700, {"hand": joined(script)})
    assert said[0].startswith("JobPreempted: scout/drive: job")
    assert said[1:] == [
        "BadValue: scout/drive takes x (m), y (m): 1 number given",
        "BadValue: scout/drive takes x (m), y (m): no such name, 'job'",
    ]


def test_a_job_that_comes_no_nearer_fails() -> None:
    box = {"length": "1 m", "width": "9 m", "height": "1 m", "at": {"x": "1.5 m"}}

    def script(client: Client) -> None:
        job = client.robots["scout"].actuators["drive"].call(3.0, 0.0)
        with pytest.raises(JobFailed, match="job 1 has failed"):
            job.result()
        assert 130 < client.tick < 300, "a second after it stands at the wall"

    run(400, {"hand": joined(script)}, scene={"kind": "boxes", "boxes": {"wall": box}})


def test_who_was_restarted_asks_for_its_job_and_goes_on_above_its_number() -> None:
    numbers: list[int | None] = []

    def first(client: Client) -> None:
        client.subscribe("scout", "jobs")
        ticks = client.lockstep(100)
        for _ in ticks:
            drive = client.robots["scout"].actuators["drive"]
            assert drive.job is None
            job = drive.call(1.0, 0.0)
            with pytest.raises(JobUnfinished):
                job.result(0.2)
            numbers.append(job.number)
            break

    def second(client: Client) -> None:
        client.subscribe("scout", "jobs")
        for _ in client.lockstep(100):
            drive = client.robots["scout"].actuators["drive"]
            job = drive.job
            if job is None:  # nothing has told of it yet
                continue
            assert job.state == JobState.RUNNING
            numbers.append(job.number)
            job.result()
            other = drive.call(0.0, 0.0)
            with pytest.raises(JobUnfinished):
                other.result(0.1)
            numbers.append(other.number)
            other.cancel()
            with pytest.raises(JobCancelled):
                other.result()
            return

    run(600, {"hand": Program(first, second)})
    begun, found, other = numbers
    assert begun is not None and other is not None
    assert begun == found
    assert begun < other


def cancel_what_was_left(client: Client) -> None:
    """Find the job of the life before, and call it off."""
    client.subscribe("scout", "jobs")
    for _ in client.lockstep(100):
        job = client.robots["scout"].actuators["drive"].job
        if job is not None:
            job.cancel()
            with pytest.raises(JobCancelled):
                job.result()
            return


def test_who_was_restarted_cancels_what_it_did_not_call() -> None:
    def first(client: Client) -> None:
        client.subscribe("scout", "jobs")
        for _ in client.lockstep(100):
            with pytest.raises(JobUnfinished):
                client.robots["scout"].actuators["drive"].call(5.0, 0.0).result(0.2)
            break

    frames = run(200, {"hand": Program(first, cancel_what_was_left)})
    assert frames[-1].vector("scout", "linear_velocity", 3) == [0.0, 0.0, 0.0]


def test_an_arm_is_given_positions_at_times() -> None:
    """By joint, as lists or arrays; who was restarted cancels what it does not know the points of."""
    said: list[str] = []

    def first(client: Client) -> None:
        client.subscribe("scout", "jobs")
        for _ in client.lockstep(100):
            drive = client.robots["scout"].actuators["drive"]
            drive.call(times=[0.5, 1.0], positions=[{"tilt": 0.2, "pan": 0.5}, [0.3, 0.1]]).result()
            said.append(refused(partial(drive.call, times=[1.0], positions=[0.5])))
            with pytest.raises(JobFailed, match=r"scout/drive: job \d+ has failed: its times do not rise"):
                drive.call(times=[1.0, 0.5], positions=[[0.5, 0.2], [0.3, 0.1]]).result()
            with pytest.raises(JobUnfinished):
                drive.call(np.array([2.0]), np.array([[1.0, 0.5]])).result(0.5)
            break

    arm = {**head("joint_trajectory", {}), "sensors": SCOUT["sensors"]}
    arm["actuators"] = {"drive": arm["actuators"]["go"]}
    programs = {"hand": Program(first, cancel_what_was_left)}
    frames = run(300, programs, scout=arm, network=LOSSY, engine="mujoco", assets="models")
    takes = "scout/drive takes times (s), positions (m or rad) of pan, tilt"
    assert said[0].startswith(f"BadValue: {takes}: Expected `array`, got `float` - at `$.positions[0]`")
    assert max(frame.vector("scout", "joint_positions", 2)[0] for frame in frames) > 0.49
    assert frames[-1].at("scout", "drive.count") == 0.0


def test_a_run_that_ends_ends_the_waiting() -> None:
    def script(client: Client) -> None:
        with pytest.raises(RunEnded):
            client.robots["scout"].actuators["drive"].call(50.0, 0.0).result()

    run(50, {"hand": joined(script)})


def test_what_cannot_be_known_is_refused() -> None:
    said: list[str] = []

    def script(client: Client) -> None:
        drive = client.robots["scout"].actuators["drive"]
        said.append(refused(lambda: drive.call(1.0, 0.0)))
        for _ in client.lockstep(100):
            said.append(refused(lambda: drive.call(1.0, 0.0)))
            return

    run(20, {"hand": Program(script)})
    assert "NotJoined: the client has not joined" in said[0]
    assert said[1].startswith("UnknownName: not subscribed to this channel of scout")
