"""Law 1 for what is held: two cranes of two nodes hand a crate over the border, on any number of nodes.

Then faults are planted, one at a time, and the same comparison must see each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.capture.start_frame import read_branch
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.node.physics.mujoco_islands import CompositionEngine
from foosim.simulation.check.component_check import ComponentCheck
from foosim.simulation.check.component_check import _shuffle as shuffle
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.simulation.what_if import what_if
from foosim.world.assembly.volumes import Volumes
from foosim.world.forms.jobs import NUMBERS, RUNNING, STATES, JobState
from foosim.world.frame import Frame
from tests.forms.worlds import DEPLOY
from tests.frames import Frames
from tests.grip_yards import NAME, SIDE_M, Step, crane, crate, world

HIGH_M: Final = 0.4
STEPS: Final[tuple[Step, ...]] = (
    (0, "a", "joints", (0.0, 0.56)),
    (60, "b", "joints", (HIGH_M, 1.0)),
    (140, "a", "gripper", (1.0, 1.0)),
    (145, "a", "joints", (HIGH_M, 0.57)),
    (220, "a", "joints", (HIGH_M, 1.17)),
    (340, "b", "joints", (HIGH_M, 1.16)),
    (400, "b", "gripper", (1.0, 1.0)),
    (415, "a", "gripper", (0.0, 2.0)),
    (418, "a", "joints", (HIGH_M, 0.6)),
    (430, "b", "joints", (HIGH_M, 0.57)),
    (560, "b", "joints", (0.01, 0.57)),
    (640, "b", "gripper", (0.0, 2.0)),
    (650, "b", "joints", (0.05, 0.57)),
    (680, "b", "gripper", (1.0, 3.0)),
    (685, "b", "joints", (0.3, 0.4)),
)
"""Crane a lifts the crate and brings it to x = 0, b takes it while a holds it, a lets go, b puts it down, and takes
it again, higher up; each grip is a job, whose number is the last one of its command."""
BOTH_HOLD: Final = 408
TICKS: Final = 760
CHECKED: Final = 220
NOISE: Final = {"kind": "gaussian_noise", "std": {"angular_rate": "0.1 rad/s"}}


def two_cranes(steps: Sequence[Step] = STEPS) -> str:
    robots = {
        "a": crane(-1.5),
        "b": crane(1.5, yaw_deg=180.0),
        "far": {
            "model": "quadrotor",
            "at": {"y": "8 m", "z": "50 mm"},
            "actuators": {},
            "sensors": {
                "imu": {"kind": "imu", "rate": "100 Hz", "modifiers": [NOISE]},
            },
        },
    }
    return world(
        robots, {"crate": crate(-0.6), "loose": crate(0.0, y=4.0, z=2.0)}, steps, capture={"frames_every": "1 tick"}
    )


def run(
    nodes: int,
    prepare: Callable[[System], None] | None = None,
    *,
    text: str = "",
    on_commit: Callable[[Frame], None] | None = None,
    capture: Path | None = None,
) -> Rehearsed:
    settings = Settings(on_commit=on_commit)
    found = rehearse(
        text or two_cranes(), NAME, TICKS, nodes, settings=settings, prepare=prepare, capture=capture, folder=DEPLOY
    )
    assert not found.json["failed"] and found.json["ticks"] == TICKS, found.json["reason"]
    return found


@cache
def on_one() -> tuple[list[bytes], list[Frame]]:
    frames = Frames()
    return run(1, on_commit=frames).digests, frames.frames


def holders(frame: Frame) -> str:
    """The cranes that hold the crate."""
    crate_index = frame.layout["crate"].index
    return "".join([name for name in "ab" if frame.at(name, "gripper.held") == crate_index])


def test_a_crate_is_handed_over() -> None:
    frames = on_one()[1]
    assert list(dict.fromkeys(holders(frame) for frame in frames)) == ["", "a", "ab", "b"]
    assert holders(frames[660]) == "" and holders(frames[-1]) == "b", "it was put down, and taken again"
    assert frames[340].vector("crate", "position", 3) == pytest.approx([0.0, 0.0, HIGH_M + SIDE_M / 2], abs=0.01)
    assert frames[560].vector("crate", "position", 3) == pytest.approx([0.6, 0.0, HIGH_M + SIDE_M / 2], abs=0.01)
    assert frames[-1].vector("crate", "position", 3)[2] > 0.2
    jobs = [[frames[-1].at(name, f"gripper.{slot}") for slot in (NUMBERS, STATES, RUNNING)] for name in "ab"]
    assert jobs == [[2.0, JobState.DONE, 0.0], [3.0, JobState.DONE, 0.0]]


def test_its_solver_is_the_owner_of_whoever_is_nearer() -> None:
    text, files = pin_assets(two_cranes(), NAME, DEPLOY)
    frames = on_one()[1]
    volumes = Volumes(load_deployment(text, NAME).with_assets(files), frames[0].layout)
    box = frames[0].layout["crate"].index
    found = []
    for frame in frames:
        island = next(one for one in volumes.islands(frame.numbers) if box in one.entities)
        found.append((len(island.entities), island.nearest))
        for name in holders(frame):
            assert frame.layout[name].index in island.entities
    assert [name for name in dict.fromkeys(name for _, name in found) if name] == ["a", "b"]
    assert {2, 3} <= {count for count, _ in found}


def test_it_is_the_same_on_three_nodes_where_robots_move_and_engines_are_rebuilt() -> None:
    assert run(3, partial(shuffle, seed=2, ticks=TICKS)).digests == on_one()[0]


def rebuild_all(system: System) -> None:
    """Make the engines of all nodes anew every 20 ticks, so that some are made amid each grasp."""
    for tick in range(10, TICKS, 20):
        for solver in system.solvers.values():
            system.at_tick(tick, solver.rebuild)


def test_it_is_the_same_on_two_nodes_whose_engines_are_rebuilt_amid_a_grasp() -> None:
    assert run(2, rebuild_all).digests == on_one()[0]


def test_a_node_and_the_vhub_that_are_lost_while_both_hold_change_nothing(tmp_path: Path) -> None:
    """The node is that of the solver: the crane that is nearer is of it."""

    def prepare(system: System) -> None:
        system.at_tick(BOTH_HOLD, partial(system.kill, "n1"))
        system.at_tick(BOTH_HOLD + 2, partial(system.kill_hub, "torn"))

    path = tmp_path / "run.mcap"
    assert run(2, prepare, capture=path).digests == on_one()[0]
    assert verify_capture(path, 3).equal and what_if(open_capture(path)).changed == 0
    assert goes_on(path, BOTH_HOLD + 3, ticks=60) == on_one()[0][BOTH_HOLD + 3 :][:60]


def goes_on(path: Path, tick: int, ticks: int) -> list[bytes]:
    """The digests of a run that begins with a captured frame."""
    text, files = pin_assets(two_cranes(), NAME, DEPLOY)
    start = read_branch(f"{path}@{tick * 0.01:g}s", load_deployment(text, NAME).with_assets(files)).start
    return rehearse(two_cranes(), NAME, ticks, 2, start=start, folder=DEPLOY).digests


def test_a_grasp_changes_no_draw_of_others() -> None:
    """A quadrotor far away reads the same noise, and a loose crate falls the same, whether the cranes grip or not."""
    frames = Frames()
    run(1, text=two_cranes([step for step in STEPS if step[2] == "joints"]), on_commit=frames)
    assert all(holders(frame) == "" for frame in frames.frames)
    assert on_one()[1][-1].numbers != frames.frames[-1].numbers
    for name in ("far", "loose"):
        entity = frames.frames[0].layout[name]
        for one, other in zip(on_one()[1], frames.frames, strict=True):
            assert one.numbers[entity.start : entity.stop] == other.numbers[entity.start : entity.stop], one.tick


def test_cranes_obey_the_laws() -> None:
    """Other names, other robots beside them, what comes and goes, readings alone and together."""
    text, files = pin_assets(two_cranes(), NAME, DEPLOY)
    assert holders(on_one()[1][CHECKED]) == "a"
    check = ComponentCheck(text, NAME, CHECKED, files=files, run=partial(rehearse, folder=DEPLOY))
    assert list(check.broken()) == []


# --- mutations -------------------------------------------------------------------------------------------------------


def test_an_engine_that_remembers_a_grasp_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = CompositionEngine._weld

    def weld(self: CompositionEngine, number: int, at: Any, turned: Any, grasp: Sequence[float]) -> None:
        kept = REMEMBERED.setdefault(id(self), list(grasp))
        ALIVE.append(self)
        honest(self, number, at, turned, kept)

    monkeypatch.setattr(CompositionEngine, "_weld", weld)
    honest_digests = on_one()[0]
    assert run(2, rebuild_all).digests != honest_digests


REMEMBERED: Final[dict[int, list[float]]] = {}
ALIVE: Final[list[CompositionEngine]] = []


def test_a_grasp_of_the_present_pose_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """The pose of the grasp is in the frame: where each new engine takes another one, the crate creeps."""
    honest = CompositionEngine.load
    seen: set[int] = set()

    def load(self: CompositionEngine, seats: Any, drives: Any, numbers: list[float], start: Any) -> None:
        if seats.grasps and id(seats) not in seen:
            seen.add(id(seats))
            ALIVE.append(seats)
            for at in seats.grasps:
                numbers[at] += 1e-6
        honest(self, seats, drives, numbers, start)

    monkeypatch.setattr(CompositionEngine, "load", load)
    assert run(2, rebuild_all).digests != on_one()[0]
