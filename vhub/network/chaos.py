"""Chaos: what TigerBeetle's simulator does to its network, as settings, clogs and partitions drawn from a key.

Sources: tigerbeetle/tigerbeetle src/vopr.zig (the ranges) and src/testing/packet_simulator.zig (the modes). Its
probabilities are those of one tick of 10 ms; here the number of ticks between two episodes is drawn at once
(geometric), which is the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.deployment.network.impairments import Impairments
from foosim.vhub.network.series_math import exponential_ns, ln

TICK_NS: Final = 10_000_000
STABILITY_TICKS: Final = 10
"""How long, at least, a partition and the time without one last."""

_RANGES, _CLOGS, _CUTS = 0, 1, 2
"""Counters of the draws of one event of chaos."""


def chaos_settings(key: bytes) -> Impairments:
    """Return delay, loss, copies and capacity of every link."""
    words = draw_words(key, _RANGES)
    least_ms, mean_ms = 30.0 * unit_interval(words[0]), 30.0 + 70.0 * unit_interval(words[1])
    return Impairments.model_validate(
        {
            "jitter": {"shape": "shifted_exp", "min": f"{least_ms:.3f} ms", "mean": f"{mean_ms:.3f} ms"},
            "loss": f"{30.0 * unit_interval(words[2]):.4f} %",
            "duplicate": f"{50.0 * unit_interval(words[3]):.4f} %",
            "capacity": 2 + int(19.0 * unit_interval(words[4])),
            "order": "free",
        }
    )


def clogs_of_chaos(key: bytes, start_ns: int, end_ns: int, source: str, destination: str) -> Iterator[tuple[int, int]]:
    """Yield the times in which a link is clogged."""
    words = draw_words(key, _CLOGS)
    chance, mean_ns = 0.02 * unit_interval(words[0]), int(5e9 * unit_interval(words[1]))
    if chance <= 0.0 or mean_ns <= 0:
        return
    of_link = draw_key(int.from_bytes(key[:8], "little"), "clog", source, destination)
    at_ns, episode = start_ns, 0
    while True:
        words = draw_words(of_link, episode)
        at_ns += _ticks_until(chance, words[0]) * TICK_NS
        if at_ns >= end_ns:
            return
        stop_ns = min(end_ns, at_ns + exponential_ns(mean_ns, words[1]))
        yield at_ns, stop_ns
        at_ns, episode = max(stop_ns, at_ns + TICK_NS), episode + 1


def partitions_of_chaos(
    key: bytes, start_ns: int, end_ns: int, endpoints: Sequence[str]
) -> Iterator[tuple[int, int, frozenset[str], bool]]:
    """Yield (start, end, the first group, whether both ways are cut) of each partition; one at a time."""
    words = draw_words(key, _CUTS)
    begins, heals = 0.03 * unit_interval(words[0]), 0.01 + 0.09 * unit_interval(words[1])
    if begins <= 0.0 or len(endpoints) < 2:
        return
    of_cuts = draw_key(int.from_bytes(key[:8], "little"), "partitions")
    at_ns, episode = start_ns, 0
    while True:
        words = draw_words(of_cuts, episode)
        at_ns += max(STABILITY_TICKS, _ticks_until(begins, words[0])) * TICK_NS
        if at_ns >= end_ns:
            return
        stop_ns = min(end_ns, at_ns + max(STABILITY_TICKS, _ticks_until(heals, words[1])) * TICK_NS)
        yield at_ns, stop_ns, _group(of_cuts, episode, words[2], endpoints), bool(words[3] & 1)
        at_ns, episode = stop_ns, episode + 1


def _ticks_until(chance: float, word: int) -> int:
    """Return in how many ticks something with this chance a tick happens: geometric, at least 1."""
    return 1 + int(ln(((word >> 12) + 0.5) * 2.0**-52) / ln(1.0 - chance))


def _group(key: bytes, episode: int, mode: int, endpoints: Sequence[str]) -> frozenset[str]:
    """Return the endpoints of the first group: a random share, a random half of each, or a single one."""
    words = [draw_words(key, episode, 1 + n)[0] for n in range(len(endpoints))]
    shuffled = [name for _, name in sorted(zip(words, endpoints, strict=True))]
    if mode % 3 == 0:  # uniform_size: every size is equally likely
        return frozenset(shuffled[: 1 + (mode >> 8) % (len(endpoints) - 1)])
    if mode % 3 == 1:  # uniform_partition: each one is on either side with the same chance
        chosen = frozenset(name for word, name in zip(words, endpoints, strict=True) if word & 1)
        return chosen or frozenset(shuffled[:1])
    return frozenset(shuffled[:1])
