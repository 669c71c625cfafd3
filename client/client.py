"""Library for programs and interactive use: connect to a run, read its robots, command them, send and receive packets.

    with connect("run:newest", "hand") as client:
        client.subscribe("red.attack", "encoder")
        robot = client.robots["red.attack"]
        for tick in client.lockstep(100):
            sample = robot.sensors["encoder"]
            client.command({"red.attack": {"slide": 0.05, "spin": 0.0}})

The name is one that the deployment declares under `clients`. In `lockstep` the run waits at each of the client's ticks
until the loop's body is done; after `listen` it continues by itself. Everything travels as packets through the emulated
network: packets arrive late, and some are lost. Lengths are in m, angles in rad, times in simulated ns, in the world's
frame (origin on the floor in the middle, z up). A client belongs to one thread.

Programs with an event loop of their own do not wait in `receive`: with `connect(..., notify=callback)` they call
`receive(0.0)` after a callback and at `deadline_s()` (docs/how-to/write_a_player.md).
"""

from __future__ import annotations

import logging
import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from foosim.client.commands import CommandEncoder
from foosim.client.core import NEVER_NS, ClientCore, ClientStatistics
from foosim.client.errors import (
    ConnectionFailed,
    ConnectionRefused,
    JobUnfinished,
    NotJoined,
    PacketError,
    RunEnded,
)
from foosim.client.jobs import Job, Jobs
from foosim.client.packets import check_packet, check_subscription
from foosim.client.player import Commands, Packet, Sample, metric_of
from foosim.client.playing import NS_PER_S, Newest
from foosim.common import limits
from foosim.common.closable import Closable
from foosim.common.errors import BadValue, Malformed, UnknownName
from foosim.common.names import is_name
from foosim.deployment.channel_kinds import channel_codec, channels_of
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.channels import VHUB, Plane
from foosim.protocol.messages import Received
from foosim.runtime.process import new_boot
from foosim.runtime.transport.inbox import Inbox
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.payloads import Field, Value

if TYPE_CHECKING:
    from foosim.runtime.transport.session import Session

CONNECT_S: Final = 10.0
RUN: Final = "run:"
"""Before the name of a run in an address."""
NEWEST: Final = "newest"
_LOG: Final = logging.getLogger("foosim.client")
_LOG.addHandler(logging.NullHandler())

AGAIN_S: Final = 0.05
"""Wall time after which a client that waits for a job looks whether a command is to be sent again."""

T = TypeVar("T")
Turns = tuple[int, int, tuple[tuple[str, str], ...]]
"""Period and offset in ticks, and at the arrival of what a client acts."""


@dataclass(frozen=True, slots=True)
class Arrived:
    """One packet that has reached the client. `sent_ns` and `due_ns` are simulated time."""

    source: str
    channel: str
    sequence: int
    """Grows with each packet of its source; a packet that the network delivers twice has it twice."""
    sent_ns: int
    due_ns: int
    payload: bytes
    value: Value | None
    """The decoded payload: the bytes themselves on `echo` and from other clients, None when it has no value."""


class Named(Generic[T]):
    """Things by name, in name order; a name that does not exist raises UnknownName with the nearest one."""

    def __init__(self, what: str, names: Iterable[str], make: Callable[[str], T]) -> None:
        self._what = what
        self._names = sorted(names)
        self._make = make

    def __getitem__(self, name: str) -> T:
        if name not in self._names:
            raise UnknownName(self._what, name, self._names)
        return self._make(name)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class CalledJob:
    """A job of this client, which waits for it."""

    def __init__(self, client: Client, job: Job) -> None:
        self._client, self._job = client, job

    @property
    def number(self) -> int | None:
        """Its number; None before it is sent, which waits for the first reading of the job sensor."""
        return self._job.number

    @property
    def state(self) -> JobState:
        """Its state by the newest reading; NONE before it is known to be taken."""
        return self._job.state

    @property
    def by(self) -> str:
        """Who commanded the robot after it, where that is known of a job that was preempted."""
        return self._job.by

    def cancel(self) -> None:
        """Call it off. Raises NotJoined, RunEnded."""
        self._job.cancel()
        self._client._send_jobs()

    def result(self, timeout_s: float | None = None) -> None:
        """Wait until it is done.

        After `listen` the time is wall time, and packets are taken as by `receive`; in lockstep it is simulated time,
        and the client goes from tick to tick as its loop would. Raises JobFailed, JobPreempted, JobCancelled,
        JobUnfinished when the time is over, RunEnded, NotJoined and ConnectionFailed.
        """
        self._client._wait_for(self._job, timeout_s)


class Actuator:
    """An actuator of a robot."""

    def __init__(self, client: Client, robot: str, channel: str) -> None:
        self._client = client
        self._robot = robot
        self._channel = channel

    @property
    def fields(self) -> tuple[Field, ...]:
        """The numbers of its commands, in their order, with their units."""
        return tuple(self._client._encoder.actuator(self._robot, self._channel).fields)

    def set(self, *numbers: Any, **named: Any) -> None:
        """Command the robot, by the numbers of a command in their order or by name: `set(slide=0.1, spin=0.0)`.

        `foosim components actuator KIND` explains the numbers of its kind. In lockstep a command is
        sent at the tick's end, and of several the last one counts; after `listen` it is sent at once. The robot keeps
        its last command. Raises BadValue for unknown fields and invalid numbers; NotJoined, RunEnded.
        """
        taker = self._client._encoder.actuator(self._robot, self._channel)
        if numbers and named:
            raise taker.wrong("numbers are given by name or in their order, not both")
        self._client._command(self._robot, self._channel, taker.pack(named or numbers))

    def call(self, *numbers: Any, **named: Any) -> CalledJob:
        """Give the actuator a job, by the numbers of a command as for `set`: `call(x=3.0, y=1.0).result(60.0)`.

        The command is sent again until the job sensor of the robot, to which the client has subscribed, reports that it
        was taken: in `receive` and `result`, or when a tick ends. It preempts the running job of any sender.
        Raises BadValue for an actuator without jobs or a sensor that reports them, and as `set` does; UnknownName
        without the subscription, NotJoined and RunEnded.
        """
        self._client._check_sending()
        jobs = self._client._jobs_of(self._robot, self._channel)
        job = jobs.call(*numbers, **named)
        self._client._commands.pop((self._robot, self._channel), None)
        self._client._send_jobs()
        return CalledJob(self._client, job)

    @property
    def job(self) -> CalledJob | None:
        """This client's last job: the one that it called, else, after a restart, the one that the sensor reports.

        Raises as `call`.
        """
        job = self._client._jobs_of(self._robot, self._channel).job
        return None if job is None else CalledJob(self._client, job)


class Robot:
    """One robot: its sensors and actuators, by the names in the deployment."""

    def __init__(self, client: Client, name: str) -> None:
        self.name: Final = name
        self._client = client
        robot = client.deployment.robots[name]

        def sensor(channel: str) -> Sample | None:
            return client._sample(name, channel)

        def actuator(channel: str) -> Actuator:
            return Actuator(client, name, channel)

        self.sensors: Final[Named[Sample | None]] = Named(f"{name} has no such sensor", robot.sensors, sensor)
        """The newest sample of each, None until one has come; its `value` is a reading of the sensor's kind."""
        self.actuators: Final[Named[Actuator]] = Named(f"{name} has no such actuator", robot.actuators, actuator)

    def send(self, channel: str, payload: bytes) -> None:
        """Send a packet to the robot; see `Client.send`."""
        self._client.send(self.name, channel, payload)


class Link:
    """The client's connection to the vHub: its core on a session, driven by the thread that waits."""

    def __init__(self, core: ClientCore, session: Session, notify: Callable[[], None] | None = None) -> None:
        from foosim.runtime.roles.loop import Loop
        from foosim.runtime.roles.role import Role
        from foosim.runtime.roles.wire import Wire

        self.core: Final = core
        self.locator: Final = session.locator
        self.closed = False
        self._session = session
        self._inbox = Inbox(limits.INBOX_MESSAGES_MAX, notify)
        self._until_ns = NEVER_NS
        self.wire = Wire(session, Plane.RADIO, self._inbox, core.name)
        self._role = Role(core.name, core, _LOG, lambda now_ns: max(now_ns, min(core.deadline_ns(), self._until_ns)))
        self._role.connect(self.wire)
        self._role.on_alive, self._role.stood = self._on_alive, core.rest
        self._loop = Loop(self._inbox, _LOG)
        self._loop.add(self._role)
        self.wire.read(channels.CLIENT_READS, channels.CLIENT_WAITS)

    def perform(self) -> None:
        """Write the core's log lines."""
        self._role.perform()

    def wait(self, reached: Callable[[], bool], timeout_s: float | None) -> None:
        """Go round until something is reached or the time is over.

        Waits for a lost vHub; raises ConnectionFailed when it does not return, ConnectionRefused when it returns with
        another run.
        """
        if self.closed:
            raise NotJoined("the client is closed")
        self._until_ns = NEVER_NS
        if timeout_s is not None:
            self._until_ns = time.monotonic_ns() + int(max(timeout_s, 0.0) * NS_PER_S)
        self._loop.go_round(sleeps=False)  # it learns until when the next one may sleep
        while True:
            if reached():
                return
            if self.core.refusal and self.core.deployment is not None:
                raise ConnectionRefused(f"{self.core.name} at {self.locator}: {self.core.refusal}")
            if self.core.lost:
                raise ConnectionFailed(f"lost the vHub at {self.locator}")
            if time.monotonic_ns() >= self._until_ns:
                return
            self._loop.go_round()

    def close(self) -> None:
        """Close the session."""
        self.closed = True
        self._session.close()

    def _on_alive(self, plane: Plane, name: str, is_alive: bool) -> None:
        if name == VHUB:
            (self.core.hub_here if is_alive else self.core.hub_gone)(time.monotonic_ns())


class Client(Closable):
    """One connection to a run. Made by `connect`; use it in `with`. When a lockstep client leaves, the run ends."""

    def __init__(self, link: Link, deployment: Deployment) -> None:
        """`link` has been let in; the client closes it."""
        self.name: Final = link.core.name
        self.deployment: Final = deployment
        """The run's deployment: the whole world in SI units."""
        self.packets: list[Arrived] = []
        """What has arrived with the last tick of `lockstep` or the last `receive`, in order of arrival."""
        robots = {name: Robot(self, name) for name in deployment.robots}
        self.robots: Final[Named[Robot]] = Named("unknown robot", robots, robots.__getitem__)
        self._core = link.core
        self._link = link
        self._subscriptions: set[tuple[str, str]] = set()
        self._newest = Newest({})
        self._period: int | None = None
        self._turns: Turns = (0, 0, ())
        """As it has joined."""
        self._commands: dict[tuple[str, str], Packet] = {}
        """By robot and channel."""
        self._encoder = CommandEncoder(deployment)
        self._outgoing: deque[Packet] = deque()
        self._jobs: dict[tuple[str, str], Jobs] = {}
        """By robot and channel of the actuator."""

    # --- description -------------------------------------------------------------------------------------------------

    @property
    def tick(self) -> int:
        """The newest tick that the vHub has named; -1 before the first. Its time is `tick * deployment.tick_ns`."""
        return self._core.tick

    @property
    def ended(self) -> bool:
        """Whether the run has ended."""
        return self._core.ended

    def statistics(self) -> ClientStatistics:
        """Return the account of the connection so far."""
        return self._core.statistics()

    # --- taking part -------------------------------------------------------------------------------------------------

    def subscribe(self, source: str, channel: str) -> None:
        """Subscribe to a robot's channel, or to another client's broadcasts on one; before `lockstep` or `listen`.

        Raises UnknownName, PacketError for an invalid channel, NotJoined.
        """
        check_subscription(self.deployment, source, channel)
        if self._period is not None and (source, channel) not in self._subscriptions:
            raise NotJoined(f"subscribe to {source} {channel} before lockstep() or listen(): it has joined")
        self._subscriptions.add((source, channel))

    def lockstep(self, rate_hz: float | Fraction | None = None) -> Iterator[int]:
        """Take part in lockstep: yield each of the client's ticks while the run waits, until the run ends.

        `rate_hz` is a whole number of ticks; None is the rate, with its offset, that the deployment declares. The
        client joins when the loop begins. What the loop's body sends leaves when the loop comes round or is left; a
        client that does not continue holds the run, up to the deployment's deadline. Where a machine was lost with the
        run's last ticks, the run continues from before them: lower ticks come again, and the log has a line. Raises
        BadValue for a rate, NotJoined, ConnectionFailed, and PacketError for more packets than one answer takes.
        """
        turns = self._turns_at(rate_hz)
        if self._period is not None and self._turns != turns:
            raise NotJoined("lockstep at another rate, or after listen(): a client joins once")
        return self._ticks(turns)

    def listen(self, subscriptions: Iterable[tuple[str, str]] = ()) -> None:
        """Take part outside of lockstep, and receive these (endpoint, channel) in addition to `subscribe`.

        The vHub admits the client at a tick soon after; packets sent before that are lost. Raises UnknownName and
        NotJoined.
        """
        for source, channel in subscriptions:
            self.subscribe(source, channel)
        if self._period:
            raise NotJoined("listen() after lockstep(): a client joins once")
        self._join((0, 0, ()))

    # --- packets -----------------------------------------------------------------------------------------------------

    def command(self, commands: Commands) -> None:
        """Command robots, by name: `{"robot-1": {"v": 0.5, "w": 0.0}}`; see `Actuator.set`.

        Raises UnknownName for a robot or an actuator, BadValue for unknown fields and invalid numbers; NotJoined,
        RunEnded.
        """
        for robot, command in sorted(commands.items()):
            for channel, payload in self._encoder.encode(robot, command):
                self._command(robot, channel, payload)

    def send(self, destination: str, channel: str, payload: bytes) -> None:
        """Send opaque bytes to a robot's (or another client's) channel; to an empty destination: see `broadcast`.

        After `listen` at once, in lockstep with the tick. Delivery is not confirmed. Raises UnknownName
        for a destination, PacketError for a size, NotJoined, RunEnded and ConnectionFailed.
        """
        packet = Packet(destination, channel, bytes(payload))
        check_packet(self.deployment, packet)
        self._check_sending()
        if self._period:
            if len(self._outgoing) + len(self._commands) >= limits.PACKETS_PER_MESSAGE_MAX:
                raise PacketError(f"more than {limits.PACKETS_PER_MESSAGE_MAX} packets at one tick")
            self._outgoing.append(packet)
            return
        self._core.send([packet], time.monotonic_ns())
        self._link.perform()

    def broadcast(self, channel: str, payload: bytes) -> None:
        """Send opaque bytes to all subscribers of this client's channel; otherwise as `send`.

        Each of them is one packet on a link of its own: some may get it, others not.
        """
        self.send("", channel, payload)

    def report(self, name: str, value: float) -> None:
        """Report a metric, a number of the run's result, of which the last value counts; see `Turn.report`.

        In lockstep it is sent with the tick. Raises BadValue for an invalid name or value and for too many names,
        NotJoined, RunEnded.
        """
        self._check_sending()
        self._core.report({name: metric_of(name, value)})
        self._link.perform()

    def receive(self, timeout_s: float = 1.0) -> list[Arrived]:
        """After `listen`: return the arrived packets, after at most `timeout_s` of wall time.

        The list is empty when nothing has. Sensors have their new samples with it. Raises RunEnded once the run is over
        and all has been taken, NotJoined and ConnectionFailed.
        """
        if self._period != 0:
            raise NotJoined("receive() after listen(); in lockstep the packets are in client.packets")
        core = self._core
        self._send_jobs()
        self._link.wait(lambda: bool(core.arrivals) or core.ended, timeout_s)
        if core.ended and not core.arrivals:
            raise RunEnded("the run is over")
        self._take(core.arrivals)
        core.arrivals.clear()
        return self.packets

    def deadline_s(self) -> float:
        """When `receive` has something to do next without a message, by `time.monotonic`; infinite for never."""
        due_ns = self._core.deadline_ns()
        due_s = inf if due_ns == NEVER_NS else due_ns / NS_PER_S
        is_waiting = any(jobs.job is not None and not jobs.job.state.has_ended for jobs in self._jobs.values())
        return min(due_s, time.monotonic() + AGAIN_S) if is_waiting else due_s

    # --- the end -----------------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Leave the run. One that is in lockstep ends it, if it is not over."""
        self._link.close()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _turns_at(self, rate_hz: float | Fraction | None) -> Turns:
        offset, arrivals = 0, list[tuple[str, str]]()
        if rate_hz is None:
            spec = self.deployment.clients.get(self.name) or self.deployment.players.get(self.name)
            rate_hz = None if spec is None else spec.rate_hz
            offset = 0 if spec is None else spec.offset_ns // self.deployment.tick_ns
            arrivals = self.deployment.arrivals_of(self.name)
        if rate_hz is None:
            raise BadValue(f"no rate for lockstep, and the deployment declares none for {self.name}", rate_hz)
        try:
            # As it is written: 0.1 is a tenth, not the binary number that is nearest to it.
            rate = rate_hz if isinstance(rate_hz, Fraction) else Fraction(str(rate_hz))
        except ValueError:
            raise BadValue("not a rate in Hz", rate_hz) from None
        if rate <= 0:
            raise BadValue("not a rate above 0 Hz", rate_hz)
        return self.deployment.ticks(rate), offset, tuple(arrivals)

    def _ticks(self, turns: Turns) -> Iterator[int]:
        core = self._core
        if self._period is None:
            self._join(turns)
        while True:
            self._link.wait(lambda: core.go is not None or core.ended, None)
            if core.go is None:
                return
            self._take(core.go.packets)
            try:
                yield core.go.tick
            finally:
                # A loop that an error ends is closed late or never: a client that is gone has nothing to answer.
                if not self._link.closed:
                    self._answer()

    def _answer(self) -> None:
        """Send the packets and commands of the loop's body, commands last and in their robots' name order."""
        packets = [*self._outgoing, *self._due_jobs(), *(command for _, command in sorted(self._commands.items()))]
        self._outgoing.clear()
        self._commands.clear()
        if self._core.go is None:  # the run has ended since
            return
        self._core.done(packets)
        self._link.perform()

    def _jobs_of(self, robot: str, channel: str) -> Jobs:
        """Return this client's jobs of an actuator, as far as they are known."""
        found = self._jobs.get((robot, channel))
        if found is None:
            found = Jobs(self.deployment, self.name, robot, channel)
            self._sample(*found.heard)  # raises without the subscription
            found.hear(self._newest.samples)
            self._jobs[robot, channel] = found
        return found

    def _due_jobs(self) -> list[Packet]:
        tick = max(self.tick, 0)
        due = [(jobs.robot, jobs.actuator, jobs.payload(tick)) for _, jobs in sorted(self._jobs.items())]
        return [Packet(robot, channel, payload) for robot, channel, payload in due if payload is not None]

    def _send_jobs(self) -> None:
        """After `listen`: send the due commands of jobs; in lockstep they are sent with the tick."""
        if self._period == 0 and not self._core.ended:
            for packet in self._due_jobs():
                self.send(*packet)

    def _wait_for(self, job: Job, timeout_s: float | None) -> None:
        tick, begun_s = self.tick, time.monotonic()
        while not job.check():
            passed_s = (self.tick - tick) * self.deployment.tick_ns / NS_PER_S
            if not self._period:
                passed_s = time.monotonic() - begun_s
            if timeout_s is not None and passed_s >= timeout_s:
                raise JobUnfinished(f"{job.what}: job {job.number} has not ended within {timeout_s:g} s")
            if self._period:
                self._next_tick()
            else:
                self.receive(AGAIN_S)

    def _next_tick(self) -> None:
        """In the body of a loop in lockstep: answer its tick, and continue to the next one."""
        core = self._core
        self._check_sending()
        self._answer()
        self._link.wait(lambda: core.go is not None or core.ended, None)
        if core.go is None:
            raise RunEnded("the run is over")
        self._take(core.go.packets)

    def _join(self, turns: Turns) -> None:
        period, offset, arrivals = turns
        self._subscriptions.update(arrivals)
        pairs = sorted(self._subscriptions)
        self._newest = Newest(channels_of(self.deployment, pairs))
        self._core.join(period, pairs, offset, arrivals)
        self._period, self._turns = period, turns
        self._link.perform()

    def _command(self, robot: str, channel: str, payload: bytes) -> None:
        if self._period:
            self._check_sending()
            self._commands[robot, channel] = Packet(robot, channel, payload)
        else:
            self.send(robot, channel, payload)

    def _check_sending(self) -> None:
        if self._link.closed:
            raise NotJoined("the client is closed")
        if self._core.ended:
            raise RunEnded("the run is over")
        if self._period is None:
            raise NotJoined("the client has not joined: call lockstep() or listen() before sending")

    def _sample(self, robot: str, channel: str) -> Sample | None:
        if self._period is not None and (robot, channel) not in self._subscriptions:
            subscribed = [name for owner, name in self._subscriptions if owner == robot]
            raise UnknownName(f"not subscribed to this channel of {robot}", channel, subscribed)
        return self._newest.samples.get((robot, channel))

    def _take(self, received: Iterable[Received]) -> None:
        received = list(received)
        self._newest.take(received)
        for jobs in self._jobs.values():
            jobs.hear(self._newest.samples)
        self.packets = [self._packet(packet) for packet in received]

    def _packet(self, packet: Received) -> Arrived:
        value: Value | None = packet.payload
        if packet.source in self.deployment.robots:
            try:
                codec = channel_codec(self.deployment, packet.source, packet.channel)
                value = packet.payload if codec is None else codec.decode(packet.payload)
            except (UnknownName, Malformed):
                value = None
        return Arrived(
            packet.source, packet.channel, packet.sequence, packet.sent_ns, packet.due_ns, packet.payload, value
        )


def _address_of(name: str) -> str:
    """Return the address of the radio plane of a run of this user. Raises NoRun."""
    from foosim.runtime.run_folder import NoRun, find_run

    folder = find_run(None if name == NEWEST else name)
    info = folder.info()
    if info is None or not info.radio:
        raise NoRun(f"run {folder.name} is starting, and its vHub does not listen yet")
    return info.radio


def connect(
    address: str,
    name: str,
    world: str = "",
    timeout_s: float = CONNECT_S,
    pki: str | os.PathLike[str] | None = None,
    notify: Callable[[], None] | None = None,
) -> Client:
    """Connect to a run as the declared client `name`.

    `address` is `run:newest` or `run:NAME` for a run of this user on this machine, else that of the vHub's radio plane,
    `tcp/HOST:PORT`. `world` refuses any other world than this one. With certificates the address is `tls/HOST:PORT`,
    and `pki` the folder with the root ca.pem and the client's own client.NAME.pem and client.NAME.key. `notify` is
    called, in another thread, when something has come for `receive`, and not again before that is called; it returns at
    once, as `loop.call_soon_threadsafe` does, since other messages wait for it.

    Raises BadValue for an invalid name or address, CertificateError for a folder without valid certificates, NoRun
    without such a live run, ConnectionFailed without an answer within `timeout_s` (wall time), NotAuthorised and
    ConnectionRefused, with the reason, when the vHub rejects the client.
    """
    if not is_name(name):
        raise BadValue("not a name for a client", name)
    if address.startswith(RUN):
        address = _address_of(address.removeprefix(RUN))
    from foosim.runtime.file_cache import FileCache
    from foosim.runtime.transport.certificates import load_credentials
    from foosim.runtime.transport.session import ConnectError, Session
    from foosim.runtime.transport.settings import Security

    credentials = load_credentials(None if pki is None else Path(pki), f"client.{name}")
    security = None if credentials is None else Security(credentials)
    begun_ns = time.monotonic_ns()
    try:
        session = Session.client(address, timeout_s, limits.RADIO_MESSAGE_BYTES_MAX, security=security)
    except ConnectError as error:
        raise ConnectionFailed(error.what) from None
    try:
        core = ClientCore(name, new_boot(), time.monotonic_ns(), world, FileCache())
        link = Link(core, session, notify)
        left_s = timeout_s - (time.monotonic_ns() - begun_ns) / NS_PER_S
        link.wait(lambda: core.deployment is not None or bool(core.refusal), left_s)
        if core.refusal:
            raise ConnectionRefused(f"{name} at {session.locator}: {core.refusal}")
        if core.deployment is None:
            who = "" if security is None else f", and is {security.credentials.identity} authorised?"
            raise ConnectionFailed(
                f"no vHub answers at {session.locator} within {timeout_s:g} s: is it the radio plane's address?{who}"
            )
        link.wire.declare_alive()
        link.wire.watch_alive(VHUB)
        return Client(link, core.deployment)
    except BaseException:
        session.close()
        raise
