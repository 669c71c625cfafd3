"""The table of rows: which component type is which class of MORSE, with fields, conventions and services.

All gateways share it. A row is pure functions of values: `out` makes the fields of a reading, in the order of a bottle
and without the timestamp; `into` makes the numbers of a command from such fields. A component type without a row of its
own gets one by its payload: the fields are those of its reading or command.

Lengths are in m, angles in rad, times in s. The world is x east, y north, z up; `yaw`, `pitch`, `roll` are the turns
R = Rz(yaw) Ry(pitch) Rx(roll).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from typing import Any, Final

import msgspec

from foosim.common.errors import Refused, UnknownName
from foosim.common.exact_math import asin, atan2
from foosim.deployment.schema import Deployment
from foosim.world.component_types.payloads import as_float
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.settings import ComponentSettings, SensorSettings
from foosim.world.scene import Quaternion, multiply

MANAGER: Final = "Socket service manager"
"""Begins the texts of failed services, also in other protocols: clients look for `wrong # of parameters`."""

Fields = dict[str, Any]


class Effect(Enum):
    """What an order of a service does to its actuator."""

    COMMAND = "command"
    """The service is answered when the command is sent."""
    JOB = "job"
    """It is answered when the job ends: `SUCCESS` with the answer, FAILED with the reason, or PREEMPTED."""
    PAUSE = "pause"
    """As a command; the running job is not answered."""
    RESUME = "resume"
    """The job that was paused is given again, with its last fields."""


@dataclass(frozen=True, slots=True)
class Order:
    """What a service has an actuator do: the fields that change, and the answer."""

    fields: Fields
    answer: Any = None
    effect: Effect = Effect.COMMAND


Service = Callable[..., Any]
"""A function of the component and the parameters. It returns its answer, or an Order. Raises Refused."""


@dataclass(frozen=True, slots=True)
class Row:
    """One class of MORSE by a component type of foosim."""

    kind: str
    """The registered name of the component type."""
    morse: str
    fields: tuple[str, ...]
    """In the order of a bottle; of a reading without the timestamp, which is before them."""
    out: Callable[[Any, Component], Fields] | None = None
    into: Callable[[Fields, Component], Fields] | None = None
    services: Mapping[str, Service] = field(default_factory=dict)
    defaults: Mapping[str, Any] = field(default_factory=dict)
    """Fields that a first command may be without."""


@dataclass(slots=True, eq=False)
class Component:
    """A sensor or an actuator of a run, by MORSE's names."""

    full: str
    """ROBOT.COMPONENT, by the labels where there are any."""
    robot: str
    channel: str
    settings: ComponentSettings
    deployment: Deployment
    row: Row
    fields: Fields | None = None
    """The newest reading, or the last command; None before the first."""
    time_ns: int = -1
    """When that was sent, in simulated time."""
    count: int = 0
    """How many readings have come, or commands were sent."""
    status: str = "Stop"
    """Of an actuator with jobs: `Transit` while one runs, `Arrived` when it is done, else `Stop`."""

    @property
    def is_out(self) -> bool:
        """Whether it is a sensor."""
        return self.row.out is not None


def row_of(settings: ComponentSettings, morse: str = "") -> Row:
    """Return the row of a component type: of several the class `morse`, or the first one. Raises UnknownName."""
    is_out = isinstance(settings, SensorSettings)
    found = [row for row in ROWS if row.kind == settings.kind and (row.out is not None) is is_out]
    found = found or [_plain(settings)]
    for row in found:
        if morse in ("", row.morse):
            return row
    raise UnknownName(f"{settings.kind} has no row of the class", morse, [row.morse for row in found])


def command(component: Component, given: Mapping[str, Any]) -> tuple[Fields, Fields]:
    """Return the fields of a whole command and the numbers of the actuator's command.

    Other fields keep the values of the last command. Raises Refused for unknown, missing and wrong fields.
    """
    row = component.row
    if row.into is None:
        raise Refused(f"{component.full} is a sensor and takes no commands")
    if unknown := [name for name in given if name not in row.fields]:
        raise UnknownName(f"{component.full} takes {', '.join(row.fields)}: no such field", unknown[0], row.fields)
    whole = {**row.defaults, **(component.fields or {}), **given}
    if missing := [name for name in row.fields if name not in whole]:
        raise Refused(f"{component.full} takes {', '.join(row.fields)}: {', '.join(missing)} missing")
    try:
        return whole, row.into(whole, component)
    except (TypeError, ValueError, LookupError, AttributeError) as error:
        raise Refused(f"{component.full} takes {', '.join(row.fields)} as numbers: {error}") from None


def services_of(row: Row) -> dict[str, Service]:
    """Return all services of a row by name: its own, and those of every component."""
    return {**COMMON, **(READING if row.out is not None else {}), **row.services}


def call(component: Component, service: str, parameters: list[Any]) -> Any:
    """Return the answer of a service, or an Order. Raises Refused, with the texts of MORSE's manager."""
    its = services_of(component.row).get(service)
    if its is None:
        raise Refused(f"The request {service} has not been registered in {MANAGER}")
    return checked(service, partial(its, component), parameters)


WRONG_TYPES: Final = (TypeError, ValueError, LookupError, AttributeError)
"""What functions of services raise for parameters of wrong types."""


def checked(service: str, its: Callable[..., Any], parameters: list[Any]) -> Any:
    """Call a function for a service. Raises Refused, with the texts of MORSE's manager."""
    try:
        inspect.signature(its).bind(*parameters)
    except TypeError as error:
        what = "wrong # of parameters for service {}." if parameters else "parameters expected for service {}!"
        raise Refused(f"{MANAGER}: {what.format(service)} {error}") from None
    try:
        return its(*parameters)
    except WRONG_TYPES as error:
        raise Refused(wrong_type(service, error)) from None


def wrong_type(service: str, error: Exception) -> str:
    """Return MORSE's text for a parameter of a wrong type."""
    return f"{MANAGER}: wrong parameter type for service {service}. {error}"


# --- services of every component -------------------------------------------------------------------------------------


def _properties(component: Component) -> Fields:
    """The settings, as they are in SI units: [value, type, description, name]."""
    settings = msgspec.to_builtins(component.settings.model_dump(mode="json"))
    return {"properties": {name: [its, type(its).__name__, "", name] for name, its in settings.items()}}


def _set_property(component: Component, name: str, value: object) -> None:
    if name in _properties(component)["properties"]:
        raise Refused(f"Property {name} of {component.full} is set by the deployment and fixed in a run")
    raise Refused(f"Property {name} does not exist for object {component.full}")


def _configurations(component: Component) -> Fields:
    """The pose of the component on its robot."""
    at = getattr(component.settings, "at", None)
    x, y, z, w = at.orientation if at is not None else (0.0, 0.0, 0.0, 1.0)
    rotation = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    place = list(at.position) if at is not None else [0.0, 0.0, 0.0]
    return {"configurations": {"object_to_robot": {"rotation": rotation, "translation": place}}}


def _local_data(component: Component) -> Fields:
    if component.fields is None:
        raise Refused(f"{component.full} has measured nothing yet")
    return {"timestamp": component.time_ns / 1e9, **component.fields}


COMMON: Final[dict[str, Service]] = {
    "get_properties": _properties,
    "set_property": _set_property,
    "get_configurations": _configurations,
}
READING: Final[dict[str, Service]] = {"get_local_data": _local_data}


# --- conventions -----------------------------------------------------------------------------------------------------


def euler(orientation: Quaternion) -> tuple[float, float, float]:
    """Return yaw, pitch and roll of an orientation."""
    x, y, z, w = orientation
    pitch = asin(min(1.0, max(-1.0, 2.0 * (w * y - z * x))))
    yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaw, pitch, atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))


def quaternion(orientation: Quaternion) -> Fields:
    """Return an orientation as MORSE writes it."""
    return dict(zip("xyzw", orientation, strict=True))


CAMERA: Final[Quaternion] = (0.5, -0.5, 0.5, 0.5)
"""From the axes of a camera here (x ahead, y left, z up) to those of MORSE's cameras (x right, y down, z ahead)."""

POSE: Final = ("x", "y", "z", "yaw", "pitch", "roll")


def _pose(value: Any, component: Component) -> Fields:
    angles = euler((value.qx, value.qy, value.qz, value.qw))
    return dict(zip(POSE, (value.x, value.y, value.z, *angles), strict=True))


def _level_pose(value: Any, component: Component) -> Fields:
    return dict(zip(POSE, (value.x, value.y, 0.0, value.heading, 0.0, 0.0), strict=True))


def _seen(value: Any, component: Component) -> Fields:
    seen = [
        {
            "name": label_of(component.deployment, one.name),
            "description": "",
            "type": getattr(component.settings, "tag", ""),
            "position": [-one.position[1], -one.position[2], one.position[0]],
            "orientation": quaternion(multiply(CAMERA, one.orientation)),
        }
        for one in value.objects
    ]
    return {"visible_objects": seen}


def label_of(deployment: Deployment, entity: str) -> str:
    """Return the label of an entity, its name if it has none."""
    its = deployment.settings_of(entity)
    return getattr(its, "label", None) or entity


# --- the table -------------------------------------------------------------------------------------------------------


def _goto(component: Component, x: float, y: float, z: float, tolerance: float = 0.5, speed: float = 1.0) -> Order:
    return Order(_place(x, y, z, tolerance, speed), "Arrived", Effect.JOB)


def _set_destination(
    component: Component, x: float, y: float, z: float, tolerance: float = 0.5, speed: float = 1.0
) -> Order:
    return Order(_place(x, y, z, tolerance, speed), True)


def _place(x: float, y: float, z: float, tolerance: float, speed: float) -> Fields:
    numbers = (as_float(one) for one in (x, y, z, tolerance, speed))
    return dict(zip(("x", "y", "z", "tolerance", "speed"), numbers, strict=True))


def _plain(settings: ComponentSettings) -> Row:
    """Return the row of a component type outside of the table: its fields are those of its reading or command."""
    codec = codec_of(settings.component_type)
    names = tuple(one.name for one in codec.fields if not (codec.has_job and one.name == "job"))
    if isinstance(settings, SensorSettings):
        return Row(settings.kind, settings.kind, names, out=lambda value, _: msgspec.to_builtins(value))
    return Row(settings.kind, settings.kind, names, into=lambda fields, _: dict(fields))


ROWS: Final = (
    Row("pose_3d", "Pose", POSE, out=_pose),
    Row("pose", "Pose", POSE, out=_level_pose),
    Row("semantic_camera", "SemanticCamera", ("visible_objects",), out=_seen),
    Row(
        "v_w",
        "MotionVW",
        ("v", "w"),
        into=lambda fields, _: {"linear": as_float(fields["v"]), "angular": as_float(fields["w"])},
        services={
            "set_speed": lambda component, v, w: Order({"v": as_float(v), "w": as_float(w)}),
            "stop": lambda component: Order({"v": 0.0, "w": 0.0}),
        },
        defaults={"v": 0.0, "w": 0.0},
    ),
    Row(
        "go_to",
        "Waypoint",
        ("x", "y", "z", "tolerance", "speed"),
        into=lambda fields, _: {"x": as_float(fields["x"]), "y": as_float(fields["y"])},
        services={
            "setdest": _set_destination,
            "goto": _goto,
            "stop": lambda component: Order({"speed": 0.0}, "Stop", Effect.PAUSE),
            "resume": lambda component: Order({}, "Transit", Effect.RESUME),
            "get_status": lambda component: component.status,
        },
        defaults={"z": 0.0, "tolerance": 0.5, "speed": 1.0},
    ),
)
