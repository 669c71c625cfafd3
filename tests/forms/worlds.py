"""For each of foosim's own forms a small world that uses it, and where in the deployment its settings stand."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from math import inf
from pathlib import Path
from typing import Any, Final, NamedTuple

import yaml
from msgspec import Struct

from foosim.client.player import Player, Samples, Turn
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.schema import Deployment
from foosim.deployment.text.yaml import write_yaml
from foosim.world.components.fitted import actuators_of
from foosim.world.forms import registry
from foosim.world.forms.forms import SAMPLES
from foosim.world.forms.payloads import PayloadCodec
from foosim.world.frame import Frame
from foosim.world.layout import build_layout

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
Place = tuple[str | int, ...]
RODS: Final = ("red.goal", "red.attack", "blue.goal", "blue.attack")
ROVERS: Final = ("rover-1", "rover-2", "rover-3")
SCENE: Final = ("field", "floor", "walls", "goal", "ramps")
MOTIONS: Final = ("position", "joint_positions", "wheel_travel")
CHARGER: Final = {"tag": "vehicle", "radius": "1 m", "power": "2 W"}
LINK: Final = {"id": "all", "from": "*", "to": "*", "delay": "2 ms", "loss": "10 %", "order": "fifo"}


class Driver(Player):
    """Gives each of its robots another command in each of its turns, drawn within a range and its actuator's limits."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        kind = registry.find_component("actuator", parameters["kind"])
        assert kind.value is not None
        self._value: type[Struct] = kind.value
        self._robots = parameters["robots"]
        fields = PayloadCodec(kind.value, kind.name).fields
        self._is_several = fields[-1].is_several
        bounds = parameters["bounds"]
        names = [fields[-1].name] * len(bounds) if self._is_several else [field.name for field in fields]
        layout = None if deployment.lacks_files else build_layout(deployment)  # players have no URDF files
        self._bounds: dict[str, list[float]] = {}
        for robot in self._robots:
            its = () if layout is None else actuators_of(deployment, layout, layout[robot])
            limits = next((found for one in its if (found := one.actuator.limits())), {})
            most = [max(map(abs, limits[name])) if name in limits else inf for name in names]
            self._bounds[robot] = list(map(min, bounds, most))
        self._has_jobs, self._in_time = kind.jobs, kind.name == "joint_trajectory"
        self._least = 0.0 if kind.name == "rotor_speeds" else -1.0

    def act(self, tick: int, samples: Samples) -> Turn:
        """Return commands for all, whatever was heard."""
        return Turn({robot: self._command(robot, tick) for robot in self._robots})

    def _command(self, robot: str, tick: int) -> Struct:
        words = draw_words(draw_key(3, "driver", robot), tick)
        more = draw_words(draw_key(4, "driver", robot), tick)
        shares = [self._least + (1.0 - self._least) * word / 2.0**64 for word in (*words, *more)]
        numbers = [bound * share for bound, share in zip(self._bounds[robot], shares, strict=False)]
        if self._in_time:
            return self._value((0.2, 0.5), (numbers, numbers[::-1]), 0.0 if tick % 3 == 2 else tick + 1.0)
        if self._has_jobs:
            numbers.append(0.0 if tick % 3 == 2 else tick + 1.0)
        return self._value(tuple(numbers)) if self._is_several else self._value(*numbers)


def driver(robots: Sequence[str], kind: str, bounds: Sequence[float], rate: str) -> dict[str, Any]:
    """Return the deployment's section of players with a driver of these robots."""
    parameters = {"robots": list(robots), "kind": kind, "bounds": list(bounds)}
    path = f"{Driver.__module__}:{Driver.__qualname__}"
    about = {"class": path, "rate": rate, "lockstep": True, "parameters": parameters}
    return {"driver": about | {"robots": {robot: [] for robot in robots}}}


@cache
def _table() -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load((DEPLOY / "table.yaml").read_text())
    data["robots"] = {rod: {**data["robots"][rod], "sensors": {}} for rod in RODS} | {"camera": {"model": "camera"}}
    data["players"] = driver(RODS, "rod_position", (0.1, 20.0), "50 Hz")
    data["table"]["rules"] |= {"kickoff_delay": "20 ms", "kickoff_speed": "4 m/s"}
    return data | {"engine": "pure", "substeps": 1, "nodes": {"n": {"robots": ["*"]}}, "network": {"links": [LINK]}}


@cache
def _hall() -> dict[str, Any]:
    data = yaml.safe_load((DEPLOY / "warehouse.yaml").read_text())
    shelf = {"shape": "box", "x": "2 m", "y": "1 m", "z": "1 m", "length": "1 m", "width": "1 m", "height": "2 m"}
    places = {"rover-1": ("0 m", "0 m"), "rover-2": ("1.5 m", "-1 m"), "rover-3": ("-1 m", "1 m")}
    robots: dict[str, Any] = {
        rover: {"model": "rover", "x": x, "y": y, "heading": "30 deg", "charge": "50 %", "sensors": {}}
        for rover, (x, y) in places.items()
    }
    robots["station"] = {"model": "station", "x": "1 m", "y": "2 m", "sensors": {}}
    return {
        **{
            key: value
            for key, value in data.items()
            if key not in ("templates", "scenery", "network", "players", "clients")
        },
        "hall": data["hall"] | {"length": "8 m", "width": "6 m"},
        "robots": robots,
        "scenery": {"shelf": shelf},
        "players": driver(ROVERS, "wheel_speeds", (1.2, 1.2), "10 Hz"),
        "nodes": {"n": {"robots": ["*"]}},
        "network": {"links": [LINK]},
    }


@cache
def _yard() -> dict[str, Any]:
    """Robots that move by kinematics, among boxes."""
    drives = ("one", "two")
    box = {"length": "1 m", "width": "50 cm", "height": "1 m", "at": {"x": "1 m", "y": "1 m", "yaw": "30 deg"}}
    path = [{"x": "-2 m", "y": "-2 m"}, {"x": "2 m", "y": "-2 m", "yaw": "90 deg"}]
    door = {"shape": "box", "length": "40 cm", "width": "20 cm", "height": "1 m", "path": path, "speed": "1 m/s"}
    robots: dict[str, Any] = {
        "one": {"model": "differential_drive", "at": {"x": "-1 m"}},
        "two": {"model": "differential_drive", "at": {"yaw": "90 deg"}, "slip": "5 %"},
        "base": {"model": "holonomic", "at": {"y": "-1 m"}},
        "craft": {"model": "rotorcraft", "at": {"y": "2 m"}},
        "door": {"model": "mover", "loop": True, **door},
    }
    players = {
        **driver(drives, "v_w", (0.8, 2.0), "10 Hz"),
        "pilot": driver(("base",), "x_y_w", (0.7, 0.7, 2.0), "10 Hz")["driver"],
        "flight": driver(("craft",), "waypoint", (3.0, 3.0, 0.0, 3.0), "5 Hz")["driver"],
    }
    return {
        "format": 2,
        "world": "yard",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 1,
        "engine": "pure",
        "pace": "fast",
        "scene": {"kind": "boxes", "boxes": {"box": box}},
        "rules": {"corner": {"kind": "zone", "length": "2 m", "width": "2 m", "tag": "vehicle"}},
        "objects": {
            "fire": {"model": "fire", "at": {"x": "-1 m", "y": "-2 m"}, "radius": "10 cm", "growth": "1 m/s"},
            "gate": {"model": "door", "closed": {"x": "3 m", "yaw": "90 deg"}, "travel": "-2 m"},
        },
        "events": [{"at": "0.1 s", "entity": "gate", "set": {"open": "70 %"}}],
        "robots": {name: {**robot, "sensors": {}} for name, robot in robots.items()},
        "players": players,
        "nodes": {"n": {"robots": ["*"]}},
        "network": {"links": [LINK]},
    }


@cache
def _solids() -> dict[str, Any]:
    """Rigid bodies of every shape that fall on a floor, and quadrotors among them."""
    corners = [[x, y, z] for x in ("-10 cm", "10 cm") for y in ("-10 cm", "10 cm") for z in ("0 cm", "20 cm")]
    shapes: dict[str, Any] = {
        "box": {"model": "box", "size": ["30 cm", "20 cm", "10 cm"]},
        "capsule": {"model": "capsule", "radius": "10 cm", "length": "20 cm"},
        "cylinder": {"model": "cylinder", "radius": "10 cm", "length": "20 cm"},
        "hull": {"model": "hull", "corners": corners},
        "sphere": {"model": "sphere", "radius": "10 cm"},
    }
    objects = {
        name: {**shape, "mass": "1 kg", "at": {"x": f"{number % 3 * 25} cm", "z": f"{20 + number * 25} cm"}}
        for number, (name, shape) in enumerate(shapes.items())
    }
    flyers = ("quad-1", "quad-2")
    robots = {
        name: {"model": "quadrotor", "at": {"x": f"{number} m", "y": "60 cm", "z": "50 cm"}, "sensors": {}}
        for number, name in enumerate(flyers)
    }
    return {
        "format": 2,
        "world": "solids",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 2,
        "engine": "mujoco",
        "pace": "fast",
        "scene": {"kind": "empty"},
        "rules": {"wind": {"kind": "wind", "x": "5 m/s", "z": "-1 m/s"}},
        "objects": objects,
        "robots": robots,
        "players": driver(flyers, "rotor_speeds", (900.0,) * 4, "50 Hz"),
        "nodes": {"n": {"robots": ["*"]}},
        "network": {"links": [LINK]},
    }


@cache
def _drives() -> dict[str, Any]:
    """Rigid robots on two wheels that push boxes, and one another."""
    data: dict[str, Any] = json.loads(json.dumps(_solids()))
    box = {"model": "box", "size": ["30 cm", "30 cm", "20 cm"], "mass": "3 kg", "surface": "frictionless"}
    scan = {"kind": "laser_scanner", "rate": "10 Hz", "rays": 31, "range": "5 m", "at": {"x": "20 cm", "z": "15 cm"}}
    rigid = {"model": "differential_drive", "dynamics": "rigid"}
    robots: dict[str, Any] = {
        "one": {**rigid, "at": {"x": "-50 cm"}, "bumper": "40 cm", "sensors": {"scan": scan}},
        "three": {**rigid, "at": {"x": "50 cm", "y": "60 cm", "yaw": "-90 deg"}},
        "two": {**rigid, "at": {"x": "50 cm", "yaw": "180 deg"}, "mass": "10 kg", "torque": "2 N m"},
    }
    robots["two"]["sensors"] = {
        name: {"kind": name, "rate": "50 Hz"}
        for name in ("contact", "imu", "joint_state", "odometry", "pose", "velocity")
    }
    return data | {
        "surfaces": {"floor": {"friction": 0.7}},
        "objects": {
            "box": {**box, "at": {"y": "5 cm", "z": "10 cm"}},
            "stack": {**box, "at": {"y": "5 cm", "z": "30 cm"}},
        },
        "robots": {name: {"sensors": {}, **robot} for name, robot in robots.items()},
        "players": driver(tuple(robots), "v_w", (1.0, 2.0), "5 Hz"),
    }


def _pushed() -> World:
    """The same, with forces on the quadrotors."""
    data = json.loads(json.dumps(_solids()))
    for robot in data["robots"].values():
        robot["actuators"] = {"push": {"kind": "force", "force": "20 N", "torque": "0.1 N m"}}
    flyers = list(data["robots"])
    return World(data | {"players": driver(flyers, "force", (20.0, 20.0, 20.0, 0.1, 0.1, 0.1), "50 Hz")})


def _gripping() -> World:
    """Robots on two wheels that take boxes and let them go."""
    data = json.loads(json.dumps(_drives()))
    gripper = {"kind": "gripper", "at": {"x": "20 cm", "z": "10 cm"}, "reach": "40 cm"}
    for robot in data["robots"].values():
        robot["actuators"] = {"drive": {"kind": "v_w"}, "gripper": gripper}
    robots = tuple(data["robots"])
    data["players"]["hands"] = driver(robots, "gripper", (1.0,), "10 Hz")["driver"]
    return World(data, ("robots", "one", "actuators", "gripper"))


def _jointed(kind: str, bounds: Sequence[float]) -> World:
    """The table with general actuators of joints on its rods."""
    data = json.loads(json.dumps(_table()))
    for rod in RODS:
        data["robots"][rod]["actuators"] = {"joints": {"kind": kind}}
    return World(data | {"players": driver(RODS, kind, bounds, "50 Hz")})


def _driven(kind: str, bounds: Sequence[float]) -> World:
    """The table with other drives of its rods."""
    data = json.loads(json.dumps(_table()))
    for rod in RODS:
        data["robots"][rod]["actuators"] = {"motors": {"kind": kind}}
    place: Place = ("robots", RODS[0], "actuators", "motors")
    return World(data | {"players": driver(RODS, kind, bounds, "50 Hz")}, place)


def _going() -> dict[str, Any]:
    """The yard with robots that are sent to places, and tell how that goes."""
    data: dict[str, Any] = json.loads(json.dumps(_yard()))
    for name in ("one", "two", "base"):
        data["robots"][name]["actuators"] = {"go": {"kind": "go_to", "feelers": "60 cm", "patience": "0.3 s"}}
        data["robots"][name]["sensors"] = {"own": {"kind": "job", "actuator": "go", "rate": "20 Hz"}}
    flight = {"flight": data["players"]["flight"]}
    return data | {"players": driver(("one", "two", "base"), "go_to", (2.0, 2.0), "5 Hz") | flight}


def changed_slots(first: Frame, last: Frame) -> set[str]:
    """Return the slots that differ between two frames, each after its entity."""
    return {
        f"{entity.name} {slot}"
        for entity in first.layout.entities
        for slot, at in entity.offsets.items()
        if first.numbers[at : at + entity.counts[slot]] != last.numbers[at : at + entity.counts[slot]]
    }


def still(deployment: Deployment, frames: Sequence[Frame]) -> set[str]:
    """Return the robots and objects that do not move from a first frame to a last, and sensors that do not measure."""
    changed = changed_slots(frames[0], frames[-1])
    moving = {
        entity.name: {f"{entity.name} {slot}" for slot in MOTIONS if slot in entity.offsets}
        for entity in frames[0].layout.present(frames[0].numbers)
    }
    measuring = {
        f"{robot} {channel}": {f"{robot} {channel}.{SAMPLES}"}
        for robot, about in deployment.robots.items()
        for channel in about.sensors
    }
    return {name for name, slots in {**moving, **measuring}.items() if slots and not slots & changed}


class World(NamedTuple):
    """The plain data of a deployment, and the place of the form's settings in it; no place: it has none."""

    data: dict[str, Any]
    place: Place = ()

    def text(self, *changes: tuple[Place, Any]) -> str:
        """Return the deployment's text, with settings changed below the place of the form's."""
        return write_yaml(_with(self.data, [((*self.place, *path), value) for path, value in changes]))

    def with_(self, path: Place, value: Any, place: Place | None = None) -> World:
        """Return the world with a value at a path from its root, which is where the form's settings are."""
        return World(_with(self.data, [(path, value)]), path if place is None else place)


def _with(data: dict[str, Any], changes: Sequence[tuple[Place, Any]]) -> dict[str, Any]:
    """Return a copy of plain data with other values at some paths."""
    copy: dict[str, Any] = json.loads(json.dumps(data))
    for (*way, last), value in changes:
        section: Any = copy
        for key in way:
            section = section.setdefault(key, {}) if isinstance(section, dict) else section[key]
        section[last] = json.loads(json.dumps(value))
    return copy


TABLE: Final = World(_table())
HALL: Final = World(_hall())
EARTH: Final = World(HALL.data | {"origin": {"latitude": "52.5 deg", "longitude": "13.4 deg"}})
YARD: Final = World(_yard())
SOLIDS: Final = World(_solids())
DRIVES: Final = World(_drives())
GRIPS: Final = _gripping()
JOBS: Final = World(_going(), ("robots", "one", "actuators", "go"))


def sensor(world: World, robots: Sequence[str], kind: str, **settings: Any) -> World:
    """Return a world in which each of these robots has a sensor."""
    for robot in reversed(robots):
        world = world.with_(("robots", robot, "sensors", "own"), {"kind": kind, "rate": "50 Hz", **settings})
    return world


def modifier(kind: str, of_readings: Mapping[str, Any], of_commands: Mapping[str, Any] | None = None) -> World:
    """Return a world in which a modifier is on readings, which have the settings' place, and on commands."""
    world = sensor(HALL, ROVERS, "pose", modifiers=[{"kind": kind, **of_readings}])
    if of_commands is not None:
        drive = {"kind": "wheel_speeds", "modifiers": [{"kind": kind, **of_commands}]}
        for rover in ROVERS:
            world = world.with_(("robots", rover, "actuators"), {"drive": drive})
    return World(world.data, ("robots", ROVERS[0], "sensors", "own", "modifiers", 0))


def scene(world: World, kind: str, settings: Mapping[str, Any]) -> World:
    """Return a world with a scene."""
    return world.with_(("scene",), {"kind": kind, **settings})


WORLDS: Final[Mapping[tuple[str, str], World]] = {
    ("model", "ball"): TABLE,
    ("model", "camera"): World(TABLE.data, ("robots", "camera")),
    ("model", "rod"): World(TABLE.data, ("robots", "red.goal")),
    ("model", "rover"): World(HALL.data, ("robots", "rover-1")),
    ("model", "station"): World(HALL.data, ("robots", "station")),
    ("model", "differential_drive"): World(YARD.data, ("robots", "two")),
    ("model", "holonomic"): World(YARD.data, ("robots", "base")),
    ("model", "mover"): World(YARD.data, ("robots", "door")),
    ("model", "rotorcraft"): World(YARD.data, ("robots", "craft")),
    ("model", "door"): World(YARD.data, ("objects", "gate")),
    ("model", "fire"): World(YARD.data, ("objects", "fire")),
    ("sensor", "ball"): sensor(TABLE, ["camera"], "ball"),
    ("sensor", "ball_state"): sensor(TABLE, ["camera"], "ball_state"),
    ("sensor", "battery"): sensor(HALL, ROVERS, "battery"),
    ("sensor", "contact"): sensor(TABLE, RODS, "contact"),
    ("sensor", "encoder"): sensor(TABLE, RODS, "encoder"),
    ("sensor", "figure_contact"): sensor(TABLE, RODS, "figure_contact"),
    ("sensor", "motor_current"): sensor(TABLE, RODS, "motor_current", slide="9 N/A", spin="0.2 N m/A"),
    ("sensor", "gps"): sensor(EARTH, ROVERS, "gps", at={"x": "10 cm", "z": "50 cm"}),
    ("sensor", "imu"): sensor(TABLE, RODS, "imu", at={"link": "spin", "x": "5 cm", "y": "20 cm"}),
    ("sensor", "gripper_state"): sensor(GRIPS, ("one", "two"), "gripper_state"),
    ("sensor", "joint_state"): sensor(
        TABLE, RODS, "joint_state", modifiers=[{"kind": "gaussian_noise", "std": {"motion": 0.001, "efforts": 0.5}}]
    ),
    ("sensor", "odometry"): sensor(HALL, ROVERS, "odometry"),
    ("sensor", "pose"): sensor(HALL, ROVERS, "pose"),
    ("sensor", "pose_3d"): sensor(HALL, ROVERS, "pose_3d", at={"x": "10 cm", "yaw": "30 deg"}),
    ("sensor", "laser_scanner"): sensor(
        HALL, ROVERS, "laser_scanner", rays=31, range="5 m", at={"x": "10 cm", "z": "20 cm"}
    ),
    ("sensor", "proximity"): sensor(HALL, ROVERS, "proximity", rays=12, range="3 m"),
    ("sensor", "range"): sensor(HALL, ROVERS, "range", range="3 m", cone="30 deg", at={"z": "20 cm"}),
    ("sensor", "thermometer"): sensor(YARD, ["one", "base", "craft"], "thermometer", at={"z": "20 cm"}),
    ("sensor", "velocity"): sensor(YARD, ["one", "base", "craft"], "velocity", at={"x": "20 cm"}),
    ("actuator", "force"): _pushed(),
    ("actuator", "gripper"): GRIPS,
    ("actuator", "joint_position"): _jointed("joint_position", (0.1, 2.0)),
    ("actuator", "joint_trajectory"): _jointed("joint_trajectory", (0.1, 0.1)),
    ("actuator", "joint_velocity"): _jointed("joint_velocity", (0.5, 20.0)),
    ("actuator", "rod_force"): _driven("rod_force", (40.0, 0.5)),
    ("actuator", "rod_position"): TABLE,
    ("actuator", "rod_velocity"): _driven("rod_velocity", (1.0, 100.0)),
    ("actuator", "rod_voltage"): _driven("rod_voltage", (20.0, 40.0)),
    ("actuator", "rotor_speeds"): SOLIDS,
    ("model", "box"): SOLIDS,
    ("model", "capsule"): SOLIDS,
    ("model", "cylinder"): SOLIDS,
    ("model", "hull"): SOLIDS,
    ("model", "quadrotor"): SOLIDS,
    ("model", "sphere"): SOLIDS,
    ("actuator", "go_to"): JOBS,
    ("sensor", "job"): World(JOBS.data, ("robots", "one", "sensors", "own")),
    ("actuator", "v_w"): YARD,
    ("actuator", "waypoint"): YARD,
    ("actuator", "x_y_w"): YARD,
    ("actuator", "wheel_speeds"): HALL,
    ("modifier", "bias_walk"): modifier("bias_walk", {"walk": {"position": "1 mm"}}, {"initial": "10 mm/s"}),
    ("modifier", "clip"): modifier("clip", {"high": {"position": "1 m"}}, {"low": "-1 m/s", "high": "500 mm/s"}),
    ("modifier", "delay"): modifier("delay", {"time": "60 ms"}, {"time": "130 ms"}),
    ("modifier", "drop_out"): modifier("drop_out", {"probability": "30 %"}, {"probability": "30 %"}),
    ("modifier", "frame_change"): modifier("frame_change", {"x": "1 m", "yaw": "30 deg"}),
    ("modifier", "gaussian_noise"): modifier("gaussian_noise", {"std": {"heading": "1 deg"}}, {"std": "10 mm/s"}),
    ("modifier", "quantise"): modifier("quantise", {"step": {"heading": "1 deg"}}, {"step": "50 mm/s"}),
    ("rule", "football"): TABLE,
    ("rule", "wind"): World(SOLIDS.data, ("rules", "wind")),
    ("rule", "zone"): World(YARD.data, ("rules", "corner")),
    ("entity_rule", "burns"): YARD.with_(
        ("robots", "base", "rules"), {"own": {"kind": "burns", "after": "50 ms"}}, ("robots", "base", "rules", "own")
    ),
    ("entity_rule", "battery"): YARD.with_(
        ("robots", "base", "rules"),
        {"own": {"kind": "battery", "capacity": "5 J", "idle": "1 W", "drag": "5 N", "chargers": [CHARGER]}},
        ("robots", "base", "rules", "own"),
    ),
    ("scene", "boxes"): World(YARD.data, ("scene",)),
    ("scene", "empty"): World(
        YARD.with_(("scene",), {"kind": "empty", "length": "9 m", "width": "9 m"}).data, ("scene",)
    ),
    ("scene", "football_table"): scene(HALL, "football_table", {key: TABLE.data["table"][key] for key in SCENE}),
    ("scene", "hall"): scene(TABLE, "hall", {key: HALL.data["hall"][key] for key in ("length", "width", "walls")}),
    ("kit", "hall"): World(HALL.data, ("hall",)),
    ("kit", "table"): World(TABLE.data, ("table",)),
}

VARIANTS: Final[Mapping[tuple[str, str, str], World]] = {
    ("model", "differential_drive", "rigid"): World(DRIVES.data, ("robots", "one")),
}
"""Worlds of forms with their setting `dynamics`."""
