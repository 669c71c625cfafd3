"""Loss: the configured share, independent of everything else (T1, T2, T7); in bursts as long as configured (T3 to T5).

Sources: Gilbert (1960), Elliott (1963); Salsano et al. (2009) for the four states. The variance of a mean over a chain
of two states is that of independent packets times (1 + w) / (1 - w), where w = 1 - p - r is its second eigenvalue.
"""

from __future__ import annotations

from collections import Counter
from itertools import groupby
from math import sqrt
from typing import Final

import numpy as np
import pytest

from tests.links.offered import MS, every, fabric_of, fates, poisson_ns, uniforms
from tests.links.proof import Proof
from tests.links.statistics import binomial_p, binomial_z, chi_square, contingency, mean_and_deviation


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


Chain = tuple[list[list[float]], list[float]]
"""Steps between states, and the loss in each."""


def two(p: float, r: float, h: float = 0.0, k: float = 1.0) -> Chain:
    return [[1 - p, p], [r, 1 - r]], [1 - k, 1 - h]


def bursts(loss: float, mean_burst: float, bad_loss: float = 1.0) -> Chain:
    """The chain of two states with this mean loss and this mean number of losses in a row."""
    share, r = loss / bad_loss, 1 - (1 - 1 / mean_burst) / bad_loss
    return two(r * share / (1 - share), r, 1 - bad_loss)


CHAINS: Final[dict[str, Chain]] = {
    **{
        f"burst: {{loss: {100 * loss:g} %, mean_burst: {burst:g}}}": bursts(loss, burst)
        for loss, burst in ((0.01, 4.0), (0.05, 3.0), (0.1, 5.0), (0.003, 1.33), (0.2, 1.5), (0.6, 1.5))
    },
    "burst: {loss: 5 %, mean_burst: 1.8, bad_loss: 60 %}": bursts(0.05, 1.8, 0.6),
    "gilbert_elliott: {p: 2 %, r: 25 %, h: 30 %, k: 99 %}": two(0.02, 0.25, 0.3, 0.99),
    "loss: 5 %, gilbert_elliott: {p: 10 %, r: 50 %}": two(0.1, 0.5, 0.0, 0.95),
    "markov4: {p13: 1 %, p31: 20 %, p32: 10 %, p23: 40 %, p14: 0.5 %}": (
        [[0.985, 0, 0.01, 0.005], [0, 0.6, 0.4, 0], [0.2, 0.1, 0.7, 0], [1, 0, 0, 0]],
        [0, 0, 1, 1],
    ),
}
"""Of four states: good, a delivery within a burst, a burst, a single loss."""


@pytest.mark.parametrize("settings", CHAINS)
def test_bursts_of_packets(proof: Proof, settings: str) -> None:
    """The mean loss, and the mean length of losses in a row, L / (L - P2); of two pure states their law: geometric."""
    n, steps, of = proof.size(200_000, 1_000_000), *map(np.array, CHAINS[settings])
    share = np.linalg.matrix_power(0.5 * (steps + np.eye(len(of))), 2**20)[0]
    loss, at = float(share @ of), share * of
    both = float(at @ steps @ of)
    variance = loss * (1 - loss)  # of the mean: by the autocovariance of "lost", summed over lags
    for _ in range(2000):
        at = at @ steps
        variance += 2 * (float(at @ of) - loss * loss)
    lost = losses(settings, n, proof.seed)
    proof.normal("T3", f"{settings}: mean loss", (sum(lost) / n - loss) / sqrt(variance / n), n)
    lengths = runs_of_losses(lost)
    mean, deviation = mean_and_deviation(lengths)
    expected = loss / (loss - both)
    proof.normal("T4", f"{settings}: mean burst", (mean - expected) / (deviation / sqrt(len(lengths))), len(lengths))
    if [*of] == [0, 1]:
        r, counts, longest = 1 / expected, Counter(lengths), max(lengths)
        due = [len(lengths) * r * (1 - r) ** (k - 1) for k in range(1, longest + 1)]
        seen = [counts[k] for k in range(1, longest + 1)]
        p = chi_square([*seen, 0], [*due, len(lengths) * (1 - r) ** longest])
        proof.likely("T5", f"{settings}: law of bursts", p, len(lengths))


def test_single_losses_beside_bursts_have_their_own_cause(proof: Proof) -> None:
    n = proof.size(100_000, 1_000_000)
    settings = "loss: 5 %, gilbert_elliott: {p: 10 %, r: 50 %}"
    causes = Counter(flight.cause for flight in fates(fabric_of(settings, proof.seed), every(MS, n)))
    spared = n - causes["burst_loss"]
    proof.normal("T3", "losses beside bursts", binomial_z(causes["random_loss"], spared, 0.05), n)
