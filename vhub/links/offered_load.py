"""The declared load of a deployment: the links that carry packets, and the packets per second of queues and airs.

Sensors are sent to the players that hear them, commands to the robots that a player drives, and messages of clients to
the players that hear them, at an undeclared rate. Pure: used by `lint`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from math import inf
from typing import Final

from foosim.common.limits import FRAMES_MAX
from foosim.deployment.network.impairments import Queue
from foosim.deployment.network.link_settings import Profile, Profiles
from foosim.deployment.schema import Deployment
from foosim.vhub.network.mtu import frame_count, longest_of
from foosim.world.component_types.per_field import payload_bytes
from foosim.world.component_types.settings import SensorSettings
from foosim.world.spec import Schedule

Key = tuple[str, str]
"""Settings that links share: the rule and the radio."""
Pair = tuple[str, str]
TICKS: Final = 2000
"""The ticks that are searched for sensors that are due together."""


@dataclass(frozen=True, slots=True)
class Flow:
    """The packets of one endpoint to another on one channel."""

    profile: Profile
    source: str
    destination: str
    channel: str
    rate_hz: float
    """As declared, 0 where it is not."""
    frames: int = 1
    """In how many frames each of them travels at most, where its size is known."""

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
        return self.channel != "" and self.profile.settings.sends_once


def flows_of(deployment: Deployment, profiles: Profiles) -> Iterator[Flow]:
    """Yield the declared load; commands are on channel ''."""
    for player, spec in deployment.players.items():
        for source, channel in deployment.heard_by(player):
            robot = deployment.robots.get(source)
            sensor = None if robot is None else robot.sensors.get(channel)
            rate_hz = 0.0 if sensor is None else float(sensor.rate_hz)
            flow = Flow(profiles.find(source, player, channel), source, player, channel, rate_hz)
            size = max([size for _, size in _sizes(deployment, flow)], default=0)
            yield replace(flow, frames=frame_count(size, flow.profile.settings.payload_max))
        for name in spec.robots:
            if deployment.robots[name].actuators:
                yield Flow(profiles.find(player, name, ""), player, name, "", float(spec.rate_hz))


def used_links(flows: Iterable[Flow]) -> dict[Key, set[Pair]]:
    """Return the directed pairs that carry packets, by their settings."""
    found: dict[Key, set[Pair]] = {}
    for flow in flows:
        found.setdefault(flow.key, set()).add((flow.source, flow.destination))
    return found


def offered_hz(flows: Iterable[Flow]) -> dict[tuple[Key, bool], float]:
    """Return the frames per second on an air, or without one of the busiest queue: by settings, broadcasts apart."""
    once = {
        (flow.key, flow.queue, "" if flow.is_once_for_all else flow.destination, flow.channel): flow for flow in flows
    }
    queues: dict[tuple[Key, bool], dict[str, float]] = {}
    for flow in once.values():
        of_key = queues.setdefault((flow.key, flow.is_once_for_all), {})
        queue = "" if flow.profile.settings.is_on_air else flow.queue
        of_key[queue] = of_key.get(queue, 0.0) + flow.rate_hz * flow.frames
    return {key: max(rates.values()) for key, rates in queues.items()}


def long_packets(deployment: Deployment, flows: Iterable[Flow]) -> dict[Key, str]:
    """Return a warning of the channels whose packets a link never carries, by settings of links."""
    found: dict[Key, dict[str, int]] = {}
    limits: dict[Key, str] = {}
    for flow in flows:
        settings = flow.profile.settings
        in_queue, in_frames = settings.queue.bytes_max if settings.has_queue else inf, longest_of(settings) or inf
        limit = min(in_queue, in_frames)
        limits[flow.key] = (
            f"the queue of {in_queue} B"
            if in_queue <= in_frames
            else f"{FRAMES_MAX} frames of {settings.payload_max} B"
        )
        for channel, size in _sizes(deployment, flow):
            if size > limit:
                found.setdefault(flow.key, {})[channel] = size
    texts = {}
    for key, channels in found.items():
        named = ", ".join(f"{channel} ({size} B)" for channel, size in sorted(channels.items()))
        what = f"all packets that do not fit into {limits[key]} are dropped: {named}"
        texts[key] = f"{what}; fewer numbers, a smaller picture or a greater limit help"
    return texts


def crowded_queues(deployment: Deployment, flows: Iterable[Flow]) -> dict[Key, str]:
    """Return a warning of sensors of a robot whose packets of one tick overflow a queue, by settings of links."""
    queues: dict[tuple[Key, str], tuple[Queue, dict[str, tuple[Schedule, int]]]] = {}
    for flow in flows:
        its, to = flow.profile.settings, "" if flow.is_once_for_all else f" to {flow.destination}"
        for channel, size in _sizes(deployment, flow) if flow.channel and its.has_queue else ():
            schedule = deployment.schedule(deployment.robots[flow.source].sensors[flow.channel])
            sent = queues.setdefault((flow.key, flow.queue), (its.queue, {}))[1]
            sent[channel + to] = schedule, size + its.overhead_bytes * flow.frames
    texts: dict[Key, str] = {}
    for (key, _), (queue, sent) in queues.items():
        most, room = queue.packets, queue.bytes_max
        is_tight = len(sent) > most or sum(size for _, size in sent.values()) > room
        for tick in range(TICKS if is_tight else 0):
            due = {one: size for one, (its, size) in sent.items() if size <= room and its.is_due(tick)}
            if len(due) > most or sum(due.values()) > room:
                named = ", ".join(f"{channel} ({size} B)" for channel, size in due.items())
                what = f"packets of one tick that overflow the queue ({room} B, {most} packets) are dropped: {named}"
                texts[key] = f"{what}; an offset of some of these sensors, smaller packets or a greater queue help"
                break
    return texts


def warnings_of(deployment: Deployment) -> list[str]:
    """Return these warnings of a deployment, with the names of links' settings."""
    flows = [*flows_of(deployment, deployment.profiles())]
    found = [*long_packets(deployment, flows).items(), *crowded_queues(deployment, flows).items()]
    return [f"{rule if radio in ('', rule) else f'{rule} via {radio}'}: {text}" for (rule, radio), text in found]


def _sizes(deployment: Deployment, flow: Flow) -> Iterator[tuple[str, int]]:
    """Yield the channels of a flow, `robot channel`, and how long their packets are at most."""
    is_command = flow.channel == ""
    name = flow.destination if is_command else flow.source
    robot = deployment.robots.get(name)
    if robot is None:
        return
    for channel, settings in sorted((robot.actuators if is_command else robot.sensors).items()):
        if is_command or channel == flow.channel:
            counts = robot.component_type.fields_of(robot, deployment)
            size = settings.carried_bytes if isinstance(settings, SensorSettings) else None
            if size is None:
                size = payload_bytes(settings.component_type, settings, counts)
            if size is not None:
                yield f"{name} {channel}", size
