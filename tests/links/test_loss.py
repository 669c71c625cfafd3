"""Loss: the configured share, independent of everything else (T1, T2, T7); in bursts as long as configured (T3 to T5).

Sources: Gilbert (1960), Elliott (1963); Salsano et al. (2009) for the four states. The variance of a mean over a chain
of two states is that of independent packets times (1 + w) / (1 - w), where w = 1 - p - r is its second eigenvalue.
"""

from __future__ import annotations

from collections import Counter
from itertools import groupby
from math import sqrt

import numpy as np
import pytest

from tests.links.offered import MS, every, fabric_of, fates, poisson_ns, uniforms
from tests.links.proof import Proof
from tests.links.statistics import binomial_p, binomial_z, chi_square, contingency


def losses(settings: str, n: int, seed: int) -> list[bool]:
    """Whether each of n packets on a link is lost."""
    return [bool(flight.cause) for flight in fates(fabric_of(settings, seed), every(MS, n))]


def runs_of_losses(lost: list[bool]) -> list[int]:
    """The lengths of losses in a row; what stands at the ends is left out, it may be cut."""
    runs = [(kind, len(list(group))) for kind, group in groupby(lost)]
    return [length for kind, length in runs[1:-1] if kind]


@pytest.mark.parametrize("percent", [0.1, 1.0, 10.0, 50.0, 99.0])
def test_independent_loss_has_its_probability(proof: Proof, percent: float) -> None:
    n = proof.size(100_000, 1_000_000)
    count = sum(losses(f"loss: {percent} %", n, proof.seed))
    proof.likely("T1", f"independent loss of {percent:g} % (exact binomial)", binomial_p(count, n, percent / 100), n)


@pytest.mark.parametrize("by", ["size", "channel", "time of day", "time between packets", "the packet before"])
def test_loss_is_independent(proof: Proof, by: str) -> None:
    n, classes = proof.size(60_000, 600_000), 4
    fabric = fabric_of("loss: 10 %", proof.seed)
    drawn = [int(classes * u) for u in uniforms(n, proof.seed, by)]
    times = poisson_ns(n, 1000.0, proof.seed)
    table = [[0] * classes for _ in range(2)]
    if by == "channel":
        flights = [fates(fabric, times, channel=f"channel-{k}") for k in range(classes)]
        for chosen, now in zip(drawn, zip(*flights, strict=True), strict=True):
            table[bool(now[chosen].cause)][chosen] += 1
            assert len({bool(flight.cause) for flight in now}) == 1, "a number is a packet's, whatever its channel"
    else:
        before, last_ns = 0, 0
        sizes = (20 + 400 * k for k in drawn) if by == "size" else 100
        for chosen, flight in zip(drawn, fates(fabric, times, sizes), strict=True):
            lost = bool(flight.cause)
            gap = min(3, (flight.sent_ns - last_ns) // 400_000)
            day = flight.sent_ns // (250 * MS) % 4
            kind = {"size": chosen, "time of day": day, "time between packets": gap}.get(by, before)
            table[lost][kind] += 1
            before, last_ns = int(lost), flight.sent_ns
        table = [row[:2] for row in table] if by == "the packet before" else table
    proof.likely("T2", f"loss against {by} (chi-squared)", contingency(table), n)


def chain_z(lost: list[bool], loss: float, eigenvalue: float) -> float:
    n = len(lost)
    return (sum(lost) / n - loss) / sqrt(loss * (1 - loss) / n * (1 + eigenvalue) / (1 - eigenvalue))


@pytest.mark.parametrize(
    ("loss", "burst"), [(0.01, 4.0), (0.05, 3.0), (0.1, 5.0), (0.003, 1.33), (0.2, 1.5), (0.6, 1.5)]
)
def test_bursts_of_packets(proof: Proof, loss: float, burst: float) -> None:
    """The mean loss, the mean length of losses in a row, and the law of these: geometric."""
    n = proof.size(100_000, 1_000_000)
    lost = losses(f"burst: {{loss: {100 * loss:g} %, mean_burst: {burst:g}}}", n, proof.seed)
    r = 1 / burst
    p = r * loss / (1 - loss)
    what = f"{100 * loss:g} % in bursts of {burst:g}"
    test = "T7" if burst == 1.33 else "T3"
    proof.normal(test, f"{what}: mean loss", chain_z(lost, loss, 1 - p - r), n)
    lengths = runs_of_losses(lost)
    mean = sum(lengths) / len(lengths)
    proof.normal("T4", f"{what}: mean burst", (mean - 1 / r) / (sqrt(1 - r) / (r * sqrt(len(lengths)))), len(lengths))
    counts = Counter(lengths)
    longest = max(counts)
    expected = [len(lengths) * r * (1 - r) ** (k - 1) for k in range(1, longest + 1)]
    tail = len(lengths) * (1 - r) ** longest
    observed = [counts[k] for k in range(1, longest + 1)]
    proof.likely("T5", f"{what}: law of bursts", chi_square([*observed, 0], [*expected, tail]), len(lengths))


def test_bursts_that_lose_a_part(proof: Proof) -> None:
    """In a bad state that loses 60 %, the mean loss and the mean losses in a row are still the configured ones."""
    n, loss, burst, bad = proof.size(200_000, 1_000_000), 0.05, 1.8, 0.6
    settings = f"burst: {{loss: {100 * loss} %, mean_burst: {burst}, bad_loss: {100 * bad} %}}"
    lost = losses(settings, n, proof.seed)
    share, r = loss / bad, 1 - (1 - 1 / burst) / bad
    w = 1 - r - r * share / (1 - share)
    # Var of a mean of Bernoulli(e x state): L(1-L) + 2 e^2 s(1-s) w/(1-w), all over n
    variance = (loss * (1 - loss) + 2 * bad * bad * share * (1 - share) * w / (1 - w)) / n
    proof.normal("T3", "5 % in bursts of 1.8 at 60 %: mean loss", (sum(lost) / n - loss) / sqrt(variance), n)
    lengths = runs_of_losses(lost)
    stay = 1 - 1 / burst
    z = (sum(lengths) / len(lengths) - burst) / (sqrt(stay) * burst / sqrt(len(lengths)))
    proof.normal("T4", "5 % in bursts of 1.8 at 60 %: mean burst", z, len(lengths))


def test_the_expert_form_of_two_states(proof: Proof) -> None:
    """p, r, h, k of netem's gemodel: the mean loss, and losses in a row by L / (L - P2)."""
    n, p, r, h, k = proof.size(200_000, 1_000_000), 0.02, 0.25, 0.3, 0.99
    settings = "gilbert_elliott: {p: 2 %, r: 25 %, h: 30 %, k: 99 %}"
    lost = losses(settings, n, proof.seed)
    bad, good_loss, bad_loss = p / (p + r), 1 - k, 1 - h
    loss, w = bad * bad_loss + (1 - bad) * good_loss, 1 - p - r
    spread = (bad_loss - good_loss) ** 2 * bad * (1 - bad) * w / (1 - w)
    z = (sum(lost) / n - loss) / sqrt((loss * (1 - loss) + 2 * spread) / n)
    proof.normal("T3", "gilbert_elliott p 2 %, r 25 %, h 30 %, k 99 %: mean loss", z, n)
    both = (1 - bad) * good_loss * ((1 - p) * good_loss + p * bad_loss)
    both += bad * bad_loss * (r * good_loss + (1 - r) * bad_loss)
    lengths = runs_of_losses(lost)
    mean = sum(lengths) / len(lengths)
    deviation = sqrt(sum((x - mean) ** 2 for x in lengths) / (len(lengths) - 1))
    z = (mean - loss / (loss - both)) / (deviation / sqrt(len(lengths)))
    proof.normal("T4", "gilbert_elliott: mean burst", z, len(lengths))


def stationary(steps: list[list[float]]) -> list[float]:
    """The stationary distribution of a chain: it is left as it is by a step, and its sum is 1."""
    stay = np.vstack([np.transpose(steps) - np.eye(len(steps)), np.ones(len(steps))])
    return [*map(float, np.linalg.lstsq(stay, [0.0] * len(steps) + [1.0], rcond=None)[0])]


def test_the_expert_form_of_four_states(proof: Proof) -> None:
    """States 1 good, 2 a delivery within a burst, 3 a burst, 4 a single loss; lost are 3 and 4."""
    n = proof.size(200_000, 1_000_000)
    p13, p31, p32, p23, p14 = 0.01, 0.2, 0.1, 0.4, 0.005
    settings = "markov4: {p13: 1 %, p31: 20 %, p32: 10 %, p23: 40 %, p14: 0.5 %}"
    steps: list[list[float]] = [
        [1 - p13 - p14, 0, p13, p14],
        [0, 1 - p23, p23, 0],
        [p31, p32, 1 - p31 - p32, 0],
        [1, 0, 0, 0],
    ]
    share = stationary(steps)
    loss = share[2] + share[3]
    # the variance of the mean by the autocovariance of "lost", summed over lags
    variance, at = loss * (1 - loss), [0.0, 0.0, share[2], share[3]]
    for _ in range(2000):
        at = [sum(at[i] * steps[i][j] for i in range(4)) for j in range(4)]
        variance += 2 * (at[2] + at[3] - loss * loss)
    lost = losses(settings, n, proof.seed)
    proof.normal("T3", "markov4: mean loss", (sum(lost) / n - loss) / sqrt(variance / n), n)


def test_single_losses_beside_bursts_add_up(proof: Proof) -> None:
    """What a burst spares is lost independently: each has its own cause, and its own share."""
    n = proof.size(100_000, 1_000_000)
    settings = "loss: 5 %, gilbert_elliott: {p: 10 %, r: 50 %}"
    causes = Counter(flight.cause for flight in fates(fabric_of(settings, proof.seed), every(MS, n)))
    burst, spared = causes["burst_loss"], n - causes["burst_loss"]
    proof.normal("T3", "losses beside bursts", binomial_z(causes["random_loss"], spared, 0.05), n)
    share, w = 1 / 6, 0.4
    z = (burst / n - share) / sqrt(share * (1 - share) / n * (1 + w) / (1 - w))
    proof.normal("T3", "bursts beside losses", z, n)
