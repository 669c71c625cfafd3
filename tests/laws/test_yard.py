"""Law 1 for bodies of any kind together: arms from a file, crates, a quadrotor, a base that drives, sensors on all.

The same world on one, two and three nodes, also with robots that move between nodes and engines that are made anew.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import pytest
import yaml

from foosim.rehearsal.check.differences import Frames
from foosim.rehearsal.run import Rehearsed, rehearse
from foosim.rehearsal.system import Settings
from tests.forms.worlds import DEPLOY, driver

NAME: Final = "yard.yaml"
TICKS: Final = 200


@cache
def yard() -> str:
    crate = {"model": "box", "size": ["20 cm"] * 3, "mass": "500 g", "speed_limit": "8 m/s"}
    scan = {"kind": "laser_scanner", "rate": "10 Hz", "rays": 31, "range": "8 m"}
    place = {"x": "5 cm", "y": "-12 cm", "z": "1.6 m"}
    arm = {"model": "urdf", "file": "arm.urdf", "fixed": True}
    robots: dict[str, Any] = {
        "arm": {
            **arm,
            "actuators": {"joints": {"kind": "joint_position"}},
            "sensors": {
                "state": {"kind": "joint_state", "rate": "30 Hz"},
                "touch": {"kind": "contact", "rate": "7 Hz"},
            },
        },
        "limp": {**arm, "at": {"x": "90 cm"}, "actuators": {"joints": {"kind": "joint_torque"}}},
        "quad": {
            "model": "quadrotor",
            "at": {"x": "-1 m", "y": "1 m", "z": "80 cm"},
            "sensors": {"imu": {"kind": "imu", "rate": "100 Hz"}, "pose": {"kind": "pose_3d", "rate": "33 Hz"}},
        },
        "scout": {
            "model": "differential_drive",
            "at": {"x": "-2 m"},
            "sensors": {"scan": {**scan, "at": {"z": "30 cm"}}},
        },
    }
    players = {
        **driver(["arm"], "joint_position", (2.5, 1.8, 2.5, 2.0, 2.5, 1.5, 2.5), "5 Hz"),
        "efforts": driver(["limp"], "joint_torque", (20.0, 20.0, 10.0, 10.0, 4.0, 4.0, 2.0), "10 Hz")["driver"],
        "flight": driver(["quad"], "rotor_speeds", (900.0,) * 4, "50 Hz")["driver"],
        "drive": driver(["scout"], "v_w", (0.8, 2.0), "10 Hz")["driver"],
    }
    return yaml.safe_dump(
        {
            "format": 2,
            "world": "yard",
            "seed": 1,
            "tick": "10 ms",
            "substeps": 4,
            "engine": "bullet",
            "pace": "fast",
            "assets": "models",
            "scene": {"kind": "empty"},
            "surfaces": {"floor": {"friction": 0.9, "restitution": 0.2}},
            "objects": {"crate": {**crate, "at": place, "count": 5, "spacing": {"y": "6 cm", "z": "30 cm"}}},
            "robots": robots,
            "players": players,
            "nodes": {"n": {"robots": ["*"]}},
            "network": {"links": [{"id": "all", "from": "*", "to": "*", "delay": "3 ms", "order": "fifo"}]},
        },
        sort_keys=False,
    )


@cache
def run(nodes: int, ticks: int = TICKS) -> tuple[Rehearsed, Frames]:
    frames = Frames()
    return rehearse(yard(), NAME, ticks, nodes, settings=Settings(on_commit=frames), folder=DEPLOY), frames


def test_the_yard_is_the_same_world_on_any_number_of_nodes() -> None:
    one, frames = run(1)
    assert one.digests == run(2)[0].digests == run(3)[0].digests
    last = frames.frames[-1]
    contacts = sum(frame.at(f"crate-{number}", "contacts") for frame in frames.frames for number in range(1, 6))
    print(f"{contacts:.0f} contacts of crates")
    assert contacts >= 10, "crates fall on an arm"
    assert max(map(abs, last.vector("arm", "joint_positions", 7))) > 0.2
    assert any(last.vector("limp", "joint_efforts", 7))


@pytest.mark.campaign
def test_the_yard_is_the_same_world_for_long() -> None:
    assert run(1, 3_000)[0].digests == run(3, 3_000)[0].digests
