"""The declared packets that are longer than the mtu of their link, which drops them. Pure: `summary` asks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from foosim.deployment.network.link_settings import Profiles
from foosim.deployment.schema import Deployment
from foosim.vhub.links.offered_load import Flow, Key, flows_of
from foosim.world.forms import registry
from foosim.world.forms.per_field import payload_bytes


def long_packets(deployment: Deployment, flows: Iterable[Flow]) -> dict[Key, str]:
    """Return a warning of the channels whose packets are longer than an mtu, by settings of links."""
    found: dict[Key, dict[str, int]] = {}
    limits: dict[Key, int] = {}
    for flow in flows:
        limit = flow.profile.settings.payload_max
        if limit is None:
            continue
        limits[flow.key] = limit
        for channel, size in _sizes(deployment, flow):
            if size > limit:
                found.setdefault(flow.key, {})[channel] = size
    return {key: _warning(channels, limits[key]) for key, channels in found.items()}


def warnings_of(deployment: Deployment) -> list[str]:
    """Return these warnings of a deployment, with the names of links' settings."""
    found = long_packets(deployment, flows_of(deployment, Profiles(deployment.network, deployment.carriers())))
    return [
        f"{rule if radio in ('', rule) else f'{rule} via {radio}'}: {text}" for (rule, radio), text in found.items()
    ]


def _sizes(deployment: Deployment, flow: Flow) -> Iterator[tuple[str, int]]:
    """Yield the channels of a flow, `robot channel`, and how long their packets are at most."""
    is_command = flow.channel == ""
    name = flow.destination if is_command else flow.source
    robot = deployment.robots.get(name)
    if robot is None:
        return
    form = "actuator" if is_command else "sensor"
    for channel, settings in sorted((robot.actuators if is_command else robot.sensors).items()):
        if is_command or channel == flow.channel:
            component = registry.find_component(form, settings.kind)
            counts = registry.model_of(robot).fields_of(robot, deployment)
            size = payload_bytes(component, settings, counts)
            if size is not None:
                yield f"{name} {channel}", size


def _warning(channels: dict[str, int], limit: int) -> str:
    named = ", ".join(f"{channel} ({size} B)" for channel, size in sorted(channels.items()))
    return f"all packets longer than the mtu of {limit} B are dropped: {named}; fewer numbers or a greater mtu help"
