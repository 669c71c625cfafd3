"""The rows of rows.yaml, and the functions that it names: readings to fields, fields to commands, services."""

from __future__ import annotations

import inspect
from base64 import b64encode
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib.resources import files
from math import inf, pi, tan
from typing import Any, Final

import msgspec
import yaml

from foosim.common.errors import Refused, UnknownName
from foosim.common.exact_math import atan2, cos, sin
from foosim.gateways.frames import euler
from foosim.gateways.rows import Component, Effect, Fields, Order, Row, Service, label_of
from foosim.world.component_types.payloads import as_float
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.settings import ComponentSettings, SensorSettings
from foosim.world.scene import Quaternion, conjugate, multiply, rotate

AIR: Final = 1.225
"""The density of the air (kg/m3)."""
STILL: Final = 1e-6
"""A receiver that is slower (m/s) has no course."""
SPEED: Final = 0.8
"""How fast joints of an armature move, where no speed is given (rad/s or m/s)."""
CAMERA: Final[Quaternion] = (0.5, -0.5, 0.5, 0.5)
"""From the axes of a camera here (x ahead, y left, z up) to those of MORSE's cameras (x right, y down, z ahead)."""
POSE: Final = ("x", "y", "z", "yaw", "pitch", "roll")


# --- readings --------------------------------------------------------------------------------------------------------


def pose(value: Any, component: Component) -> Fields:
    """The pose of a place; that of `pose` is on the ground."""
    if hasattr(value, "heading"):
        return dict(zip(POSE, (value.x, value.y, 0.0, value.heading, 0.0, 0.0), strict=True))
    angles = euler((value.qx, value.qy, value.qz, value.qw))
    return dict(zip(POSE, (value.x, value.y, value.z, *angles), strict=True))


def motion(value: Any, component: Component) -> Fields:
    """Velocities in the frames of the mount and of the world, and the pressure by the speed ahead (Pa)."""
    back, linear = conjugate((value.qx, value.qy, value.qz, value.qw)), (value.vx, value.vy, value.vz)
    own = rotate(back, linear)
    return {
        "linear_velocity": [*own],
        "angular_velocity": [*rotate(back, (value.wx, value.wy, value.wz))],
        "world_linear_velocity": [*linear],
        "rotation": {name: its for name, its in pose(value, component).items() if name in POSE[3:]},
        "diff_pressure": 0.5 * AIR * own[0] * own[0],
    }


def travel(value: Any, component: Component) -> Fields:
    """The pose in the frame of the start, and changes since the reading before: these by the rate are velocities."""
    now, rate = pose(value, component), float(component.settings.rate_hz)  # type: ignore[attr-defined]
    last = (value.last_qx, value.last_qy, value.last_qz, value.last_qw)
    before = dict(zip(POSE, (value.last_x, value.last_y, value.last_z, *euler(last)), strict=True))
    change = {name: now[name] - before[name] for name in POSE}
    change |= {name: (change[name] + pi) % (2.0 * pi) - pi for name in POSE[3:]}
    speeds = dict(zip(("vx", "vy", "vz", "wz", "wy", "wx"), (its * rate for its in change.values()), strict=True))
    way = sum(change[name] ** 2 for name in POSE[:3]) ** 0.5
    return {**now, **speeds, **{f"d{name}": its for name, its in change.items()}, "dS": way}


def fix(value: Any, component: Component) -> Fields:
    """Place and velocity on Earth, the time since 1970, as if the run had begun then, and the course over ground."""
    from numpy import datetime64

    day, _, time = str(datetime64(component.time_ns // 10**9, "s")).partition("T")
    is_still = value.east * value.east + value.north * value.north < STILL * STILL
    return {
        "longitude": value.longitude,
        "latitude": value.latitude,
        "altitude": value.altitude,
        "velocity": [value.east, value.north, value.up],
        "date": day[8:10] + day[5:7] + day[2:4],
        "time": time.replace(":", ""),
        "heading": inf if is_still else atan2(value.east, value.north) * 180.0 / pi % 360.0,
    }


def battery(value: Any, component: Component) -> Fields:
    """The charge (%), and whether it grows since the reading before."""
    charge, before = value.share * 100.0, (component.fields or {}).get("charge", inf)
    is_charging = charge > before or (charge >= 100.0 and charge == before)
    status = ("Charged" if charge >= 100.0 else "Charging") if is_charging else "Discharging"
    return {"charge": charge, "status": status}


def near(value: Any, component: Component) -> Fields:
    """Distances by name."""
    found = {label_of(component.deployment, one.name): one.distance for one in value.entities}
    return {"near_objects": found, "near_robots": found}


def touched(value: Any, component: Component) -> Fields | None:
    """What is touched; a reading without anything is not sent on."""
    names = [label_of(component.deployment, name) for name in value.objects]
    return {"collision": True, "objects": ",".join(names)} if names else None


def scan(value: Any, component: Component) -> Fields:
    """Points in the plane of the scanner, the first to the right; a miss is at the origin."""
    its: Any = component.settings

    def made() -> list[tuple[float, float]]:
        first, last = its.bearings
        step = (last - first) / max(its.rays - 1, 1)
        return [(cos(first + ray * step), sin(first + ray * step)) for ray in range(its.rays)]

    ways = component.deployment.shared(f"beams of {component.robot} {component.channel}", made)
    met = zip(ways, value.distances, strict=True)
    points = [[x * d, y * d, 0.0] if d < its.range else [0.0, 0.0, 0.0] for (x, y), d in met]
    return {"point_list": points, "range_list": [*value.distances]}


def scan_of_rows(value: Any, component: Component) -> Fields:
    """Rows of beams, the highest first, where the scanner has the lowest first."""
    import numpy as np

    its: Any = component.settings
    ranges = value.ranges()[::-1]
    points = np.array(its.directions).reshape(*ranges.shape, 3)[::-1] * ranges[..., None]
    points[ranges >= its.range] = 0.0
    return {"point_list": points.reshape(-1, 3).tolist(), "range_list": ranges.ravel().tolist()}


def _focal(its: Any) -> tuple[float, list[list[float]]]:
    """The focal length in pixels, and the intrinsic matrix."""
    focal = its.width / 2.0 / tan(its.angle / 2.0)
    return focal, [[focal, 0.0, its.width / 2.0], [0.0, focal, its.height / 2.0], [0.0, 0.0, 1.0]]


def image(value: Any, component: Component) -> Fields:
    """Rows of red, green, blue and 255, the uppermost first."""
    import numpy as np

    colours = value.image()
    height, width, _ = colours.shape
    rgba = np.dstack((colours, np.full((height, width), 255, np.uint8)))
    picture = {"image": b64encode(rgba.tobytes()).decode(), "intrinsic_matrix": _focal(component.settings)[1]}
    return {"height": height, "width": width, **picture}


def depth(value: Any, component: Component) -> Fields:
    """Points x right, y down, z ahead as little-endian float32, row by row, without those where nothing is seen."""
    import numpy as np

    picture, (focal, matrix) = value.depth(), _focal(component.settings)
    height, width = picture.shape
    rows, columns = np.nonzero(picture)
    ahead = picture[rows, columns]
    right, down = (columns + 0.5 - width / 2.0) / focal * ahead, (rows + 0.5 - height / 2.0) / focal * ahead
    points = b64encode(np.stack((right, down, ahead), axis=1).astype("<f4").tobytes()).decode()
    size = {"height": height, "width": width}
    return {**size, "points": points, "nb_points": len(ahead), "intrinsic_matrix": matrix}


def seen(value: Any, component: Component) -> Fields:
    """Poses in MORSE's frame of cameras, or in that of the world, as the camera's setting `frame` has it."""
    its: Any = component.settings
    objects = []
    for one in value.objects:
        (x, y, z), orientation = one.position, one.orientation
        if its.frame == "own":
            (x, y, z), orientation = (-y, -z, x), multiply(CAMERA, orientation)
        turned = dict(zip(("x", "y", "z", "w"), orientation, strict=True))
        about = {"name": label_of(component.deployment, one.name), "description": "", "type": its.tag}
        objects.append({**about, "position": [x, y, z], "orientation": turned})
    return {"visible_objects": objects}


def joints(value: Any, component: Component) -> Fields:
    """Positions by the names of joints, or of pan and tilt."""
    return dict(zip(component.row.fields, value.positions, strict=True))


# --- commands --------------------------------------------------------------------------------------------------------


def _start(component: Component) -> Any:
    """Return the pose at which its robot starts."""
    return component.deployment.robots[component.robot].at  # type: ignore[attr-defined]


def destination(fields: Fields, component: Component) -> Fields:
    """The place, and the heading of the start, which it keeps."""
    return {**{name: as_float(fields[name]) for name in POSE[:3]}, "yaw": _start(component).yaw}


def wrench(fields: Fields, component: Component) -> Fields:
    """Force and torque along each axis."""
    axes = [(name, axis, its) for name in ("force", "torque") for axis, its in zip("xyz", fields[name], strict=True)]
    return {f"{name}_{axis}": as_float(its) for name, axis, its in axes}


def teleport(fields: Fields, component: Component) -> Fields:
    """The pose of an upright robot."""
    if as_float(fields["pitch"]) or as_float(fields["roll"]):
        raise Refused(f"{component.full} puts an upright robot somewhere: pitch and roll are 0")
    return {name: as_float(fields[name]) for name in POSE[:4]}


def positions(fields: Fields, component: Component) -> Fields:
    """Return the positions of all joints: others keep theirs, at first where they are."""
    joints = component.row.fields
    rest = {} if set(joints) <= set(fields) else _joints_now(component)
    return {"positions": [as_float(fields.get(joint, rest.get(joint))) for joint in joints]}


def by_speed(fields: Fields, component: Component, speed: float = SPEED) -> Fields:
    """Return the trajectory of joints to positions, others stay, by a speed (rad/s or m/s)."""
    now = _joints_now(component)
    wanted = {joint: as_float(fields.get(joint, now[joint])) for joint in component.row.fields}
    way = max(abs(to - now[joint]) for joint, to in wanted.items())
    time_s = max(way / as_float(speed), component.deployment.tick_ns / 1e9)
    return {"times": [time_s], "positions": [[*wanted.values()]]}


# --- services --------------------------------------------------------------------------------------------------------


def _moved(component: Component, **by: float) -> Order:
    """Return a pose relative to the last one, at first that of the start."""
    at = _start(component)
    start = {**dict(zip(POSE, at.position, strict=False)), "yaw": at.yaw, "pitch": 0.0, "roll": 0.0}
    return Order({name: its + as_float(by.get(name, 0.0)) for name, its in (component.fields or start).items()})


def _joints_now(component: Component) -> dict[str, float]:
    """Return the positions of joints, by the joint sensor beside an actuator."""
    for one in component.beside.values():
        if one.robot == component.robot and one.settings.kind == "joint_state" and one.fields is not None:
            return one.fields
    raise Refused(f"{component.full}: its robot needs a sensor joint_state, with its joints by name, that has measured")


def _known(component: Component, name: str) -> str:
    if name not in component.row.fields:
        raise Refused(f"Joint <{name}> does not exist in armature {component.full}")
    return name


def move_joints(component: Component, wanted: dict[str, float], speed: float | None = None) -> Order:
    """Move joints at a speed; answered when they are there."""
    fields = {_known(component, name): as_float(value) for name, value in wanted.items()}
    return Order(fields, effect=Effect.JOB, numbers=by_speed(fields, component, speed or SPEED))


def trajectory(component: Component, way: dict[str, Any]) -> Order:
    """Move joints along points in time."""
    try:
        points = [(one["time_from_start"], one["positions"]) for one in way["points"]]
    except KeyError as missing:
        raise Refused(f"Error: invalid trajectory: key {missing} was expected.") from None
    numbers = {"times": [time for time, _ in points], "positions": [its for _, its in points]}
    return Order({}, effect=Effect.JOB, numbers=numbers)


SERVICES: Final[dict[str, Service]] = {
    "status": lambda component: component.status,
    "translate": lambda component, x, y=0.0, z=0.0: _moved(component, x=x, y=y, z=z),
    "rotate_robot": lambda component, roll, pitch=0.0, yaw=0.0: _moved(component, roll=roll, pitch=pitch, yaw=yaw),
    "pan_tilt_now": lambda component: [*_joints_now(component).values()],
    "joint_names": lambda component: [*component.row.fields],
    "joint_count": lambda component: len(component.row.fields),
    "joint": lambda component, name: (component.fields or {}).get(_known(component, name)),
    "state": lambda component: component.fields,
    "set_joint": lambda component, name, value: Order({_known(component, name): as_float(value)}),
    "set_joints": lambda component, values: Order(dict(zip(component.row.fields, map(as_float, values), strict=True))),
    "move_joint": lambda component, name, value, speed=None: move_joints(component, {name: value}, speed),
    "move_joints": move_joints,
    "trajectory": trajectory,
}
"""By their names in rows.yaml."""


# --- the table -------------------------------------------------------------------------------------------------------


def _attributes(names: Mapping[str, str | list[str]]) -> Callable[[Any, Component], Fields]:
    def read(value: Any, of: str | list[str]) -> Any:
        return getattr(value, of) if isinstance(of, str) else [getattr(value, one) for one in of]

    return lambda value, _: {name: read(value, of) for name, of in names.items()}


def _numbers(names: Mapping[str, str]) -> Callable[[Fields, Component], Fields]:
    return lambda fields, _: {number: as_float(fields[name]) for number, name in names.items()}


def _service(about: str | Mapping[str, Any]) -> Service:
    """Return a function by its name, or the one of a description."""
    if isinstance(about, str):
        return SERVICES[about]
    none, kind = inspect.Parameter.empty, inspect.Parameter.POSITIONAL_ONLY
    takes = dict(next(iter(one.items())) if isinstance(one, dict) else (one, none) for one in about.get("takes", ()))
    fixed = about.get("fields", {}) | {name: its for name, its in takes.items() if its is not none}
    answer, effect = about.get("answer"), Effect(about.get("effect", "command"))

    def order(component: Component, *given: float) -> Order:
        return Order(fixed | dict(zip(takes, map(as_float, given), strict=False)), answer, effect)

    parameters = [inspect.Parameter(name, kind, default=its) for name, its in ({"component": none} | takes).items()]
    order.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return order


def _row(kind: str, morse: str, about: Mapping[str, Any]) -> Row:
    out, into = about.get("out"), about.get("into")
    return Row(
        kind,
        morse,
        tuple(about.get("fields", out if isinstance(out, dict) else ())),
        _attributes(out) if isinstance(out, dict) else out and globals()[out],
        _numbers(into) if isinstance(into, dict) else into and globals()[into],
        {name: _service(its) for name, its in about.get("services", {}).items()},
        about.get("defaults", {}),
        about.get("only", {}),
        about.get("joints", False),
    )


ROWS: Final = tuple(
    _row(kind, morse, about)
    for kind, classes in yaml.safe_load(files("foosim.gateways").joinpath("rows.yaml").read_text()).items()
    for morse, about in classes.items()
)


def row_of(settings: ComponentSettings, morse: str = "") -> Row:
    """Return the row of a component type: of several the class `morse`, or the first one. Raises UnknownName."""
    is_out = isinstance(settings, SensorSettings)
    joints = settings.component_type.joints_named(settings) if settings.component_type.joints else None
    found = [
        replace(row, fields=tuple(joints or ())) if row.joints else row
        for row in ROWS
        if row.kind == settings.kind and (row.out is not None) is is_out and (joints or not row.joints)
        if all(getattr(settings, name) == value for name, value in row.only.items())
    ] or [_plain(settings)]
    for row in found:
        if morse in ("", row.morse):
            return row
    raise UnknownName(f"{settings.kind} has no row of the class", morse, [row.morse for row in found])


def _plain(settings: ComponentSettings) -> Row:
    """Return the row of a component type outside of the table."""
    codec = codec_of(settings.component_type)
    names = tuple(one.name for one in codec.fields if not (codec.has_job and one.name == "job"))
    if isinstance(settings, SensorSettings):
        return Row(settings.kind, settings.kind, names, out=lambda value, _: msgspec.to_builtins(value))
    return Row(settings.kind, settings.kind, names, into=lambda fields, _: dict(fields))
