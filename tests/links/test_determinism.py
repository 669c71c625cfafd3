"""Law 6 at full strength (T22): a fate depends on seed, link, number, size, times, the world and whom it meets; on
nothing else. Each network here is driven tick by tick with unicasts and broadcasts of four clients and a robot.
"""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Final

import msgspec
import pytest

from foosim.deployment.network.presets import PRESETS
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Sent
from foosim.vhub.network.packet import Flight
from foosim.vhub.recording.rows_of_closing import packet_row
from foosim.vhub.state.hub_state import HubState
from foosim.world.edits import Disrupt, Edit
from foosim.world.robot_packets import RobotPacket
from tests.links.offered import ENDS, Hub, deployment_of, rule
from tests.links.proof import Proof

TICKS: Final = 72
PLACES: Final = (
    "network.places={a: [0 m, 0 m, 1 m], b: [25 m, 0 m, 1 m], c: [0 m, 40 m, 1 m], d: [60 m, 30 m, 2 m], "
    "'*': [10 m, 10 m, 1 m]}"
)
TRACE: Final = "\n".join(str(3 * k + k % 2) for k in range(1, 40))
TABLE: Final = " ".join(str(round(8192 * (k / 500 - 1) ** 3)) for k in range(1001))
ALL: Final = "from: '*', to: '*'"


def radio(preset: str, more: str = "") -> tuple[str, ...]:
    """Everybody carries one radio."""
    return f"network.radios={{r: {{preset: {preset}{more}}}}}", "network.robots={'*': [r]}", PLACES


def rules(settings: str) -> tuple[str, ...]:
    return (rule(settings, ALL),)


WORKED: Final = "jitter: {shape: gamma, sd: 3 ms}"
NETWORKS: Final[dict[str, tuple[str, ...]]] = {
    **{f"radio {preset}": radio(preset) for preset in PRESETS},
    **{f"default {preset}": (f"network.defaults={{preset: {preset}}}", PLACES) for preset in PRESETS},
    "wifi fading": radio("wifi_5_indoor", ", fading: {kind: nakagami}, duplicate: 30 %, retries: 1"),
    "wifi hidden": (*radio("wifi_5_indoor", ", tx_power: -28 dBm, duplicate: 20 %"), "network.defaults={phase: 2 ms}"),
    "dot11p crowded": radio("dot11p", ", duplicate: 30 %, path_loss: {environment: log_distance, exponent: 3.6}"),
    "lora busy": radio("lora_eu868", ", duty_cycle: 100 %, spreading_factor: 9, duplicate: 20 %, queue: {packets: 50}"),
    "lora duty": radio("lora_eu868", ", duty_cycle: 2 %, duty_window: 10 s"),
    "zigbee unicast": radio("zigbee", ", published: unicast, retries: 2"),
    "acoustic loud": radio("acoustic", ", rate: 100 kbit/s, queue: {packets: 100}"),
    "two radios": (
        "network.radios={near: {preset: zigbee}, far: {preset: lora_eu868, duty_cycle: 100 %}}",
        "network.robots={a: [near, far], b: [near], '*': [far]}",
        PLACES,
    ),
    "one air": (
        "network.radios={x: {preset: wifi_2_4_indoor, air: ism}, y: {preset: zigbee, air: ism}}",
        "network.robots={a: [x], b: [x], '*': [y]}",
        PLACES,
    ),
    "chain": rules(f"gilbert_elliott: {{p: 10 %, r: 30 %, k: 95 %}}, duplicate: 20 %, {WORKED}"),
    "four states": rules("markov4: {p13: 10 %, p31: 30 %, p32: 10 %, p23: 30 %, p14: 5 %}, delay: 20 ms"),
    "bursts in time": rules("burst: {loss: 20 %, mean_bad: 10 ms, bad_loss: 60 %, bad_extra_delay: 15 ms}"),
    "outages": rules("outages: {mean_on: 30 ms, mean_off: 10 ms}, loss: 10 %"),
    "codel": rules("rate: 200 kbit/s, queue: {drop: codel, codel_target: 1 ms, codel_interval: 10 ms}"),
    "trace": rules("trace: {file: lte.trace}, queue: {packets: 30}, duplicate: 10 %"),
    "table": rules("jitter: {shape: table, file: wild.dist, mean: 8 ms, sd: 4 ms}, order: free"),
    "errors": rules("corrupt: {bit_error_rate: 0.002 p, deliver: true}, reorder: {probability: 20 %, extra: 9 ms}"),
    "late": rules(f"rate: 300 kbit/s, ttl: 12 ms, {WORKED}"),
    "events": (
        *rules(f"delay: 9 ms, {WORKED}, ttl: 30 ms"),
        "network.events=[{at: 20 ms, for: 30 ms, partition: [[a, b], [rest]]}, "
        "{at: 60 ms, for: {exponential: 20 ms}, clog: {from: '*', to: b}}, "
        "{at: 80 ms, set: {link: tried, loss: 30 %, ttl: 11 ms}}, {at: 120 ms, heal: settings}, "
        "{at: 130 ms, set: {link: tried, rate: 500 kbit/s}}]",
    ),
    "set on a radio": (
        *radio("wifi_5_indoor"),
        f"network.links=[{{id: tried, {ALL}, via: r, ttl: 50 ms}}]",
        "network.events=[{at: 40 ms, set: {link: tried, ttl: 1 ms, delay: 4 ms}}, {at: 90 ms, heal: settings}]",
    ),
}
"""Networks with every stage in use, as sets."""
ASKED: Final = {
    30: {"partition": [["c"], ["rest"]], "for": "25 ms"},
    50: {"clog": {"from": "a", "to": "b"}, "for": {"exponential": "15 ms"}},
    70: {"heal": "all"},
}
"""Requests on a running system, by tick."""


def network(name: str, seed: int, *more: str) -> Deployment:
    files = {"lte.trace": TRACE} if name == "trace" else {"wild.dist": TABLE} if name == "table" else None
    found = deployment_of(*NETWORKS[name], *more, files=files)
    return found if seed == 1 else found.model_copy(update={"seed": seed})


def traffic(tick: int) -> tuple[dict[str, list[Sent]], list[RobotPacket], list[Edit]]:
    """What is sent at a tick: sizes vary; some go to one, some to all who hear."""
    rng = random.Random(tick)
    sent: dict[str, list[Sent]] = {}
    for name in ENDS:
        for n in range(rng.randrange(3)):
            to = rng.choice(["", *(other for other in ENDS if other != name), "red.goal"])
            payload = bytes([tick & 255]) * rng.choice([1, 20, 90])
            sent.setdefault(name, []).append(Sent(4 * tick + n + 1, to, "news" if not to else "data", 0, payload))
    robots = [RobotPacket("red.goal", n, to, "news", b"abc" * n) for n, to in enumerate(["", "a"])] if tick % 3 else []
    edits: list[Edit] = [Disrupt(json.dumps(ASKED[tick]))] if tick in ASKED else []
    return sent, robots, edits


Shuffle = Callable[[dict[str, list[Sent]]], dict[str, list[Sent]]]


def drive(deployment: Deployment, ticks: int = TICKS, folds: Iterable[int] = (), shuffle: Shuffle | None = None) -> Hub:
    """Close ticks; at some of them the state is written down and another one goes on from that."""
    hub, written = Hub(deployment), list[bytes]()
    for tick in range(ticks):
        if tick in folds:
            raw = hub.state.snapshot()
            hub.state = HubState.restore(deployment, raw)
            assert hub.state.snapshot() == raw
        sent, robots, edits = traffic(tick)
        hub.close(sent if shuffle is None else shuffle(sent), robots, edits)
        written += map(row, hub.fates[len(written) :])
        assert_conserved(hub)
    assert written == [row(flight) for flight in hub.fates], "a fate that changed behind its row"
    return hub


def assert_conserved(hub: Hub) -> None:
    """What was sent is delivered, dropped or in flight, in all and between any two; each packet has one fate."""
    account, flights = hub.state.packets, [*hub.fates, *hub.state.in_flight()]
    assert len({(f.source, f.destination, f.sequence, f.copy) for f in flights}) == len(flights)
    flying = Counter((f.source, f.destination) for f in hub.state.in_flight() if not f.copy)
    assert account.offered == account.delivered + account.dropped + flying.total()
    assert account.dropped == sum(bool(f.cause) for f in hub.fates if not f.copy)
    open_on = Counter[tuple[str, str]]()
    for (source, destination, _), link in hub.state.fabric.states.items():
        open_on[source, destination] += link.offered - link.delivered - link.dropped
    assert +open_on == flying
    copies = sum(link.copies for link in hub.state.fabric.states.values())
    assert copies == account.copies == sum(f.copy for f in flights)


def row(flight: Flight) -> bytes:
    return msgspec.json.encode(packet_row(flight))


def rows(hub: Hub) -> list[bytes]:
    """All rows, those in flight too: every fate with every input."""
    return [row(flight) for flight in [*hub.fates, *hub.state.in_flight()]]


def shuffled(sent: dict[str, list[Sent]]) -> dict[str, list[Sent]]:
    """The same in another order of arrival."""
    rng = random.Random(len(sent) + sum(map(len, sent.values())))
    return {who: rng.sample(sent[who], len(sent[who])) for who in rng.sample(sorted(sent), len(sent))}


@pytest.mark.parametrize("name", NETWORKS)
def test_the_same_from_any_journal_in_any_order_of_arrival(proof: Proof, name: str) -> None:
    """Byte for byte: a run that is written down and taken up again, in which packets come otherwise.

    That is at every fourth tick; `make stats` does it at each.
    """
    deployment = network(name, proof.seed)
    once = drive(deployment)
    state, found = once.state.snapshot(), rows(once)
    assert len(found) > 200
    every = 1 if proof.is_full else 4
    again = [drive(deployment, folds=range(1, TICKS, every), shuffle=shuffled)]
    if proof.is_full:
        again += [drive(deployment), drive(deployment, shuffle=shuffled)]
        again += [drive(deployment, folds=[tick]) for tick in range(5, TICKS, 24)]
    for other in again:
        for number, (one, same) in enumerate(zip(found, rows(other), strict=True)):
            assert one == same, f"row {number}"
        assert other.state.snapshot() == state
        assert other.deliveries == once.deliveries
    proof.exact("T22", f"{name}: fates that differ from any journal, in any order of arrival", 0, 0, len(found))


def test_another_seed_is_another_run() -> None:
    deployment = network("bursts in time", 1)
    assert rows(drive(deployment)) != rows(drive(deployment.model_copy(update={"seed": 2})))


def words(hub: Hub) -> dict[tuple[str, str, int, int], tuple[int, ...]]:
    flights: list[Flight] = [*hub.fates, *hub.state.in_flight()]
    return {(f.source, f.destination, f.sequence, f.copy): f.words for f in flights if f.words}


@pytest.mark.parametrize(
    "more",
    [
        "jitter: {shape: gamma, sd: 30 ms}",
        "duplicate: 50 %",
        "rate: 100 kbit/s, queue: {packets: 3}",
        "corrupt: {bit_error_rate: 1 %}",
        "gilbert_elliott: {p: 20 %, r: 20 %}",
        "outages: {mean_on: 20 ms, mean_off: 20 ms}",
        "reorder: {probability: 50 %, extra: 5 ms}",
        "ttl: 3 ms",
    ],
)
def test_what_a_packet_draws_does_not_depend_on_other_impairments(proof: Proof, more: str) -> None:
    """Draws are equal; and who is lost for its draw alone is lost with or without the other."""
    plain = drive(deployment_of(rule("loss: 20 %", ALL)))
    beside = drive(deployment_of(rule(f"loss: 20 %, {more}", ALL)))
    one, other = words(plain), words(beside)
    differing = sum(one[packet] != other[packet] for packet in one.keys() & other.keys())
    proof.exact("T22", f"draws that differ with {more} switched on", differing, 0, len(one))
    assert {key for key in one if key[3] == 0} <= other.keys()
    lost = {(f.source, f.destination, f.sequence) for f in plain.fates if f.cause == "random_loss"}
    for flight in beside.fates:
        if flight.copy == 0 and flight.cause in ("", "random_loss"):
            key = flight.source, flight.destination, flight.sequence
            assert (flight.cause == "random_loss") == (key in lost)


def test_links_are_judged_as_if_there_were_no_others(proof: Proof) -> None:
    """A hub that has a part of the links (a shard) gives them the fates that the whole hub gives them."""
    settings = f"loss: 10 %, rate: 300 kbit/s, duplicate: 20 %, burst: {{loss: 10 %, mean_bad: 9 ms}}, {WORKED}"
    deployment = deployment_of(rule(settings, ALL))
    whole = drive(deployment)
    for sources in (["a"], ["b", "c"], ["d", "red.goal"]):
        shard = Hub(deployment)
        for tick in range(TICKS):
            sent, robots, edits = traffic(tick)
            shard.close({name: sent[name] for name in sent if name in sources},
                        robots if "red.goal" in sources else [], edits)  # fmt: skip
        found = rows(shard)
        flights = [*whole.fates, *whole.state.in_flight()]
        expected = [row for row, flight in zip(rows(whole), flights, strict=True) if flight.source in sources]
        assert sorted(found) == sorted(expected) and len(found) > 100
    proof.exact("T22", "fates that differ in a shard of the links", 0, 0, len(flights))


@pytest.mark.parametrize("duplicate", ["0 %", "60 %"])
@pytest.mark.parametrize("preset", ["wifi_5_indoor", "dot11p", "lora_eu868", "zigbee", "lte", "acoustic"])
def test_a_broadcast_goes_once_to_all_who_hear(preset: str, duplicate: str) -> None:
    """Whether the first of its receivers is in range decides nothing for the others; copies are made for each."""
    sets = radio(preset, f", duplicate: {duplicate}, duty_cycle: 100 %")
    fates = []
    for far in ((), ("network.places.b=[90 km, 90 km, 1 m]",)):
        hub = Hub(deployment_of(*sets, *far))
        for tick in range(3000):
            hub.close({"a": [Sent(tick + 1, "", "news", 0, b"xyz" * 9)]} if tick % 150 == 0 else {})
        fates.append({(f.destination, f.sequence, f.copy): f for f in hub.fates})
        for f in hub.fates:
            if preset != "lte" and not f.copy:
                assert f.queue_ns == 0 or f.cause, "one airtime for all receivers, copies behind it"
    near, apart = fates
    others = [key for key in near if key[0] != "b"]
    assert len(others) >= 36 and {f.cause for f in apart.values() if f.destination == "b"} <= {"out_of_range", "snr"}
    for key in others:
        assert near[key].cause == apart[key].cause, key
        if not key[2] and preset != "lte":  # a base station sends to each by itself, one after the other
            assert row(near[key]) == row(apart[key]), key


@pytest.mark.parametrize("left_out", ["b", "d"])
@pytest.mark.parametrize("preset", ["wifi_5_indoor", "dot11p", "zigbee", "lora_eu868", "acoustic"])
def test_a_broadcast_gets_its_turn_whoever_hears_it(proof: Proof, preset: str, left_out: str) -> None:
    """Its medium access draws from its sender's radio: fates of others are the same without one of the receivers.

    That is so for the first of them, too (b of what a sends), and among stations that contend.
    """
    deployment = network(f"radio {preset}", proof.seed, "network.radios.r.duty_cycle=100 %")
    found = []
    for joined in (ENDS, [name for name in ENDS if name != left_out]):
        hub = Hub(deployment, joined=joined)
        for tick in range(150):
            busy = {name: [Sent(tick + 1, "", "news", 0, name.encode() * 40)] for name in ("a", "c")}
            hub.close(busy if tick % 15 == 0 else {})
        flights = [*hub.fates, *hub.state.in_flight()]
        found.append([row(flight) for flight in flights if flight.destination != left_out])
    assert found[0] == found[1] and len(found[0]) == 40
    proof.exact("T22", f"{preset}: fates of a broadcast that differ without its receiver {left_out}", 0, 0, 40)
