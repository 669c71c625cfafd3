"""Seeds are independent (T23): of 64 networks no two have anything in common, nor two slots or two links of one."""

from __future__ import annotations

from itertools import combinations

from scipy import stats

from foosim.common.keyed_random import Slot
from foosim.vhub.links.fabric import Fabric
from tests.links.offered import ENDS, MS, deployment_of, every, fabric_of, fates, rule
from tests.links.proof import Proof
from tests.links.statistics import binomial_z, chi_square, correlation, ks_uniform

SEEDS = 64


def test_p_values_are_uniform_over_seeds(proof: Proof) -> None:
    """T1 once more with each of 64 seeds: its p-values come of the uniform law."""
    n = proof.size(3000, 100_000)
    first = 1 + SEEDS * (proof.seed - 1)
    found = []
    for seed in range(first, first + SEEDS):
        lost = sum(bool(f.cause) for f in fates(fabric_of("loss: 30 %", seed), every(MS, n)))
        found.append(float(stats.norm.cdf(binomial_z(lost, n, 0.3))))
    proof.likely("T23", "p-values of 64 seeds: Kolmogorov against uniform", ks_uniform(found), SEEDS)


def draws(fabric: Fabric, ends: tuple[str, str], n: int) -> list[tuple[float, ...]]:
    return [tuple(word / 2**64 for word in f.words) for f in fates(fabric, every(MS, n), ends=ends)]


def test_slots_and_links_do_not_correlate(proof: Proof) -> None:
    n = proof.size(5000, 100_000)
    deployment = deployment_of(rule("loss: 1 %", "from: '*', to: '*'"))
    fabric = Fabric(deployment, deployment.network.model_copy(update={"seed": proof.seed}))
    pairs = [(one, other) for one, other in combinations(ENDS, 2)] + [("b", "a")]
    by_link = {pair: draws(fabric, pair, n) for pair in pairs}
    limit = 4 / n**0.5 if not proof.is_full else 5.5 / n**0.5  # of 49 pairs none is beyond that
    columns = list(zip(*by_link["a", "b"], strict=True))
    slots = [abs(correlation(columns[one], columns[other])) for one, other in combinations(range(len(Slot)), 2)]
    proof.below("T23", f"greatest correlation of two slots ({len(slots)} pairs)", max(slots), limit, n)
    loss = {pair: [words[Slot.LOSS] for words in found] for pair, found in by_link.items()}
    links = [abs(correlation(loss[one], loss[other])) for one, other in combinations(pairs, 2)]
    proof.below("T23", f"greatest correlation of two links ({len(links)} pairs)", max(links), limit, n)
    follow = abs(correlation(loss["a", "b"][1:], loss["a", "b"][:-1]))
    proof.below("T23", "correlation of a packet with the next", follow, limit, n)


def test_every_slot_is_uniform(proof: Proof) -> None:
    n = proof.size(20_000, 500_000)
    counts = [[0] * 256 for _ in Slot]
    for flight in fates(fabric_of("loss: 1 %", proof.seed), every(MS, n)):
        for slot in Slot:
            counts[slot][flight.words[slot] & 255] += 1
    for slot in Slot:
        p = chi_square(counts[slot], [n / 256] * 256)
        proof.likely("T23", f"low bits of the slot {slot.name.lower()} (chi-squared, 255 degrees)", p, n)
