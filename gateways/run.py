"""A run as gateways see it: components, commands, jobs, and packets between robots.

It has no clock, socket or thread: packets that have arrived are handed to it, and packets leave by a function, so tests
drive it with the packets of a simulation in their own process.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from foosim.client.commands import CommandEncoder
from foosim.client.jobs import Job, Jobs
from foosim.client.player import Packet
from foosim.client.playing import Newest
from foosim.common.errors import Malformed, Refused
from foosim.common.json_text import decode_json, encode_json
from foosim.deployment.channel_kinds import channels_of
from foosim.deployment.schema import Deployment
from foosim.gateways.components import RADIO, RECEIVED, components_of, robots_of
from foosim.gateways.rows import Component, Effect, Fields, Order, call, command, reading
from foosim.protocol.messages import Received
from foosim.world.component_types.jobs import JobState

MEASURED: Final = "measured"
"""The channel of packets to the gateway's own client with what real sensors have measured."""
Send = Callable[[str, Packet], None]
"""Sends a packet of the client with a name."""


@dataclass(slots=True, eq=False)
class Called:
    """A service that takes time; when its job has ended `ended` is called. `answer` is that of one that is done."""

    component: Component
    job: Job
    answer: Any
    ended: Callable[[Called], None]


class Listener:
    """What follows a run. The hooks do nothing."""

    def arrived(self, component: Component) -> None:
        """A reading has arrived: its fields are in `component.fields`, its time in `component.time_ns`."""

    def draws(self, component: Component) -> bool:
        """Whether a reading of a camera is drawn when it arrives; else it is at the request of a service."""
        return False

    def advanced(self) -> None:
        """The newest tick that is known, `Run.tick`, has changed."""


class Run:
    """The run of a gateway."""

    def __init__(
        self,
        deployment: Deployment,
        name: str,
        send: Send,
        proceed: Callable[[], None],
    ) -> None:
        """`name` is the gateway's. `proceed` continues the tick that waits for it."""
        self.deployment: Final = deployment
        self.name: Final = name
        self.settings: Final = deployment.gateways[name]
        self.proceed: Final = proceed
        self.tick = -1
        """The newest that is known."""
        self.listeners: Final[list[Listener]] = []
        self.clients: Final = self.settings.clients(name)
        """The names of the gateway's clients by robot; its own one is that of no robot."""
        self.robots: Final = robots_of(deployment, self.settings)
        """By the name that programs know."""
        found = components_of(deployment, self.settings)
        self.components: Final = {one.full: one for one in found.values()}
        """By MORSE's names, `ROBOT.COMPONENT`, of labels where there are any."""
        self._by_channel = {(one.robot, one.channel): one for one in found.values()}
        self._channels = channels_of(deployment, [pair for robot in self.clients for pair in self.heard(robot)])
        self._reports = Newest({pair: its for pair, its in self._channels.items() if pair not in self._by_channel})
        self._jobs: dict[str, Jobs] = {}
        self._called: list[Called] = []
        self._paused: dict[str, tuple[Fields, list[Called]]] = {}
        """By component the fields before it was paused, and the services that wait."""
        self._encoder, self._send, self._log = CommandEncoder(deployment), send, logging.getLogger(name)

    @property
    def time_s(self) -> float:
        """The simulated time of the newest tick that is known."""
        return max(self.tick, 0) * self.deployment.tick_ns / 1e9

    def heard(self, robot: str) -> Iterator[tuple[str, str]]:
        """Yield the (endpoint, channel) to which the client on board of a robot subscribes."""
        if robot:
            yield from ((robot, channel) for channel in self.deployment.robots[robot].sensors)

    # --- from the run -------------------------------------------------------------------------------------------------

    def arrived(self, robot: str, packets: Iterable[Received], tick: int) -> None:
        """Take the packets of the client on board of a robot in order of arrival, and the newest tick."""
        packets = list(packets)
        for packet in packets:
            component = self._by_channel.get((packet.source, packet.channel))
            if component is not None:
                self._measured(component, packet)
            elif packet.channel == RADIO:
                self._received(robot, packet)
        self._reports.take(packets)
        if tick > self.tick:
            self.tick = tick
            for listener in self.listeners:
                listener.advanced()
        if self._called:
            self._look_at_jobs()

    def _measured(self, component: Component, packet: Received) -> None:
        codec, _ = self._channels[packet.source, packet.channel]
        assert codec is not None, "sensors have a codec"
        try:
            value = codec.decode(packet.payload)
        except Malformed as malformed:
            self._log.warning("%s: %s", component.full, malformed)
            return
        if component.is_drawn and not any(listener.draws(component) for listener in self.listeners):
            component.undrawn, component.time_ns = value, packet.sent_ns
            return
        component.undrawn = None
        fields = reading(component, value, packet.sent_ns)
        if fields is not None:
            self._deliver(component, fields, packet)

    def _received(self, robot: str, packet: Received) -> None:
        sender = next((robot for robot, client in self.clients.items() if client == packet.source), "")
        component = self._by_channel.get((robot, RECEIVED))
        try:
            data = decode_json(packet.payload)
        except Malformed as malformed:
            self._log.warning("a packet to %s: %s", robot, malformed)
            return
        if component is not None:
            label = next((label for label, robot in self.robots.items() if robot == sender), packet.source)
            self._deliver(component, {"from": label, "data": data}, packet)

    def _deliver(self, component: Component, fields: Fields, packet: Received) -> None:
        component.fields, component.time_ns = fields, packet.sent_ns
        component.count += 1
        for listener in self.listeners:
            listener.arrived(component)

    # --- to the run ---------------------------------------------------------------------------------------------------

    def command(self, component: Component, given: Mapping[str, Any]) -> None:
        """Send a command by its fields; omitted ones keep their values. Raises Refused."""
        fields, numbers = command(component, given)
        if component.row.kind == RADIO:
            packet = self._radio(component, fields)
        else:
            payload = self._encoder.actuator(component.robot, component.channel).pack(numbers)
            packet = Packet(component.robot, component.channel, payload)
        self._send(self.clients[component.robot], packet)
        component.fields = fields
        component.count += 1

    def _radio(self, component: Component, fields: Fields) -> Packet:
        to = fields["to"]
        if not isinstance(to, str) or to not in self.robots:
            raise Refused(f"{component.full}: no robot {to!r} has a radio here (valid are: {', '.join(self.robots)})")
        return Packet(self.clients[self.robots[to]], RADIO, encode_json(fields["data"]))

    def measured(self, component: Component, fields: Fields) -> None:
        """Enter what a real sensor in place of this one has measured into the capture, by its row's fields."""
        data = {"sensor": f"{component.robot}.{component.channel}", **fields}
        self._send(self.clients[component.robot], Packet(self.clients[""], MEASURED, encode_json(data)))

    def call(
        self, component: Component, service: str, parameters: list[Any], ended: Callable[[Called], None]
    ) -> Called | Any:
        """Call a service: return its answer, or what takes time, for which `ended` is called when it has ended.

        Raises Refused, with the texts of MORSE.
        """
        result = call(component, service, parameters)
        if not isinstance(result, Order):
            return result
        if result.effect is Effect.JOB:
            return self._begin(component, result, ended)
        if result.effect is Effect.START:
            self._begin(component, result, lambda called: None)
        elif result.effect is Effect.PAUSE:
            self._pause(component, result)
        elif result.effect is Effect.RESUME:
            self._resume(component)
        else:
            self.command(component, result.fields)
        return result.answer

    def _pause(self, component: Component, order: Order) -> None:
        """Command a stop that leaves the service of the running job without an answer."""
        before, jobs = component.fields, self._jobs.get(component.full)
        if before is None or component.full in self._paused:
            return
        waiting = [called for called in self._called if jobs is not None and called.job is jobs.job]
        self._called = [called for called in self._called if called not in waiting]
        if jobs is None:
            self.command(component, order.fields)
        else:
            self._begin(component, order, lambda called: None)
        self._paused[component.full], component.status = (before, waiting), "Stop"

    def _resume(self, component: Component) -> None:
        """Give the command again that was paused, and its job."""
        fields, waiting = self._paused.pop(component.full, (None, []))
        if fields is not None and component.full not in self._jobs:
            self.command(component, fields)
        elif fields is not None:
            job = self._begin(component, Order(fields), lambda called: None).job
            for called in waiting:
                called.job = job
            self._called += waiting

    def _begin(self, component: Component, order: Order, ended: Callable[[Called], None]) -> Called:
        fields, numbers = command(component, order.fields, order.numbers)
        client = self.clients[component.robot]
        jobs = self._jobs.get(component.full)
        if jobs is None:
            jobs = self._jobs[component.full] = Jobs(self.deployment, client, component.robot, component.channel)
            jobs.hear(self._reports.samples)
        called = Called(component, jobs.call(**numbers), order.answer, ended)
        component.fields, component.status = fields, "Transit"
        self._called += self._paused.pop(component.full, (None, []))[1]
        self._called.append(called)
        self._look_at_jobs()
        return called

    @property
    def has_jobs(self) -> bool:
        """Whether a service takes time."""
        return bool(self._called)

    def fail(self, absent: Collection[str]) -> None:
        """End the services of robots that are absent."""
        for called in self._called:
            if called.component.robot in absent:
                called.job.state, called.job.why = JobState.FAILED, "its robot is absent"
        self._look_at_jobs()

    def cancel(self, called: Called) -> None:
        """Call a service off that takes time."""
        self._called += self._paused.pop(called.component.full, (None, []))[1]
        called.job.cancel()
        self._look_at_jobs()

    def _look_at_jobs(self) -> None:
        """Send commands of jobs that are due, and end services whose jobs have ended."""
        tick = max(self.tick, 0)
        for jobs in self._jobs.values():
            jobs.hear(self._reports.samples)
            payload = jobs.payload(tick)
            if payload is not None:
                self._send(self.clients[jobs.robot], Packet(jobs.robot, jobs.actuator, payload))
        over = [called for called in self._called if called.job.state.has_ended]
        self._called = [called for called in self._called if not called.job.state.has_ended]
        for called in over:
            newest = self._jobs[called.component.full].job
            if called.job is newest:
                called.component.status = "Arrived" if called.job.state == JobState.DONE else "Stop"
            called.ended(called)
