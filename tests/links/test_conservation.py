"""Of the stages that would drop a packet the first names the cause (T24); more signal is never less (T25)."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.common.limits import FRAMES_MAX
from foosim.vhub.network.packet import Flight
from tests.links.offered import MS, every, fabric_of, fates
from tests.links.proof import Proof


@settings(max_examples=30)
@given(
    st.lists(st.tuples(st.integers(0, 10**12), st.integers(0, 1500)), min_size=1, max_size=50),
    st.sampled_from(["allow: true", "loss: 0 %", "duplicate: 0 %", "corrupt: {bit_error_rate: 0 p}", "delay: 0 s",
                     "loss: 0 %, order: free", "reorder: {probability: 0 %, extra: 1 s}"]),
)  # fmt: skip
def test_with_everything_off_nothing_is_dropped_or_delayed(offers: list[tuple[int, int]], off: str) -> None:
    times = sorted({at for at, _ in offers})
    for flight in fates(fabric_of(off), times, [size for _, size in offers]):
        assert (flight.cause, flight.due_ns) == ("", flight.sent_ns)
        assert not flight.is_doubled and not flight.bits_flipped


# --- the first gate --------------------------------------------------------------------------------------------------

GATES: Final[tuple[tuple[str, str], ...]] = (
    ("too_big", "mtu: 1 B"),
    ("filtered", "allow: false"),
    ("queue_full", "rate: 1 bit/s, queue: {bytes: 1 B}"),
    ("random_loss", "loss: 100 %"),
    ("crc_fail", "corrupt: {bit_error_rate: 50 %}"),
    ("expired", "ttl: 1 ms, delay: 2 ms"),
    ("rx_down", ""),
)
"""A cause for each stage in their fixed order, and what makes it drop everything."""


def test_an_earlier_gate_beats_a_later_one(proof: Proof) -> None:
    """Of all that would drop a packet the first names the cause, for every choice of them."""
    wrong = 0
    for chosen in range(1, 2 ** len(GATES)):
        gates = [gate for place, gate in enumerate(GATES) if chosen >> place & 1]
        fabric = fabric_of(", ".join(["allow: true"] * ("allow: false" not in [g[1] for g in gates])
                                     + [written for _, written in gates if written]))  # fmt: skip
        link = fabric.link("a", "b", "data")
        flight = Flight("a", "b", "data", 1, 0, 0, bytes(100))
        flight.size = FRAMES_MAX + 1
        if link.send(flight):
            link.arrive(flight, "rx_down" if gates[-1][0] == "rx_down" else "")
        wrong += flight.cause != gates[0][0]
    proof.exact("T24", "combinations of gates in which not the first names the cause", wrong, 0, 2 ** len(GATES) - 1)
    sizes = [FRAMES_MAX, FRAMES_MAX + 1]
    assert [flight.cause for flight in fates(fabric_of("mtu: 1 B"), [0, 1], sizes)] == ["", "too_big"]


def test_what_is_dropped_early_leaves_later_stages_as_they_were() -> None:
    """A packet that is filtered or cut neither waits in a queue nor moves a chain, nor is the order's last."""
    settings_ = "rate: 1 Mbit/s, gilbert_elliott: {p: 30 %, r: 30 %}, jitter: {shape: gamma, sd: 5 ms}"
    cut = "network.events=[{at: 10 ms, for: 30 ms, partition: [[a], [rest]]}]"
    with_cut = list(fates(fabric_of(settings_, 1, cut), every(MS, 100)))
    fabric = fabric_of(settings_)
    link = fabric.link("a", "b", "data")
    for flight in with_cut:
        if flight.cause == "partition" and flight.arrival_tick == -1 and 10 * MS <= flight.sent_ns < 40 * MS:
            continue
        alone = Flight("a", "b", "data", flight.sequence, flight.sent_ns, 0, flight.payload)
        if link.send(alone):
            link.arrive(alone, "")
        assert alone.due_ns == flight.due_ns
        assert flight.cause in (alone.cause, "partition")


# --- metamorphic -----------------------------------------------------------------------------------------------------


def received(n: int, seed: int, **changed: Any) -> int:
    """How many broadcasts of n come through a link, over 60 m with fading if nothing else is said."""
    at = {"power": 5, "distance": 60, "rate": "6 Mbit/s", "preset": "wifi_5_indoor", "factor": 7} | changed
    wifi = f"burst: null, rates: fixed, fixed_rate: {at['rate']}"
    more = wifi if at["preset"] == "wifi_5_indoor" else "loss: 0 %"
    more += ", queue: {packets: 1000000, bytes: 1 GiB}, duty_cycle: 100 %"
    if at["preset"] == "lora_eu868":
        more += f", spreading_factor: {at['factor']}"
    fading = "fading: {kind: rayleigh, coherence: 1 ms}, shadowing: {on: false}"
    sets = (
        f"network.radios={{r: {{preset: {at['preset']}, tx_power: {at['power']} dBm, {more}, {fading}}}}}",
        "network.robots={'*': [r]}",
        f"network.places={{a: [0 m, 0 m, 1 m], b: [{at['distance']} m, 0 m, 1 m], '*': [0 m, 0 m, 50 m]}}",
    )
    fabric = fabric_of("allow: true", seed, "network.links=[]", *sets)
    link, count = fabric.link("a", "b", "news"), 0
    payload = bytes(50 if at["preset"] == "lora_eu868" else 80)
    for sequence in range(1, n + 1):
        flight = Flight("a", "b", "news", sequence, sequence * 400 * MS, 0, payload, published=True)
        count += link.send(flight) and link.arrive(flight, "")
    return count


@pytest.mark.parametrize(
    ("what", "values"),
    [
        ("power", [{"power": p} for p in range(-6, 24, 3)]),
        ("rate", [{"rate": f"{r} Mbit/s", "power": 0} for r in (54, 48, 36, 24, 18, 12, 6)]),
        ("power of zigbee", [{"preset": "zigbee", "power": p} for p in range(-40, 0, 5)]),
        ("power of LoRa", [{"preset": "lora_eu868", "power": p, "distance": 3000} for p in range(-10, 15, 3)]),
        ("distance", [{"preset": "zigbee", "power": -10, "distance": d} for d in (4000, 2000, 1000, 500, 200, 50, 10)]),
        ("spreading factor", [{"preset": "lora_eu868", "factor": f, "distance": 5000} for f in range(7, 13)]),
    ],
)
def test_more_signal_is_never_less(proof: Proof, what: str, values: list[dict[str, Any]]) -> None:
    """The same packets with the same draws, better and better: none that came through is lost."""
    n = proof.size(150, 1500)
    counts = [received(n, proof.seed, **value) for value in values]
    assert counts[0] < counts[-1], counts
    falls = sum(b < a for a, b in pairwise(counts))
    proof.exact("T25", f"{what}: steps that lower the share received", falls, 0, n)


def test_scaled_times_scale_delays(proof: Proof) -> None:
    """Everything ten times as long, sent ten times as slowly: every delay is ten times as long."""
    n = proof.size(3000, 30_000)
    written = "delay: {0} ms, jitter: {{shape: gamma, mean: {1} ms, sd: {0} ms}}, rate: {2} kbit/s, "
    written += "burst: {{loss: 10 %, mean_bad: {3} ms, bad_loss: 50 %, bad_extra_delay: {1} ms}}"
    slow = list(fates(fabric_of(written.format(20, 40, 100, 300), proof.seed), every(90 * MS, n)))
    fast = list(fates(fabric_of(written.format(2, 4, 1000, 30), proof.seed), every(9 * MS, n)))
    assert [f.cause for f in slow] == [f.cause for f in fast] and any(f.cause for f in slow)
    off = max(abs((s.due_ns - s.sent_ns) - 10 * (f.due_ns - f.sent_ns)) for s, f in zip(slow, fast, strict=True))
    proof.below("T25", "delays at a tenth of the speed less ten times the delay, at most (ns)", off, 200, n)
