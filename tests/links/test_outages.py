"""Bursts and outages in seconds (T6): times of a link, the same for all who send, as long and frequent as configured.

Who sends periodically sees a bad time as long as it has packets that meet it.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from math import sqrt
from typing import Final

import pytest

from foosim.common.keyed_random import draw_key
from foosim.deployment.network.impairments import ParetoDwell
from foosim.vhub.network.good_bad_periods import Episodes, pareto_with_mean
from foosim.vhub.network.packet import Flight
from tests.links.offered import MS, S, every, fabric_of, fates
from tests.links.proof import Proof
from tests.links.statistics import binomial_z, ks, ks_exponential

Times = list[tuple[int, int]]


def scale_of(mean: float, alpha: float, top: float) -> float:
    """The least length of a Pareto law that, cut at `top`, has this mean."""
    low, high = 0.0, mean
    for _ in range(80):
        scale = (low + high) / 2
        found = (alpha * scale - scale**alpha * top ** (1 - alpha)) / (alpha - 1)
        low, high = (scale, high) if found < mean else (low, scale)
    return scale


PARETO: Final = ParetoDwell.model_validate({"alpha": 1.5, "max": "400 ms"})


@pytest.mark.parametrize("dwell", [None, PARETO], ids=["exponential", "Pareto"])
def test_lengths_are_of_their_laws(proof: Proof, dwell: ParetoDwell | None) -> None:
    """The times themselves, one after the other: many more than a flow of packets meets."""
    n, good_ms, bad_ms, top_ms = proof.size(10_000, 100_000), 30.0, 20.0, 400.0
    pareto = None if dwell is None else pareto_with_mean(20 * MS, dwell)
    times = Episodes(draw_key(proof.seed, "times"), 30 * MS, 20 * MS, pareto)
    lengths: dict[bool, list[float]] = {True: [], False: []}
    for _ in range(2 * n):
        lengths[times.is_bad(times.start_ns)].append((times.end_ns - times.start_ns) / MS)
        times.is_bad(times.end_ns)
    good, bad = lengths[False], lengths[True]
    proof.likely("T6", "lengths of times without outages, 30 ms", ks_exponential(good, good_ms), len(good))
    if dwell is None:
        proof.likely("T6", "lengths of bad times, 20 ms", ks_exponential(bad, bad_ms), len(bad))
        return
    scale = scale_of(bad_ms, dwell.alpha, top_ms)
    whole = 1 - (scale / top_ms) ** dwell.alpha
    below = [length for length in bad if length < top_ms]
    p = ks(below, lambda x: (1 - (scale / x) ** dwell.alpha) / whole if x > scale else 0.0)
    proof.likely("T6", "lengths of bad times by Pareto, 1.5, up to 400 ms", p, len(below))
    z = binomial_z(len(bad) - len(below), len(bad), 1 - whole)
    proof.normal("T6", "lengths of bad times by Pareto that are cut at 400 ms", z, len(bad))


def test_two_flows_on_one_link_in_turns() -> None:
    """The flows share the link's objects too, in whatever order they ask for times: earlier ones after later ones."""
    settings = "burst: {loss: 20 %, mean_bad: 25 ms}"
    alone = [f.cause for f in fates(fabric_of(settings), every(MS, 2000))]
    fabric = fabric_of(settings)
    backwards = [f.cause for f in fates(fabric, [n * MS for n in range(1999, -1, -1)])]
    assert backwards[::-1] == alone


@pytest.mark.parametrize(
    ("settings", "share", "mean_ms"),
    [
        ("burst: {loss: 5 %, mean_bad: 40 ms}", 0.05, 40.0),
        ("burst: {loss: 5 %, mean_bad: 40 ms, bad_loss: 50 %}", 0.05, 40.0),
        ("burst: {loss: 25 %, mean_bad: 20 ms, dwell: {alpha: 1.5, max: 400 ms}}", 0.25, 100.0),
        ("outages: {mean_on: 300 ms, mean_off: 100 ms}", 0.25, 100.0),
        ("outages: {mean_on: 300 ms, mean_off: 100 ms}, loss: 20 %", 0.25 + 0.75 * 0.2, 100.0),
        ("outages: {mean_on: 300 ms, mean_off: 100 ms}, burst: {loss: 5 %, mean_bad: 40 ms, bad_loss: 50 %}",
         1 - 0.75 * 0.95, 100.0),
        ("outages: {mean_on: 300 ms, mean_off: 100 ms}, gilbert_elliott: {p: 5 %, r: 50 %}", 1 - 0.75 / 1.1, 100.0),
        ("outages: {mean_on: 300 ms, mean_off: 100 ms}, markov4: {p13: 5 %, p31: 50 %}", 1 - 0.75 / 1.1, 100.0),
    ],
)  # fmt: skip
def test_the_share_of_loss(proof: Proof, settings: str, share: float, mean_ms: float) -> None:
    """Of the time that is lost; its deviation by blocks of 20 mean lengths, which are nearly independent."""
    block, blocks = round(20 * mean_ms), proof.size(50, 500)
    lost = [bool(f.cause) for f in fates(fabric_of(settings, proof.seed), every(MS, block * blocks))]
    means = [sum(lost[k * block : (k + 1) * block]) / block for k in range(blocks)]
    mean = sum(means) / blocks
    deviation = sqrt(sum((x - mean) ** 2 for x in means) / (blocks - 1))
    proof.normal("T6", f"share lost, {settings}", (mean - share) / (deviation / sqrt(blocks)), len(lost))


def test_times_start_anywhere(proof: Proof) -> None:
    """At time 0 a link is bad as often as ever, over many links."""
    links = proof.size(400, 4000)
    settings = "burst: {loss: 20 %, mean_bad: 1 s}"
    seeds = range(proof.seed, proof.seed + links)
    bad = sum(bool(next(fates(fabric_of(settings, seed), [0])).cause) for seed in seeds)
    proof.normal("T6", "share of links that start bad", (bad - 0.2 * links) / sqrt(0.16 * links), links)


def calls_of(work: Callable[[], object]) -> int:
    """How many functions are called in the course of some work."""
    count = 0

    def called(frame: object, event: str, arg: object) -> None:
        nonlocal count
        count += event == "call"

    sys.setprofile(called)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


def test_times_are_gone_on_in() -> None:
    """An event elsewhere costs a link not all of its times again, nor do packets in flight across a change of its."""
    fabric = fabric_of("burst: {loss: 5 %, mean_bad: 10 ms}, delay: 50 ms")
    link, at_ns = fabric.link("a", "b", "data"), 600 * S
    flights = [Flight("a", "b", "data", number, at_ns + number * MS, 0, b"x") for number in range(40)]
    first = calls_of(lambda: link.send(flights[0]))
    fabric.take(0, at_ns + MS, json.dumps({"partition": [["c"], ["d"]], "for": "1 s"}))
    assert calls_of(lambda: [link.send(flight) for flight in flights[1:20]]) < first / 10
    fabric.take(0, at_ns + 20 * MS, json.dumps({"set": {"link": "tried", "delay": "60 ms"}}))

    def in_turns() -> None:
        for later, earlier in zip(flights[20:], flights[:20], strict=True):
            link.send(later)
            link.arrive(earlier, "")

    assert calls_of(in_turns) < first / 5
