"""Rate and queue: throughput, bursts, changes (T13); waits and losses of M/D/1, Little's law (T14); CoDel; traces.

Packets of 1250 bytes at 10 Mbit/s take 1 ms: that is the service time of the formulas. Sources: Pollaczek (1930) and
Khinchine (1932) for M/D/1, Gross and Harris, Fundamentals of Queueing Theory, for M/D/1/K; RFC 8289 for CoDel.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from itertools import pairwise
from math import exp, lgamma, log, sqrt
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.links.offered import MS, S, every, fabric_of, fates, poisson_ns
from tests.links.proof import Proof
from tests.links.statistics import binomial_z

SIZE: Final = 1250
RATE: Final = "rate: 10 Mbit/s"
FULL: Final = "queue_full"


# --- throughput ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rate", "bps"), [("9600 bit/s", 9_600), ("10 Mbit/s", 10**7), ("1 Gbit/s", 10**9)])
def test_a_saturated_link_delivers_its_rate(proof: Proof, rate: str, bps: int) -> None:
    """Twice as much is offered as goes through; sizes vary, headers count."""
    n = proof.size(20_000, 200_000)
    fabric = fabric_of(f"rate: {rate}, overhead: 38 B, queue: {{packets: 20}}", proof.seed)
    sizes = [40 + 97 * k % 1460 for k in range(n)]
    mean_ns = (sum(sizes) / n + 38) * 8 / bps * S
    times = [round(k * mean_ns / 2) for k in range(n)]
    sent = [(f.due_ns, len(f.payload) + 38) for f in fates(fabric, times, sizes) if not f.cause]
    (first_ns, _), (last_ns, _) = sent[0], sent[-1]
    bits = 8 * sum(size for _, size in sent[1:])
    proof.ratio("T13", f"throughput of {rate}, saturated", bits / (last_ns - first_ns) * S, bps, 0.001, len(sent))
    # a burst: more bits than the rate gives, in any time that begins anywhere
    excess = most = 0.0
    for (before_ns, _), (at_ns, size) in pairwise(sent):
        excess = max(0.0, excess + 8 * size - (at_ns - before_ns) * bps / S)
        most = max(most, excess)
    proof.below("T13", f"burst of {rate} beyond its rate (bits; one packet of the longest)", most, 8 * 1538, len(sent))


def test_a_new_rate_holds_within_one_buffer(proof: Proof) -> None:
    """10 Mbit/s, 2 from 1 s on, set by an event: what waits then leaves as it was to, all behind it at the new rate."""
    event = "network.events=[{at: 1 s, set: {link: tried, rate: 2 Mbit/s}}]"
    fabric = fabric_of(f"{RATE}, queue: {{packets: 10}}", proof.seed, event)
    sent = [f for f in fates(fabric, every(MS // 2, 6000), SIZE) if not f.cause]
    before = [f.due_ns for f in sent if f.due_ns < S]
    buffer_ns = S + 10 * 5 * MS
    after = [f.due_ns for f in sent if f.due_ns > buffer_ns]
    rates = [(len(t) - 1) * 8 * SIZE / (t[-1] - t[0]) * S for t in (before, after)]
    proof.ratio("T13", "rate before a change", rates[0], 1e7, 0.001, len(before))
    proof.ratio("T13", "rate one buffer after a change", rates[1], 2e6, 0.001, len(after))


# --- waiting ---------------------------------------------------------------------------------------------------------


def lindley(times_ns: NDArray[np.float64], service_ns: float) -> NDArray[np.float64]:
    """The waits of a queue served in order: Lindley's recursion, as a running minimum."""
    work = np.concatenate(([0.0], np.cumsum(service_ns - np.diff(times_ns))))
    waits: NDArray[np.float64] = work - np.minimum.accumulate(work)
    return waits


@pytest.mark.parametrize("load", [0.5, 0.8, 0.95])
def test_waits_are_those_of_a_queue(proof: Proof, load: float) -> None:
    """Every wait is Lindley's; the mean is that of M/D/1: rho / (2 mu (1 - rho)).

    A mean at a load of 0.95 moves by percents over a million packets. So Lindley's recursion over the same arrivals is
    the control variate: its mean over many more arrivals stands in for that over these.
    """
    n, more = proof.size(20_000, 200_000), proof.size(20_000_000, 100_000_000)
    times = poisson_ns(n, 1000 * load, proof.seed)
    flights = list(fates(fabric_of(RATE, proof.seed), times, SIZE))
    waits = np.array([f.due_ns - f.sent_ns - MS for f in flights], dtype=np.float64)
    same = lindley(np.array(times, dtype=np.float64), MS)
    proof.exact("T14", f"waits that are not Lindley's, load {load:g}", int(np.sum(waits != same)), 0, n)
    rng = np.random.Generator(np.random.Philox(proof.seed))
    total, at = 0.0, 0.0
    for _ in range(more // 4_000_000):  # runs that begin empty, long against the queue's memory
        found = lindley(np.cumsum(rng.exponential(MS / load, 4_000_000)), MS)
        total, at = total + float(np.sum(found)), at + 4_000_000
    mean = float(np.mean(waits) - np.mean(same)) + total / at
    expected = load * MS / (2 * (1 - load))
    proof.ratio("T14", f"mean wait of M/D/1 in ns, load {load:g}", mean, expected, 0.02, n)
    if load < 0.9:  # arrivals see time averages: L = lambda (W + S)
        seen = sum(f.queue_bytes for f in flights) / SIZE / n
        little = n / times[-1] * (float(np.mean(waits)) + MS)
        proof.ratio("T14", f"Little's law: packets in the system, load {load:g}", seen, little, 0.02, n)


def loss_of_md1k(load: float, k: int) -> float:
    """The share that M/D/1/K loses: of the chain of packets that a departure leaves behind."""
    arrivals = [exp(-load + j * log(load) - lgamma(j + 1)) for j in range(k + 1)]
    left = [1.0]
    for j in range(k - 1):
        rest = left[j] - left[0] * arrivals[j] - sum(left[i] * arrivals[j - i + 1] for i in range(1, j + 1))
        left.append(rest / arrivals[0])
    return 1 - 1 / (left[0] / sum(left) + load)


@pytest.mark.parametrize(("load", "k"), [(0.8, 3), (1.0, 5), (1.3, 4)])
def test_full_queues_lose_as_much_as_theory_says(proof: Proof, load: float, k: int) -> None:
    n = proof.size(60_000, 600_000)
    times = poisson_ns(n, 1000 * load, proof.seed)
    fabric = fabric_of(f"{RATE}, queue: {{packets: {k}}}", proof.seed)
    causes = Counter(f.cause for f in fates(fabric, times, SIZE))
    assert set(causes) == {"", FULL}
    expected = loss_of_md1k(load, k)
    proof.ratio("T14", f"loss of M/D/1/{k}, load {load:g}", causes[FULL] / n, expected, 0.05, n)


def test_a_queue_is_bounded_in_bytes_and_time() -> None:
    by_bytes = list(fates(fabric_of(f"{RATE}, queue: {{bytes: {4 * SIZE} B}}"), [0] * 10, SIZE))
    assert [f.cause for f in by_bytes] == [""] * 4 + [FULL] * 6
    by_time = list(fates(fabric_of(f"{RATE}, queue: {{wait: 2.5 ms}}"), [0] * 10, SIZE))
    assert [f.cause for f in by_time] == [""] * 3 + ["expired"] * 7
    assert [f.queue_ns for f in by_time[:4]] == [0, MS, 2 * MS, 3 * MS]


class Codel:
    """The law of RFC 8289, 5.5 and 5.6, with its names and default times; times are ns."""

    def __init__(self) -> None:
        self.dropping = False
        self.count = self.lastcount = self.drop_next = self.first_above = 0

    def control_law(self, t: int) -> int:
        return t + int(100 * MS / sqrt(self.count))

    def is_ok_to_drop(self, now: int, sojourn: int, packets: int) -> bool:
        if sojourn < 5 * MS or packets <= 1:
            self.first_above = 0
        elif self.first_above == 0:
            self.first_above = now + 100 * MS
        else:
            return now >= self.first_above
        return False

    def drops(self, now: int, sojourn: int, packets: int) -> bool:
        ok_to_drop = self.is_ok_to_drop(now, sojourn, packets)
        if self.dropping:
            self.dropping = ok_to_drop
            if not ok_to_drop or now < self.drop_next:
                return False
            self.count += 1
            self.drop_next = self.control_law(self.drop_next)
            return True
        if ok_to_drop:
            self.dropping = True
            delta = self.count - self.lastcount
            self.count = 1
            if delta > 1 and now - self.drop_next < 16 * 100 * MS:
                self.count = delta
            self.drop_next = self.control_law(now)
            self.lastcount = self.count
        return ok_to_drop


def test_codel_drops_as_its_standard_says() -> None:
    """Under a load that comes and goes: what a time of drops begins with is what the last one has added."""
    times: list[int] = []
    for cycle in range(8):
        first_ns = cycle * 1050 * MS
        times += [*range(first_ns, first_ns + 600 * MS, MS * 5 // 8)]
        times += range(first_ns + 600 * MS, first_ns + 1050 * MS, 2 * MS)
    law, free_ns, waiting = Codel(), 0, list[int]()
    for flight in fates(fabric_of(f"{RATE}, queue: {{drop: codel}}"), times, SIZE):
        waiting = [end_ns for end_ns in waiting if end_ns > flight.sent_ns]
        leaves_ns = max(free_ns, flight.sent_ns)
        is_dropped = law.drops(leaves_ns, leaves_ns - flight.sent_ns, len(waiting))
        assert flight.cause == ("queue_codel" if is_dropped else "")
        if not is_dropped:
            free_ns = leaves_ns + MS
            waiting.append(free_ns)
    assert 1 < law.lastcount < law.count < 500, "the count is taken up, and does not only grow"


# --- traces ----------------------------------------------------------------------------------------------------------


def test_a_trace_gives_its_opportunities(proof: Proof) -> None:
    """mahimahi's form: a saturated link sends 1500 bytes at each line, over and over; small packets share one."""
    n = proof.size(20_000, 200_000)
    lines = sorted({(7 * k * k + 3 * k) % 997 + 1 for k in range(400)} | {1000})
    files = {"lte.trace": "\n".join(map(str, lines))}
    settings = "trace: {file: lte.trace}, queue: {packets: 50}"
    for size, share in ((1500, 1), (500, 3), (3000, 0.5)):
        fabric = fabric_of(settings, proof.seed, files=files)
        due = [f.due_ns for f in fates(fabric, every(MS // 5, n), size) if not f.cause]
        rounds = due[-1] // S
        whole = bisect_right(due, rounds * S + 10)  # what leaves at once comes 1 ns apart, in order
        expected = int(rounds * len(lines) * share)
        proof.exact("T13", f"trace: packets of {size} B in whole rounds", whole, expected, n)
        at = {time_ns // MS % 1000 for time_ns in due}
        assert at <= {line % 1000 for line in lines} and all(time_ns % MS < 10 for time_ns in due)


def test_a_trace_ends() -> None:
    files = {"once.trace": "1\n2\n3"}
    fabric = fabric_of("trace: {file: once.trace, loop: false}, queue: {packets: 2}", files=files)
    flights = list(fates(fabric, [0, 0, 1, 2 * MS, 5 * MS, 6 * MS, 7 * MS], 1500))
    assert [f.due_ns for f in flights[:2]] == [MS, 2 * MS] and flights[2].cause == FULL
    assert flights[3].due_ns == 3 * MS
    assert flights[4].due_ns >= 2**62, "nothing comes out behind its end"
    assert [f.cause for f in flights[5:]] == ["expired"] * 2


def test_an_idle_trace_keeps_nothing() -> None:
    """An opportunity that nobody uses is gone."""
    fabric = fabric_of("trace: {file: t, loop: true}", files={"t": "10\n20\n30\n40\n50"})
    due = [f.due_ns // MS for f in fates(fabric, [15 * MS, 15 * MS, 120 * MS, 1001 * MS], 1500)]
    assert due == [20, 30, 120, 1010]


def test_queues_of_two_links_do_not_meet(proof: Proof) -> None:
    """A rule's rate is a queue of each link's own; a radio's is its sender's, for all its links."""
    own = fabric_of(RATE)
    assert [next(iter(fates(own, [0], SIZE, ends=("a", to)))).queue_ns for to in ("b",)] == [0]
    rule = "from: a, to: '*', "
    shared = fabric_of("loss: 0 %", 1, "network.radios={w: {preset: wired_1g, rate: 10 Mbit/s, jitter: null}}",
                       f"network.links=[{{id: tried, {rule}via: w}}]")  # fmt: skip
    waits = [next(iter(fates(shared, [0], SIZE, ends=("a", to)))).queue_ns for to in ("b", "c", "d")]
    frame = SIZE + 38
    assert waits == [k * frame * 800 for k in range(3)]
    each = fabric_of(RATE, 1, f"network.links=[{{id: tried, {rule}{RATE}}}]")
    assert [next(iter(fates(each, [0], SIZE, ends=("a", to)))).queue_ns for to in ("b", "c", "d")] == [0, 0, 0]
    n = proof.size(1000, 10_000)
    lost = sum(bool(f.cause) for f in fates(fabric_of(f"{RATE}, loss: 30 %", proof.seed), every(2 * MS, n), SIZE))
    proof.normal("T13", "loss behind a queue is the configured one", binomial_z(lost, n, 0.3), n)
