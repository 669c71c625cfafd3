"""The payload kinds of the channels of a deployment's endpoints."""

from __future__ import annotations

from foosim.common.errors import UnknownName
from foosim.common.names import CHANNEL_ECHO
from foosim.deployment.schema import Deployment
from foosim.world.payloads import command_channels


def channel_kind(deployment: Deployment, robot: str, channel: str) -> str:
    """Return the kind of an endpoint's channel, bytes for players and clients; raises UnknownName."""
    if robot in deployment.players or robot in deployment.clients:
        return CHANNEL_ECHO
    if robot not in deployment.robots:
        raise UnknownName("unknown robot", robot, deployment.robots)
    settings = deployment.robots[robot]
    built_in = [CHANNEL_ECHO, *command_channels(settings)]
    if channel in built_in:
        return channel
    if channel not in settings.sensors:
        raise UnknownName(f"{robot} has no such channel", channel, [*settings.sensors, *built_in])
    return settings.sensors[channel].kind
