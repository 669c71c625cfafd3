"""Copies and bit errors (T15): as often as configured, exactly the bits that are said, anywhere in the packet."""

from __future__ import annotations

from collections import Counter
from math import comb, expm1, log1p, sqrt

import pytest

from foosim.vhub.network.packet import Flight, content_of
from tests.links.offered import MS, every, fabric_of, fates, play
from tests.links.proof import Proof
from tests.links.statistics import binomial_z, chi_square


def flipped(before: bytes, after: bytes) -> list[int]:
    """The places of the bits that differ."""
    rest = int.from_bytes(before, "little") ^ int.from_bytes(after, "little")
    places = []
    while rest:
        places.append((rest & -rest).bit_length() - 1)
        rest &= rest - 1
    return places


@pytest.mark.parametrize(("size", "rate"), [(100, 1e-4), (1500, 1e-5), (16, 2e-3), (1, 0.1)])
def test_packets_with_errors(proof: Proof, size: int, rate: float) -> None:
    """1 - (1 - rate)^bits of the packets, binomial counts of flipped bits in them, uniform places."""
    n, bits = proof.size(30_000, 600_000), 8 * size
    settings = f"corrupt: {{bit_error_rate: {rate:.10f} p, deliver: true}}"
    zeros = bytes(size)
    counts, places, within = Counter[int](), [0] * min(bits, 16), [0] * 8
    for flight in fates(fabric_of(settings, proof.seed), every(MS, n), size):
        assert not flight.cause
        found = flipped(zeros, content_of(flight)) if flight.bits_flipped else []
        assert len(found) == flight.bits_flipped and (found or content_of(flight) == zeros)
        counts[len(found)] += 1
        for place in found:
            places[place * len(places) // bits] += 1
            within[place % 8] += 1
    what = f"{size} B at {rate:g}"
    hit = -expm1(bits * log1p(-rate))
    proof.normal("T15", f"corruption of {what}: share of packets", binomial_z(n - counts[0], n, hit), n)
    due = [n * comb(bits, k) * rate**k * (1 - rate) ** (bits - k) for k in range(1, 12 if bits > 12 else bits + 1)]
    most = len(due)
    seen = [counts[k] for k in range(1, most + 1)]
    if sum(x >= 5 for x in due) > 2:
        proof.likely("T15", f"corruption of {what}: bits in one packet", chi_square(seen, due), sum(seen))
    total = sum(places)
    proof.likely("T15", f"corruption of {what}: places", chi_square(places, [total / len(places)] * len(places)), total)
    proof.likely("T15", f"corruption of {what}: bits of a byte", chi_square(within, [total / 8] * 8), total)


@pytest.mark.parametrize(("size", "rate"), [(60_000, 0.01), (1500, 0.2), (8000, 0.5)])
def test_many_errors_in_long_packets(proof: Proof, size: int, rate: float) -> None:
    """Where a packet without errors is less likely than the least number of a float."""
    n, bits = proof.size(30, 300), 8 * size
    settings = f"corrupt: {{bit_error_rate: {rate:.3f} p, deliver: true}}"
    counts = [f.bits_flipped for f in fates(fabric_of(settings, proof.seed), every(MS, n), size)]
    z = (sum(counts) - n * bits * rate) / sqrt(n * bits * rate * (1 - rate))
    proof.normal("T15", f"corruption of {size} B at {rate:g}: bits", z, n)
    spread = sum((count - bits * rate) ** 2 for count in counts) / (bits * rate * (1 - rate))
    proof.normal("T15", f"corruption of {size} B at {rate:g}: their spread", (spread - n) / sqrt(2 * n), n)


def test_with_a_checksum_they_are_lost(proof: Proof) -> None:
    """The same packets: a draw says the same, whatever becomes of it."""
    n = proof.size(15_000, 300_000)
    lost = [f.cause for f in fates(fabric_of("corrupt: {bit_error_rate: 0.0001 p}", proof.seed), every(MS, n))]
    settings = "corrupt: {bit_error_rate: 0.0001 p, deliver: true}"
    spoiled = [f.bits_flipped > 0 for f in fates(fabric_of(settings, proof.seed), every(MS, n))]
    differing = sum((cause == "crc_fail") != bad for cause, bad in zip(lost, spoiled, strict=True))
    assert set(lost) == {"", "crc_fail"}
    proof.exact("T15", "packets lost for errors that are not those delivered with errors", differing, 0, n)


def test_an_empty_packet_has_no_bits() -> None:
    flights = fates(fabric_of("corrupt: {bit_error_rate: 50 %}"), every(MS, 50), 0)
    assert {f.cause for f in flights} == {""}


def flight_of(sequence: int, sent_ns: int, size: int = 1250) -> Flight:
    return Flight("a", "b", "data", sequence, sent_ns, 0, bytes(size))


def test_copies_are_as_frequent_as_configured(proof: Proof) -> None:
    n = proof.size(25_000, 500_000)
    count = sum(f.is_doubled for f in fates(fabric_of("duplicate: 7 %", proof.seed), every(MS, n)))
    proof.normal("T15", "duplication: share", binomial_z(count, n, 0.07), n)


def test_copies_take_time_on_the_wire_and_have_a_fate_of_their_own(proof: Proof) -> None:
    """Each has its own draws: half of either sort is lost, independently; each is served after the other."""
    n = proof.size(4000, 40_000)
    settings = "rate: 10 Mbit/s, loss: 50 %, duplicate: 100 %, delay: 5 ms"
    flights = play(fabric_of(settings, proof.seed), [flight_of(k, 10 * MS * k) for k in range(n)])
    twins = [f for f in flights if f.copy]
    originals = {f.sequence: f for f in flights if not f.copy}
    doubled = [f.sequence for f in originals.values() if f.is_doubled]
    assert sorted(f.sequence for f in twins) == doubled, "one copy of each that came through so far"
    assert not any(f.is_doubled for f in twins), "a copy is never doubled again"
    assert {f.queue_ns for f in twins} == {MS} and {f.queue_ns for f in originals.values()} == {0}
    assert all(f.due_ns == f.sent_ns + 7 * MS for f in twins if not f.cause)
    lost = sum(bool(f.cause) for f in twins)
    proof.normal("T15", "duplication: loss of copies is their own", binomial_z(lost, len(twins), 0.5), len(twins))
