"""Worlds of many component types together: what one engine can have beside one another, all at once.

`mixed` is a football table in a hall with rovers and what moves by kinematics; `yard` has rigid bodies of all kinds,
robots from files, grippers, heads, jobs, boxes of a scene and what comes and goes. They have all component types
but scenes, of which a world has one.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, Final

import yaml

from tests.components.worlds import DEPLOY, driver
from tests.grip_yards import Script, crane, crate
from tests.heads import folder, head

NAME: Final = "world.yaml"
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
    "roamer": ("go_within", (9.0, 9.0, 0.2, 0.8)),
    "hawk": ("fly_within", (9.0, 9.0, 0.0, 3.0, 0.2)),
    "jumper": ("teleport", (9.0, 9.0, 0.0, 3.0)),
}
AROUND: Final[dict[str, Any]] = {
    "sonar": {"kind": "sonar", "rate": "20 Hz", "range": "4 m", "at": {"z": "30 cm"}},
    "nearby": {"kind": "nearby", "rate": "20 Hz", "range": "8 m", "tag": "vehicle"},
    "scan": {"kind": "laser_scanner_3d", "rate": "10 Hz", "rows": 4, "columns": 30, "range": "5 m"},
    "map": {"kind": "terrain_map", "rate": "10 Hz", "length": "2 m", "width": "1 m", "resolution": "25 cm"},
}
"""Sensors of what is around the tug."""
MEASURED: Final = ("accelerometer", "clock", "motion_state", "satellite_fix", "travel")
OF_JUMPER: Final[dict[str, Any]] = {kind: {"kind": kind, "rate": "50 Hz"} for kind in MEASURED} | {
    "touch": {"kind": "collision", "rate": "50 Hz", "at": {"z": "20 cm"}, "reach": "9 m"}
}
OF_GOER: Final = {"jobs": {"kind": "job", "actuator": "go", "rate": "20 Hz"}}
GOERS: Final[dict[str, Any]] = {
    "roamer": {
        "model": "holonomic",
        "at": {"x": "-4 m", "y": "-5 m"},
        "actuators": {"go": {"kind": "go_within"}},
        "sensors": OF_GOER,
    },
    "hawk": {
        "model": "rotorcraft",
        "at": {"x": "-3 m", "y": "-5 m"},
        "actuators": {"go": {"kind": "fly_within"}},
        "sensors": OF_GOER,
    },
    "jumper": {
        "model": "holonomic",
        "at": {"x": "-5 m", "y": "-5 m"},
        "actuators": {"motion": {"kind": "x_y_w"}, "jump": {"kind": "teleport"}},
        "sensors": OF_JUMPER,
    },
}
"""Robots by places that they are to come to, or are put at."""
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
    """Return the text of plain data; what it shares is written each time, for deployments have no anchors."""
    return yaml.safe_dump(json.loads(json.dumps(data)), sort_keys=False)


@cache
def mixed() -> str:
    """Return the table's deployment with a hall around it, two rovers and a station."""
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
    eye = {"kind": "camera", "rate": "50 Hz", "at": {"z": "2 m"}, "look_at": {"entity": "ball"}, "exposure": "5 ms"}
    data["robots"]["camera"]["sensors"]["eye"] = eye
    for rod, (kind, _) in DRIVES.items():
        data["robots"][rod]["actuators"] = {"motors": {"kind": kind}}
        for player in data["players"].values():
            player["robots"].pop(rod, None)
    for robot, (kind, bounds) in {**DRIVEN, **DRIVES}.items():
        data["players"][f"{robot.replace('.', '-')}-driver"] = driver([robot], kind, bounds, "50 Hz")["driver"]
    data["robots"] |= {
        "rover-1": {"model": "rover", "x": "1.4 m", "y": "0 m", "heading": "170 deg", "sensors": sensors},
        "rover-2": {"model": "rover", "x": "-1.6 m", "y": "1 m", "charge": "50 %", "sensors": sensors},
        "charger": {"model": "station", "x": "-3 m", "y": "1 m"},
        "tug": {"model": "differential_drive", "at": {"x": "-5 m", "y": "-3 m"}, "tags": ["guest"]},
        "omni": {"model": "holonomic", "at": {"x": "-4 m", "y": "-3 m"}},
        "craft": {"model": "rotorcraft", "at": {"x": "-3 m", "y": "-3 m"}},
        **GOERS,
        "walker": {"model": "mover", "shape": "sphere", "radius": "30 cm", "path": WALK, "speed": "1 m/s"},
    }
    for robot in ("tug", "omni", "craft"):
        data["robots"][robot]["sensors"] = {"velocity": {"kind": "velocity", "rate": "50 Hz"}, "warmth": WARMTH}
    data["robots"]["tug"]["sensors"] |= AROUND
    data["robots"]["omni"]["rules"] = {"own": CELL}
    depths = {"kind": "depth_camera", "rate": "50 Hz", "at": {"z": "50 cm"}, "focal_length": "25 mm"}
    things = {"kind": "segmentation", "rate": "30 Hz", "look_at": {"entity": "walker"}, "latency": "15 ms"}
    kinds = {"kind": "semantic_camera", "rate": "50 Hz", "at": {"z": "50 cm"}, "tag": "vehicle", "hidden": True}
    data["robots"]["omni"]["sensors"] |= {"depths": depths, "things": things, "kinds": kinds}
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
    data["rules"]["jumps"] = {"kind": "teleported"}
    data["nodes"] = {"all": {"robots": sorted(data["robots"])}}
    for player in data["players"].values():
        player.pop("process", None)
    data["table"]["rules"]["kickoff_delay"] = "20 ms"
    return written(data)


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
GRIPS: Final = (
    *((4, "crane-1", "gripper", (1.0, 1.0)), (10, "crane-1", "joints", (0.1, 0.0))),
    *((40, "crane-2", "gripper", (1.0, 1.0)), (60, "crane-1", "gripper", (0.0, 2.0))),
    *(
        (64, "crane-1", "joints", (0.1, -0.2)),
        (64, "crane-2", "joints", (0.4, 0.1)),
        (100, "crane-2", "gripper", (0.0,)),
    ),
)
"""One crane takes a crate, another one takes it from that and lets it fall."""
EVENTS: Final[tuple[dict[str, Any], ...]] = (
    {"at": "0.1 s", "entity": "drive-2", "remove": True},
    {"at": "0.3 s", "entity": "drive-2", "add": True},
    {"at": "0.2 s", "entity": "drive-4", "add": "6,9"},
    {"at": "0.2 s", "entity": "crate-6", "add": "-4,6,0.5"},
    {"at": "0.5 s", "entity": "crate-6", "remove": True},
    {"between": ["0.2 s", "0.8 s"], "choose": "2 of base-*", "set": {"down": True}},
    {"between": ["0.3 s", "0.6 s"], "choose": "1 of crate-*", "set": {"at": "-4,7,0.3"}},
    {"at": "0.5 s", "entity": "world", "set": {"breeze.x": "60 cm/s"}},
)


def kinematic() -> dict[str, Any]:
    """Return robots with little room that move by kinematics, three of each kind and one spare."""
    sensors = {"velocity": {"kind": "velocity", "rate": "20 Hz"}, "pose": {"kind": "pose", "rate": "50 Hz"}}
    jobs = {"jobs": {"kind": "job", "actuator": "go", "rate": "20 Hz"}}
    robots: dict[str, Any] = {
        "drive": {"model": "differential_drive", "at": {"x": "5 m", "y": "6 m"}, "slip": "3 %", "spare": 1},
        "base": {"model": "holonomic", "at": {"x": "5 m", "y": "7 m"}},
        "craft": {"model": "rotorcraft", "at": {"x": "5 m", "y": "5 m"}},
        "goer": {"model": "holonomic", "at": {"x": "5 m", "y": "4 m"}, "sensors": jobs},
    }
    robots["goer"]["actuators"] = {"go": {"kind": "go_to", "feelers": "60 cm", "patience": "0.3 s"}}
    found = {name: {"count": 3, "spacing": {"x": "1 m"}, "sensors": sensors, **its} for name, its in robots.items()}
    for n in range(1, 4):
        path = [{"x": f"{4 + n} m", "y": "8 m"}, {"x": f"{4 + n} m", "y": "3 m"}]
        found[f"mover-{n}"] = {"model": "mover", "shape": "sphere", "radius": "15 cm", "path": path, "speed": "1 m/s"}
    return found


FINGER: Final = """<mujoco model="finger"><worldbody><body name="base">
<geom type="box" size="0.05 0.05 0.05" mass="1"/>
<body name="tip"><joint name="swing" axis="0 1 0" damping="0.01"/>
<geom type="capsule" fromto="0.1 0 0 0.3 0 0" size="0.02" mass="0.2"/></body></body></worldbody></mujoco>
"""
"""A pendulum that begins level."""


def robots_of_yard() -> dict[str, Any]:
    """Return robots of all kinds, in places of their own."""
    seen = {"kind": "rgbd", "rate": "20 Hz", "at": {"z": "1 m", "pitch": "20 deg"}, "fov": "90 deg", "shadows": True}
    scan = {"kind": "laser_scanner", "rate": "10 Hz", "rays": 31, "range": "8 m"}
    arm = {"model": "urdf", "file": "arm.urdf", "fixed": True}
    return {
        **kinematic(),
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
            "sensors": {"scan": {**scan, "at": {"x": "20 cm", "z": "15 cm"}}, "seen": seen, **OF_SCOUT},
        },
        "finger": {"model": "mjcf", "file": "finger.xml", "fixed": True, "at": {"x": "6 m", "y": "-9 m", "z": "1 m"}},
        "crane-1": crane(-0.35, y=-6.0, reach="5 cm"),
        "crane-2": crane(0.35, y=-6.0, yaw_deg=180.0, reach="5 cm"),
        "way": head("joint_trajectory", {"y": "-9 m"}, patience="0.1 s", tolerance=1e-4),
        "eye": head("look_at", {"x": "2 m", "y": "-9 m"}, patience="0.5 s"),
        "head": head("pan_tilt", {"x": "4 m", "y": "-9 m"}),
    }


def players_of_yard() -> dict[str, Any]:
    """Return a driver of each kind of actuator, and the script of the cranes."""
    script = {
        "class": f"{Script.__module__}:Script",
        "rate": "100 Hz",
        "lockstep": True,
        "robots": {"crane-1": ["grip"], "crane-2": ["grip"]},
        "parameters": {"steps": [list(step) for step in GRIPS]},
    }
    drives = [f"drive-{n}" for n in range(1, 5)]
    return {
        "efforts": driver(["limp"], "joint_torque", (20.0, 20.0, 10.0, 10.0, 4.0, 4.0, 2.0), "10 Hz")["driver"],
        "flight": driver(["quad"], "rotor_speeds", (900.0,) * 4, "50 Hz")["driver"],
        "push": driver(["pushed"], "force", (20.0, 20.0, 20.0, 0.1, 0.1, 0.1), "50 Hz")["driver"],
        "drive": driver(["scout", *drives], "v_w", (0.8, 2.0), "10 Hz")["driver"],
        "bases": driver([f"base-{n}" for n in range(1, 4)], "x_y_w", (0.7, 0.7, 3.0), "10 Hz")["driver"],
        "crafts": driver([f"craft-{n}" for n in range(1, 4)], "waypoint", (6.0, 6.0, 0.0, 3.0), "5 Hz")["driver"],
        "goers": driver([f"goer-{n}" for n in range(1, 4)], "go_to", (8.0, 8.0), "5 Hz")["driver"],
        "ways": driver(["way"], "joint_trajectory", (0.5, 0.5), "5 Hz")["driver"],
        "eyes": driver(["eye"], "look_at", (3.0, 3.0, 1.0), "5 Hz")["driver"],
        "heads": driver(["head"], "pan_tilt", (1.0, 1.0), "5 Hz")["driver"],
        "script": script,
        **driver(["arm"], "joint_position", (2.5, 1.8, 2.5, 2.0, 2.5, 1.5, 2.5), "5 Hz"),
    }


@cache
def yard() -> str:
    """Return a deployment with rigid bodies of all kinds and what moves by kinematics; `files()` has its files."""
    objects: dict[str, Any] = {
        name: {**shape, "mass": "1 kg", "at": {"x": "-2 m", "y": "2 m", "z": f"{20 + number * 35} cm"}}
        for number, (name, shape) in enumerate(SHAPES.items())
    }
    place = {"x": "5 cm", "y": "-12 cm", "z": "1.6 m"}
    light = {"model": "box", "size": ["20 cm"] * 3, "mass": "500 g", "speed_limit": "8 m/s"}
    objects["crate"] = {**light, "at": place, "count": 5, "spare": 1, "spacing": {"y": "6 cm", "z": "30 cm"}}
    objects |= {"load": crate(0.0, y=-6.0), "fallen": crate(5.1, y=7.1, z=0.8)}
    boxes = {
        f"b{n}": {"at": {"x": f"{n + 4.5} m", "y": "6.5 m"}, "length": "10 cm", "width": "30 cm", "height": "50 cm"}
        for n in range(4)
    }
    zone = {"kind": "zone", "at": {"x": "6 m", "y": "6 m"}, "shape": "circle", "radius": "1 m", "tag": "vehicle"}
    near = {"kind": "catch", "prey": "vehicle", "hunter": "vehicle", "distance": "98 cm"}
    return written(
        {
            "format": 2,
            "world": "yard",
            "seed": 1,
            "tick": "10 ms",
            "substeps": 4,
            "rules": {"breeze": {"kind": "wind", "x": "30 cm/s", "z": "10 cm/s"}, "middle": zone, "near": near},
            "engine": "mujoco",
            "pace": "fast",
            "assets": "models",
            "scene": {"kind": "boxes", "boxes": boxes},
            "surfaces": {"floor": {"friction": 0.9, "restitution": 0.2}},
            "objects": objects,
            "robots": robots_of_yard(),
            "players": players_of_yard(),
            "nodes": {"n": {"robots": ["*"]}},
            "network": {"links": [{"id": "all", "from": "*", "to": "*", "delay": "3 ms", "order": "fifo"}]},
            "events": list(EVENTS),
        }
    )


@cache
def assets() -> Path:
    """Return the folder in whose folder `models` the files of the yard's robots are."""
    made = folder()
    for file in ("arm.urdf", "crane.urdf"):
        (made / "models" / file).write_bytes((DEPLOY / "models" / file).read_bytes())
    (made / "models" / "finger.xml").write_text(FINGER)
    return made
