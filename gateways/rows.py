"""Rows: which component type is which class of MORSE, with fields, conventions and services. rows.yaml and table.py
have them.

All gateways share them. A row is pure functions of values: `out` makes the fields of a reading, without the timestamp;
`into` makes the numbers of a command from such fields.

Lengths are in m, angles in rad, times in s. The world is x east, y north, z up; `yaw`, `pitch`, `roll` are the turns
R = Rz(yaw) Ry(pitch) Rx(roll).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from typing import Any, Final

import msgspec

from foosim.common.errors import Refused, UnknownName
from foosim.deployment.schema import Deployment
from foosim.gateways.frames import Alteration
from foosim.world.component_types.settings import ComponentSettings

MANAGER: Final = "Socket service manager"
"""Begins the texts of failed services, also in other protocols: clients look for `wrong # of parameters`."""

Fields = dict[str, Any]


class Effect(Enum):
    """What an order of a service does to its actuator."""

    COMMAND = "command"
    """The service is answered when the command is sent."""
    JOB = "job"
    """It is answered when the job ends: `SUCCESS` with the answer, FAILED with the reason, or PREEMPTED."""
    START = "start"
    """A job begins, and the service is answered at once."""
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
    numbers: Fields | None = None
    """The numbers of the actuator's command, where they do not follow from the fields."""


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
    out: Callable[[Any, Component], Fields | None] | None = None
    """None: this reading is not sent on."""
    into: Callable[[Fields, Component], Fields] | None = None
    services: Mapping[str, Service] = field(default_factory=dict)
    defaults: Mapping[str, Any] = field(default_factory=dict)
    """Fields that a first command may be without."""
    only: Mapping[str, Any] = field(default_factory=dict)
    """The values of settings with which it applies."""
    joints: bool = False
    """Its fields are the names of the joints, where the component's settings have them."""


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
    undrawn: Any = None
    """The newest reading, where it is a picture without a reader: its fields are made at a request."""
    time_ns: int = -1
    """When the newest reading was sent, in simulated time."""
    count: int = 0
    """How many readings have come, or commands were sent."""
    alterations: Sequence[Alteration] = ()
    """The frames of reference in which its fields are given."""
    beside: Mapping[str, Component] = field(default_factory=dict)
    """The components of the gateway by `ROBOT.CHANNEL`."""
    status: str = "Stop"
    """Of an actuator with jobs: `Transit` while one runs, `Arrived` when it is done, else `Stop`."""

    @property
    def is_out(self) -> bool:
        """Whether it is a sensor."""
        return self.row.out is not None

    @property
    def is_drawn(self) -> bool:
        """Whether its readings are pictures, which cost time."""
        return bool(self.settings.component_type.drawn_by)


def reading(component: Component, value: Any, time_ns: int) -> Fields | None:
    """Return the fields of a reading that was sent at a time (ns); None: it is not sent on.

    The component has the fields of the reading before, as it was sent on, until the caller replaces them.
    """
    assert component.row.out is not None, f"{component.full} is no sensor"
    component.time_ns = time_ns
    fields = component.row.out(value, component)
    if fields is None:
        return None
    fields = {name: fields[name] for name in component.row.fields}
    for one in component.alterations:
        fields = one.apply(fields, one.leaving)
    return fields


def command(component: Component, given: Mapping[str, Any], numbers: Fields | None = None) -> tuple[Fields, Fields]:
    """Return the fields of a whole command and the numbers of the actuator's command, if these are not given.

    Other fields keep the values of the last command. Raises Refused for unknown, missing and wrong fields.
    """
    row = component.row
    if row.into is None:
        raise Refused(f"{component.full} is a sensor and takes no commands")
    if unknown := [name for name in given if name not in row.fields]:
        raise UnknownName(f"{component.full} takes {', '.join(row.fields)}: no such field", unknown[0], row.fields)
    whole = {**row.defaults, **(component.fields or {}), **given}
    if missing := [name for name in row.fields if name not in whole and not row.joints]:
        raise Refused(f"{component.full} takes {', '.join(row.fields)}: {', '.join(missing)} missing")
    if numbers is not None:
        return whole, numbers
    try:
        fields = whole
        for one in component.alterations:
            fields = one.apply(fields, one.coming)
        return whole, row.into(fields, component)
    except WRONG_TYPES as error:
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


WRONG_TYPES: Final = (TypeError, ValueError, LookupError, AttributeError, ArithmeticError)
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
    if component.undrawn is not None:
        component.fields, component.undrawn = reading(component, component.undrawn, component.time_ns), None
    if component.fields is None:
        raise Refused(f"{component.full} has measured nothing yet")
    return {"timestamp": component.time_ns / 1e9, **component.fields}


COMMON: Final[dict[str, Service]] = {
    "get_properties": _properties,
    "set_property": _set_property,
    "get_configurations": _configurations,
}
READING: Final[dict[str, Service]] = {"get_local_data": _local_data}


def label_of(deployment: Deployment, entity: str) -> str:
    """Return the label of an entity, its name if it has none."""
    its = deployment.settings_of(entity)
    return getattr(its, "label", None) or entity
