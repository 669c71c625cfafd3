"""The components that a gateway serves: sensors, actuators and radios of robots, under MORSE's names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from foosim.deployment.schema import Deployment
from foosim.gateways.frames import alterations
from foosim.gateways.rows import Component, Order, Row, label_of, services_of
from foosim.gateways.table import row_of
from foosim.world.component_types.settings import ActuatorSettings, ComponentSettings, GatewaySettings, SensorSettings

RADIO: Final = "radio"
"""The channel of packets between clients on board of robots."""
RECEIVED: Final = "received"
DATASTREAM: Final = "morse.middleware.socket_datastream.SocketDatastreamManager"


def send_radio(component: Component, to: str, data: Any) -> Order:
    """The service `send` of a radio: send any data to another robot, by its label."""
    return Order({"to": to, "data": data})


def robots_of(deployment: Deployment, settings: GatewaySettings) -> dict[str, str]:
    """Return the robots that a gateway serves, by the name that programs know; in names of MORSE a dot is before a
    component, so in those of robots it is `_`."""
    names = {robot: settings.names.get(robot) or label_of(deployment, robot) for robot in settings.robots}
    return {name.replace(".", "_"): robot for robot, name in names.items()}


def radios(deployment: Deployment, robot: str, label: str) -> Iterator[Component]:
    """Yield the components of a robot that send packets to other robots and receive theirs."""
    sends = Row(RADIO, "Radio", ("to", "data"), into=lambda fields, _: fields, services={"send": send_radio})
    takes = Row(RADIO, "RadioReceiver", ("from", "data"), out=lambda value, _: value)
    for channel, row in ((RADIO, sends), (RECEIVED, takes)):
        yield Component(f"{label}.{channel}", robot, channel, ComponentSettings(kind=RADIO), deployment, row)


def components_of(deployment: Deployment, settings: GatewaySettings) -> dict[str, Component]:
    """Return the components of the robots that a gateway serves, by their names in the deployment, `ROBOT.CHANNEL`.

    Raises BadValue for a class that one of them does not have, and frames in which it cannot be given.
    """
    found: dict[str, Component] = {}
    for label, robot in robots_of(deployment, settings).items():
        its = deployment.robots[robot]
        if len(settings.robots) > 1:
            found |= {f"{robot}.{one.channel}": one for one in radios(deployment, robot, label)}
        parts: dict[str, SensorSettings | ActuatorSettings] = {**its.sensors, **its.actuators}
        for channel, one in parts.items():
            if one.kind != "job":
                key, name = f"{robot}.{channel}", f"{label}.{one.label or channel}"
                row = row_of(one, settings.classes.get(key, ""))
                frames = alterations(settings.alter.get(key, ()), row.morse, deployment.origin)
                found[key] = Component(name, robot, channel, one, deployment, row, beside=found, alterations=frames)
    return found


def details_of(components: Iterable[Component], robots: Mapping[str, str], deployment: Deployment) -> dict[str, Any]:
    """Return the robots and components as MORSE's `simulation details` has them; `robots` are by label."""
    found: dict[str, dict[str, Any]] = {
        label: {"name": label, "type": deployment.robots[robot].model, "components": {}}
        for label, robot in robots.items()
    }
    labels = {robot: label for label, robot in robots.items()}
    for one in components:
        found[labels[one.robot]]["components"][one.full] = {
            "type": one.row.morse,
            "services": [*services_of(one.row)],
            "stream_interfaces": [[DATASTREAM, "OUT" if one.is_out else "IN"]],
        }
    return {"robots": [*found.values()], "environment": deployment.world}
