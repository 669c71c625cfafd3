"""Turns on Wi-Fi: stations that hear one another never send at once, whoever comes in between."""

from __future__ import annotations

from itertools import combinations
from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.protocol.messages import Sent
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.airtime import wifi_ack_ns
from foosim.vhub.radio.timings import WIFI_5
from foosim.vhub.state.hub_state import HubState
from foosim.world.assembly.initial_state import initial_frame
from tests.links.offered import ENDS, Hub, deployment_of

RADIO: Final = (
    "preset: wifi_5_indoor, tx_power: {power} dBm, shadowing: {{on: false}}, burst: null, jitter: null, loss: 0 %, "
    "rates: fixed, fixed_rate: 6 Mbit/s, retries: 31, queue: {{packets: 100}}"
)
CARRIED: Final = "network.robots={a: [r], b: [r], c: [r], d: [r]}"
LINE: Final = "network.places={a: [0 m, 0 m, 9 m], b: [9 m, 0 m, 9 m], c: [18 m, 0 m, 9 m], d: [27 m, 0 m, 9 m]}"
TRAFFIC: Final = st.lists(
    st.lists(st.tuples(st.sampled_from(ENDS), st.booleans(), st.integers(1, 1400)), max_size=6), min_size=3, max_size=9
)


@pytest.mark.parametrize("power", [20, -16])
def test_stations_that_hear_one_another_take_turns(power: int) -> None:
    """On a line, where all hear all, or each its neighbours; from a journal that is folded at every tick, too."""
    deployment = deployment_of(
        f"network.radios={{r: {{{RADIO.format(power=power)}}}}}", CARRIED, LINE, "network.defaults={phase: 1 ms}",
    )  # fmt: skip
    fabric = Fabric(deployment)
    fabric.turn_to(initial_frame(deployment))
    hear = {frozenset(ends) for ends in combinations(ENDS, 2) if _hears(fabric, *ends)}
    assert len(hear) == (6 if power == 20 else 3)
    tail_ns = WIFI_5.sifs_ns + wifi_ack_ns("ofdm_6", WIFI_5)

    @settings(max_examples=25)
    @given(traffic=TRAFFIC)
    def hold(traffic: list[list[tuple[str, bool, int]]]) -> None:
        found: list[list[tuple[str, int, int, str]]] = []
        for folds in (False, True):
            hub, number = Hub(deployment), 0
            for packets in [*traffic, *[[]] * 60]:
                sent: dict[str, list[Sent]] = {}
                for source, is_broadcast, size in packets:
                    number += 1
                    to = "" if is_broadcast else ENDS[ENDS.index(source) - 1 if source != "a" else 1]
                    sent.setdefault(source, []).append(Sent(number, to, "news", 0, bytes(size)))
                hub.close(sent)
                if folds:
                    hub.state = HubState.restore(deployment, hub.state.snapshot())
            assert not hub.state.in_flight()
            found.append([(f.source, f.sequence, f.due_ns, f.cause) for f in hub.fates])
        assert found[0] == found[1]
        got = [flight for flight in hub.fates if not flight.cause]
        for one, other in combinations({(f.source, f.sequence): f for f in got}.values(), 2):
            if frozenset((one.source, other.source)) in hear or one.source == other.source:
                first, second = sorted((one, other), key=lambda flight: flight.air_start_ns)
                assert first.air_end_ns + (0 if first.published else tail_ns) <= second.air_start_ns
        for flight in got:
            spent_ns = flight.phase_ns + flight.queue_ns + flight.access_ns + flight.airtime_ns
            assert flight.sent_ns + spent_ns == flight.air_end_ns <= flight.due_ns
            assert flight.due_ns <= flight.arrival_tick * deployment.tick_ns < flight.due_ns + deployment.tick_ns

    hold()


def _hears(fabric: Fabric, one: str, other: str) -> bool:
    budget = fabric.link(one, other, "news").setup_at(0).budget
    assert budget is not None
    of = budget.propagation
    return of.hears(of.place(one), of.place(other), of.power_cdbm)


def test_a_packet_that_comes_in_between_puts_off_the_others() -> None:
    """By its exchange less the slot that others count down meanwhile; never forward, and what has begun stays."""
    deployment = deployment_of(f"network.radios={{r: {{{RADIO.format(power=20)}}}}}", CARRIED, LINE)
    fabric = Fabric(deployment)
    before: dict[tuple[str, int], int] = {}
    shifts = set()
    flights: list[Flight] = []
    for number in range(1, 200):
        source, to = (("a", "b"), ("c", "d"), ("b", "a"), ("d", "c"))[number % 4]
        sent_ns = number // 4 * 6_000_000
        flight = Flight(source, to, "news", number, sent_ns, 0, bytes(500))
        fabric.link(source, to, "news").send(flight)
        alone_ns = WIFI_5.difs_ns + WIFI_5.slot_ns + flight.airtime_ns + WIFI_5.sifs_ns + wifi_ack_ns("ofdm_6", WIFI_5)
        for known in flights:
            later_ns = known.air_end_ns - before[known.source, known.sequence]
            assert later_ns == 0 or (later_ns > 0 and known.air_start_ns > sent_ns)
            if later_ns and flight.retries == 0:
                shifts.add(later_ns - alone_ns)
        flights.append(flight)
        before = {(known.source, known.sequence): known.air_end_ns for known in flights}
    assert shifts and shifts <= {-k for k in range(WIFI_5.slot_ns + 1)}, "less a slot, or what was left of one"
