"""Who gets the channel, and what it costs: Bianchi's analysis for 802.11, carrier sensing for 802.15.4.

A packet's attempts are drawn with the contenders n: the stations, its own included, that have a frame queued or on air.
On 802.11 its station counts down `backoff_ns`, all attempts together, while the channel is idle (`turns`). Then its
turn begins, at a time s: the frame arrives at s + `delay_ns`, and the channel is free again at s + `occupancy_ns`. On
802.15.4 the medium of a collision domain is one server with a horizon, at which the turn begins, and backoff is in it.
So a domain never carries more than its capacity, whatever arrives at once.

What a packet occupies is its own exchange, plus its share of what contenders spend together: a collision is one busy
time for all that collide. With the share of Bianchi's fixed point, and since a slot of backoff passes for all stations
at once, n stations that always have a frame get the saturation throughput S(n) in all.

Attempts are drawn each for itself, where stations that collide double their windows together. What this changes of how
long a station waits is in its countdown, not in its draws: while it waits in a doubled window the others contend as
n - 1, so slots last longer, and the one that it collided with waits, too (`Contention.quiet_slots`).

Source: Bianchi, "Performance analysis of the IEEE 802.11 distributed coordination function" (2000).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import exp
from typing import Final, Literal, NamedTuple

from foosim.common.keyed_random import chance_threshold
from foosim.vhub.radio.timings import LRWPAN, LrwpanTiming, WifiTiming

CONTENDERS_MAX: Final = 200
"""The largest tabled count of stations; greater ones count as this."""
TURNS_SAVED: Final = 0.8
"""By how many turns of others a station waits less after each of its collisions, since the one that it collided with
waits in a doubled window, too. Judgement: fitted to a slot simulation of 2 to 20 stations (`tests/links/dcf.py`)."""

Words = Callable[[int], Sequence[int]]
"""Gives the eight words of a block of the packet's own draw, blocks numbered from 0."""
Outcome = Literal["ok", "collision", "error", "busy"]


class Access:
    """What became of one transmission on a shared medium."""

    __slots__ = ("airtime_ns", "backoff_ns", "delay_ns", "occupancy_ns", "outcome", "retries")

    def __init__(
        self, delay_ns: int, occupancy_ns: int, retries: int, airtime_ns: int, outcome: Outcome, backoff_ns: int = 0
    ) -> None:
        self.delay_ns = delay_ns
        """From its turn until the frame is whole at the receiver, or is given up."""
        self.occupancy_ns = occupancy_ns
        """From its turn until the medium is free for the next."""
        self.retries = retries
        """Attempts after the first."""
        self.airtime_ns = airtime_ns
        """For which its own frames were on the air, all attempts together, without acknowledgements."""
        self.outcome = outcome
        """`ok`, or why the last attempt failed; `busy`: the channel was never free."""
        self.backoff_ns = backoff_ns
        """What its station counts down, all attempts together, before its turn begins: 802.11 alone."""


@dataclass(frozen=True)
class Contention:
    """Bianchi's fixed point for n saturated stations."""

    tau: float
    """The probability that a station sends in a slot."""
    p: float
    """The probability that an attempt collides."""
    threshold: int
    """An attempt collides when its word is below this."""
    collision_share: float
    """Of a collision that one has part in: one over the mean number of its stations, weighted by part."""
    busy_without: float
    """The probability that a slot is busy while one waits in a window that was doubled: others contend as n - 1."""
    quiet_slots: float
    """How many slots of its countdown a collision spares a station: turns that its collision partners do not have."""


def _power(base: float, exponent: int) -> float:
    """By multiplication alone, so that it has the same bits on every machine."""
    result = 1.0
    while exponent:
        if exponent & 1:
            result *= base
        base *= base
        exponent >>= 1
    return result


def _send_probability(p: float, window: int, doublings: int) -> float:
    """2 / (1 + W + p W sum_{i < m} (2p)^i): Bianchi's tau without the division by 1 - 2p."""
    total, term = 0.0, 1.0
    for _ in range(doublings):
        total += term
        term *= 2.0 * p
    return 2.0 / (1.0 + window + p * window * total)


@lru_cache(maxsize=4_096)
def contention(contenders: int, window: int, doublings: int) -> Contention:
    """Return the fixed point for n saturated stations with backoff in 0 to W 2^i - 1, i at most `doublings`.

    tau = 2 (1 - 2p) / ((1 - 2p)(W + 1) + p W (1 - (2p)^m)) and p = 1 - (1 - tau)^(n - 1), by bisection: the right side
    falls as p rises. More than CONTENDERS_MAX count as that many.
    """
    n = min(max(contenders, 1), CONTENDERS_MAX)
    p = _collision_probability(n, window, doublings)
    tau = _send_probability(p, window, doublings)
    idle = _power(1.0 - tau, n)
    one = n * tau * _power(1.0 - tau, n - 1)
    share = (1.0 - idle - one) / (n * tau * p) if n > 1 else 0.0
    if n == 1 or doublings < 2:  # no station waits so long that others contend without it
        return Contention(tau, p, chance_threshold(p), share, p, 0.0)
    other_tau = _send_probability(_collision_probability(n - 1, window, doublings), window, doublings)
    busy_without = 1.0 - _power(1.0 - other_tau, n - 1)
    return Contention(tau, p, chance_threshold(p), share, busy_without, TURNS_SAVED / ((n - 1) * tau))


def _collision_probability(n: int, window: int, doublings: int) -> float:
    if n == 1:
        return 0.0
    low, high = 0.0, 1.0
    for _ in range(60):
        p = (low + high) / 2.0
        if 1.0 - _power(1.0 - _send_probability(p, window, doublings), n - 1) > p:
            low = p
        else:
            high = p
    return low


def _doublings(cw_min: int, cw_max: int) -> int:
    """How often the window doubles, from cw_min + 1 to cw_max + 1."""
    return ((cw_max + 1) // (cw_min + 1)).bit_length() - 1


def wifi_contention(contenders: int, timing: WifiTiming, *, unicast: bool) -> Contention:
    """Return the fixed point that 802.11 frames meet: broadcasts' window does not double."""
    return contention(contenders, timing.cw_min + 1, _doublings(timing.cw_min, timing.cw_max) if unicast else 0)


def wifi_access(
    words: Words,
    contenders: int,
    per_threshold: int,
    airtime_ns: int,
    ack_ns: int,
    timing: WifiTiming,
) -> Access:
    """Return how an 802.11 frame gets across, with n contenders (the sender included) and the channel's error rate.

    An attempt takes DIFS, backoff of b slots, the frame, SIFS and the acknowledgement; it fails with
    1 - (1 - p)(1 - PER), doubles the window, and is repeated `timing.retries` times. `ack_ns` 0 is a broadcast: one
    attempt, no acknowledgement, its contenders broadcast too (their window does not double). A failed attempt lasts as
    long as a good one (the others wait for an acknowledgement that does not come). Each attempt has four words of the
    packet's own: backoff, collision, error, spare; two attempts share a block.
    """
    unicast = ack_ns > 0
    window = timing.cw_min + 1
    doublings = _doublings(timing.cw_min, timing.cw_max) if unicast else 0
    point = contention(contenders, window, doublings)
    attempts = timing.retries + 1 if unicast else 1
    tail_ns = timing.sifs_ns + ack_ns if unicast else 0
    exchange_ns = timing.difs_ns + airtime_ns + tail_ns
    collision_ns = round(exchange_ns * point.collision_share)
    outcome: Outcome = "ok"
    spent_ns = slots = first = collisions = 0
    block: Sequence[int] = ()
    for attempt in range(attempts):
        if attempt & 1 == 0:
            block = words(attempt >> 1)
        at = (attempt & 1) << 2
        slots += block[at] * (window << (attempt if attempt < doublings else doublings)) >> 64
        if not attempt:
            first = slots
        if block[at + 1] < point.threshold:
            outcome = "collision"
            collisions += 1
            spent_ns += collision_ns
        elif block[at + 2] < per_threshold:
            outcome = "error"
            spent_ns += exchange_ns
        else:
            spent_ns += exchange_ns
            backoff_ns = slots * timing.slot_ns
            if attempt:
                backoff_ns = _countdown_ns(first, slots, collisions, exchange_ns, timing.slot_ns, point)
            return Access(spent_ns - tail_ns, spent_ns, attempt, (attempt + 1) * airtime_ns, "ok", backoff_ns)
    backoff_ns = _countdown_ns(first, slots, collisions, exchange_ns, timing.slot_ns, point)
    return Access(spent_ns, spent_ns, attempts - 1, attempts * airtime_ns, outcome, backoff_ns)


def _countdown_ns(first: int, slots: int, collisions: int, exchange_ns: int, slot_ns: int, point: Contention) -> int:
    """Return the countdown of a station that drew `slots`, `first` of them from the least window.

    In doubled windows it waits longer for a slot to pass, by the mean slots of n - 1 and of n stations; and each
    collision has spared it turns of the station that it collided with.
    """
    mean_ns = point.p * exchange_ns + (1.0 - point.p) * slot_ns
    longer = (point.busy_without * exchange_ns + (1.0 - point.busy_without) * slot_ns) / mean_ns
    counted = first + (slots - first) * longer - collisions * point.quiet_slots
    return max(0, round(counted * slot_ns))


def saturation_rate_hz(contenders: int, airtime_ns: int, ack_ns: int, timing: WifiTiming) -> float:
    """Return S(n), the frames per second that n saturated stations get across in all: for what a configuration means.

    `ack_ns` 0: broadcasts.
    """
    unicast = ack_ns > 0
    tau = wifi_contention(contenders, timing, unicast=unicast).tau
    n = min(max(contenders, 1), CONTENDERS_MAX)
    exchange_ns = timing.difs_ns + airtime_ns + (timing.sifs_ns + ack_ns if unicast else 0)
    idle = _power(1.0 - tau, n)
    good = n * tau * _power(1.0 - tau, n - 1)
    return good / (idle * timing.slot_ns + (1.0 - idle) * exchange_ns) * 1e9


# --- 802.15.4: stations that look before they send, and do not freeze their backoff ----------------------------------


class Sensing(NamedTuple):
    """The mean field of n saturated stations of unslotted 802.15.4."""

    busy: float
    """The probability that a look at the channel finds it busy."""
    access_threshold: int
    """An attempt never finds the channel free when its word is below this."""
    p: float
    """The probability that an attempt that found the channel free collides."""
    threshold: int
    idle_share: float
    """Of one's first backoff: what the channel is idle for before an attempt, as a share of the mean backoff."""
    collision_share: float
    rate_hz: float
    """Frames per second that get across in all."""


@lru_cache(maxsize=4_096)
def sensing(contenders: int, airtime_ns: int, unicast: bool, timing: LrwpanTiming = LRWPAN) -> Sensing:
    """Return the mean field of n saturated stations whose frames last `airtime_ns`.

    A station's cycle is its backoffs and looks at the channel and, where one of these finds it free, an exchange. Busy
    is the share of the others' cycles on the air, given that one does not send, by bisection. Who looks within a
    turnaround of the first to find the channel free sees nothing and collides with it: with l such in the mean, groups
    of 1 + Poisson(l) send at once, and an attempt is alone with exp(-l) / (1 + l). Where many wait, the next one is on
    the air before the group that sent last is back: that group does not look then, and its first looks are in vain.
    Judgement, compared with a simulation of the stations: within an eighth of its throughput for up to 20 stations, too
    low by a sixth for 30, and for 50 by up to a third where frames are long.
    """
    n = min(max(contenders, 1), CONTENDERS_MAX)
    turn, frame, cca = float(timing.turnaround_ns), float(airtime_ns), float(timing.cca_ns)
    ack = float(timing.ack_bytes * timing.byte_ns) if unicast else 0.0
    tail = turn + ack if unicast else 0.0
    exponents = [min(timing.be_min + k, timing.be_max) for k in range(timing.backoffs + 1)]
    waits = [((1 << exponent) - 1) / 2.0 * timing.unit_backoff_ns + cca for exponent in exponents]

    def cycle(busy: float) -> tuple[float, float, float, float]:
        """Length of a cycle, share of cycles that send, looks that fall into a turnaround, probability to be alone."""
        looks = waiting = 0.0
        reached = 1.0
        for wait in waits:
            looks += reached
            waiting += reached * wait
            reached *= busy
        sends = 1.0 - reached
        length = waiting + sends * (turn + frame + tail)
        one_before = 1.0 - exp(-(n - 1) * looks / length * (tail + cca))
        away = one_before * one_before * one_before  # cubed: fits few stations, where a group is back in time
        look = (looks - away * sends) / (length - sends * (turn + frame)) * turn
        others = look * (n - 1 - away) / (1.0 + look * away)  # l = look (n - 1 - away (1 + l))
        return length, sends, others, exp(-others) / (1.0 + others)

    low, high = 0.0, 1.0
    for _ in range(50):
        busy = (low + high) / 2.0
        length, sends, others, alone = cycle(busy)
        on_air = sends * (frame + cca + (alone * (ack + cca) if unicast else 0.0)) / (1.0 + others)
        if (n - 1) * on_air / (length - sends * (turn + frame + tail)) > busy:
            low = busy
        else:
            high = busy
    busy = 0.0 if n == 1 else low
    length, sends, others, alone = cycle(busy)
    collided = (1.0 - exp(-others)) / (1.0 + others)
    used = alone * (cca + turn + frame + tail) + collided * (cca + turn + frame)
    idle_ns = max(length / (n * sends) - used, 0.0)
    return Sensing(
        busy,
        chance_threshold(1.0 - sends),
        1.0 - alone,
        chance_threshold(1.0 - alone),
        idle_ns / (waits[0] - cca),
        collided / (1.0 - alone) if n > 1 else 0.0,
        n * sends * alone / length * 1e9,
    )


def csma_access(
    words: Words,
    contenders: int,
    per_threshold: int,
    airtime_ns: int,
    unicast: bool = True,
    timing: LrwpanTiming = LRWPAN,
) -> Access:
    """Return how an 802.15.4 frame gets across by unslotted CSMA/CA, with n contenders, the sender included.

    Each attempt backs off and looks at the channel, up to `backoffs` times more when it is busy: always busy ends it
    with `busy`, as in the standard. Else the frame is sent, and, unicast, sent again up to `retries` times for want of
    an acknowledgement. Backoff passes for all contenders at once. Each attempt has four words of the packet's own:
    backoff, collision, error, access; two attempts share a block.
    """
    point = sensing(contenders, airtime_ns, unicast, timing)
    attempts = timing.retries + 1 if unicast else 1
    tail_ns = timing.turnaround_ns + timing.ack_bytes * timing.byte_ns if unicast else 0
    sent_ns = timing.cca_ns + timing.turnaround_ns + airtime_ns
    unit_ns = timing.unit_backoff_ns * point.idle_share
    outcome: Outcome = "ok"
    spent_ns = 0
    block: Sequence[int] = ()
    for attempt in range(attempts):
        if attempt & 1 == 0:
            block = words(attempt >> 1)
        at = (attempt & 1) << 2
        if block[at + 3] < point.access_threshold:
            return Access(spent_ns, spent_ns, attempt, attempt * airtime_ns, "busy")
        spent_ns += round((block[at] << timing.be_min >> 64) * unit_ns)
        if block[at + 1] < point.threshold:
            outcome = "collision"
            spent_ns += round(sent_ns * point.collision_share)
        elif block[at + 2] < per_threshold:
            outcome = "error"
            spent_ns += sent_ns
        else:
            spent_ns += sent_ns
            return Access(spent_ns, spent_ns + tail_ns, attempt, (attempt + 1) * airtime_ns, "ok")
    return Access(spent_ns, spent_ns, attempts - 1, attempts * airtime_ns, outcome)
