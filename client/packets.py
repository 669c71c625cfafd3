"""Checks packets and subscriptions against the deployment before a client sends them.

The vHub refuses and counts invalid ones; these checks raise an error at the sender.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from foosim.client.errors import PacketError
from foosim.client.player import Packet
from foosim.common import limits
from foosim.common.errors import UnknownName
from foosim.common.names import CHANNEL_ECHO
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Sent

PACKET_OVERHEAD_BYTES: Final = 128
"""The greatest size of a packet in a message without its payload: two names and two numbers."""


def check_packet(deployment: Deployment, packet: Packet) -> None:
    """Raise UnknownName or PacketError for a packet that could not be sent."""
    destination = packet.destination
    known = deployment.robots, deployment.players, deployment.clients
    if destination and not any(destination in section for section in known):
        raise UnknownName("unknown destination", destination, deployment.endpoints())
    _check_channel(packet.channel)
    size = len(packet.payload)
    if size > limits.PAYLOAD_BYTES_MAX:
        raise PacketError(f"{size} bytes in one packet, at most {limits.PAYLOAD_BYTES_MAX} are allowed")


def check_subscription(deployment: Deployment, source: str, channel: str) -> None:
    """Raise UnknownName unless the deployment has this endpoint and, if it is a robot, the robot this channel to hear.

    Players and clients may use channels of any valid name; raises PacketError for an invalid one.
    """
    if source in deployment.players or source in deployment.clients:
        _check_channel(channel)
        return
    if source not in deployment.robots:
        raise UnknownName("unknown endpoint", source, deployment.endpoints())
    heard = [*deployment.robots[source].sensors, CHANNEL_ECHO]
    if channel not in heard:
        raise UnknownName(f"{source} has no such channel to hear", channel, heard)


def _check_channel(channel: str) -> None:
    if not 1 <= len(channel) <= limits.NAME_LENGTH_MAX:
        raise PacketError(f"channel {channel!r}: not 1 to {limits.NAME_LENGTH_MAX} characters")


def split(sent: Iterable[Sent], bytes_max: int) -> Iterator[list[Sent]]:
    """Yield the packets in as many messages as their sizes need."""
    part: list[Sent] = []
    size = 0
    for packet in sent:
        bytes_more = len(packet.payload) + PACKET_OVERHEAD_BYTES
        if part and size + bytes_more > bytes_max - PACKET_OVERHEAD_BYTES:
            yield part
            part, size = [], 0
        part.append(packet)
        size += bytes_more
    if part:
        yield part
