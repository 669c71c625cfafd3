"""Good and bad times of a link, as functions of simulated time: every caller sees the same ones, in any order.

Lengths are drawn by (key, number of the episode). Times begin in their stationary state at time 0 (exact where lengths
are exponential).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from foosim.common.keyed_random import draw_words, unit_interval
from foosim.deployment.network.impairments import Burst, ParetoDwell
from foosim.vhub.network.series_math import exponential_ns, power

KEPT: Final = 8
"""Times that a link has at hand: those of its bursts and outages, under settings that come and go."""


@dataclass(frozen=True, slots=True)
class Pareto:
    """Lengths from `scale_ns` on with the tail `alpha`, cut at `max_ns`."""

    scale_ns: float
    alpha: float
    max_ns: int

    def length_ns(self, word: int) -> int:
        above = ((word >> 12) + 0.5) * 2.0**-52
        return max(1, min(self.max_ns, int(self.scale_ns * power(above, -1.0 / self.alpha))))


def pareto_with_mean(mean_ns: int, dwell: ParetoDwell) -> Pareto:
    """Return the law whose lengths, cut at the greatest, have this mean: its scale by bisection."""
    alpha, top = dwell.alpha, float(dwell.max_ns)

    def mean_of(scale: float) -> float:
        return (alpha * scale - power(scale, alpha) * power(top, 1.0 - alpha)) / (alpha - 1.0)

    low, high = 1.0, float(min(mean_ns, dwell.max_ns))
    for _ in range(100):
        middle = (low + high) / 2.0
        low, high = (middle, high) if mean_of(middle) < mean_ns else (low, middle)
    return Pareto(low, alpha, dwell.max_ns)


class Episodes:
    """Alternating good and bad times of one link."""

    def __init__(self, key: bytes, good_ns: int, bad_ns: int, dwell: Pareto | None = None) -> None:
        """`good_ns` and `bad_ns` are mean lengths; good ones are exponential, bad ones too without a `dwell`."""
        self._key = key
        self._good_ns, self._bad_ns, self._dwell = good_ns, bad_ns, dwell
        self._starts_bad = unit_interval(draw_words(key, 0)[0]) * (good_ns + bad_ns) < bad_ns
        self._restart()

    def _restart(self) -> None:
        self._episode = 0
        self.start_ns = 0
        self.end_ns = self._length_ns(0)

    def is_bad(self, time_ns: int) -> bool:
        """Whether a time is a bad one. Queries are cheaper in ascending order of time."""
        if time_ns < self.start_ns:
            self._restart()
        while time_ns >= self.end_ns:
            self._episode += 1
            self.start_ns = self.end_ns
            self.end_ns += self._length_ns(self._episode)
        return self._starts_bad ^ bool(self._episode & 1)

    def _length_ns(self, episode: int) -> int:
        word = draw_words(self._key, 1 + episode)[0]
        if not self._starts_bad ^ bool(episode & 1):
            return max(1, exponential_ns(self._good_ns, word))
        if self._dwell is not None:
            return self._dwell.length_ns(word)
        return max(1, exponential_ns(self._bad_ns, word))


class Times:
    """The good and bad times of one link, for each of its settings: they continue when the settings return."""

    def __init__(self) -> None:
        self._known: dict[tuple[bytes, int, int, Pareto | None], Episodes] = {}

    def of_burst(self, key: bytes, burst: Burst) -> Episodes:
        """Return the times of a burst model in seconds, bad ones as frequent as its mean loss wants."""
        assert burst.mean_bad_ns is not None
        share = burst.loss / burst.bad_loss
        dwell = None if burst.dwell is None else pareto_with_mean(burst.mean_bad_ns, burst.dwell)
        return self.of(key, int(burst.mean_bad_ns * (1.0 - share) / share), burst.mean_bad_ns, dwell)

    def of(self, key: bytes, good_ns: int, bad_ns: int, dwell: Pareto | None = None) -> Episodes:
        """Return the times with these means, the bad ones of a law of their own where it is given."""
        what = key, good_ns, bad_ns, dwell
        found = self._known.pop(what, None) or Episodes(key, good_ns, bad_ns, dwell)
        self._known[what] = found
        if len(self._known) > KEPT:
            del self._known[next(iter(self._known))]
        return found
