"""Each row of the table against the truth of the frame, each command against what it does; MORSE's frames and texts."""

from __future__ import annotations

import json
from base64 import b64decode
from collections.abc import Callable, Iterator
from functools import cache
from math import atan2, cos, hypot, pi, sin, tan
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
import yaml

from foosim.common.errors import BadValue, Refused
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.gateways.components import RADIO
from foosim.gateways.frames import alterations, euler
from foosim.gateways.rows import Component, Effect, Order, Row, call, command, reading
from foosim.gateways.table import ROWS, row_of
from foosim.library.generic.collision import Touched
from foosim.library.mobile.battery import Battery
from foosim.simulation.simulation import Simulation, read_for_stepping
from foosim.world.earth import EarthOrigin, Geodesy
from foosim.world.scene import from_rpy, rotate
from tests.components.worlds import DEPLOY
from tests.gateways.serving import Served
from tests.gateways.test_socket import Program
from tests.grip_yards import crane, crate, solids_text
from tests.heads import folder, head
from tests.kinematic_yard import yard_text

ORIGIN: Final = {"latitude": "43 deg", "longitude": "1 deg", "altitude": "100 m"}
TICK_S: Final = 0.01
RADIUS: Final = 0.25
RANGE: Final = 4.0
EYE: Final = {"x": "30 cm", "z": "20 cm"}
VIEW: Final[dict[str, Any]] = {"at": EYE, "width": 64, "height": 48, "far": "4 m"}
ABOUT: Final[dict[str, dict[str, Any]]] = {
    "nearby": {"range": "9 m", "tag": "prey"},
    "collision": {"reach": "9 m", "at": {**EYE, "yaw": "15 deg"}, "tag": "prey"},  # with a ray to the other robot
    "laser_scanner": {"rays": 181, "range": "4 m", "angle": "180 deg", "at": EYE},
    "laser_scanner_3d": {"rows": 5, "columns": 61, "range": "4 m", "angle": "90 deg", "at": EYE},
    "camera": {**VIEW, "focal_length": "35 mm"},
    "depth_camera": VIEW,
    "rgbd": VIEW,
    "semantic_camera": {**VIEW, "tag": "prey"},
}
"""The settings of sensors that need some."""
SENSORS: Final = sorted({row.kind for row in ROWS if row.out is not None} - {"joint_state"})
MOUSE: Final = {
    "model": "holonomic",
    "label": "The Mouse",
    "at": {"x": "2.2 m", "y": "1 m", "yaw": "40 deg"},
    "tags": ["prey"],
}


def text_of_yard(**more: Any) -> str:
    """Return a deployment of a robot with each sensor, in two halves, and of another one, beside a fire."""
    halves = (SENSORS[::2], SENSORS[1::2])
    cat = {
        "model": "differential_drive",
        "at": {"x": "20 cm", "yaw": "10 deg"},
        "rules": {"cell": {"kind": "battery", "capacity": "100 J", "idle": "10 W"}},
        "actuators": {"drive": {"kind": "v_w"}},
    }
    robots: dict[str, Any] = {
        f"cat-{half}": {
            **cat,
            "sensors": {
                kind.replace("_", "-"): {"kind": kind, "rate": "100 Hz", **ABOUT.get(kind, {})} for kind in kinds
            },
        }
        for half, kinds in enumerate(halves)
    }
    robots["cat-1"]["at"] = {"x": "20 cm", "y": "-80 cm", "yaw": "30 deg"}
    robots["omni"] = {"model": "holonomic", "at": {"x": "-5 m"}, "actuators": {"go": {"kind": "go_within"}}}
    robots["mouse"] = MOUSE
    fire = {"model": "fire", "at": {"x": "1 m", "y": "6 m"}, "radius": "50 cm", "radius_max": "50 cm"}
    return yard_text(robots, origin=ORIGIN, objects={"fire": fire}, **more)


@cache
def yard() -> tuple[Deployment, Simulation]:
    """The yard once the robots have driven along a curve."""
    deployment = load_deployment(text_of_yard(), "yard.yaml")
    simulation = Simulation(deployment)
    simulation.step({f"cat-{half}": {"linear": 0.6, "angular": 0.3} for half in (0, 1)}, ticks=100)
    return deployment, simulation


class Truth:
    """A robot in the frame of the yard, in the one before, and at the start; what it should see of the mouse."""

    def __init__(self, robot: str) -> None:
        deployment, simulation = yard()
        entity = simulation.frame.layout[robot]
        self.deployment, self.numbers, self.entity = deployment, simulation.frame.numbers, entity
        self.x, self.y, self.z = self.of("position")
        (self.yaw,) = self.of("heading")
        self.velocity, self.turning = self.of("linear_velocity"), self.of("angular_velocity")
        self.start: Any = deployment.robots[robot].at  # type: ignore[attr-defined]
        self.time_s = simulation.tick * TICK_S

    def of(self, field: str) -> tuple[float, ...]:
        at = self.entity.offsets[field]
        return tuple(self.numbers[at : at + self.entity.counts[field]])

    def own(self, way: tuple[float, ...], yaw: float | None = None) -> list[float]:
        """Return a way in the axes of the robot, or turned otherwise."""
        turned = self.yaw if yaw is None else yaw
        return [way[0] * cos(turned) + way[1] * sin(turned), way[1] * cos(turned) - way[0] * sin(turned), way[2]]

    def place(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        """Return a place in the frame of the eye in the world's."""
        x += 0.3
        return self.x + x * cos(self.yaw) - y * sin(self.yaw), self.y + x * sin(self.yaw) + y * cos(self.yaw), z + 0.2


def on_something(truth: Truth, point: list[float]) -> bool:
    """Whether a place in the frame of the eye is on the hull, the mark or the antenna of a robot, or on the floor."""
    x, y, z = truth.place(*point)
    away = min(hypot(x - its.x, y - its.y) for its in map(Truth, ("mouse", "cat-0", "cat-1")))
    return abs(z) < 2e-3 or (away < RADIUS + 2e-3 and -2e-3 < z < 0.36)


def pose_of(t: Truth) -> dict[str, Any]:
    return {"x": t.x, "y": t.y, "z": t.z, "yaw": t.yaw, "pitch": 0.0, "roll": 0.0}


def velocity_of(t: Truth) -> dict[str, Any]:
    own = t.own(t.velocity)
    return {
        "linear_velocity": own,
        "angular_velocity": [0.0, 0.0, 0.3],
        "world_linear_velocity": [*t.velocity],
        "rotation": {"yaw": t.yaw, "pitch": 0.0, "roll": 0.0},
        "diff_pressure": 0.5 * 1.225 * own[0] ** 2,
    }


def odometry_of(t: Truth) -> dict[str, Any]:
    x, y, z = t.own((t.x - t.start.x, t.y - t.start.y, t.z), t.start.yaw)
    vx, vy, vz = t.own(t.velocity, t.start.yaw)
    now = {"x": x, "y": y, "z": z, "yaw": t.yaw - t.start.yaw, "pitch": 0.0, "roll": 0.0}
    rates = {"vx": vx, "vy": vy, "vz": vz, "wz": 0.3, "wy": 0.0, "wx": 0.0}
    changes = {"dx": vx, "dy": vy, "dz": vz, "dyaw": 0.3, "dpitch": 0.0, "droll": 0.0, "dS": hypot(vx, vy)}
    return now | rates | {name: its * TICK_S for name, its in changes.items()}


def fix_of(t: Truth) -> dict[str, Any]:
    assert t.deployment.origin is not None
    latitude, longitude, altitude = Geodesy(t.deployment.origin).geodetic((t.x, t.y, t.z))
    place = {"longitude": longitude * 180 / pi, "latitude": latitude * 180 / pi, "altitude": altitude}
    course = (pi / 2 - atan2(t.velocity[1], t.velocity[0])) * 180 / pi % 360.0
    return place | {"velocity": [*t.velocity], "date": "010170", "time": "000001", "heading": course}


def felt(t: Truth) -> dict[str, Any]:
    pull = [0.0, 0.6 * 0.3, 0.0]  # towards the middle of the curve
    return {
        "angular_velocity": [0.0, 0.0, 0.3],
        "linear_acceleration": [pull[0], pull[1], 9.80665],
        "distance": 0.6 * TICK_S,
        "velocity": t.own(t.velocity),
        "acceleration": pull,
    }


def near(t: Truth) -> dict[str, Any]:
    distances = {"The Mouse": hypot(2.2 - t.x, 1.0 - t.y)}
    return {"near_objects": distances, "near_robots": distances}


def scanned(t: Truth, found: dict[str, Any]) -> None:
    hits = [point for point, distance in zip(found["point_list"], found["range_list"], strict=True) if distance < RANGE]
    assert len(hits) > 3 and all(on_something(t, point) for point in hits)
    bearing = atan2(1.0 - t.y, 2.2 - t.x) - t.yaw
    assert min(abs(atan2(y, x) - bearing) for x, y, z in hits if z > -0.1) < 0.05
    for point, distance in zip(found["point_list"], found["range_list"], strict=True):
        assert (point == [0.0] * 3) is (distance == RANGE)
        assert distance == RANGE or sum(its * its for its in point) ** 0.5 == pytest.approx(distance)
    bearings = [atan2(y, x) for x, y, _ in found["point_list"] if x or y]
    rows = 5 if len(found["range_list"]) != 181 else 1
    assert rows > 1 or bearings == sorted(bearings)
    if rows > 1:  # the highest first
        low, high = found["point_list"][-61:], found["point_list"][:61]
        assert max(z for _, _, z in low) <= 0.0 <= min(z for _, _, z in high)


def pictured(t: Truth, found: dict[str, Any]) -> None:
    (fx, _, cx), (_, fy, cy), _ = found["intrinsic_matrix"]
    assert (cx, cy, found["height"], found["width"]) == (32.0, 24.0, 48, 64) and fx == fy
    if "image" in found:
        pixels = np.frombuffer(b64decode(found["image"]), np.uint8).reshape(48, 64, 4)
        assert (pixels[..., 3] == 255).all() and len({*map(tuple, pixels.reshape(-1, 4).tolist())}) > 3
        x, y, z = t.own((2.2 - t.x, 1.0 - t.y, 0.15))
        column, row = round(cx - y / (x - 0.3) * fx - 0.5), round(cy - (z - 0.2) / (x - 0.3) * fy - 0.5)
        red, green, blue, _ = pixels[row, column].tolist()
        assert green > red and blue > red, "the hull of a holonomic base is teal"
        return
    points = np.frombuffer(b64decode(found["points"]), "<f4").reshape(-1, 3)
    assert (
        len(points) == found["nb_points"] > 500 and points[:, 2].max() <= 4.0 and fx == pytest.approx(32 / tan(pi / 6))
    )
    assert sum(on_something(t, [ahead, -right, -down]) for right, down, ahead in points.tolist()) > 0.97 * len(points)


def seen_by(t: Truth, found: dict[str, Any]) -> None:
    (one,) = found["visible_objects"]
    right, down, ahead = one["position"]
    assert (one["name"], one["type"]) == ("The Mouse", "prey")
    assert t.place(ahead, -right, -down) == pytest.approx((2.2, 1.0, 0.0))
    turned = (*(one["orientation"][axis] for axis in "xyz"), one["orientation"]["w"])
    in_camera = rotate(turned, (1.0, 0.0, 0.0))
    bearing = 40 * pi / 180 - t.yaw
    assert in_camera == pytest.approx((-sin(bearing), 0.0, cos(bearing)))


TRUTHS: Final[dict[str, Callable[[Truth], dict[str, Any]]]] = {
    **dict.fromkeys(("Pose", "GPS", "Gyroscope"), pose_of),
    **dict.fromkeys(("Velocity", "Attitude", "Airspeed"), velocity_of),
    **dict.fromkeys(("Odometry", "DifferentialOdometry", "RawOdometry"), odometry_of),
    **dict.fromkeys(("RawGPS", "ExtendedGPS"), fix_of),
    **dict.fromkeys(("IMU", "Accelerometer"), felt),
    "Battery": lambda t: {"charge": 100.0 - 10.0 * t.time_s, "status": "Discharging"},
    "Thermometer": lambda t: {"temperature": 25.0 + 200.0 * 0.25 / ((t.x - 1.0) ** 2 + (t.y - 6.0) ** 2)},
    "Proximity": near,
    "Collision": lambda t: {"collision": True, "objects": "The Mouse"},
    "Clock": lambda t: {},
}
SEEING: Final[dict[str, Callable[[Truth, dict[str, Any]], None]]] = {
    "LaserScanner": scanned,
    "VideoCamera": pictured,
    "DepthCamera": pictured,
    "SemanticCamera": seen_by,
}


def made(row: Row, deployment: Deployment, robot: str, channel: str) -> Component:
    its = deployment.robots[robot]
    settings: Any = its.sensors.get(channel) or its.actuators[channel]
    return Component(f"{robot}.{channel}", robot, channel, settings, deployment, row_of(settings, row.morse))


@pytest.mark.parametrize("row", [row for row in ROWS if row.kind in SENSORS], ids=lambda row: f"{row.kind}-{row.morse}")
def test_a_reading_is_the_truth_of_the_frame(row: Row) -> None:
    deployment, simulation = yard()
    robot, channel = next(pair for pair in simulation.readings if pair[1] == row.kind.replace("_", "-"))
    component, truth = made(row, deployment, robot, channel), Truth(robot)
    found = reading(component, simulation.readings[robot, channel].value, round(truth.time_s * 1e9))
    assert found is not None and tuple(found) == component.row.fields == row.fields
    if row.morse in SEEING:
        SEEING[row.morse](truth, found)
        return
    for name, its in TRUTHS[row.morse](truth).items():
        if name in found:
            assert found[name] == pytest.approx(
                its, abs=3e-3 if row.kind in ("travel", "imu", "accelerometer") else 1e-9
            ), name
    assert found.keys() <= TRUTHS[row.morse](truth).keys()
    component.fields = found
    assert call(component, "get_local_data", []) == {"timestamp": truth.time_s, **found}


def test_a_reading_without_a_touch_is_not_sent_on_and_a_battery_that_fills_charges() -> None:
    deployment, _ = yard()
    touch = made(next(row for row in ROWS if row.kind == "collision"), deployment, "cat-0", "collision")
    assert reading(touch, Touched(()), 0) is None
    battery = made(next(row for row in ROWS if row.kind == "battery"), deployment, "cat-1", "battery")
    for charge, status in ((0.5, "Discharging"), (0.6, "Charging"), (0.6, "Discharging"), (1.0, "Charged")):
        battery.fields = reading(battery, Battery(charge, 12.0), 0)
        assert battery.fields == {"charge": charge * 100.0, "status": status}


# --- commands --------------------------------------------------------------------------------------------------------

PUSHED: Final = {"kind": "force", "force": "100 N", "torque": "1 N m"}
TRACK: Final = {"joint-state": {"kind": "joint_state", "rate": "100 Hz", "joints": ["pan", "tilt"]}}
MOVERS: Final[dict[str, dict[str, Any]]] = {
    "v_w": {"model": "differential_drive"},
    "x_y_w": {"model": "holonomic"},
    "go_within": {"model": "differential_drive"},
    "go_to": {"model": "holonomic"},
    "fly_within": {"model": "rotorcraft"},
    "waypoint": {"model": "rotorcraft"},
    "teleport": {"model": "holonomic"},
}


def world_of(kind: str, settings: dict[str, Any]) -> Deployment:
    """A world with one robot `it` whose actuator `go` is of a kind."""
    if kind in MOVERS:
        robot = {**MOVERS[kind], "at": {"yaw": "90 deg"}, "actuators": {"go": {"kind": kind}}}
        rules = {"jumps": {"kind": "teleported"}} if kind == "teleport" else {}
        return load_deployment(yard_text({"it": robot}, rules=rules), "it.yaml")
    objects: dict[str, Any] = {}
    if kind == "force":
        robot = {"model": "quadrotor", "at": {"z": "5 m", "yaw": "90 deg"}, "actuators": {"go": {**PUSHED, **settings}}}
    elif kind == "gripper":
        robot, objects = crane(-0.35, y=-6.0, reach="5 cm"), {"load": crate(0.0, y=-6.0)}
    else:
        joints = {} if kind == "pan_tilt" else {"joints": ["pan", "tilt"]}
        robot = {**head(kind, {}, **joints), "sensors": TRACK}
    place = folder() / f"{kind}.yaml"
    place.write_text(solids_text(robots={"it": robot}, objects=objects))
    (folder() / "models" / "crane.urdf").write_bytes((DEPLOY / "models" / "crane.urdf").read_bytes())
    return read_for_stepping(place)


class Commanded:
    """A robot whose actuator is commanded by a row."""

    def __init__(self, row: Row) -> None:
        self.deployment = world_of(row.kind, dict(row.only))
        self.simulation = Simulation(self.deployment)
        self.channel = "gripper" if row.kind == "gripper" else "go"
        self.component = made(row, self.deployment, "it", self.channel)
        self.entity = self.simulation.frame.layout["it"]
        if "joint-state" in self.deployment.robots["it"].sensors:
            state = next(row for row in ROWS if row.kind == "joint_state")
            self.joints = made(state, self.deployment, "it", "joint-state")
            self.component.beside = {"it.joint-state": self.joints}
            self.step(2)

    def of(self, field: str) -> list[float]:
        at, numbers = self.entity.offsets[field], self.simulation.frame.numbers
        return [*numbers[at : at + self.entity.counts[field]]]

    def do(self, service: str, *parameters: Any, ticks: int = 1000) -> Order:
        """Call a service, and let some time pass."""
        order = call(self.component, service, [*parameters])
        assert isinstance(order, Order), order
        self.send(order.fields, order.numbers, ticks)
        return order

    def send(self, fields: dict[str, Any], numbers: dict[str, Any] | None = None, ticks: int = 1000) -> None:
        self.component.fields, numbers = command(self.component, fields, numbers)
        self.step(ticks, {"it": {self.channel: numbers}})

    def step(self, ticks: int, commands: dict[str, Any] | None = None) -> None:
        self.simulation.step(commands, ticks=ticks)
        if ("it", "joint-state") in self.simulation.readings:
            value = self.simulation.readings["it", "joint-state"].value
            self.joints.fields = reading(self.joints, value, 0)


def drives(its: Commanded) -> None:
    its.do("set_speed", 0.5, 0.4, ticks=200)
    assert (hypot(*its.of("linear_velocity")[:2]), its.of("angular_velocity")[2]) == pytest.approx((0.5, 0.4), abs=1e-3)
    its.send({"w": 0.0}, ticks=100)  # the speed stays
    assert (hypot(*its.of("linear_velocity")[:2]), its.of("angular_velocity")[2]) == pytest.approx((0.5, 0.0), abs=1e-3)
    its.do("stop", ticks=200)
    assert hypot(*its.of("linear_velocity")[:2]) == 0.0


def slides(its: Commanded) -> None:
    its.send({"x": 0.3, "y": 0.2, "w": 0.0}, ticks=200)
    assert its.of("linear_velocity")[:2] == pytest.approx((-0.2, 0.3), abs=1e-3)  # it looks along y


def goes(its: Commanded) -> None:
    its.send({"x": 1.0, "y": 2.0})
    away = hypot(its.of("position")[0] - 1.0, its.of("position")[1] - 2.0)
    assert away <= (0.5 if "tolerance" in its.component.row.fields else 0.11)
    if "goto" not in its.component.row.services:
        return
    wide = "tolerance" in its.component.row.fields
    order = its.do("goto", -1.0, 0.0, 0.0, *((0.2, 0.4) if wide else ()))
    assert (order.answer, order.effect) == ("Arrived", Effect.JOB)
    assert hypot(its.of("position")[0] + 1.0, its.of("position")[1]) <= (0.2 if wide else 0.11)
    assert call(its.component, "get_status", []) == "Stop" and its.do("setdest", 0.0, 0.0, 0.0).answer is True
    if wide:
        its.do("goto", 3.0, 0.0, 0.0, ticks=200)
        assert its.do("stop").effect is Effect.PAUSE and hypot(*its.of("linear_velocity")) == 0.0
        assert its.of("position")[0] < 2.4 and call(its.component, "resume", []).effect is Effect.RESUME


def flies(its: Commanded) -> None:
    yaw = {} if its.component.row.morse == "Destination" else {"yaw": 1.0}
    its.send({"x": 1.0, "y": 2.0, "z": 3.0, **yaw}, ticks=1500)
    assert its.of("position") == pytest.approx((1.0, 2.0, 3.0), abs=0.05)
    assert its.of("heading")[0] == pytest.approx(1.0 if yaw else pi / 2, abs=1e-2)
    if yaw:
        assert its.do("goto", 0.0, 0.0, 2.0, 0.0).answer == "Arrived"
        assert its.of("position") == pytest.approx((0.0, 0.0, 2.0), abs=0.05)


def jumps(its: Commanded) -> None:
    its.do("translate", 1.0, 2.0, ticks=2)
    its.do("rotate", 0.0, 0.0, -0.5, ticks=2)
    assert (*its.of("position"), *its.of("heading")) == pytest.approx((1.0, 2.0, 0.0, pi / 2 - 0.5))
    its.send({"x": -3.0, "yaw": 0.25}, ticks=2)
    assert (*its.of("position"), *its.of("heading")) == pytest.approx((-3.0, 2.0, 0.0, 0.25))
    with pytest.raises(Refused, match="pitch and roll are 0"):
        its.send({"roll": 0.1})


def is_pushed(its: Commanded) -> None:
    its.send({"force": [10.0, 0.0, 0.0]}, ticks=20)
    vx, vy, _ = its.of("linear_velocity")
    along, across = (vx, vy) if its.component.row.morse == "ExternalForce" else (vy, vx)
    assert along > 0.5 and abs(across) < 0.05 * along


def points(its: Commanded) -> None:
    its.send({"pan": 0.5} if its.component.row.joints else {"pan": 0.5, "tilt": 0.0}, ticks=200)
    assert its.of("joint_positions") == pytest.approx([0.5, 0.0], abs=0.02)
    if its.component.row.morse == "PTU":
        assert its.do("set_pan_tilt", -0.5, 0.3, ticks=200).effect is Effect.JOB
        assert call(its.component, "get_pan_tilt", []) == pytest.approx([-0.5, 0.3], abs=0.02)
        return
    its.do("set_rotations", [0.1, 0.2], ticks=200)
    assert its.of("joint_positions") == pytest.approx([0.1, 0.2], abs=0.02)
    its.do("set_rotation", "tilt", -0.3, ticks=200)
    assert its.of("joint_positions") == pytest.approx([0.1, -0.3], abs=0.02)
    assert call(its.component, "get_joints", []) == ["pan", "tilt"]
    with pytest.raises(Refused, match="Joint <neck> does not exist"):
        call(its.component, "set_rotation", ["neck", 0.0])
    if "rotate" in its.component.row.services:
        its.do("rotate", "pan", 0.6, 0.25, ticks=100)
        assert its.of("joint_positions")[0] == pytest.approx(0.35, abs=0.05)  # half-way after half of the time
        its.do("trajectory", {"points": [{"time_from_start": 1.0, "positions": [-0.2, 0.1]}]}, ticks=150)
        assert its.of("joint_positions") == pytest.approx([-0.2, 0.1], abs=0.02)
        with pytest.raises(Refused, match=r"invalid trajectory: key 'positions' was expected"):
            call(its.component, "trajectory", [{"points": [{"time_from_start": 1.0}]}])


def grips(its: Commanded) -> None:
    assert its.do("grab", ticks=5).answer is True
    assert its.of("gripper.closed") == [1.0]
    its.do("release", ticks=5)
    assert its.of("gripper.closed") == [0.0]


EFFECTS: Final[dict[str, Callable[[Commanded], None]]] = {
    **dict.fromkeys(("MotionVW", "MotionVWDiff"), drives),
    "MotionXYW": slides,
    "Waypoint": goes,
    **dict.fromkeys(("RotorcraftWaypoint", "Destination"), flies),
    "Teleport": jumps,
    **dict.fromkeys(("ForceTorque", "ExternalForce"), is_pushed),
    **dict.fromkeys(("PTU", "Armature"), points),
    "Gripper": grips,
}


@pytest.mark.parametrize("row", [row for row in ROWS if row.into], ids=lambda row: f"{row.kind}-{row.morse}")
def test_a_command_does_what_its_fields_say(row: Row) -> None:
    its = Commanded(row)
    with its.simulation:
        (goes if row.kind == "go_to" else EFFECTS[row.morse])(its)
        with pytest.raises(Refused, match="no such field"):
            command(its.component, {"nonsense": 1.0})
        with pytest.raises(Refused, match=r"a str is not a number|as numbers"):
            command(its.component, dict.fromkeys(its.component.row.fields, "much"))


@pytest.mark.parametrize("morse", ["ArmaturePose", "PTUPosture"])
def test_joints_have_their_names(morse: str) -> None:
    its = Commanded(next(row for row in ROWS if row.kind == "pan_tilt"))
    with its.simulation:
        its.send({"pan": 0.4, "tilt": -0.2}, ticks=150)
        joints = made(next(row for row in ROWS if row.morse == morse), its.deployment, "it", "joint-state")
        joints.fields = reading(joints, its.simulation.readings["it", "joint-state"].value, 0)
        assert joints.fields == dict(zip(("pan", "tilt"), its.of("joint_positions"), strict=True))
        if morse == "ArmaturePose":
            assert call(joints, "get_joint", ["tilt"]) == its.of("joint_positions")[1]
            assert call(joints, "get_joints_length", []) == len(call(joints, "get_joints", [])) == 2
            assert call(joints, "get_state", []) == joints.fields


# --- frames and texts ------------------------------------------------------------------------------------------------

# Where MORSE's own tests have their world, in degrees rounded to float32 as it keeps them; their places and values, for
# which they allow 2 cm and 2e-6 degrees.
PLACE: Final = tuple(float(np.float32(degrees)) * pi / 180 for degrees in (1.4333, 43.6))
VALUES: Final[tuple[tuple[str, tuple[float, ...], tuple[float, ...]], ...]] = (
    ("ECEF", (10.0, 8.0, 0.1), (4617522.748, 4397221.061, 158481.297)),
    ("geodetic", (10.0, 8.0, 0.1), (43.6000883, 1.43337247, 135.1000)),
    ("ECEF", (100.0, 200.0, 50.0), (4617493.329, 4397317.326, 158674.479)),
    ("geodetic", (100.0, 200.0, 50.0), (43.6008970, 1.43510869, 185.0039)),
    ("UTM 123456789 -4242 421", (10.0, 8.0, 0.1), (123456799.0, -4234.0, 421.1)),
    ("NED", (10.0, 8.0, 0.1), (8.0, 10.0, -0.1)),
    ("feet", (10.0, 8.0, 0.1), (32.808399, 26.2467192, 0.32808399)),
)


@pytest.mark.parametrize(("name", "place", "value"), VALUES)
def test_frames_are_those_of_morse_and_back(name: str, place: tuple[float, ...], value: tuple[float, ...]) -> None:
    origin = EarthOrigin.model_construct(None, latitude=PLACE[0], longitude=PLACE[1], altitude=135.0, heading=pi / 2)
    (one,) = alterations([name], "Pose", origin)
    fields = {**dict(zip("xyz", place, strict=True)), "yaw": 0.5}
    changed = one.apply(fields, one.leaving)
    angle = 2e-6 if name == "geodetic" else 0.02
    for key, its, tolerance in zip("xyz", value, (angle, angle, 0.02), strict=True):
        assert changed[key] == pytest.approx(its, abs=tolerance, rel=0.0)
    assert one.apply(changed, one.coming) == pytest.approx(fields, abs=1e-6) and changed["yaw"] == 0.5


@pytest.mark.parametrize("name", ["geocentric", "NED", "NED_legacy"])
def test_other_frames_are_what_they_are_called(name: str) -> None:
    origin = EarthOrigin.model_construct(None, latitude=0.7, longitude=0.1, altitude=0.0, heading=pi / 2)
    (one,) = alterations([name], "Gyroscope" if name.startswith("NED") else "GPS", origin)
    fields = dict(zip(one.names, (0.3, 0.2, 0.1), strict=True))
    changed = one.apply(fields, one.leaving)
    expected = {
        "geocentric": (18.0 / pi, atan2((1 - 1 / 298.257223563) ** 2 * sin(0.7), cos(0.7)) * 180 / pi),
        "NED": (pi / 2 - 0.3, -0.2, 0.1),
        "NED_legacy": (0.1, -0.2, pi / 2 - 0.3),
    }[name]
    assert tuple(changed.values())[: len(expected)] == pytest.approx(expected, abs=1e-5)
    assert one.apply(changed, one.coming) == pytest.approx(fields, abs=1e-6)


@pytest.mark.parametrize(
    ("written", "morse", "message"),
    [
        ("ENU", "Pose", "unknown frame .*NED"),
        ("NED", "IMU", "NED is for Pose, GPS"),
        ("feet", "Gyroscope", "feet is for Pose, GPS"),
        ("UTM", "Pose", "UTM has three offsets in m"),
        ("NED 1 2 3", "Pose", "others have none"),
        ("ECEF", "Pose", "without an origin on Earth"),
    ],
)
def test_frames_that_do_not_fit_are_refused(written: str, morse: str, message: str) -> None:
    with pytest.raises(BadValue, match=message):
        alterations([written], morse, None)


def test_frames_are_applied_to_readings_and_commands_in_their_order() -> None:
    deployment, simulation = yard()
    component = made(ROWS[0], deployment, "cat-0", "pose-3d")
    component.alterations = alterations(["UTM 1000 2000 0", "NED"], "Pose", None)
    found, truth = reading(component, simulation.readings["cat-0", "pose-3d"].value, 0), Truth("cat-0")
    assert found is not None and (found["x"], found["y"]) == pytest.approx((truth.y + 2000.0, truth.x + 1000.0))
    go = made(next(row for row in ROWS if row.kind == "go_within"), deployment, "omni", "go")
    go.alterations = alterations(["NED"], "Waypoint", None)
    go.fields, numbers = command(go, {"x": 2.0, "y": 1.0})
    assert (numbers["x"], numbers["y"]) == (1.0, 2.0) and go.fields["x"] == 2.0
    assert command(go, {"x": 3.0})[1] == {**numbers, "y": 3.0}, "the rest stays, in the frame of the command"


def test_the_builder_writes_classes_of_the_table() -> None:
    classes = yaml.safe_load((Path(__file__).parents[2] / "gateways" / "builder" / "components.yaml").read_text())[
        "classes"
    ]
    written = {
        (its["kind"], its.get("row", morse))
        for section in ("sensors", "actuators")
        for morse, one in classes[section].items()
        for its in (one, *({**one, **level} for level in one.get("levels", {}).values()))
    }
    assert len(written) > 20 and written <= {(row.kind, row.morse) for row in ROWS}


def test_euler_angles_turn_back() -> None:
    for yaw, pitch, roll in ((0.3, 0.2, 0.1), (-3.0, -1.5, 2.0), (2.0, 1.2, -3.0)):
        assert euler(from_rpy(roll, pitch, yaw)) == pytest.approx((yaw, pitch, roll))


def test_services_answer_with_the_texts_of_morse() -> None:
    deployment, _ = yard()
    go = made(next(row for row in ROWS if row.kind == "go_within"), deployment, "omni", "go")
    manager = "Socket service manager: "
    for service, parameters, text in (
        ("nope", [], "The request nope has not been registered in Socket service manager"),
        ("goto", [], f"{manager}parameters expected for service goto! "),
        ("goto", [5.0], f"{manager}wrong # of parameters for service goto. "),
        ("stop", [5.0], f"{manager}wrong # of parameters for service stop. "),
        ("goto", ["a", 1.0, 2.0], f"{manager}wrong parameter type for service goto. "),
        ("set_property", ["Nope", 1.0], "Property Nope does not exist for object omni.go"),
        ("set_property", ["tolerance", 1.0], "Property tolerance of omni.go is set by the deployment"),
        ("get_local_data", [], "The request get_local_data has not been registered"),
    ):
        with pytest.raises(Refused) as refused:
            call(go, service, parameters)
        assert str(refused.value).startswith(text)
    assert call(go, "get_properties", [])["properties"]["tolerance"][:2] == ["0.1 m", "str"]
    eye = made(next(row for row in ROWS if row.kind == "camera"), deployment, "cat-0", "camera")
    pose = call(eye, "get_configurations", [])["configurations"]["object_to_robot"]
    assert pose == {"rotation": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "translation": [0.3, 0.0, 0.2]}
    with pytest.raises(Refused, match="has measured nothing yet"):
        call(eye, "get_local_data", [])
    with pytest.raises(BadValue, match=r"go_within has no row of the class \(there are: Waypoint\)"):
        row_of(go.settings, "Boat")


def test_a_box_ahead_of_a_robot_that_looks_back_has_the_orientation_of_morses_test() -> None:
    """Its box is 2.2 m ahead and 0.2 m higher."""
    robots = {
        "cat": {
            "model": "differential_drive",
            "at": {"yaw": "180 deg"},
            "sensors": {"eye": {"kind": "semantic_camera", "rate": "10 Hz", "tag": "box", "at": {"z": "1 m"}}},
        },
        "box": {"model": "rotorcraft", "at": {"x": "-2.2 m", "z": "1.2 m"}, "tags": ["box"]},
    }
    deployment = load_deployment(yard_text(robots), "yard.yaml")
    with Simulation(deployment) as simulation:
        simulation.step(ticks=2)
        eye = made(next(row for row in ROWS if row.kind == "semantic_camera"), deployment, "cat", "eye")
        found = reading(eye, simulation.readings["cat", "eye"].value, 0)
    assert found is not None
    (one,) = found["visible_objects"]
    assert one["position"] == pytest.approx([0.0, -0.2, 2.2], abs=1e-3)
    sign = one["orientation"]["x"] / abs(one["orientation"]["x"])
    assert [sign * one["orientation"][axis] for axis in "xyzw"] == pytest.approx([0.5, 0.5, -0.5, 0.5], abs=1e-6)


def test_a_component_type_outside_of_the_table_has_the_fields_of_its_payload() -> None:
    data = {"gap": {"kind": "range", "rate": "100 Hz", "range": "3 m"}}
    robots = {"it": {"model": "differential_drive", "sensors": data, "actuators": {"go": {"kind": "wheel_speeds"}}}}
    with Simulation(load_deployment(yard_text(robots), "yard.yaml")) as simulation:
        simulation.step(ticks=2)
        deployment = simulation.deployment
        gap, go = (made(Row("", "", ()), deployment, "it", channel) for channel in ("gap", "go"))
        assert reading(gap, simulation.readings["it", "gap"].value, 0) == {"distance": 3.0}
        assert (gap.row.morse, go.row.fields) == ("range", ("left", "right"))
        assert command(go, {"left": 0.1, "right": 0.2})[1] == {"left": 0.1, "right": 0.2}


@pytest.mark.parametrize("nth", range(3))
def test_each_class_makes_a_round_trip_through_the_socket(nth: int) -> None:
    """Of the classes of a component type the first, the second and the third."""
    classes: dict[str, str] = {}
    for robot, its in yard()[0].robots.items():
        for channel, one in (*its.sensors.items(), *its.actuators.items()):
            rows = [row.morse for row in ROWS if row.kind == one.kind and not row.only]
            if rows:
                classes[f"{robot}.{channel}"] = rows[min(nth, len(rows) - 1)]
    gateway = {"kind": "socket", "listen": "127.0.0.1:0", "streams": 0, "classes": classes}
    heard: set[str] = set()

    def script(served: Served) -> Iterator[int]:
        program, components = Program(served), served.run.components
        streams = {name: program.stream(name) for name in components}
        yield served.run.tick + 10
        for name, one in components.items():
            if one.row.kind == RADIO:
                continue
            if one.is_out and (lines := streams[name].lines()):
                last = json.loads(lines[-1])
                assert [*last] == ["timestamp", *one.row.fields], name
                assert last == json.loads(json.dumps({"timestamp": one.time_ns / 1e9, **(one.fields or {})})), name
                heard.add(name)
            elif not one.is_out:
                streams[name].write(json.dumps(dict.fromkeys(one.row.fields, 0.5)) + "\n")
                while not one.count:
                    served.go_round()
                assert one.fields == dict.fromkeys(one.row.fields, 0.5), name
                heard.add(name)

    served = Served(text_of_yard(gateways={"morse": gateway}), "morse", script)
    served.rehearse(60)
    assert heard == {name for name, one in served.run.components.items() if one.row.kind != RADIO}
