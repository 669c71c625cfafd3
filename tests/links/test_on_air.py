"""What a radio has sent, and only that, is on air, in its duty cycle's account and in its queue."""

from __future__ import annotations

from typing import Final

import pytest

from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.airtime import lora_airtime_ns
from foosim.world.assembly.initial_state import initial_frame
from tests.links.offered import ENDS, MS, S, deployment_of, fabric_of, play

PLACES: Final = "{a: [0 m, 0 m, 1 m], b: [3 m, 0 m, 1 m], c: [0 m, 3 m, 1 m], '*': [3 m, 3 m, 1 m]}"


def near(radio: str) -> Fabric:
    """Stations that hear one another, with this radio."""
    deployment = deployment_of(
        f"network.radios={{r: {radio}}}", "network.robots={'*': [r]}", f"network.places={PLACES}"
    )
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
