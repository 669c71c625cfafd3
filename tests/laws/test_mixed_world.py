"""A world of many forms together: a football table beside rovers in a hall, with all sensors and modifiers.

Whoever computes which robot on however many nodes, with moves and objects made anew, it is the same to the last bit.
Rigid bodies and robots from files are in the yard of `test_yard`; tests/forms has what neither of both can have.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final

import yaml

from foosim.cli.rehearse import elsewhere
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.rehearsal.run import rehearse
from foosim.rehearsal.system import Settings
from foosim.world.assembly.used_forms import forms_of
from foosim.world.frame import Frame
from tests.forms.test_forms import ALONE, HEADS, own
from tests.forms.worlds import driver, still
from tests.frames import Frames, broken_laws
from tests.laws.test_yard import yard

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
TICKS: Final = 120
NAME: Final = "mixed.yaml"
MODIFIERS: Final[dict[str, Any]] = {
    "pose": [
        {"kind": "gaussian_noise", "std": {"position": "1 cm", "heading": "1 deg"}},
        {"kind": "frame_change", "x": "1 m", "yaw": "10 deg"},
    ],
    "odometry": [{"kind": "bias_walk", "initial": "1 mm", "walk": "1 mm"}, {"kind": "delay", "time": "20 ms"}],
    "battery": [{"kind": "quantise", "step": {"voltage": "100 mV"}}, {"kind": "drop_out", "probability": "20 %"}],
    "proximity": [{"kind": "clip", "low": "10 cm", "high": "2 m"}],
    "pose_3d": [{"kind": "frame_change", "x": "1 m", "yaw": "10 deg"}],
    "gps": [{"kind": "gaussian_noise", "std": {"horizontal": 1e-5}}],
    "laser_scanner": [],
    "range": [],
}
OF_ROD: Final[dict[str, Any]] = {
    "imu": {"kind": "imu", "rate": "333 Hz", "at": {"link": "spin", "x": "5 cm"}},
    "joints": {"kind": "joint_state", "rate": "70 Hz", "modifiers": [{"kind": "bias_walk", "walk": 0.001}]},
    "touch": {"kind": "contact", "rate": "7 Hz"},
    "figures": {"kind": "figure_contact", "rate": "7 Hz"},
    "current": {"kind": "motor_current", "rate": "333 Hz", "slide": "14 N/A", "spin": "0.32 N m/A"},
}
"""Sensors of the rod of each goal, at rates that are not whole ticks."""
DRIVES: Final = {
    "blue.defence": ("joint_velocity", (0.5, 20.0)),
    "red.defence": ("rod_voltage", (20.0, 40.0)),
    "blue.midfield": ("rod_velocity", (1.0, 100.0)),
    "blue.attack": ("rod_force", (40.0, 0.5)),
}
"""Rods with other drives than that to positions, and the bounds of their commands."""
DRIVEN: Final = {
    "rover-1": ("wheel_speeds", (1.2, 1.2)),
    "rover-2": ("wheel_speeds", (1.2, 1.2)),
    "tug": ("v_w", (0.8, 2.0)),
    "omni": ("x_y_w", (0.7, 0.7, 2.0)),
    "craft": ("waypoint", (3.0, 3.0, 0.0, 3.0)),
}
OF_COMMANDS: Final[dict[str, list[dict[str, Any]]]] = {
    "rover-1": [
        {"kind": "gaussian_noise", "std": "10 mm/s"},
        {"kind": "bias_walk", "initial": "10 mm/s"},
        {"kind": "delay", "time": "30 ms"},
    ],
    "rover-2": [
        {"kind": "clip", "low": "-1 m/s", "high": "500 mm/s"},
        {"kind": "drop_out", "probability": "30 %"},
        {"kind": "quantise", "step": "50 mm/s"},
    ],
}
CELL: Final = {
    "kind": "battery",
    "capacity": "5 J",
    "idle": "1 W",
    "drag": "5 N",
    "chargers": [{"tag": "vehicle", "radius": "1 m", "power": "2 W"}],
}
WARMTH: Final = {
    "kind": "thermometer",
    "rate": "30 Hz",
    "modifiers": [{"kind": "gaussian_noise", "std": "0.5 degC"}],
}
WALK: Final = [{"x": "-5 m", "y": "-2 m"}, {"x": "-5 m", "y": "2 m", "yaw": "180 deg"}]


def written(data: dict[str, Any]) -> str:
    """The text of plain data; what it shares is written each time, for deployments have no anchors."""
    return yaml.safe_dump(json.loads(json.dumps(data)), sort_keys=False)


@cache
def mixed() -> str:
    """The table's deployment, with a hall around it, two rovers and a station."""
    data = yaml.safe_load((DEPLOY / "table.yaml").read_text())
    hall = yaml.safe_load((DEPLOY / "warehouse.yaml").read_text())["hall"]
    sensors = {name: {"kind": name, "rate": "50 Hz", "modifiers": modifiers} for name, modifiers in MODIFIERS.items()}
    sensors["proximity"] |= {"rays": 8, "range": "4 m"}
    sensors["laser_scanner"] |= {"rays": 19, "range": "4 m", "at": {"z": "80 cm"}}
    sensors["range"] |= {"range": "4 m", "cone": "20 deg", "at": {"z": "80 cm"}}
    data["hall"] = hall
    data["origin"] = {"latitude": "52.5 deg", "longitude": "13.4 deg"}
    for rod in ("red.goal", "blue.goal"):
        data["robots"][rod]["sensors"] |= OF_ROD
    data["robots"]["camera"]["sensors"]["exact"] = {"kind": "ball_state", "rate": "50 Hz"}
    for rod, (kind, _) in DRIVES.items():
        data["robots"][rod]["actuators"] = {"motors": {"kind": kind}}
        for player in data["players"].values():
            player["robots"].pop(rod, None)
    data["players"] |= {
        f"{robot}-driver": driver([robot], kind, bounds, "50 Hz")["driver"] for robot, (kind, bounds) in DRIVEN.items()
    }
    data["players"] |= {
        rod.replace(".", "-"): driver([rod], kind, bounds, "50 Hz")["driver"] for rod, (kind, bounds) in DRIVES.items()
    }
    data["robots"] |= {
        "rover-1": {"model": "rover", "x": "1.4 m", "y": "0 m", "heading": "170 deg", "sensors": sensors},
        "rover-2": {"model": "rover", "x": "-1.6 m", "y": "1 m", "charge": "50 %", "sensors": sensors},
        "charger": {"model": "station", "x": "-3 m", "y": "1 m"},
        "tug": {"model": "differential_drive", "at": {"x": "-5 m", "y": "-3 m"}, "tags": ["guest"]},
        "omni": {"model": "holonomic", "at": {"x": "-4 m", "y": "-3 m"}},
        "craft": {"model": "rotorcraft", "at": {"x": "-3 m", "y": "-3 m"}},
        "walker": {"model": "mover", "shape": "sphere", "radius": "30 cm", "path": WALK, "speed": "1 m/s"},
    }
    for robot in ("tug", "omni", "craft"):
        data["robots"][robot]["sensors"] = {"velocity": {"kind": "velocity", "rate": "50 Hz"}, "warmth": WARMTH}
    data["robots"]["omni"]["rules"] = {"own": CELL}
    data["robots"]["craft"]["rules"] = {"skin": {"kind": "burns", "after": "100 ms"}}
    data["objects"] = {
        "door": {"model": "door", "closed": {"x": "-6 m", "y": "1 m"}, "height": "50 cm", "open": "50 %"},
        "fire": {"model": "fire", "at": {"x": "-3 m", "y": "-4 m"}, "radius": "50 cm", "growth": "3 m/s"},
    }
    data["events"] = [{"at": "20 ms", "entity": "door", "set": {"open": True}}]
    for rover, modifiers in OF_COMMANDS.items():
        data["robots"][rover]["actuators"] = {"drive": {"kind": "wheel_speeds", "modifiers": modifiers}}
    data["scene"] = {"kind": "empty"}
    data["rules"] = {"corner": {"kind": "zone", "length": "9 m", "width": "9 m", "tag": "guest"}}
    data["nodes"] = {"all": {"robots": sorted(data["robots"])}}
    for player in data["players"].values():
        player.pop("process", None)
    data["table"]["rules"]["kickoff_delay"] = "20 ms"
    return written(data)


def test_every_form_is_in_a_mixed_world_or_has_its_laws_tested_alone() -> None:
    text, files = pin_assets(yard(), "yard.yaml", DEPLOY)
    worlds = (load_deployment(mixed(), NAME), load_deployment(text, "yard.yaml").with_assets(files))
    used = {(form.type_name, form.name) for world in worlds for form in forms_of(world)}
    assert set(own()) - used == ALONE | HEADS


@cache
def alone() -> tuple[dict[str, Any], list[Frame]]:
    """The result and the frames of a rehearsal of it on one node."""
    frames = Frames()
    return rehearse(mixed(), NAME, TICKS, 1, settings=Settings(on_commit=frames)).json, frames.frames


def test_all_of_it_moves_and_measures() -> None:
    result, frames = alone()
    assert not result["failed"]
    assert still(load_deployment(mixed(), NAME), frames) == set()


def test_nodes_moves_and_new_objects_change_nothing() -> None:
    assert list(broken_laws(mixed(), NAME, TICKS)) == []


def test_another_process_computes_the_same() -> None:
    assert list(elsewhere(mixed(), NAME, TICKS, alone()[0])) == []


def test_a_kit_changes_nothing_of_another() -> None:
    """The ball rolls, and rods move, beside rovers as without them; what refers to an entity refers to the same one."""
    data = yaml.safe_load(mixed())
    for name in ("rover-1", "rover-2", "charger"):
        del data["robots"][name]
        data["players"].pop(f"{name}-driver", None)
    del data["hall"]
    data["nodes"] = {"all": {"robots": sorted(data["robots"])}}
    frames = Frames()
    result = rehearse(written(data), NAME, TICKS, 1, settings=Settings(on_commit=frames)).json
    assert not result["failed"], result["reason"]
    assert told(frames.frames) == told(alone()[1])


def told(frames: Sequence[Frame]) -> list[list[float | str]]:
    """What each frame has of some entities, with the names of those to which it refers."""
    found = []
    for frame in frames:
        layout = frame.layout
        numbers: list[float | str] = [float(number) for number in frame.numbers]
        for place in layout.references:
            number = float(frame.numbers[place])
            numbers[place] = layout.entities[int(number)].name if number >= 0.0 else ""
        names = ("ball", "red.goal", "blue.attack", "world")
        found.append([n for name in names for n in numbers[layout[name].start : layout[name].stop]])
    return found
