"""Law 6 for what robots send: a packet draws by seed, link, channel, tick and its count within the channel.

So another sensor shifts no draw, though it shifts the sequence numbers of its robot's other packets. What these share
with it they share still: the order and the bursts of a link, its queue, the air.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final

import msgspec
import pytest

from foosim.analysis.explain import explain_row
from foosim.capture.rows import PacketRow
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Sent
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight
from foosim.vhub.recording.rows_of_closing import packet_row
from foosim.vhub.stages.explanation import Evidence
from foosim.vhub.state.hub_state import HubState
from foosim.world.robot_packets import RobotPacket
from tests.links.offered import ENDS, Hub, deployment_of, rule
from tests.links.test_determinism import ALL, NETWORKS, PLACES, network, traffic

ROBOT: Final = "red.goal"
TICKS: Final = 2_000
FREE: Final = "delay: 3 ms, jitter: {shape: gamma, sd: 2 ms}, loss: 20 %, order: free"
Address = tuple[str, str, str, int, int, int]
"""Source, destination, channel, time of sending, count within the channel (a client's number), copy."""
Sends = list[tuple[str, str]]
"""Channel and receiver, empty for all who hear it, in the order of the robot's list."""
USUAL: Final[Sends] = [("news", ""), ("news", "a"), ("news", ""), ("scan", ""), ("scan", "b")]
"""Several packets of a channel in a tick, several channels."""
FIRST: Final[Sends] = [("air", ""), ("air", "c"), *USUAL]
MIDST: Final[Sends] = [*USUAL[:3], ("radar", ""), *USUAL[3:], ("temper", "")]


def robot_packets(tick: int, sends: Sends) -> list[RobotPacket]:
    return [
        RobotPacket(ROBOT, index, to, channel, b"%4d" % tick + channel.encode() * 9)
        for index, (channel, to) in enumerate(sends)
    ]


def hub_of(deployment: Deployment, heard: Iterable[str], joined: Iterable[str] = ENDS) -> Hub:
    """A hub whose clients hear these channels of the robot, and the news of one another."""
    state = HubState(deployment)
    for name in joined:
        pairs = [(ROBOT, channel) for channel in heard]
        state.join(Joining(name, 0, pairs + [(other, "news") for other in ENDS if other != name]), 0)
    return Hub(deployment, state)


def drive(
    deployment: Deployment,
    sends: Sends,
    heard: Iterable[str] = ("news", "scan"),
    ticks: int = TICKS,
    talk: bool = False,
) -> dict[Address, Flight]:
    """Have the robot send at every tick; return all packets, those in flight too. `talk`: clients send as well."""
    hub = hub_of(deployment, heard)
    for tick in range(ticks):
        sent, _, edits = traffic(tick)
        hub.close(sent if talk else {}, robot_packets(tick, sends), edits if talk else [])
    return by_address([*hub.fates, *hub.state.in_flight()])


def by_address(flights: Iterable[Flight]) -> dict[Address, Flight]:
    found: dict[Address, Flight] = {}
    for f in flights:
        nth = f.count if f.source == ROBOT else f.sequence
        address = f.source, f.destination, f.channel, f.sent_ns, nth, f.copy
        assert address not in found, address
        found[address] = f
    return found


def row(flight: Flight) -> dict[str, Any]:
    """The row of a packet without the numbers that only order a robot's packets."""
    found = packet_row(flight)
    if flight.source == ROBOT:
        found = msgspec.structs.replace(found, sequence=0)
    return {name: getattr(found, name) for name in PacketRow.__struct_fields__}


def differing(one: dict[Address, Flight], other: dict[Address, Flight]) -> dict[Address, set[str]]:
    """The fields in which the rows of packets of both differ, where they do; all of `one` are in the other."""
    assert one.keys() <= other.keys()
    rows = {address: (row(flight), row(other[address])) for address, flight in one.items()}
    return {
        address: {name for name in before if before[name] != after[name]}
        for address, (before, after) in rows.items()
        if before != after
    }


@pytest.mark.parametrize("sends", [FIRST, MIDST], ids=["first", "midst"])
@pytest.mark.parametrize("name", NETWORKS)
def test_a_sensor_that_nobody_hears_changes_no_row(name: str, sends: Sends) -> None:
    """Whatever stages draw, and whatever is shared: it is not sent to anybody, but it has numbers."""
    deployment = network(name, 1)
    silent = [send for send in sends if send in USUAL or not send[1]]
    usual = drive(deployment, USUAL, ticks=24, talk=True)
    beside = drive(deployment, silent, ticks=24, talk=True)
    assert len(usual) > 300 and not differing(usual, beside) and usual.keys() == beside.keys()
    numbers = [{f.sequence for f in found.values() if f.source == ROBOT} for found in (usual, beside)]
    assert numbers[0] != numbers[1], "the numbers have shifted"


APART: Final = {
    "losses and jitter": FREE,
    "copies": f"{FREE}, duplicate: 30 %",
    "bit errors": f"{FREE}, corrupt: {{bit_error_rate: 1 %, deliver: true}}",
    "late ones": f"{FREE}, reorder: {{probability: 20 %, extra: 9 ms}}",
    "bursts in time": f"{FREE.replace('loss: 20 %, ', '')}, burst: {{loss: 20 %, mean_bad: 10 ms}}",
    "outages": f"{FREE}, outages: {{mean_on: 30 ms, mean_off: 10 ms}}",
}
"""Links on which a packet takes nothing from another one."""


@pytest.mark.parametrize("name", APART)
def test_a_sensor_that_is_heard_changes_no_other_row_where_links_share_nothing(name: str) -> None:
    ticks = TICKS if name == "losses and jitter" else 200
    deployment = deployment_of(rule(APART[name], ALL))
    usual = drive(deployment, USUAL, ticks=ticks)
    assert len(usual) >= 14 * ticks and len({flight.cause for flight in usual.values()}) > 1
    for sends in (FIRST, MIDST):
        beside = drive(deployment, sends, ("air", "news", "radar", "scan", "temper"), ticks)
        assert not differing(usual, beside) and len(beside) > len(usual)
        assert {address[2] for address in beside.keys() - usual.keys()} <= {"air", "radar", "temper"}


SHARED: Final[dict[str, tuple[str, frozenset[str]]]] = {
    "order": (FREE.replace("free", "fifo"), frozenset({"due_ns", "arrival_tick", "fate"})),
    "a chain of bursts": (
        f"{FREE}, gilbert_elliott: {{p: 5 %, r: 30 %}}",
        frozenset({"is_bad", "fate", "cause", "due_ns", "arrival_tick", "jitter_word", "jitter_ns"}),
    ),
    "queue and rate": (
        f"{FREE}, rate: 2 Mbit/s, queue: {{packets: 12}}",
        frozenset({"queue_ns", "queue_bytes", "airtime_ns", "rate_bps", "due_ns", "arrival_tick", "fate", "cause"})
        | {"jitter_ns", "jitter_word", "decided_by"},
    ),
}
"""Settings by which packets of a link depend on each other, and what of a row may change by another packet on it."""


@pytest.mark.parametrize("name", SHARED)
def test_where_packets_compete_their_draws_are_equal_all_the_same(name: str) -> None:
    """Another sensor is one more packet in the queue, in the order, in the count of a burst: no luck changes."""
    settings, may_differ = SHARED[name]
    deployment = deployment_of(rule(settings, ALL))
    usual = drive(deployment, USUAL, ticks=500)
    beside = drive(deployment, FIRST, ("air", "news", "scan"), 500)
    assert all(flight.words == beside[address].words for address, flight in usual.items())
    found = differing(usual, beside)
    assert found and set().union(*found.values()) <= may_differ, set().union(*found.values()) - may_differ
    lost = [{address for address, f in run.items() if f.cause == "random_loss"} for run in (usual, beside)]
    if name == "order":
        assert lost[0] == lost[1] & usual.keys(), "who is lost by its draw alone is lost in both"


def test_no_two_packets_have_one_draw() -> None:
    """Neither two channels in a tick, nor two packets of a channel, copies, receivers, ticks."""
    deployment = deployment_of(rule(f"{FREE}, duplicate: 30 %", ALL))
    found = drive(deployment, FIRST, ("air", "news", "scan"), ticks=200)
    assert len({flight.words for flight in found.values()}) == len(found) > 3_000
    counts = {(address[2], address[4]) for address in found}
    assert counts == {("air", 0), ("air", 1), ("news", 0), ("news", 1), ("news", 2), ("scan", 0), ("scan", 1)}
    setup = Hub(deployment).state.fabric.link(ROBOT, "a", "news").setup_at(0)
    to_a = [flight for (_, to, *_), flight in found.items() if to == "a"]
    for block in (1, 2, 3, 1024):
        assert len({setup.words(flight, block) for flight in to_a}) == len(to_a)


def test_the_address_of_a_draw_is_the_documented_one() -> None:
    """A robot's: the key of link and channel, tick and count; a client's: the key of the link and its number."""
    deployment = deployment_of(rule(f"{FREE}, duplicate: 30 %", ALL))
    for (source, to, channel, sent_ns, nth, copy), flight in drive(deployment, FIRST, ticks=60, talk=True).items():
        ends = "link", source, to
        if source == ROBOT:
            key, number = draw_key(1, *ends, "channel", channel), (sent_ns // deployment.tick_ns << 16) + nth
        else:
            key, number = draw_key(1, *ends), flight.sequence
        assert flight.words == draw_words(key, number, copy)
    fabric = Fabric(deployment_of("network.radios={r: {preset: zigbee}}", "network.robots={'*': [r]}", PLACES))
    for source, more in ((ROBOT, ("channel", "news")), ("a", ())):
        sending = fabric.link(source, "b", "news").setup_at(0).sending
        assert sending.of("news") == draw_key(1, "sending", source, "r", *more), "of a broadcast's turn on the air"


def test_a_row_has_the_address_of_its_draws() -> None:
    """`explain` makes them again."""
    deployment = deployment_of(rule(FREE, ALL))
    everything = Evidence(deployment, {}, [], lambda tick: None, list)
    found = drive(deployment, FIRST, ("air", "news", "scan"), ticks=60, talk=True)
    for flight in [f for f in found.values() if f.destination == "a"]:
        assert explain_row(everything, packet_row(flight)).agrees
    changed = msgspec.structs.replace(packet_row(next(f for f in found.values() if f.count == 1)), count=0)
    assert explain_row(everything, changed).verdict.endswith("its draws differ from the address in its row")


Order = Callable[[list[str]], list[str]]


@pytest.mark.parametrize("order", [sorted, lambda names: sorted(names, reverse=True)], ids=["names", "reversed"])
def test_who_joined_first_is_nothing(order: Order) -> None:
    """Walks go in name order: clients that came in another order, with subscriptions in another order."""
    deployment = network("wifi fading", 1)
    hub = hub_of(deployment, order(["news", "scan"]), order(list(ENDS)))
    usual = hub_of(deployment, ["scan", "news"], ["c", "a", "d", "b"])
    for tick in range(40):
        sent: dict[str, list[Sent]] = traffic(tick)[0]
        for one, names in ((hub, order(list(sent))), (usual, [*sent])):
            one.close({name: sent[name] for name in names}, robot_packets(tick, USUAL))
    assert [packet_row(f) for f in hub.fates] == [packet_row(f) for f in usual.fates]
    assert [packet_row(f) for f in hub.state.in_flight()] == [packet_row(f) for f in usual.state.in_flight()]
    assert hub.deliveries == usual.deliveries
