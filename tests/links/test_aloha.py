"""LoRa is pure ALOHA with capture (T17): as many packets get through as the law says, and the strongest survives.

Source of the law S = G e^-2G without capture: Abramson, "The ALOHA system" (1970).
"""

from __future__ import annotations

from itertools import pairwise
from math import exp
from typing import Final

import pytest

from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.airtime import lora_airtime_ns
from tests.links.offered import deployment_of, play, poisson_ns
from tests.links.proof import Proof

SIZE: Final = 20
RADIO: Final = "{preset: lora_eu868, duty_cycle: 100 %, loss: 0 %, shadowing: {on: false}}"


def lora(far_m: float = 100.0) -> Fabric:
    """Any number of stations b1, b2, ... 100 m from a, and others c1, c2, ... somewhere else; all on one air."""
    places = f"{{a: [0 m, 0 m, 1 m], 'b*': [100 m, 0 m, 1 m], 'c*': [0 m, {far_m} m, 1 m]}}"
    robots = "{a: [l], 'b*': [l], 'c*': [l]}"
    return Fabric(
        deployment_of(f"network.radios={{l: {RADIO}}}", f"network.places={places}", f"network.robots={robots}")
    )


def packet(source: str, sequence: int, sent_ns: int) -> Flight:
    return Flight(source, "a", "data", sequence, sent_ns, 0, bytes(SIZE))


@pytest.mark.parametrize("load", [0.1, 0.5, 1.0])
def test_throughput_without_capture(proof: Proof, load: float) -> None:
    """Of equal powers whoever overlaps is lost, both of them; each packet is of a station of its own."""
    n = proof.size(8_000, 200_000)
    airtime_ns = lora_airtime_ns(7, SIZE)
    times = poisson_ns(n, load / airtime_ns * 1e9, proof.seed)
    gaps = [later - earlier >= airtime_ns for earlier, later in pairwise(times)]
    alone = [before and after for before, after in zip([True, *gaps], [*gaps, True], strict=True)]
    flights = play(lora(), [packet(f"b{k}", k, at_ns) for k, at_ns in enumerate(times)])
    through = [not flight.cause for flight in flights]
    proof.exact("T17", f"ALOHA at load {load:g}: who is alone gets through, nobody else", sum(through), sum(alone), n)
    assert through == alone
    within = 0.02 if proof.is_full else 0.1
    proof.ratio("T17", f"ALOHA at load {load:g}: throughput", load * sum(through) / n, load * exp(-2 * load), within, n)


@pytest.mark.parametrize(
    ("far_m", "one", "two"), [(180.0, "", ""), (150.0, "", "collision"), (140.0, "collision", "collision")]
)
def test_a_signal_survives_what_is_together_6_db_weaker(far_m: float, one: str, two: str) -> None:
    """37.6 lg(d / 100 m) below it: 9.6 dB at 180 m, 6.6 at 150, 5.5 at 140; two of them are 3 dB more."""
    for others, cause in ((["c1"], one), (["c1", "c2"], two)):
        flights = play(lora(far_m), [packet("b1", 1, 0), *(packet(name, 2, 1_000_000) for name in others)])
        assert flights[0].cause == cause, (far_m, others)
