"""What a sender's radio sends once for all is of the radio alone; a rule is of the link of one receiver.

What a radio has sent, and only that, is on air, in its duty cycle's account and in its queue.
"""

from __future__ import annotations

from typing import Final

import pytest

from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.airtime import lora_airtime_ns
from foosim.world.assembly.initial_state import initial_frame
from tests.links.offered import ENDS, MS, S, deployment_of, fabric_of, play

PLACES: Final = "network.places={'*': [0 m, 0 m, 1 m], c: [5 m, 0 m, 1 m]}"
EVERYBODY: Final = "network.robots={'*': [r]}"
PLAIN: Final = "medium: radio, tx_power: 100 dBm, rate: 80 kbit/s"


def sent(fabric: Fabric, number: int, to: tuple[str, ...], *, published: bool = True) -> list[Flight]:
    """One packet of 100 B from a, judged at sending."""
    flights = [Flight("a", one, "data", number, 0, 0, bytes(100), published) for one in to]
    for flight in flights:
        fabric.link("a", flight.destination, "data").send(flight)
    return flights


@pytest.mark.parametrize("radio", ["preset: wifi_5_indoor", "preset: zigbee", PLAIN])
@pytest.mark.parametrize("first", ["b", "c"])
def test_a_rule_of_one_receiver_bounds_no_broadcast(radio: str, first: str) -> None:
    """The queue of b's rule holds one packet, the radio's two: the third broadcast is dropped for all, whoever is
    first; a unicast by the rule finds it full."""
    rule = "{id: tight, from: a, to: b, queue: {packets: 1}}"
    sets = f"network.radios={{r: {{{radio}, queue: {{packets: 2}}}}}}", EVERYBODY, PLACES, f"network.links=[{rule}]"
    fabric = Fabric(deployment_of(*sets))
    order = ("b", "c") if first == "b" else ("c", "b")
    for number in (1, 2):
        assert not {flight.cause for flight in sent(fabric, number, order)} & {"queue_full"}
    assert [flight.cause for flight in sent(fabric, 3, order)] == ["queue_full"] * 2
    rest = Fabric(deployment_of(*sets))
    sent(rest, 1, ("c",), published=False)
    assert [sent(rest, n, (to,), published=False)[0].cause for n, to in ((2, "b"), (3, "c"))] == ["queue_full", ""]


@pytest.mark.parametrize("first", ["b", "c"])
def test_a_broadcast_is_aired_once_whatever_rates_rules_have(first: str) -> None:
    """A radio without a medium of its own has a rule's rate for what goes to one alone."""
    rule = "{id: slow, from: a, to: b, rate: 8 kbit/s}"
    fabric = Fabric(deployment_of(f"network.radios={{r: {{{PLAIN}}}}}", EVERYBODY, PLACES, f"network.links=[{rule}]"))
    order = ("b", "c") if first == "b" else ("c", "b")
    assert [flight.airtime_ns for flight in sent(fabric, 1, order)] == [10_000_000] * 2
    one, other = sent(fabric, 2, ("b",), published=False)[0], sent(fabric, 3, ("c",), published=False)[0]
    assert (one.queue_ns, one.airtime_ns) == (10_000_000, 100_000_000)
    assert (other.queue_ns, other.airtime_ns) == (110_000_000, 10_000_000)


def test_links_by_the_radio_of_the_defaults_share_it() -> None:
    """A rule over the defaults' radio is on the air of all others, and in their queue."""
    rule = "{id: late, from: a, to: b, delay: 5 ms}"
    fabric = Fabric(deployment_of("network.defaults={preset: wifi_5_indoor}", PLACES, f"network.links=[{rule}]"))
    one, other = sent(fabric, 1, ("b", "c"))
    assert (one.rule, other.rule) == ("late", "wifi_5_indoor")
    assert (one.air_start_ns, one.air_end_ns) == (other.air_start_ns, other.air_end_ns)
    assert len(fabric.airs) == 1 and fabric.profiles.on_radio


@pytest.mark.parametrize(
    ("carried", "causes"),
    [
        ("{a: [r], b: [far], c: [r, far]}", ["no_route", ""]),
        ("{a: [far], b: [r], c: [r]}", ["no_route", "no_route"]),
        ("{a: [r], b: [twin]}", ["", ""]),  # c carries nothing: the rule puts it on the radio
    ],
)
def test_who_carries_other_radios_is_not_on_that_of_a_rule(carried: str, causes: list[str]) -> None:
    wifi = "preset: wifi_5_indoor, burst: null"
    radios = f"{{r: {{{wifi}}}, far: {{preset: lora_eu868}}, twin: {{{wifi}, air: r}}}}"
    rule = "{id: near, from: '*', to: '*', via: r}"
    sets = f"network.radios={radios}", f"network.robots={carried}", PLACES, f"network.links=[{rule}]"
    found = sent(Fabric(deployment_of(*sets)), 1, ("b", "c"))
    assert [flight.cause for flight in found] == causes


def test_airtime_that_a_duty_cycle_counts_is_that_of_the_packet() -> None:
    """10 ms each of 1 % of 3 s: three of them."""
    radio = f"{PLAIN}, duty_cycle: 1 %, duty_window: 3 s"
    fabric = Fabric(deployment_of(f"network.radios={{r: {{{radio}}}}}", EVERYBODY, PLACES))
    causes = [sent(fabric, number, ("b", "c"))[0].cause for number in range(1, 6)]
    assert causes == ["", "", "", "duty_cycle", "duty_cycle"]


NEAR: Final = "{a: [0 m, 0 m, 1 m], b: [3 m, 0 m, 1 m], c: [0 m, 3 m, 1 m], '*': [3 m, 3 m, 1 m]}"


def near(radio: str) -> Fabric:
    """Stations that hear one another, with this radio."""
    deployment = deployment_of(f"network.radios={{r: {radio}}}", "network.robots={'*': [r]}", f"network.places={NEAR}")
    fabric = Fabric(deployment)
    fabric.turn_to(initial_frame(deployment))
    return fabric


@pytest.mark.parametrize("preset", ["wifi_5_indoor", "zigbee"])
def test_nothing_is_on_air_before_its_turn(preset: str) -> None:
    """Stations that hear one another take turns; who never finds a free channel has sent nothing."""
    pairs = [(one, other) for one in ENDS for other in ENDS if one != other]
    offers = [
        Flight(one, other, "news", number, number * 50 * MS, 0, bytes(60), published=True)
        for number in range(60)
        for one, other in pairs
    ]
    flights = play(near(f"{{preset: {preset}}}"), offers)
    given_up = [flight for flight in flights if flight.outcome == "collision" and not flight.airtime_ns]
    assert bool(given_up) is (preset == "zigbee")
    assert all(flight.air_start_ns == flight.air_end_ns for flight in given_up)
    assert not any(flight.interference for flight in flights)


@pytest.mark.parametrize("published", [False, True])
def test_what_the_queue_drops_costs_no_duty_cycle(published: bool) -> None:
    """Of a hundred packets at once the queue takes two: two are on air, and paid for; and so is a third one."""
    fabric = near("{preset: lora_eu868, duty_cycle: 10 %, duty_window: 60 s, queue: {packets: 2}}")
    link, radio = fabric.link("a", "b", "news"), fabric.radios
    flights = [Flight("a", "b", "news", number, 0, 0, bytes(20), published) for number in range(1, 101)]
    assert [link.send(flight) for flight in flights] == [True] * 2 + [False] * 98
    assert {flight.cause for flight in flights} == {"", "queue_full"}
    airtime_ns = lora_airtime_ns(7, 20)
    assert radio["a", "r"].sent_ns == 2 * airtime_ns
    assert link.send(Flight("a", "b", "news", 101, S, 0, bytes(20), published))
    assert radio["a", "r"].sent_ns == 3 * airtime_ns, "nothing has left the window yet"
    assert link.send(Flight("a", "b", "news", 102, 61 * S, 0, bytes(20), published))
    assert radio["a", "r"].sent_ns == 2 * airtime_ns, "the third and the fourth"


def test_what_waits_before_a_radio_counts_as_before_a_wire() -> None:
    """Payload and overhead: of 5000 B four packets of 1100 B have room."""
    settings = "rate: 1 Mbit/s, overhead: 1000 B, queue: {bytes: 5000 B}"
    on_air, on_wire = near(f"{{medium: radio, tx_power: 10 dBm, {settings}}}"), fabric_of(settings)
    found = []
    for fabric in (on_air, on_wire):
        flights = [Flight("a", "b", "data", number, 0, 0, bytes(100)) for number in range(1, 8)]
        found.append([(fabric.link("a", "b", "data").send(flight), flight.queue_bytes) for flight in flights])
    assert found[0] == found[1] == [(n < 4, 1100 * min(n, 4)) for n in range(7)]
