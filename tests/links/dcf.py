"""IEEE 802.11's distributed coordination function, slot by slot: a second opinion that shares nothing with the vHub.

n stations always have a frame. Each draws its backoff uniformly from its window, counts one down in each slot, idle or
busy, and sends at zero; two or more at once collide, double their windows, and give a frame up after the last retry.
Whoever is done, or has given up, draws from the least window. A busy slot is counted by those who wait, too, as by the
categories of 802.11e and in Bianchi's chain; plain DCF keeps it. A collision takes as long as a frame with its
acknowledgement: who sent waits for one that does not come, and who heard it waits for EIFS, as long at the lowest rate.
This is the process of which Bianchi's chain is the mean field; here it is played, with numpy and a fixed seed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Played:
    """What saturated stations got: frames per second in all, and how long each frame took from its station's last."""

    rate_hz: float
    delays_ms: NDArray[np.float64]
    """Of the frames that got across."""


def play(
    stations: int, frames: int, exchange_ns: int, slot_ns: int, cw: tuple[int, int], retries: int, seed: int
) -> Played:
    """Play until so many frames got across; `exchange_ns` is from DIFS to the end of the ACK, also of a collision."""
    rng = np.random.default_rng(seed)
    least, most = cw[0] + 1, cw[1] + 1
    stage = np.zeros(stations, dtype=int)
    counter: NDArray[Any] = rng.integers(0, least, stations)
    since_ns = np.zeros(stations)
    now_ns = 0
    delays_ns: list[float] = []
    while len(delays_ns) < frames:
        idle = int(counter.min())
        now_ns += idle * slot_ns + exchange_ns
        counter -= idle
        sending = np.flatnonzero(counter == 0)
        counter[counter > 0] -= 1
        for station in sending:
            stage[station] += 1
            if len(sending) == 1:
                delays_ns.append(now_ns - since_ns[station])
            if len(sending) == 1 or stage[station] > retries:
                stage[station], since_ns[station] = 0, now_ns
            counter[station] = rng.integers(0, min(least << stage[station], most))
    return Played(frames / now_ns * 1e9, np.array(delays_ns) / 1e6)
