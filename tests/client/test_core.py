"""A client's core against the vHub's, in memory: what is lost, repeated or comes in another order does no harm."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.client.core import AGAIN_NS, NEVER_NS, ClientCore
from foosim.client.errors import PacketError
from foosim.client.player import Packet
from foosim.common import limits
from foosim.common.errors import UnknownName
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.channels import CLIENT_READS, Plane
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import (
    Build,
    ClientHello,
    ClientWelcome,
    Commit,
    Deliveries,
    Done,
    Down,
    Epoch,
    Go,
    Join,
    Received,
    Samples,
    Up,
)
from foosim.vhub.core import HubCore
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.robot_packets import RobotPacket

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
NAME = TABLE.name
TEXT = apply_sets(
    TABLE.read_text(),
    NAME,
    ["players={}", "network.links=[]", "clients={hand: {lockstep: true, rate: 250 Hz}, ear: {lockstep: false}}"],
)
DEPLOYMENT = load_deployment(TEXT, NAME)
LAYOUT = build_layout(DEPLOYMENT)
NUMBERS = np.array(initial_numbers(DEPLOYMENT, LAYOUT))
HEARD = [("red.goal", "encoder")]
ECHO = Packet("red.goal", "echo", b"one")


class Air:
    """A hub and what is between it and its clients; a test decides what is carried, how often and when."""

    def __init__(self) -> None:
        self.now_ns = 0
        self.tick = -1
        self.epoch = 1
        self.hub = HubCore("boot", bytes(32), 0)
        self.deliveries: list[Deliveries] = []
        self._said: list[Publish] = []
        build = Build("vhub", "boot", "first", "run-1", NAME, TEXT, "fast")
        self.tell(channels.BUILD, "vhub", encode(build))
        self.hub.begin(None, 0)

    def tell(self, channel: channels.Channel, name: str, payload: bytes) -> None:
        """Give the hub one message."""
        self.hub.receive(channel, name, payload, self.now_ns)
        self.hub.advance(self.now_ns)

    def said(self) -> list[Publish]:
        """What the hub has said to clients since the last time."""
        for action in self.hub.actions:
            if isinstance(action, Publish) and action.channel is channels.DELIVERIES:
                self.deliveries.append(decode(Deliveries, action.payload))
        said = [a for a in self.hub.actions if isinstance(a, Publish) and a.channel.plane is Plane.RADIO]
        self.hub.actions.clear()
        return said

    def carry(self, core: ClientCore) -> None:
        """Carry everything both ways until nobody has anything to say."""
        core.wake(self.now_ns)
        while True:
            up, down = published(core), [message for message in self.said() if message.name == core.name]
            if not up and not down:
                return
            for message in up:
                self.tell(message.channel, message.name, message.payload)
            for message in down:
                core.receive(message.channel, message.name, message.payload, self.now_ns)

    def enter(self, name: str, period: int, boot: str = "one") -> ClientCore:
        """Let a client in, and join."""
        core = ClientCore(name, boot, self.now_ns)
        self.carry(core)
        assert core.welcome is not None, core.refusal
        core.join(period, HEARD)
        self.carry(core)
        return core

    def start(self) -> None:
        owners = [(robot, "n1") for robot in DEPLOYMENT.robots]
        self.tell(channels.EPOCH, channels.SUPERVISOR, encode(Epoch(1, 0, bytes(32), ["n1"], owners, b"")))

    def close(self) -> None:
        """Give the hub one more tick: its frame and, at every fifth, one packet of the red goalkeeper."""
        self.tick += 1
        self.now_ns += DEPLOYMENT.tick_ns
        frame = Frame(self.tick, LAYOUT, NUMBERS, {})
        commit = Commit(self.epoch, self.tick, frame.digest, frame.values.tobytes(), frame.outbox_items, [], False)
        self.tell(channels.COMMIT, channels.VHUB, encode(commit))
        robots = [entity.name for entity in LAYOUT.robots]
        packet = RobotPacket("red.goal", 0, "", "encoder", b"%16d" % self.tick)
        self.tell(channels.SAMPLES, "n1", encode(Samples(self.tick, frame.digest, "n1", robots, [packet])))

    def closed(self) -> int:
        assert self.hub.state is not None
        return self.hub.state.closed


def published(core: ClientCore) -> list[Publish]:
    """What a client has said since the last time."""
    said = [action for action in core.actions if isinstance(action, Publish)]
    core.actions.clear()
    return said


def taken(core: ClientCore, *downlinks: Down | Go) -> None:
    """Let a client take downlinks."""
    for downlink in downlinks:
        core.receive(channels.DOWN, core.name, encode(downlink), 0)


def down(number: int, *packets: Received, ended: bool = False) -> Down:
    return Down(number, number, 0, list(packets), ended)


def in_run(name: str = "ear", period: int = 0) -> ClientCore:
    """A client that has joined, without a hub."""
    core = ClientCore(name, "one", 0)
    welcome = ClientWelcome(name, "one", "hub", 0, 0, NAME, TEXT)
    core.receive(channels.CLIENT_WELCOME, name, encode(welcome), 0)
    core.join(period, HEARD)
    core.actions.clear()
    return core


# --- letting in ------------------------------------------------------------------------------------------------------


def test_hello_is_repeated_until_the_answer_and_join_until_the_next_downlink() -> None:
    air = Air()
    core = ClientCore("ear", "one", 0)
    for now_ns in (0, AGAIN_NS, 2 * AGAIN_NS):
        assert core.deadline_ns() == now_ns
        core.wake(now_ns)
        (hello,) = published(core)
        assert hello.channel is channels.CLIENT_HELLO
    air.tell(hello.channel, "ear", hello.payload)
    (welcome,) = air.said()
    core.receive(welcome.channel, welcome.name, welcome.payload, now_ns)
    core.receive(welcome.channel, welcome.name, welcome.payload, now_ns)
    assert (core.deployment, core.statistics().repeated) == (DEPLOYMENT, 1)
    core.join(0, HEARD)
    joins = published(core)
    waits = []
    for _ in range(6):
        waits.append(core.deadline_ns())
        core.wake(core.deadline_ns())
        joins += published(core)
    assert {join.payload for join in joins} == {joins[0].payload}, "byte for byte"
    wanted = decode_join(joins[0]).subscriptions
    assert decode_any(Join | Up | Done, joins[0].payload) == Join("ear", "one", 0, wanted, hub="boot")
    gaps = [later - sooner for sooner, later in pairwise(waits)]
    assert gaps == sorted(gaps) and gaps[-1] == limits.WANT_EVERY_NS_MAX
    half_ns, now_ns = limits.WANT_EVERY_NS_MAX // 2, waits[-1]
    for number in (1, 1, 2):  # a repeat is no sign that the Join is known
        now_ns += half_ns
        core.receive(channels.DOWN, "ear", encode(down(number)), now_ns)
        assert core.deadline_ns() == waits[-1] + (3 if number == 1 else 5) * half_ns
    core.wake(core.deadline_ns())
    assert published(core) == joins[:1], "nothing new for a second"


def decode_join(message: Publish) -> Join:
    join = decode_any(Join | Up | Done, message.payload)
    assert isinstance(join, Join)
    return join


@pytest.mark.parametrize(
    ("name", "world", "reason"),
    [
        ("hands", "", "no client hands is declared; declared are ear, hand, nearest is hand"),
        ("ear", "pool", "world pool, this is table"),
    ],
)
def test_a_refused_client_has_the_reason_and_sends_no_further_hello(name: str, world: str, reason: str) -> None:
    air = Air()
    core = ClientCore(name, "one", 0, world)
    air.carry(core)
    assert (core.refusal, core.welcome, core.deadline_ns()) == (reason, None, NEVER_NS)


def test_a_welcome_with_a_deployment_that_is_not_valid_is_a_refusal() -> None:
    core = ClientCore("ear", "one", 0)
    welcome = ClientWelcome("ear", "one", "hub", 0, 0, NAME, "format: 2\n")
    core.receive(channels.CLIENT_WELCOME, "ear", encode(welcome), 0)
    assert core.deployment is None
    assert core.refusal.startswith("the vHub's deployment is not valid here:\ntable.yaml:1:")


# --- lockstep --------------------------------------------------------------------------------------------------------


def test_a_lost_go_and_a_lost_answer_come_again_byte_for_byte() -> None:
    air = Air()
    core = air.enter("hand", 1)
    air.start()
    air.close()
    (go,) = air.said()
    air.now_ns += limits.WANT_EVERY_NS_MAX
    air.hub.wake(air.now_ns)
    (again,) = air.said()
    assert again == go, "the first one was lost"
    core.receive(again.channel, again.name, again.payload, 0)
    core.done([ECHO])
    (lost,) = published(core)
    core.receive(go.channel, go.name, go.payload, 0)
    core.receive(go.channel, go.name, go.payload, 0)
    repeats = published(core)
    assert [repeat.payload for repeat in repeats] == [lost.payload] * 2
    assert core.go is None, "the player is not asked twice"
    for message in (*repeats, lost):
        air.tell(message.channel, message.name, message.payload)
    air.said()
    assert [[packet.payload for packet in d.packets] for d in air.deliveries] == [[], [b"one"]]
    assert (core.statistics().answered, core.statistics().sent, core.statistics().repeated) == (1, 1, 2)


def test_an_answer_that_cannot_be_sent_leaves_its_tick_waiting() -> None:
    core = in_run("hand", 1)
    taken(core, Go(1, 0, 0, []))
    with pytest.raises(UnknownName, match=r"unknown destination .*'red\.gaol', nearest is 'red\.goal'"):
        core.done([Packet("red.gaol", "echo", b"")])
    big = Packet("red.goal", "echo", bytes(limits.PAYLOAD_BYTES_MAX))
    with pytest.raises(PacketError, match="bytes in one answer, at most 1048576 are allowed"):
        core.done([big] * 40)
    assert core.go is not None and core.statistics().sent == 0
    core.done([ECHO])
    done = decode_any(Join | Up | Done, published(core)[-1].payload)
    assert isinstance(done, Done) and [packet.sequence for packet in done.packets] == [1]


def test_a_go_out_of_turn_is_refused() -> None:
    core = in_run("hand", 2)
    taken(core, Go(1, 3, 0, []))
    assert (core.go, core.statistics().malformed) == (None, 1)
    taken(core, Go(2, 4, 0, []), Go(1, 2, 0, []))
    assert core.go is not None and core.go.tick == 4, "an older tick does not come back"
    free = in_run("ear", 0)
    taken(free, Go(1, 0, 0, []))
    assert (free.go, free.statistics().malformed) == (None, 1)


# --- free-running ----------------------------------------------------------------------------------------------------


def test_downlinks_in_another_order_are_all_taken_and_once_each() -> None:
    core = in_run()
    packets = [Received("red.goal", number, 0, "echo", 0, 0, b"%d" % number) for number in range(6)]
    taken(core, down(1, packets[1]), down(4, packets[4]), down(2, packets[2]))
    assert core.statistics().missing == 1
    taken(core, down(2, packets[2]), down(4, packets[4]), down(3, packets[3]), down(3, packets[3]))
    assert [packet.sequence for packet in core.arrivals] == [1, 4, 2, 3]
    assert (core.statistics().missing, core.statistics().repeated, core.statistics().downlinks) == (0, 3, 4)
    assert core.tick == 4, "the newest tick stays"


@pytest.mark.parametrize(("numbers", "received"), [((), 0), ((1, 2), 2), ((1, 2, 4, 5), 2), ((1, 3, 2), 3)])
def test_a_hello_to_a_vhub_that_is_back_names_the_last_downlink_without_a_gap(
    numbers: tuple[int, ...], received: int
) -> None:
    """The vHub sends those above it again, and no other."""
    core = in_run()
    taken(core, *[down(number) for number in numbers])
    published(core)
    core.hub_gone(0)
    core.wake(0)
    (hello,) = [decode(ClientHello, one.payload) for one in published(core) if one.channel is channels.CLIENT_HELLO]
    assert hello.received == received


def test_what_is_not_taken_in_time_is_counted() -> None:
    core = in_run()
    packet = Received("red.goal", 1, 0, "echo", 0, 0, b"")
    for number in range(16):
        taken(core, down(number + 1, *[packet] * (limits.INBOX_MESSAGES_MAX // 16)))
    taken(core, down(17, packet, packet))
    assert (len(core.arrivals), core.statistics().overflowed) == (limits.INBOX_MESSAGES_MAX, 2)


def test_many_packets_go_in_as_many_messages_as_they_need() -> None:
    core = in_run()
    core.send([Packet("red.goal", "echo", bytes(limits.PAYLOAD_BYTES_MAX))] * 70)
    messages = [decode_any(Join | Up | Done, message.payload) for message in published(core)]
    assert len(messages) == 3
    assert [p.sequence for m in messages if isinstance(m, Up) for p in m.packets] == list(range(1, 71))


# --- what does not fit -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("robot", "channel", "text"),
    [
        ("red.gaol", "encoder", "unknown endpoint (there are: blue.attack, blue.defence, blue.goal, blue.midfield,"
         " camera, ear, hand, red.attack, red.defence, red.goal, red.midfield), 'red.gaol', nearest is 'red.goal'"),
        ("hand", "c" * 33, f"channel '{'c' * 33}': not 1 to 32 characters"),
        ("red.goal", "encode", "red.goal has no such channel to hear (there are: echo, encoder), 'encode',"
         " nearest is 'encoder'"),
        ("camera", "position", "camera has no such channel to hear (there are: ball, echo), 'position'"),
    ],
)  # fmt: skip
def test_a_subscription_to_nothing_is_refused(robot: str, channel: str, text: str) -> None:
    core = in_run()
    with pytest.raises((UnknownName, PacketError)) as error:
        core.join(0, [("camera", "ball"), (robot, channel)])
    assert str(error.value) == text
    assert published(core) == []


@pytest.mark.parametrize(
    ("packet", "text"),
    [
        (Packet("red.goal", "", b""), "channel '': not 1 to 32 characters"),
        (Packet("red.goal", "c" * 33, b""), "not 1 to 32 characters"),
        (Packet("red.goal", "echo", bytes(32769)), "32769 bytes in one packet, at most 32768 are allowed"),
    ],
)
def test_a_packet_that_the_wire_does_not_take_is_refused(packet: Packet, text: str) -> None:
    core = in_run()
    with pytest.raises(PacketError, match=text):
        core.send([ECHO, packet])
    assert (published(core), core.statistics().sent) == ([], 0)


def test_messages_to_others_and_before_the_welcome_are_refused() -> None:
    core = ClientCore("ear", "one", 0)
    taken(core, down(1))
    core.receive(channels.DOWN, "hand", encode(down(1)), 0)
    core.receive(channels.CLIENT_WELCOME, "ear", encode(ClientWelcome("hand", "one", "hub", 0, 0, NAME, TEXT)), 0)
    assert (core.statistics().malformed, core.statistics().downlinks, core.welcome) == (3, 0, None)


@given(
    st.sampled_from([channel for channel, _ in CLIENT_READS]),
    st.binary(max_size=64),
    st.integers(0, 10_000),
    st.integers(1, 255),
)
def test_random_and_mutated_bytes_are_refused_and_counted(
    channel: channels.Channel, noise: bytes, at: int, flip: int
) -> None:
    core = in_run("hand", 1)
    core.receive(channel, "hand", noise, 0)
    assert core.statistics().malformed == 1
    whole = bytearray(encode(Go(1, 1, 0, [Received("red.goal", 1, 0, "echo", 0, 0, b"payload")])))
    whole[at % len(whole)] ^= flip
    core.receive(channels.DOWN, "hand", bytes(whole), 0)
    taken(core, Go(limits.COUNTER_MAX, limits.COUNTER_MAX, 0, []))
    assert core.go is not None, "it goes on"
