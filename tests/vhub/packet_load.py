"""A load of packets through the vHub's core, which is restarted on the way; each packet's fate is looked for.

Three free-running clients send to the table's robots, to a fourth client and to nobody, a thousand packets each tick,
over links that delay and lose; some are said twice, some are no messages, now and then one says more at once than an
inbox takes. A robot is down and the fourth client away for a while. Now and then the vHub dies, behind a closing or
amid a tick, and another one goes on from its journal; clients send again what it does not know. What they sent is
counted here, by number, and compared with the fates in the closings and with the vHub's account.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from foosim.common import limits
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.codec import decode_any, encode
from foosim.protocol.hub_messages import ResumeGrant
from foosim.protocol.messages import (
    Build,
    ClientHello,
    ClientWelcome,
    Commit,
    End,
    Epoch,
    Join,
    Samples,
    Sent,
    Subscription,
    Tempo,
    Up,
)
from foosim.simulation.journals import HubJournal
from foosim.vhub.core import HubCore
from foosim.vhub.network.packet import IN_FLIGHT
from foosim.vhub.state.capture_queue import RecordClosing
from foosim.vhub.state.hub_state import OUTBOX_SHIFT
from foosim.vhub.state.records import Closing
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.robot_packets import RobotPacket

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
RUN: Final = "packets"
CLIENTS: Final = ("client-1", "client-2", "client-3")
EAR: Final = "ear"
NOBODY: Final = "nobody"
SETS: Final = (
    "players={}",
    f"clients={{{', '.join(f'{name}: {{}}' for name in (*CLIENTS, EAR))}}}",
    "deadlines.client_back=100 ms",  # how far back a vHub that is started again has to fold
    "network.links=[{id: lossy, from: '*', to: '*', delay: 1 ms,"
    " jitter: {shape: gamma, mean: 0.3 ms, sd: 0.5 ms}, loss: 5 %}]",
)
PAYLOAD: Final = bytes(16)
REPEATED: Final = 5
"""Of the last packets, that a client says once more at each tick."""
GARBLED_EVERY: Final = 7
BURST_EVERY: Final = 1000
BURST_AT: Final = 400
BURST: Final = 9_500
"""Packets in each of seven messages, of which an inbox takes six."""
DOWN_EVERY: Final = 200
DOWN_TICKS: Final = 10
AWAY_EVERY: Final = 500
AWAY_AT: Final = 100
BACK_AT: Final = 130
DEATH_AT: Final = 37


@dataclass(frozen=True, slots=True)
class Load:
    """How much happens: the packets of each client at each tick, and how many ticks apart the vHub dies."""

    packets: int = 333
    deaths_every: int = 500


@dataclass(slots=True)
class Count:
    """What became of all packets. `asked` are those that were sent to the vHub, each as often as it was sent.

    `lost_in_crash` are those that a vHub had taken and not recorded when it died: they are sent again. `unexplained`
    are packets without a fate or with two, and whatever the accounts differ by.
    """

    asked: int = 0
    delivered: int = 0
    dropped: dict[str, int] = field(default_factory=dict)
    """By cause, as `refused`."""
    refused: dict[str, int] = field(default_factory=dict)
    in_flight: int = 0
    lost_in_crash: int = 0
    crashes: int = 0
    unexplained: int = 0
    ticks: int = 0


class Client:
    """A free-running client: its packets are numbered without a gap and kept until they are recorded."""

    def __init__(self, name: str, rods: list[str]) -> None:
        self.name = name
        self.last = 0
        """The number of the last packet that it has sent."""
        self._rods = rods
        self.fates = bytearray(1)
        """How many fates each number has."""

    def destination(self, number: int) -> str:
        if number % 50 == 7:
            return NOBODY
        return EAR if number % 10 == 3 else self._rods[number % len(self._rods)]

    def packets(self, first: int, end: int) -> list[Sent]:
        """Return the packets of some numbers; the same number is the same packet."""
        return [Sent(number, self.destination(number), "position", 0, PAYLOAD) for number in range(first, end)]

    def more(self, count: int) -> list[Sent]:
        """Return the next packets."""
        first, self.last = self.last + 1, self.last + count
        self.fates.extend(bytes(count))
        return self.packets(first, self.last + 1)

    def wrong(self) -> int:
        """Return how many of the packets have no fate or several, or one though they went to nobody."""
        right = (np.arange(self.last + 1) % 50 != 7).astype(np.uint8)
        right[0] = 0
        return int(np.count_nonzero(np.frombuffer(self.fates, np.uint8) != right))


class Talk:
    """Plays supervisor, nodes and clients to one vHub after another, and counts."""

    def __init__(self, load: Load) -> None:
        self._load = load
        self._text = apply_sets(TABLE.read_text(), TABLE.name, SETS)
        self.deployment = load_deployment(self._text, TABLE.name)
        self.count = Count()
        self._layout = build_layout(self.deployment)
        self._robots = [entity.name for entity in self._layout.robots]
        rods = [entity.name for entity in self._layout.of("rod")]
        self._clients = {name: Client(name, rods) for name in CLIENTS}
        self._sensed = [
            (robot, index, sensor)
            for robot in self._robots
            for index, sensor in enumerate(sorted(self.deployment.robots[robot].sensors))
        ]
        self._without_fate: set[tuple[str, int]] = set()
        """What robots sent to the ear, by robot and number."""
        self._numbers = np.array(initial_numbers(self.deployment, self._layout))
        (self._sampled_every,) = {
            self.deployment.ticks(sensor.rate_hz)
            for robot in self.deployment.robots.values()
            for sensor in robot.sensors.values()
        }
        self._journal = HubJournal()
        self._welcomes: dict[str, ClientWelcome] = {}
        self._unrecorded = 0
        """What this vHub has taken since its last closing."""
        self._tick = 0
        self._start()

    # --- the vHub ----------------------------------------------------------------------------------------------------

    def _start(self) -> None:
        """Start a vHub, which goes on from the journal if there is one; the clients come (back) to it."""
        core = self.core = HubCore(f"boot-{self.count.crashes}", bytes(32), 0)
        build = Build(VHUB, core.member.boot, "first", RUN, TABLE.name, self._text, "fast")
        self._say(channels.BUILD, VHUB, encode(build))
        core.begin(self._journal.past(core, RUN), 0)
        self._say(channels.RESUME_GRANT, VHUB, encode(ResumeGrant(VHUB, core.member.boot, 0)))
        self._perform()
        for name in (*self._clients, EAR):
            self._come(name, self.count.crashes)
        owners = [(robot, "n1") for robot in self._robots]
        self._say(channels.EPOCH, SUPERVISOR, encode(Epoch(1, 0, bytes(32), ["n1"], owners, b"")))
        self._say(channels.TEMPO, SUPERVISOR, encode(Tempo("fast", False)))

    def _come(self, name: str, returns: int) -> None:
        hello = ClientHello(name, "one", limits.PROTOCOL_VERSION, "", 0, returns)
        self._say(channels.CLIENT_HELLO, name, encode(hello))
        wanted = [Subscription(robot, sensor) for robot, _, sensor in self._sensed] if name == EAR else []
        self._say(channels.UP, name, encode(Join(name, "one", 0, wanted)))

    def _die(self) -> None:
        """End the vHub: what it had not written is gone. Clients send what the next one does not know."""
        self.count.crashes += 1
        self.count.lost_in_crash += self._unrecorded
        self._unrecorded = 0
        self.core.actions.clear()
        self._start()
        for name, client in self._clients.items():
            self._up_from(client, self._welcomes[name].sequence + 1)

    def _say(self, channel: channels.Channel, name: str, payload: bytes) -> None:
        self.core.receive(channel, name, payload, self._tick * self.deployment.tick_ns)
        if self.core.actions:
            self._perform()

    def _perform(self) -> None:
        """Perform as the vHub's process does; the capture is this count."""
        actions, self.core.actions[:] = [*self.core.actions], []
        for action in actions:
            if isinstance(action, Journal):
                self._journal.append(action.record)
            elif isinstance(action, RecordClosing):
                self._journal.captured_tick = action.closing.frame.tick
                self._take(action.closing)
            elif isinstance(action, Publish) and action.channel is channels.CLIENT_WELCOME:
                self._welcomes[action.name] = decode_any(ClientWelcome, action.payload)

    # --- what is sent ------------------------------------------------------------------------------------------------

    def _up(self, name: str, packets: list[Sent]) -> None:
        self.count.asked += len(packets)
        self._unrecorded += len(packets)
        self._say(channels.UP, name, encode(Up(name, "one", packets)))

    def _up_from(self, client: Client, first: int) -> None:
        """Send what a client has sent from a number on, once more or for the first time."""
        for begin in range(first, client.last + 1, BURST):
            self._up(client.name, client.packets(begin, min(begin + BURST, client.last + 1)))

    def _clients_say(self, tick: int) -> None:
        for place, (name, client) in enumerate(self._clients.items()):
            self._up_from(client, self._recorded(name) + 1)  # what was too much at the tick before
            self._up(name, client.packets(max(1, client.last - REPEATED + 1), client.last + 1))
            self._up(name, client.more(self._load.packets))
            if tick % GARBLED_EVERY == place:
                self.count.asked += 1
                self._unrecorded += 1
                self._say(channels.UP, name, b"\xc1no message")
        if tick % BURST_EVERY == BURST_AT:
            client = self._clients[CLIENTS[0]]
            client.more(7 * BURST)
            self._up_from(client, client.last - 7 * BURST + 1)
        if tick % AWAY_EVERY == AWAY_AT:
            self.core.client_gone(EAR, tick * self.deployment.tick_ns)
        elif tick % AWAY_EVERY == BACK_AT:
            self._come(EAR, 0)

    def _recorded(self, name: str) -> int:
        assert self.core.state is not None
        member = self.core.state.members.get(name)
        return 0 if member is None else member.sequence

    def _robots_send(self, tick: int, frame: Frame) -> None:
        packets = [RobotPacket(robot, index, "", sensor, PAYLOAD) for robot, index, sensor in self._sensed]
        self._say(channels.SAMPLES, "n1", encode(Samples(tick, frame.digest, "n1", self._robots, packets)))
        if not AWAY_AT <= tick % AWAY_EVERY < BACK_AT:
            self.count.asked += len(packets)
            self._without_fate |= {(robot, (tick << OUTBOX_SHIFT) + index) for robot, index, _ in self._sensed}

    # --- what comes of it --------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """Bring the vHub through one more tick; where it is its time, it dies amid it or behind it, by turns."""
        tick, count = self._tick, self.count
        dies = tick % self._load.deaths_every == DEATH_AT
        amid = dies and count.crashes % 2 == 0
        self._clients_say(tick)
        if amid:
            self._die()
        self._commit(last=False)
        self._unrecorded = 0
        if dies and not amid:
            self._die()
        self._tick += 1

    def _commit(self, last: bool) -> None:
        tick = self._tick
        numbers = self._numbers.copy()
        numbers[self._layout["red.attack"].offsets["down"]] = float(tick % DOWN_EVERY < DOWN_TICKS)
        frame = Frame(tick, self._layout, numbers)
        if tick % self._sampled_every == 0 and not last:
            self._robots_send(tick, frame)
        commit = Commit(1, tick, frame.digest, numbers.tobytes(), [], [], last)
        self._say(channels.COMMIT, VHUB, encode(commit))
        self.core.advance(tick * self.deployment.tick_ns)
        self._perform()
        assert self.core.state is not None
        assert last or self.core.state.closed == tick, f"tick {tick}: the vHub waits for {self.core.waiting_for!r}"

    def _take(self, closing: Closing) -> None:
        """Look at the fates of one closing."""
        count = self.count
        for flight in closing.fates:
            if not flight.cause:
                count.delivered += 1
            elif flight.cause == IN_FLIGHT:
                count.in_flight += 1
            else:
                count.dropped[flight.cause] = count.dropped.get(flight.cause, 0) + 1
            client = self._clients.get(flight.source)
            if client is not None:
                client.fates[flight.sequence] += 1
            elif (key := (flight.source, flight.sequence)) in self._without_fate:
                self._without_fate.remove(key)
            else:
                count.unexplained += 1

    def end(self) -> Count:
        """End the run; return what became of all packets."""
        self._commit(last=True)
        self._say(channels.END, SUPERVISOR, encode(End(self._tick, "done", False)))
        self.core.advance(self._tick * self.deployment.tick_ns)
        self._perform()
        state, count = self.core.state, self.count
        assert state is not None
        count.refused = dict(state.refusals)
        dropped, refused = sum(count.dropped.values()), sum(count.refused.values())
        offered = count.delivered + dropped + count.in_flight
        account = state.packets
        told = (account.offered, account.delivered, account.dropped, account.in_flight, account.refused)
        seen = (offered, count.delivered, dropped, count.in_flight, refused)
        count.unexplained += sum(abs(one - other) for one, other in zip(told, seen, strict=True))
        count.unexplained += abs(count.asked - offered - refused - count.lost_in_crash)
        count.unexplained += len(self._without_fate) + sum(client.wrong() for client in self._clients.values())
        count.ticks = self._tick
        return count


def run(ticks: int, load: Load) -> Count:
    """Bring a vHub through so many ticks; return what became of all packets."""
    talk = Talk(load)
    for _ in range(ticks):
        talk.tick()
    return talk.end()
