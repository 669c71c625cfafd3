"""The declared load of a deployment: the links that carry packets, and the packets per second of queues and airs.

Sensors are sent to the players that hear them, commands to the robots that a player drives, and what clients say to the
players that hear it, at a rate that is not declared. Pure: `lint` asks.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from foosim.deployment.network.link_settings import Profile, Profiles
from foosim.deployment.schema import Deployment

Key = tuple[str, str]
"""Settings that links share: the rule and the radio."""
Pair = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Flow:
    """The packets of one endpoint to another on one channel."""

    profile: Profile
    source: str
    destination: str
    channel: str
    rate_hz: float
    """As declared, 0 where it is not."""

    @property
    def key(self) -> Key:
        return self.profile.rule, self.profile.radio

    @property
    def queue(self) -> str:
        """Its queue: the link's own, else the sender's."""
        return f"{self.source}>{self.destination}" if self.profile.is_own_queue else self.source

    @property
    def is_once_for_all(self) -> bool:
        """Whether the radio broadcasts it: it is sent once for all receivers."""
        return self.channel != "" and self.profile.settings.is_on_air and self.profile.settings.published == "broadcast"


def flows_of(deployment: Deployment, profiles: Profiles) -> Iterator[Flow]:
    """Yield the declared load; commands are on channel ''."""
    for player, spec in deployment.players.items():
        for source, channel in deployment.heard_by(player):
            robot = deployment.robots.get(source)
            sensor = None if robot is None else robot.sensors.get(channel)
            rate_hz = 0.0 if sensor is None else float(sensor.rate_hz)
            yield Flow(profiles.find(source, player, channel), source, player, channel, rate_hz)
        for name in spec.robots:
            if deployment.robots[name].actuators:
                yield Flow(profiles.find(player, name, ""), player, name, "", float(spec.rate_hz))


def used_links(flows: Iterable[Flow]) -> dict[Key, set[Pair]]:
    """Return the directed pairs that carry packets, by their settings."""
    found: dict[Key, set[Pair]] = {}
    for flow in flows:
        found.setdefault(flow.key, set()).add((flow.source, flow.destination))
    return found


def offered_hz(flows: Iterable[Flow]) -> dict[Key, float]:
    """Return the packets per second on an air, or without one of the busiest queue, by settings."""
    once = {
        (flow.key, flow.queue, "" if flow.is_once_for_all else flow.destination, flow.channel): flow for flow in flows
    }
    queues: dict[Key, dict[str, float]] = {}
    on_air: dict[Key, bool] = {}
    for flow in once.values():
        of_key = queues.setdefault(flow.key, {})
        of_key[flow.queue] = of_key.get(flow.queue, 0.0) + flow.rate_hz
        on_air[flow.key] = flow.profile.settings.is_on_air
    return {key: sum(rates.values()) if on_air[key] else max(rates.values()) for key, rates in queues.items()}
