"""Delay: every shape of jitter against its law (T8), constant delay to the nanosecond (T9), order (T10 to T12).

Delays come out of links whose packets may overtake each other, so that the order changes none of them.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import exp, expm1, log, sqrt
from typing import Final

import pytest
from scipy import stats

from foosim.vhub.network.jitter import CELLS
from tests.links.offered import MS, every, fabric_of, fates
from tests.links.proof import Proof
from tests.links.statistics import binomial_z, ks, mean_and_deviation


def mixture(*parts: tuple[float, float, float]) -> Callable[[float], float]:
    """The distribution function of uniform parts: share, from and to (ms)."""
    return lambda x: sum(share * min(1.0, max(0.0, (x - a) / (b - a))) for share, a, b in parts)


SHAPES: Final[dict[str, Callable[[float], float]]] = {
    "gamma, mean: 2 ms, sd: 1 ms": stats.gamma(4, scale=0.5).cdf,
    "gamma, sd: 2 ms": stats.expon(scale=2).cdf,
    "gamma, mean: 1 ms, sd: 3 ms": stats.gamma(1 / 9, scale=9).cdf,
    "uniform, width: 4 ms": stats.uniform(0, 4).cdf,
    "lognormal, mean: 2 ms, sd: 6 ms": stats.lognorm(sqrt(log(10)), scale=2 / sqrt(10)).cdf,
    "pareto, mean: 2 ms, alpha: 2.5": stats.lomax(2.5, scale=3).cdf,
    "mixture, parts: [{share: 30 %, to: 2 ms}, {share: 70 %, from: 3 ms, to: 5 ms}]": mixture((0.3, 0, 2), (0.7, 3, 5)),
    "mixture, parts: [{share: 99.9 %, from: 0.1 ms, to: 0.8 ms}, {share: 0.1 %, from: 0.8 ms, to: 100 ms}]": mixture(
        (0.999, 0.1, 0.8), (0.001, 0.8, 100)
    ),
}
"""Shapes as they are written, with the distribution function of their law (ms); tests/vhub/test_jitter.py has all."""


RESOLVED_MS: Final = 1e-3
"""Delays are whole nanoseconds: of a law that has a fifth of its weight within the first one, only what is above this
is compared as a continuous one."""


def delays_ms(settings: str, n: int, seed: int, delay_ns: int = 7 * MS) -> list[float]:
    """What a link adds to its constant delay."""
    flights = fates(fabric_of(f"delay: {delay_ns} ns, order: free, {settings}", seed), every(MS, n))
    return [(flight.due_ns - flight.sent_ns - delay_ns) / MS for flight in flights]


@pytest.mark.parametrize("shape", SHAPES)
def test_jitter_has_its_law(proof: Proof, shape: str) -> None:
    n, cdf = proof.size(25_000, 300_000), SHAPES[shape]
    drawn = delays_ms(f"jitter: {{shape: {shape}}}", n, proof.seed)
    least = cdf(RESOLVED_MS)
    above = [x for x in drawn if x > RESOLVED_MS]
    proof.likely("T8", f"{shape}: Kolmogorov", ks(above, lambda x: (cdf(x) - least) / (1 - least)), len(above))
    if least > 1 / CELLS:  # what the table resolves
        z = binomial_z(n - len(above), n, least)
        proof.normal("T8", f"{shape}: share below {RESOLVED_MS * 1e3:g} us", z, n)
    proof.exact("T8", f"{shape}: delays below the constant one", sum(x < 0 for x in drawn), 0, n)


def test_the_greater_of_a_least_delay_and_an_exponential_one(proof: Proof) -> None:
    """Where it is the least, it is that exactly, as often as it should; above, it is exponential."""
    n, least, mean = proof.size(25_000, 300_000), 2.0, 5.0
    drawn = delays_ms("jitter: {shape: shifted_exp, min: 2 ms, mean: 5 ms}", n, proof.seed)
    assert min(drawn) == least
    above = [x - least for x in drawn if x > least + 1e-3]
    due = exp(-(least + 1e-3) / mean)
    proof.normal("T8", "shifted_exp: share above the least", binomial_z(len(above), n, due), n)
    p = ks(above, lambda x: -expm1(-(x - 1e-3) / mean))
    proof.likely("T8", "shifted_exp: Kolmogorov", p, len(above))


def test_jitter_from_a_table(proof: Proof) -> None:
    """A file in netem's form; what it puts below 0 is 0."""
    n = proof.size(25_000, 300_000)
    table = " ".join(str(round(-8192 * sqrt(3) * (1 - 2 * k / 4095))) for k in range(4096))
    settings = "order: free, jitter: {{shape: table, file: uniform.dist, mean: {} ms, sd: 1 ms}}"
    drawn = {}
    for mean in (5, 1):
        fabric = fabric_of(settings.format(mean), proof.seed, files={"uniform.dist": table})
        drawn[mean] = [(f.due_ns - f.sent_ns) / MS for f in fates(fabric, every(MS, n))]
    half = sqrt(3)
    p = ks(drawn[5], lambda x: min(1.0, max(0.0, (x - 5 + half) / (2 * half))))
    proof.likely("T8", "table of a uniform law: Kolmogorov", p, n)
    proof.ratio("T8", "table: mean", mean_and_deviation(drawn[5])[0], 5.0, 0.01, n)
    proof.ratio("T8", "table: deviation", mean_and_deviation(drawn[5])[1], 1.0, 0.01, n)
    zeros = sum(x == 0 for x in drawn[1])
    assert min(drawn[1]) == 0
    proof.normal("T8", "table: share that is cut at 0", binomial_z(zeros, n, (half - 1) / (2 * half)), n)


# --- constant delay and order ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("delay_ns", [0, 1, 999, 1_000_000, 1_234_567_890])
def test_a_constant_delay_is_exact(proof: Proof, delay_ns: int) -> None:
    n = 1000
    off = [f.due_ns - f.sent_ns - delay_ns for f in fates(fabric_of(f"delay: {delay_ns} ns"), every(1_000_003, n))]
    proof.exact("T9", f"constant delay of {delay_ns} ns: greatest deviation in ns", max(map(abs, off)), 0, n)


def test_links_are_fifo(proof: Proof) -> None:
    n = proof.size(25_000, 500_000)
    jitter = "jitter: {shape: gamma, mean: 3 ms, sd: 3 ms}"
    dense = [f.due_ns for f in fates(fabric_of(f"delay: 1 ms, {jitter}", proof.seed), every(MS // 5, n))]
    proof.exact("T10", "fifo: packets that overtake, at 5 kHz", sum(b <= a for a, b in pairwise(dense)), 0, n)
    sparse = [f.due_ns - f.sent_ns for f in fates(fabric_of(jitter, proof.seed), every(300 * MS, n))]
    proof.ratio("T10", "fifo: mean delay at 3 Hz", sum(sparse) / n / MS, 3.0, max(0.01, proof.z / sqrt(n)), n)


@pytest.mark.parametrize("share", [0.25, 0.5, 0.8])
def test_free_links_overtake_as_often_as_their_jitter_says(proof: Proof, share: float) -> None:
    """Uniform over w, packets every D: P(overtaken by the next) = (1 - D / w)^2 / 2; neighbours are correlated."""
    n, width = proof.size(50_000, 1_000_000), 4 * MS
    settings = "order: free, jitter: {shape: uniform, width: 4 ms}"
    period = round(share * width)
    due = [f.due_ns for f in fates(fabric_of(settings, proof.seed), every(period, n))]
    overtaken = [b < a for a, b in pairwise(due)]
    p = (1 - share) ** 2 / 2
    both = max(0.0, 1 - 2 * share) ** 3 / 6  # J1 > D + J2 and J2 > D + J3: a corner of the cube
    variance = (p * (1 - p) + 2 * (both - p * p)) / len(overtaken)
    z = (sum(overtaken) / len(overtaken) - p) / sqrt(variance)
    proof.normal("T11", f"free order: overtaken by the next, D = {share:g} w", z, n)


def test_explicit_reordering(proof: Proof) -> None:
    n = proof.size(50_000, 1_000_000)
    settings = "delay: 2 ms, reorder: {probability: 3 %, extra: 25 ms}"
    late = [f.due_ns - f.sent_ns for f in fates(fabric_of(settings, proof.seed), every(MS, n))]
    count = sum(delay != 2 * MS for delay in late)
    proof.normal("T12", "explicit reordering: share", binomial_z(count, n, 0.03), n)
    proof.exact("T12", "explicit reordering: delays in ms", sorted(set(late)), [2 * MS, 27 * MS], n)
    overtaking = [0] * 2
    due = [f.due_ns for f in fates(fabric_of(settings, 3), every(MS, 5000))]
    for k in range(len(due) - 30):
        behind = sum(later < due[k] for later in due[k + 1 : k + 30])
        overtaking[due[k] - k * MS > 2 * MS] += behind
    assert overtaking[0] == 0 and overtaking[1] > 0, "who is late is overtaken, nobody else"
