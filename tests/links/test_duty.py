"""The duty cycle's window: wherever it begins, no more is on air in it than its share; lint's packets get through."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.deployment.network.radios import Radio
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.links.summary import SMALL_BYTES, SharedSettings, summary_of
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.airtime import lora_airtime_ns
from foosim.vhub.stages.duty import GRAINS, RUNS_MAX
from tests.links.offered import MS, S, deployment_of, every
from tests.links.proof import Proof

HOUR_NS: Final = 3600 * S
LORA: Final = "preset: lora_eu868"
PLAIN: Final = "medium: radio, tx_power: 20 dBm, rate: 1 Mbit/s"


def fabric_of(radio: str, *sets: str) -> Fabric:
    places = "network.places={a: [0 m, 0 m, 1 m], b: [3 m, 0 m, 1 m], '*': [3 m, 3 m, 1 m]}"
    return Fabric(deployment_of(f"network.radios={{r: {{{radio}}}}}", "network.robots={'*': [r]}", places, *sets))


def offered(fabric: Fabric, times_ns: Sequence[int], sizes: Sequence[int], published: Sequence[bool]) -> list[Flight]:
    """Send at times that ascend, a broadcast to both who hear it; return what came of the first receiver's."""
    flights = []
    for number, (at_ns, size, is_broadcast) in enumerate(zip(times_ns, sizes, published, strict=True), 1):
        for to in ("b", "c")[: 1 + is_broadcast]:
            flight = Flight("a", to, "data", number, at_ns, 0, bytes(size), is_broadcast)
            fabric.link("a", to, "data").send(flight)
            if to == "b":
                flights.append(flight)
    return flights


def most_ns(flights: Sequence[Flight], window_ns: int, offsets_ns: Sequence[int] = ()) -> int:
    """Return the most airtime of any window: of those that end with a transmission or begin with one, and of others."""
    spans = [(flight.air_start_ns, flight.air_end_ns) for flight in flights if flight.air_end_ns]
    if not spans:
        return 0
    starts, ends = (np.array(times, dtype=np.int64) for times in zip(*spans, strict=True))
    assert (starts[1:] >= ends[:-1]).all(), "one after the other"
    edges = np.unique(np.concatenate([[0], starts, ends]))
    on_air = np.searchsorted(ends, edges[:-1], side="right") < np.searchsorted(starts, edges[:-1], side="right")
    before = np.concatenate([[0], np.cumsum(np.diff(edges) * on_air)])

    def until(times: np.ndarray) -> np.ndarray:
        """The airtime up to times, in whole nanoseconds."""
        at = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(edges) - 1)
        going = np.append(on_air, False)[at] * (times - edges[at])
        return np.where(times <= 0, 0, before[at] + going)

    lasts = np.concatenate([ends, starts + window_ns, np.array(offsets_ns, dtype=np.int64) + window_ns])
    return int((until(lasts) - until(lasts - window_ns)).max())


OFFERED: Final = st.lists(
    st.tuples(st.one_of(st.just(0), st.integers(0, 5_000)), st.integers(1, 50), st.booleans()), min_size=5, max_size=60
)


@pytest.mark.parametrize("radio", [LORA, f"{LORA}, spreading_factor: 10", PLAIN.replace("1 Mbit", "2 kbit")])
def test_no_window_has_more_than_its_share(radio: str) -> None:
    @settings(max_examples=40)
    @given(
        packets=OFFERED,
        share=st.sampled_from((1, 3, 10, 50)),
        window_s=st.sampled_from((2, 7, 30)),
        offsets=st.lists(st.integers(-30_000, 200_000), max_size=20),
        queue=st.sampled_from((2, 20)),
    )
    def hold(packets: list[tuple[int, int, bool]], share: int, window_s: int, offsets: list[int], queue: int) -> None:
        duty = f"duty_cycle: {share} %, duty_window: {window_s} s, queue: {{packets: {queue}}}"
        waits, sizes, published = zip(*packets, strict=True)
        fabric = fabric_of(f"{radio}, {duty}", "network.defaults={phase: 2 ms}")
        flights = offered(fabric, [wait * MS for wait in accumulate(waits)], sizes, published)
        assert most_ns(flights, window_s * S, [offset * MS for offset in offsets]) <= share * window_s * S // 100
        for flight in flights:
            if flight.cause == "duty_cycle":
                (left_ns,) = flight.decided_by
                assert isinstance(left_ns, int) and 0 <= left_ns <= share * window_s * S // 100

    hold()


def test_a_window_that_is_used_up_opens_as_what_it_counts_leaves_it() -> None:
    """Two of three at once fill it; the third has to wait until as much of the first one is over, and no longer."""
    airtime_ns = lora_airtime_ns(7, 20)
    for late_ns, cause in ((-1, "duty_cycle"), (0, "")):
        fabric = fabric_of(f"{LORA}, duty_cycle: 1 %, duty_window: 12 s")
        assert 2 * airtime_ns <= 120 * MS < 3 * airtime_ns
        free_ns = 120 * MS - 2 * airtime_ns
        third_ns = 12 * S - free_ns + late_ns
        found = offered(fabric, [0, 0, 1 * S, third_ns], [20] * 4, [False] * 4)
        assert [flight.cause for flight in found] == ["", "", "duty_cycle", cause]
        assert found[2].decided_by == (free_ns,)


def test_many_short_ones_are_remembered_together_and_the_rule_holds(proof: Proof) -> None:
    """Some thousand in a window: what is remembered is bounded, and hardly anything of the share is given away."""
    fabric = fabric_of(f"{PLAIN}, duty_cycle: 50 %, duty_window: 1 s, queue: {{packets: 10}}")
    count = proof.size(25_000, 250_000)
    sizes = [8 + k % 5 if k % 20_000 < 10_000 else 12 for k in range(count)]  # what leaves is not what comes
    flights = offered(fabric, every(100_000, count), sizes, [False] * count)
    assert most_ns(flights, S) <= S // 2
    sender = fabric.radios["a", "r"]
    assert len(sender.sent) < RUNS_MAX and sender.sent_ns == sum(airtime_ns for _, _, airtime_ns in sender.sent)
    assert {flight.cause for flight in flights} == {"", "duty_cycle"}
    seconds = count // 10_000
    whole = sum(flight.airtime_ns for flight in flights if not flight.cause and flight.sent_ns < seconds * S)
    proof.ratio("T17", "share of a duty cycle's window that many short packets get", whole / seconds / S, 0.5,
                2 / GRAINS, count)  # fmt: skip


@pytest.mark.parametrize("window", ["1 h", "2 min"])
def test_the_packets_that_lint_allows_get_through(window: str) -> None:
    """Evenly, or all at once, as many an hour as it says, on and on; a window lets no more through."""
    settings = Radio.model_validate({"preset": "lora_eu868", "duty_window": window})
    found = summary_of(SharedSettings("r", "", settings), {})
    packets_h = found.duty_packets_h
    assert packets_h is not None
    if window == "1 h":
        assert packets_h == 36 * S // lora_airtime_ns(7, SMALL_BYTES)
    radio = f"{LORA}, duty_window: {window}, loss: 0 %, queue: {{packets: 1000, wait: 1 min}}"
    even = every(-(-HOUR_NS // packets_h), 3 * packets_h)
    windows = HOUR_NS // (HOUR_NS if window == "1 h" else 120 * S)
    bursts = [k * (HOUR_NS // windows) for k in range(3 * windows) for _ in range(packets_h // windows)]
    for times_ns in (even, bursts):
        flights = offered(fabric_of(radio), times_ns, [SMALL_BYTES] * len(times_ns), [False] * len(times_ns))
        assert {flight.cause for flight in flights} == {""}
    more = sorted([*bursts, *(at_ns + 90 * S for at_ns in bursts)])
    flights = offered(fabric_of(radio), more, [SMALL_BYTES] * len(more), [False] * len(more))
    assert sum(not flight.cause for flight in flights) == len(bursts)
