"""Delay: every shape of jitter against its law (T8), constant delay to the nanosecond (T9), order (T10 to T12).

Delays come out of links whose packets may overtake each other, so that the order changes none of them.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import exp, expm1, log, log1p, sqrt
from typing import Final

import pytest

from foosim.vhub.network.jitter import CELLS, quantiles_ns
from tests.links.offered import MS, deployment_of, every, fabric_of, fates, rule
from tests.links.proof import Proof
from tests.links.statistics import binomial_z, gamma_cdf, ks, mean_and_deviation, normal_cdf
from tests.vhub.test_jitter import moments

Law = Callable[[float], float]


def lomax(mean: float, alpha: float, top: float) -> tuple[Law, float, float]:
    """The law, the mean and the deviation of a Lomax number cut at `top`, scaled to a mean (ms)."""

    def mean_of(scale: float) -> float:
        return scale / (alpha - 1) * -expm1((1 - alpha) * log1p(top / scale))

    low, high = mean * (alpha - 1), 100 * top
    for _ in range(200):
        scale = (low + high) / 2
        low, high = (scale, high) if mean_of(scale) < mean else (low, scale)
    u = 1 + top / scale
    square = 2 * scale * scale * ((u ** (2 - alpha) - 1) / (2 - alpha) - (u ** (1 - alpha) - 1) / (1 - alpha))
    return lambda x: 1 - (1 + x / scale) ** -alpha, mean, sqrt(square - mean * mean)


def mixture(*parts: tuple[float, float, float]) -> tuple[Law, float, float]:
    """The same of uniform parts: share, from and to (ms)."""
    mean = sum(share * (a + b) / 2 for share, a, b in parts)
    square = sum(share * (a * a + a * b + b * b) / 3 for share, a, b in parts)

    def cdf(x: float) -> float:
        return sum(share * min(1.0, max(0.0, (x - a) / (b - a))) for share, a, b in parts)

    return cdf, mean, sqrt(square - mean * mean)


def gamma(mean: float, deviation: float) -> tuple[Law, float, float]:
    shape = (mean / deviation) ** 2
    return lambda x: gamma_cdf(shape, x * shape / mean), mean, deviation


def lognormal(mean: float, deviation: float) -> tuple[Law, float, float]:
    variance = log(1 + (deviation / mean) ** 2)
    middle = log(mean) - variance / 2
    return lambda x: normal_cdf((log(x) - middle) / sqrt(variance)) if x > 0 else 0.0, mean, deviation


SHAPES: Final = {
    "gamma, mean: 2 ms, sd: 1 ms": gamma(2, 1),
    "gamma, sd: 2 ms": gamma(2, 2),
    "gamma, mean: 2 ms, sd: 1.4 ms": gamma(2, 1.4),
    "gamma, mean: 1 ms, sd: 3 ms": gamma(1, 3),
    "gamma, mean: 5 ms, sd: 0.5 ms": gamma(5, 0.5),
    "uniform, width: 4 ms": (lambda x: min(1.0, x / 4), 2.0, 4 / sqrt(12)),
    "lognormal, mean: 4 ms, sd: 1 ms": lognormal(4, 1),
    "lognormal, mean: 2 ms, sd: 6 ms": lognormal(2, 6),
    "pareto, mean: 2 ms, alpha: 2.5": lomax(2, 2.5, 10_000),
    "pareto, mean: 2 ms, alpha: 1.5, max: 1 s": lomax(2, 1.5, 1000),
    "pareto, mean: 2 ms, alpha: 1.2": lomax(2, 1.2, 10_000),
    "pareto, mean: 2 ms, alpha: 20, max: 12 ms": lomax(2, 20, 12),
    "mixture, parts: [{share: 30 %, to: 2 ms}, {share: 70 %, from: 3 ms, to: 5 ms}]": mixture((0.3, 0, 2), (0.7, 3, 5)),
    "mixture, parts: [{share: 99.9 %, from: 0.1 ms, to: 0.8 ms}, {share: 0.1 %, from: 0.8 ms, to: 100 ms}]": mixture(
        (0.999, 0.1, 0.8), (0.001, 0.8, 100)
    ),
}
"""Shapes as they are written, with law, mean and standard deviation (ms)."""


RESOLVED_MS: Final = 1e-3
"""Delays are whole nanoseconds: of a law that has a fifth of its weight within the first one, only what is above this
is compared as a continuous one."""


def delays_ms(settings: str, n: int, seed: int, delay_ns: int = 7 * MS) -> list[float]:
    """What a link adds to its constant delay."""
    flights = fates(fabric_of(f"delay: {delay_ns} ns, order: free, {settings}", seed), every(MS, n))
    return [(flight.due_ns - flight.sent_ns - delay_ns) / MS for flight in flights]


@pytest.mark.parametrize("shape", SHAPES)
def test_jitter_has_its_law(proof: Proof, shape: str) -> None:
    n = proof.size(25_000, 300_000)
    cdf, mean, deviation = SHAPES[shape]
    settings = f"jitter: {{shape: {shape}}}"
    drawn = delays_ms(settings, n, proof.seed)
    least = cdf(RESOLVED_MS)
    above = [x for x in drawn if x > RESOLVED_MS]
    p = ks(above, lambda x: (cdf(x) - least) / (1 - least))
    proof.likely("T8", f"{shape}: Kolmogorov", p, len(above))
    if least > 1 / CELLS:  # what the table resolves
        z = binomial_z(n - len(above), n, least)
        proof.normal("T8", f"{shape}: share below {RESOLVED_MS * 1e3:g} us", z, n)
    proof.exact("T8", f"{shape}: delays below the constant one", sum(x < 0 for x in drawn), 0, n)
    jitter = deployment_of(rule(settings)).network.links[0].jitter
    assert jitter is not None
    exact_mean, exact_deviation = (x / MS for x in moments(quantiles_ns(jitter)))
    proof.ratio("T8", f"{shape}: mean of all draws", exact_mean, mean, 0.01, 2**64)
    proof.ratio("T8", f"{shape}: deviation of all draws", exact_deviation, deviation, 0.01, 2**64)
    found_mean, found_deviation = mean_and_deviation(drawn)
    fourth = sum((x - found_mean) ** 4 for x in drawn) / n / found_deviation**4
    proof.normal("T8", f"{shape}: mean of those drawn", (found_mean - exact_mean) / (found_deviation / sqrt(n)), n)
    if fourth < 20:  # else a sample says nothing of its law's deviation
        spread = exact_deviation * sqrt((fourth - 1) / 4 / n)
        proof.normal("T8", f"{shape}: deviation of those drawn", (found_deviation - exact_deviation) / spread, n)


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
    expected = least + mean * exp(-least / mean)
    square = least**2 + exp(-least / mean) * (2 * mean * least + 2 * mean**2)
    found, _ = mean_and_deviation(drawn)
    z = (found - expected) / sqrt((square - expected**2) / n)
    proof.normal("T8", "shifted_exp: mean", z, n)


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
    latest, reordered = 0, 0  # RFC 4737: a packet is reordered that arrives after a later one
    for at in reversed([*enumerate(due)]):
        reordered += latest != 0 and at[1] > latest
        latest = at[1] if latest == 0 else min(latest, at[1])
    if share >= 0.5:  # only the next can overtake
        proof.exact("T11", f"RFC 4737 type-P-reordered beside it, D = {share:g} w", reordered, sum(overtaken), n)


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
