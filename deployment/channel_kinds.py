"""The readings and commands of the channels of a deployment's endpoints."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

from foosim.common.errors import UnknownName
from foosim.common.names import CHANNEL_ECHO
from foosim.deployment.schema import Deployment
from foosim.world.component_types.payloads import PayloadCodec
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import class_at
from foosim.world.component_types.settings import SensorSettings


def channel_codec(deployment: Deployment, endpoint: str, channel: str) -> PayloadCodec | None:
    """Return the type of a channel's payloads: None for bytes, as on `echo` and channels of players and clients.

    Raises UnknownName.
    """
    robot = deployment.robots.get(endpoint)
    if robot is None and endpoint not in deployment.players and endpoint not in deployment.clients:
        raise UnknownName("unknown robot", endpoint, deployment.robots)
    if robot is None or channel == CHANNEL_ECHO:
        return None
    if channel in robot.sensors:
        settings = robot.sensors[channel]
        its = settings.component_type
        if not its.drawn_by:
            return codec_of(its)
        return deployment.shared(f"{endpoint}/{channel}", lambda: _drawn(deployment, settings, endpoint, channel))
    if channel in robot.actuators:
        return codec_of(robot.actuators[channel].component_type)
    raise UnknownName(f"{endpoint} has no such channel", channel, [*robot.sensors, CHANNEL_ECHO, *robot.actuators])


def _drawn(deployment: Deployment, settings: SensorSettings, robot: str, channel: str) -> PayloadCodec:
    """Return the codec of readings that are drawn where they are looked at."""
    component = settings.component_type
    drawn_by = class_at(component.drawn_by)(deployment, settings, robot, channel)
    return PayloadCodec(component.value, component.name, drawn_by)


def joints_of(deployment: Deployment, endpoint: str, channel: str) -> tuple[str, ...]:
    """Return the names of the joints that the component of a channel selects, in the order of its numbers; none for any
    other channel."""
    robot = deployment.robots.get(endpoint)
    its = None if robot is None else robot.sensors.get(channel) or robot.actuators.get(channel)
    return () if its is None else tuple(its.component_type.joints_named(its) or ())


class Carried(NamedTuple):
    """What the network carries in place of a sensor's payload: its size (bytes), and how much later it arrives."""

    size: int | None
    latency_ns: int


PLAIN: Final = Carried(None, 0)
"""Of a channel whose packets are as long as their payload, without a latency."""


def carried_by(deployment: Deployment) -> dict[tuple[str, str], Carried]:
    """Return what the network carries of robots' sensors, by robot and channel, without the PLAIN ones."""
    found = {
        (robot, channel): Carried(settings.carried_bytes, settings.late_by_ns)
        for robot, spec in deployment.robots.items()
        for channel, settings in spec.sensors.items()
    }
    return {pair: carried for pair, carried in found.items() if carried != PLAIN}


class Channel(NamedTuple):
    """The codec of a channel's payloads, None for bytes, and the joints that its numbers are of."""

    codec: PayloadCodec | None
    joints: tuple[str, ...]


def channels_of(deployment: Deployment, pairs: Iterable[tuple[str, str]]) -> dict[tuple[str, str], Channel]:
    """Return the channels of pairs of endpoint and channel. Raises UnknownName."""
    return {pair: Channel(channel_codec(deployment, *pair), joints_of(deployment, *pair)) for pair in pairs}
