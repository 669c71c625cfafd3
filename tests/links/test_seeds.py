"""Seeds are independent (T23): no two networks have anything in common, nor two slots or two links of one."""

from __future__ import annotations

import numpy as np
from scipy import stats

from foosim.common.keyed_random import Slot
from foosim.vhub.links.fabric import Fabric
from tests.links.offered import MS, deployment_of, every, fabric_of, fates, rule
from tests.links.proof import Proof
from tests.links.statistics import binomial_z, chi_square, ks

SEEDS = 64
LINKS = ("a", "b"), ("b", "a"), ("a", "c"), ("c", "b")


def test_p_values_are_uniform_over_seeds(proof: Proof) -> None:
    """The share of losses with each of 64 seeds: its p-values follow the uniform law."""
    n = proof.size(1000, 100_000)
    first = 1 + SEEDS * (proof.seed - 1)
    found = []
    for seed in range(first, first + SEEDS):
        lost = sum(bool(f.cause) for f in fates(fabric_of("loss: 30 %", seed), every(MS, n)))
        found.append(float(stats.norm.cdf(binomial_z(lost, n, 0.3))))
    proof.likely("T23", "p-values of 64 seeds: Kolmogorov against uniform", ks(found, float), SEEDS)


def test_slots_links_seeds_and_packets_are_uniform_and_do_not_correlate(proof: Proof) -> None:
    """All slots of four links, of one of them with the next seed, and of its next packets."""
    n = proof.size(5000, 100_000)
    deployment = deployment_of(rule("loss: 1 %", "from: '*', to: '*'"))
    seeds = proof.seed, proof.seed + 1
    one, other = (Fabric(deployment, deployment.network.model_copy(update={"seed": seed})) for seed in seeds)
    tried = [*((one, link) for link in LINKS), (other, LINKS[0])]
    flights = [fates(fabric, every(MS, n + 1), ends=ends) for fabric, ends in tried]
    draws = [np.array([flight.words for flight in offered], np.uint64) for offered in flights]
    for slot in Slot:
        counts = np.bincount(draws[0][:, slot] & np.uint64(255), minlength=256)
        p = chi_square(counts.tolist(), [(n + 1) / 256] * 256)
        proof.likely("T23", f"low bits of the slot {slot.name.lower()} (chi-squared, 255 degrees)", p, n)
    columns = np.hstack([*(words[1:] for words in draws), draws[0][:-1]]).astype(float)
    assert columns.shape == (n, (len(tried) + 1) * len(Slot))
    found = np.abs(np.triu(np.corrcoef(columns, rowvar=False), 1))
    limit = float(stats.norm.isf(proof.alpha / 2 / (found.shape[0] * (found.shape[0] - 1) / 2))) / n**0.5
    proof.below("T23", f"greatest correlation of two of {found.shape[0]} columns", float(found.max()), limit, n)
