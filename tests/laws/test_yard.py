"""The laws for rigid bodies of all kinds together: arms from a file, crates, quadrotors, a robot on wheels, sensors."""

from __future__ import annotations

from functools import cache, partial
from typing import Any, Final

import pytest
import yaml

from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.simulation.check.component_check import ComponentCheck
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings
from tests.forms.worlds import DEPLOY, driver, still
from tests.frames import Frames

NAME: Final = "yard.yaml"
TICKS: Final = 120
CORNERS: Final = [[x, y, z] for x in ("-10 cm", "10 cm") for y in ("-10 cm", "10 cm") for z in ("0 cm", "20 cm")]
SHAPES: Final[dict[str, Any]] = {
    "box": {"model": "box", "size": ["30 cm", "20 cm", "10 cm"]},
    "capsule": {"model": "capsule", "radius": "10 cm", "length": "20 cm"},
    "cylinder": {"model": "cylinder", "radius": "10 cm", "length": "20 cm"},
    "hull": {"model": "hull", "corners": CORNERS},
    "sphere": {"model": "sphere", "radius": "10 cm"},
}
"""Bodies that fall on one another."""
OF_SCOUT: Final = {
    kind: {"kind": kind, "rate": "50 Hz"} for kind in ("contact", "imu", "joint_state", "odometry", "pose", "velocity")
}


@cache
def yard() -> str:
    crate = {"model": "box", "size": ["20 cm"] * 3, "mass": "500 g", "speed_limit": "8 m/s"}
    scan = {"kind": "laser_scanner", "rate": "10 Hz", "rays": 31, "range": "8 m"}
    place = {"x": "5 cm", "y": "-12 cm", "z": "1.6 m"}
    arm = {"model": "urdf", "file": "arm.urdf", "fixed": True}
    objects: dict[str, Any] = {
        name: {**shape, "mass": "1 kg", "at": {"x": "-2 m", "y": "2 m", "z": f"{20 + number * 35} cm"}}
        for number, (name, shape) in enumerate(SHAPES.items())
    }
    objects["crate"] = {**crate, "at": place, "count": 5, "spacing": {"y": "6 cm", "z": "30 cm"}}
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
        "pushed": {
            "model": "quadrotor",
            "at": {"x": "-1 m", "y": "2 m", "z": "50 cm"},
            "actuators": {"push": {"kind": "force", "force": "20 N", "torque": "0.1 N m"}},
        },
        "scout": {
            "model": "differential_drive",
            "dynamics": "rigid",
            "at": {"x": "-2 m"},
            "sensors": {"scan": {**scan, "at": {"x": "20 cm", "z": "15 cm"}}, **OF_SCOUT},
        },
    }
    players = {
        **driver(["arm"], "joint_position", (2.5, 1.8, 2.5, 2.0, 2.5, 1.5, 2.5), "5 Hz"),
        "efforts": driver(["limp"], "joint_torque", (20.0, 20.0, 10.0, 10.0, 4.0, 4.0, 2.0), "10 Hz")["driver"],
        "flight": driver(["quad"], "rotor_speeds", (900.0,) * 4, "50 Hz")["driver"],
        "push": driver(["pushed"], "force", (20.0, 20.0, 20.0, 0.1, 0.1, 0.1), "50 Hz")["driver"],
        "drive": driver(["scout"], "v_w", (0.8, 2.0), "10 Hz")["driver"],
    }
    return yaml.safe_dump(
        {
            "format": 2,
            "world": "yard",
            "seed": 1,
            "tick": "10 ms",
            "substeps": 4,
            "rules": {"breeze": {"kind": "wind", "x": "30 cm/s", "z": "10 cm/s"}},
            "engine": "mujoco",
            "pace": "fast",
            "assets": "models",
            "scene": {"kind": "empty"},
            "surfaces": {"floor": {"friction": 0.9, "restitution": 0.2}},
            "objects": objects,
            "robots": robots,
            "players": players,
            "nodes": {"n": {"robots": ["*"]}},
            "network": {"links": [{"id": "all", "from": "*", "to": "*", "delay": "3 ms", "order": "fifo"}]},
        },
        sort_keys=False,
    )


@cache
def run(nodes: int, ticks: int) -> tuple[Rehearsed, Frames]:
    frames = Frames()
    return rehearse(yard(), NAME, ticks, nodes, settings=Settings(on_commit=frames), folder=DEPLOY), frames


def test_the_yard_obeys_the_laws() -> None:
    text, files = pin_assets(yard(), NAME, DEPLOY)
    assert list(ComponentCheck(text, NAME, TICKS, files=files, run=partial(rehearse, folder=DEPLOY)).broken()) == []


def test_all_of_the_yard_moves_and_measures() -> None:
    found, frames = run(1, TICKS)
    assert not found.json["failed"], found.json["reason"]
    text, files = pin_assets(yard(), NAME, DEPLOY)
    assert still(load_deployment(text, NAME).with_assets(files), frames.frames) == set()
    contacts = sum(frame.at(f"crate-{number}", "contacts") for frame in frames.frames for number in range(1, 6))
    print(f"{contacts:.0f} contacts of crates")
    assert contacts >= 10, "crates fall on an arm"
    last = frames.frames[-1]
    assert max(map(abs, last.vector("arm", "joint_positions", 7))) > 0.2
    assert any(last.vector("limp", "joint_efforts", 7))


@pytest.mark.campaign
def test_the_yard_is_the_same_world_for_long() -> None:
    assert run(1, 3_000)[0].digests == run(3, 3_000)[0].digests
