"""What a radio has sent, and only that, is on air, in its duty cycle's account and in its queue."""

from __future__ import annotations

from typing import Final

from foosim.protocol.start import initial_frame
from foosim.vhub.fabric import Fabric
from foosim.vhub.packet import Flight
from tests.links.offered import ENDS, MS, deployment_of, play

PLACES: Final = "{a: [0 m, 0 m, 1 m], b: [3 m, 0 m, 1 m], c: [0 m, 3 m, 1 m], '*': [3 m, 3 m, 1 m]}"


def near(radio: str) -> Fabric:
    """Stations that hear one another, with this radio."""
    deployment = deployment_of(
        f"network.radios={{r: {radio}}}", "network.robots={'*': [r]}", f"network.places={PLACES}"
    )
    fabric = Fabric(deployment)
    fabric.turn_to(initial_frame(deployment))
    return fabric


def test_802154_that_never_finds_the_channel_free_spoils_nobody() -> None:
    """Stations that hear one another take turns; who gives up has sent nothing, and no airtime is in its row."""
    pairs = [(one, other) for one in ENDS for other in ENDS if one != other]
    offers = [
        Flight(one, other, "news", number, number * 50 * MS, 0, bytes(60), published=True)
        for number in range(60)
        for one, other in pairs
    ]
    flights = play(near("{preset: zigbee}"), offers)
    given_up = [flight for flight in flights if flight.outcome == "collision" and not flight.airtime_ns]
    assert given_up and all(flight.air_start_ns == flight.air_end_ns for flight in given_up)
    assert not any(flight.interference for flight in flights)
