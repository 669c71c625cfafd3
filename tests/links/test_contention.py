"""Medium access (T16): Bianchi's table; saturated stations on their links, beside a slot simulation, and in a hub."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from math import sqrt
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from foosim.common.keyed_random import UNIT, chance_threshold, draw_key, draw_words
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Sent
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.airtime import lrwpan_airtime_ns, wifi_ack_ns, wifi_airtime_ns
from foosim.vhub.radio.contention import (
    CONTENDERS_MAX,
    Access,
    Words,
    contention,
    csma_access,
    saturation_rate_hz,
    sensing,
    wifi_access,
)
from foosim.vhub.radio.timings import CATEGORIES, LRWPAN, WIFI_5, with_category
from foosim.vhub.state.hub_state import HubState
from tests.links import dcf
from tests.links.offered import Hub, deployment_of
from tests.links.proof import Proof
from tests.links.statistics import Z_ALPHA, binomial_z

AIRTIME_NS = wifi_airtime_ns("ofdm_24", 300, WIFI_5)
ACK_NS = wifi_ack_ns("ofdm_24", WIFI_5)
EXCHANGE_NS = 34_000 + 136_000 + 16_000 + 28_000
# 300 bytes at 24 Mb/s, W = 16, m = 6: collision probability, packets a second in all, mean access delay in ms, loss.
BIANCHI = {
    1: (0.0, 3552, 0.28, 0.0),
    2: (0.105, 3773, 0.53, 1e-8),
    5: (0.272, 3648, 1.4, 3e-5),
    10: (0.384, 3421, 2.9, 5e-4),
    20: (0.481, 3167, 6.3, 3e-3),
    50: (0.595, 2792, 17.9, 1.6e-2),
}


def words_of(counter: int, seed: int = 1) -> Words:
    key = draw_key(seed, "contention")
    return lambda block: draw_words(key, counter, block)


class Loop(NamedTuple):
    """What n saturated stations got."""

    rate_hz: float
    delay_ms: float
    outcomes: Counter[str]
    retries: int
    packets: int


def saturated(stations: int, packets: int, access: Callable[[Words, int], Access], seed: int = 1) -> Loop:
    """Serve stations that always have a frame through one horizon, as the pipeline does on 802.15.4.

    A station sends its next when its last is done. Delays count once every station has been served.
    """
    ready = [(0, station) for station in range(stations)]
    free_ns = waited_ns = retries = 0
    outcomes: Counter[str] = Counter()
    for packet in range(packets):
        sent_ns, station = heapq.heappop(ready)
        got = access(words_of(packet, seed), stations)
        free_ns = max(sent_ns, free_ns) + got.occupancy_ns
        waited_ns += free_ns - sent_ns if packet >= stations else 0
        outcomes[got.outcome] += 1
        retries += got.retries
        heapq.heappush(ready, (free_ns, station))
    return Loop(outcomes["ok"] / free_ns * 1e9, waited_ns / (packets - stations) / 1e6, outcomes, retries, packets)


# --- Wi-Fi -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", BIANCHI)
def test_the_fixed_point(proof: Proof, n: int) -> None:
    p, rate, delay_ms, lost = BIANCHI[n]
    point, stations = contention(n, 16, 6), f"Wi-Fi, {n:2} stations by Bianchi: "
    proof.within("T16", stations + "probability to collide", point.p, p, 0.0006, 1)
    computed = saturation_rate_hz(n, AIRTIME_NS, ACK_NS, WIFI_5)
    proof.within("T16", stations + "packets/s", computed, rate, 0.6, 1)
    assert point.p**8 == pytest.approx(lost, rel=0.5, abs=1e-9)
    assert n / computed * 1e3 == pytest.approx(delay_ms, rel=0.025)


@pytest.mark.parametrize("n", [2, 3, 7, 30, 200])
@pytest.mark.parametrize(("window", "doublings"), [(16, 6), (4, 1), (32, 5), (16, 0)])
def test_the_fixed_point_solves_both_equations(n: int, window: int, doublings: int) -> None:
    point = contention(n, window, doublings)
    p, tau = point.p, point.tau
    assert 1 - (1 - tau) ** (n - 1) == pytest.approx(p, abs=1e-9)
    if abs(p - 0.5) > 1e-6:
        numerator = 2 * (1 - 2 * p)
        bianchi = numerator / ((1 - 2 * p) * (window + 1) + p * window * (1 - (2 * p) ** doublings))
        assert tau == pytest.approx(bianchi, abs=1e-9)
    assert point.threshold == chance_threshold(p)


slot_by_slot = lru_cache(maxsize=1)(dcf.play)
BEST_EFFORT = with_category(WIFI_5, CATEGORIES["best_effort"])


def crowd(n: int, seed: int) -> tuple[Deployment, list[tuple[str, str]]]:
    """Clients side by side, who have one Wi-Fi of 24 Mbit/s and nothing else that costs time or packets; and n of them
    who send, each with whom it sends to."""
    names = [f"s{k:02}" for k in range(max(n, 2))]
    radio = "preset: wifi_5_indoor, rates: fixed, fixed_rate: 24 Mbit/s, delay: 0 ms, jitter: null, burst: null"
    deployment = deployment_of(
        f"clients={{{', '.join(f'{name}: {{}}' for name in names)}}}",
        f"network.seed={seed}",
        f"network.radios={{w: {{{radio}, shadowing: {{on: false}}, queue: {{packets: 10}}}}}}",
        "network.robots={'s*': [w]}",
        f"network.places={{{', '.join(f'{name}: [{k % 5} m, {k // 5} m, 2 m]' for k, name in enumerate(names))}}}",
        "network.links=[{id: crowd, from: 's*', to: 's*', via: w}]",
    )
    return deployment, list(zip(names, names[1:] + names[:1], strict=True))[:n]


def closed_loop(n: int, packets: int, depth: int, seed: int) -> tuple[list[Flight], int]:
    """Have n stations offer 300 bytes to a neighbour whenever one of theirs is done, so that each has `depth` waiting
    or on air, through all stages of their links. Return what was done, after some time, and how long that took."""
    deployment, pairs = crowd(n, seed)
    fabric = Fabric(deployment)
    done: list[Flight] = []
    ready: list[tuple[int, int, int, Flight]] = []
    sequences = Counter[int]()

    def offer(place: int, at_ns: int) -> None:
        source, to = pairs[place]
        sequences[place] += 1
        flight = Flight(source, to, "data", sequences[place], at_ns, 0, bytes(300))
        fabric.link(source, to, "data").send(flight)
        heapq.heappush(ready, (flight.air_end_ns, place, flight.sequence, flight))

    for place in range(n):
        for _ in range(depth):
            offer(place, 0)
    while len(done) < packets + n:
        at_ns, place, sequence, flight = heapq.heappop(ready)
        if flight.air_end_ns > at_ns and not flight.cause:  # others had their turn before it
            heapq.heappush(ready, (flight.air_end_ns, place, sequence, flight))
            continue
        done.append(flight)
        offer(place, at_ns)
    return done[n:], done[-1].air_end_ns - done[n - 1].air_end_ns


@pytest.mark.parametrize(("n", "depth"), [(n, depth) for n in (1, 2, 3, 8, 20) for depth in (1, 2)])
def test_saturated_stations_on_their_links(proof: Proof, n: int, depth: int) -> None:
    """Stations that have one packet ready, or another one behind it: Bianchi's throughput, and the delays of stations
    that are played slot by slot: a few win several times in a row, others wait for long."""
    packets = proof.size(12_000 if n <= 3 else 4_000, {2: 200_000, 3: 200_000, 8: 100_000}.get(n, 50_000))
    flights, spent_ns = closed_loop(n, packets, depth, proof.seed)
    assert {f.cause for f in flights} <= {"", "collision"} and {f.airtime_ns for f in flights} == {AIRTIME_NS}
    rate = saturation_rate_hz(n, AIRTIME_NS, ACK_NS, BEST_EFFORT)
    stations = f"Wi-Fi, {n:2} saturated stations on their links, {depth} waiting: "
    arrived = [f for f in flights if not f.cause]
    proof.ratio("T16", stations + "packets/s", len(arrived) / spent_ns * 1e9, rate, 0.02, packets)
    if n == 1:
        return
    p = contention(n, 16, 6).p
    spread = sqrt(p / packets) / (1 - p)
    retries = sum(f.retries for f in flights) / packets
    proof.normal("T16", stations + "retries", (retries - p * (1 - p**7) / (1 - p)) / spread, packets)
    timing = BEST_EFFORT
    tail_ns = timing.sifs_ns + ACK_NS
    exchange_ns = timing.difs_ns + AIRTIME_NS + tail_ns
    cw = timing.cw_min, timing.cw_max
    played = slot_by_slot(n, 4 * packets, exchange_ns, timing.slot_ns, cw, timing.retries, proof.seed)
    proof.ratio("T16", stations + "packets/s as played", len(arrived) / spent_ns * 1e9, played.rate_hz, 0.02, packets)
    delays_ms = np.array([f.access_ns + f.airtime_ns + tail_ns for f in arrived]) / 1e6
    longest_ms = float(np.quantile(played.delays_ms, 0.999))
    figures: tuple[tuple[str, Figure, Figure], ...] = (
        ("mean", np.mean, _error),
        ("99 % quantile", _late, _late_error),
        ("deviation", np.std, _deviation_error),
        ("deviation, cut at the 99.9 % quantile", _cut(np.std, longest_ms), _cut(_deviation_error, longest_ms)),
    )
    for what, of, error in figures:
        measured, expected = float(of(delays_ms)), float(of(played.delays_ms))
        chance = proof.z * float(error(played.delays_ms)) * sqrt(1 + len(played.delays_ms) / len(delays_ms))
        proof.ratio("T16", f"{stations}access delay in ms, {what}", measured, expected, max(0.05, chance), packets)


Figure = Callable[[NDArray[np.float64]], float | np.floating]


def _cut(figure: Figure, longest_ms: float) -> Figure:
    """The figure where nobody waits for longer: the few longest decide on a whole deviation, which needs millions."""
    return lambda delays_ms: figure(np.minimum(delays_ms, longest_ms))


def _late(delays_ms: NDArray[np.float64]) -> np.floating:
    return np.quantile(delays_ms, 0.99)


# The standard errors of figures as shares of them, from batches, since those who wait for long do so together. They are
# those of the law that is tested, so of what is played: a sample without one of the longest waits hardly has an error.


def _error(delays_ms: NDArray[np.float64], of: Figure = np.mean) -> float:
    batches = np.array([of(batch) for batch in np.array_split(delays_ms, 20)])
    return float(batches.std(ddof=1) / sqrt(len(batches)) / of(delays_ms))


def _late_error(delays_ms: NDArray[np.float64]) -> float:
    return _error(delays_ms, _late)


def _deviation_error(delays_ms: NDArray[np.float64]) -> float:
    """By the squares: of the deviations of batches the mean is too small."""
    return _error((delays_ms - delays_ms.mean()) ** 2) / 2


def test_who_wins_is_drawn_by_its_own_number() -> None:
    """Of four that are ready at once each one wins sometimes, whatever its name; and a lone station never waits."""
    deployment, pairs = crowd(4, 1)
    fabric = Fabric(deployment)
    winners: Counter[str] = Counter()
    for number in range(1, 201):
        flights = [Flight(one, to, "data", number, number * 10**8, 0, bytes(300)) for one, to in pairs]
        for flight in flights:
            fabric.link(flight.source, flight.destination, "data").send(flight)
        spans = sorted((flight.air_start_ns, flight.air_end_ns) for flight in flights)
        assert all(one[1] <= other[0] for one, other in pairwise(spans)), "one after the other"
        winners[min(flights, key=lambda flight: flight.air_start_ns).source] += 1
    assert set(winners) == {one for one, _ in pairs} and max(winners.values()) < 80


@pytest.mark.parametrize("n", [2, 5, 20])
def test_saturated_stations_in_a_hub(proof: Proof, n: int) -> None:
    """From what clients hand in, tick by tick, to fates: half as much again as goes through, so that all queues fill.

    Who contends when a packet's turn comes that waits behind its sender's own is judged by what waits by now.
    """
    ticks, (deployment, pairs) = proof.size(250, 5_000), crowd(n, proof.seed)
    rate, tick_ns = saturation_rate_hz(n, AIRTIME_NS, ACK_NS, BEST_EFFORT), deployment.tick_ns
    each = int(1.5 * rate * tick_ns / 1e9 / n) + 1
    state = HubState(deployment)
    for name in deployment.clients:
        state.join(Joining(name, 0, []), 0)
    hub = Hub(deployment, state)
    for tick in range(ticks):
        numbers = range(tick * each + 1, (tick + 1) * each + 1)
        hub.close({source: [Sent(number, to, "data", 0, bytes(300)) for number in numbers] for source, to in pairs})
    first_ns, last_ns = ticks // 10 * tick_ns, ticks * tick_ns
    arrived = sum(not f.cause and first_ns < f.due_ns <= last_ns for f in hub.fates)
    assert {f.cause for f in hub.fates} <= {"", "queue_full", "collision"}
    what = f"Wi-Fi, {n:2} saturated stations in a hub: packets/s"
    proof.ratio("T16", what, arrived / (last_ns - first_ns) * 1e9, rate, 0.04, arrived)


def test_alone_it_takes_the_time_of_the_standard() -> None:
    """DIFS, backoff of 0 to 15 slots, frame, SIFS, ACK: nothing is shared."""
    got = [wifi_access(words_of(n), 1, 0, AIRTIME_NS, ACK_NS, WIFI_5) for n in range(2_000)]
    slots = Counter(access.backoff_ns / 9_000 for access in got)
    assert sorted(slots) == list(range(16))
    assert {access.occupancy_ns for access in got} == {EXCHANGE_NS}
    assert all(access.delay_ns == access.occupancy_ns - 44_000 and access.retries == 0 for access in got)
    assert {access.outcome for access in got} == {"ok"} and {access.airtime_ns for access in got} == {AIRTIME_NS}


@pytest.mark.parametrize("per", [0.1, 0.5])
@pytest.mark.parametrize("n", [1, 10])
def test_an_attempt_fails_by_collision_or_error(per: float, n: int) -> None:
    """With 1 - (1 - p)(1 - PER), each time anew; what is left after eight attempts is lost."""
    p = contention(n, 16, 6).p
    fails = 1 - (1 - p) * (1 - per)
    count = 4_000
    got = [wifi_access(words_of(k), n, chance_threshold(per), AIRTIME_NS, ACK_NS, WIFI_5) for k in range(count)]
    lost = sum(access.outcome != "ok" for access in got)
    assert abs(binomial_z(lost, count, fails**8)) < Z_ALPHA
    assert abs(binomial_z(sum(access.retries == 0 for access in got), count, 1 - fails)) < Z_ALPHA
    assert all(
        access.retries == 7 and access.delay_ns == access.occupancy_ns for access in got if access.outcome != "ok"
    )
    assert all(access.airtime_ns == (access.retries + 1) * AIRTIME_NS for access in got)


def test_broadcast_is_lost_where_unicast_is_late() -> None:
    """One attempt without acknowledgement, at the window that never doubles."""
    n, count = 10, 4_000
    p = contention(n, 16, 0).p
    got = [wifi_access(words_of(k), n, 0, AIRTIME_NS, 0, WIFI_5) for k in range(count)]
    assert abs(binomial_z(sum(access.outcome == "collision" for access in got), count, p)) < Z_ALPHA
    assert all(access.retries == 0 and access.airtime_ns == AIRTIME_NS for access in got)
    assert all(access.delay_ns == access.occupancy_ns for access in got)
    unicast = [wifi_access(words_of(k), n, 0, AIRTIME_NS, ACK_NS, WIFI_5) for k in range(count)]
    assert sum(access.outcome != "ok" for access in unicast) < 10
    assert sum(access.outcome != "ok" for access in got) > 1000
    spent_ns = sum(access.occupancy_ns + access.backoff_ns * (1 - p) / n for access in got)
    rate = sum(access.outcome == "ok" for access in got) / spent_ns * 1e9
    assert rate == pytest.approx(saturation_rate_hz(n, AIRTIME_NS, 0, WIFI_5), rel=0.06)


def test_priority_and_retries_are_the_timings() -> None:
    voice = with_category(WIFI_5, CATEGORIES["voice"])
    slots = {wifi_access(words_of(k), 1, 0, AIRTIME_NS, ACK_NS, voice).backoff_ns // 9_000 for k in range(200)}
    assert slots == {0, 1, 2, 3}
    once = wifi_access(words_of(0), 1, UNIT, AIRTIME_NS, ACK_NS, replace(WIFI_5, retries=1))
    assert (once.outcome, once.retries) == ("error", 1)


def test_attempts_have_their_own_words() -> None:
    """Raising the error rate leaves what the first attempts drew alone: paired experiments stay paired."""
    for k in range(300):
        few = wifi_access(words_of(k), 5, chance_threshold(0.2), AIRTIME_NS, ACK_NS, WIFI_5)
        many = wifi_access(words_of(k), 5, chance_threshold(0.6), AIRTIME_NS, ACK_NS, WIFI_5)
        assert few.retries <= many.retries and (few.retries < many.retries or few.outcome == "ok" or few.retries == 7)
    asked: list[int] = []

    def words(block: int) -> Sequence[int]:
        asked.append(block)
        return (0, UNIT - 1, 0, 0, UNIT // 2, UNIT - 1, 0, 0)

    failed = wifi_access(words, 1, 1, 1_000, 1_000, WIFI_5)
    assert failed.outcome == "error" and asked == [0, 1, 2, 3]
    windows = sum((16 << min(attempt, 6)) // 2 for attempt in (1, 3, 5, 7))
    assert failed.occupancy_ns == 8 * (34_000 + 1_000 + 16_000 + 1_000) and failed.backoff_ns == windows * 9_000


# --- 802.15.4 --------------------------------------------------------------------------------------------------------


class Motes:
    """The standard's stations themselves, event by event: each senses, backs off, sends and waits for its ACK."""

    UNIT_US, CCA_US, TURN_US, ACK_US, WAIT_US = 320, 128, 192, 352, 864

    def __init__(self, stations: int, frame_us: int, seed: int) -> None:
        self.frame_us = frame_us
        self.draws = 0
        self.key = draw_key(seed, "motes")
        self.events: list[tuple[int, int, str]] = []
        self.exponent, self.busy_looks = [3] * stations, [0] * stations
        self.tries, self.since, self.until = [0] * stations, [0] * stations, [0] * stations
        self.hit = [False] * stations
        self.air: list[tuple[int, int]] = []
        self.count: Counter[str] = Counter()
        self.delay_us = 0
        for station in range(stations):
            self.back_off(station, self.draw(5_000))

    def draw(self, below: int) -> int:
        self.draws += 1
        return draw_words(self.key, self.draws)[0] * below >> 64

    def back_off(self, station: int, at: int) -> None:
        slots = self.draw(1 << self.exponent[station])
        heapq.heappush(self.events, (at + slots * self.UNIT_US + self.CCA_US, station, "look"))

    def anew(self, station: int, at: int, outcome: str) -> None:
        self.count[outcome] += 1
        self.delay_us += at - self.since[station]
        self.exponent[station], self.busy_looks[station], self.tries[station] = 3, 0, 0
        self.since[station] = at
        self.back_off(station, at)

    def look(self, station: int, at: int) -> None:
        self.air = [(begin, end) for begin, end in self.air if end > at - 200]
        if not any(begin < at and end > at - self.CCA_US for begin, end in self.air):
            self.count["sent"] += 1
            heapq.heappush(self.events, (at + self.TURN_US, station, "send"))
            return
        self.exponent[station] = min(self.exponent[station] + 1, 5)
        self.busy_looks[station] += 1
        if self.busy_looks[station] > 4:
            self.anew(station, at, "busy")
        else:
            self.back_off(station, at)

    def send(self, station: int, at: int) -> None:
        self.hit[station] = False
        for other, until in enumerate(self.until):
            if until > at:
                self.hit[other] = self.hit[station] = True
        self.until[station] = at + self.frame_us
        self.air.append((at, at + self.frame_us))
        heapq.heappush(self.events, (at + self.frame_us, station, "sent"))

    def sent(self, station: int, at: int) -> None:
        if not self.hit[station]:
            heard = at + self.TURN_US + self.ACK_US
            self.air.append((at + self.TURN_US, heard))
            heapq.heappush(self.events, (heard, station, "ok"))
            return
        self.count["hit"] += 1
        self.tries[station] += 1
        self.exponent[station], self.busy_looks[station] = 3, 0
        if self.tries[station] > 3:
            heapq.heappush(self.events, (at + self.WAIT_US, station, "collision"))
        else:
            self.back_off(station, at + self.WAIT_US)

    def run(self, until_us: int) -> None:
        while self.events[0][0] < until_us:
            at, station, what = heapq.heappop(self.events)
            if what in ("ok", "collision"):
                self.anew(station, at, what)
            else:
                getattr(self, what)(station, at)


@pytest.mark.parametrize("size", [20, 50, 100])
@pytest.mark.parametrize("n", [1, 2, 3, 5, 10, 20])
def test_802154_against_its_stations(proof: Proof, n: int, size: int) -> None:
    """The closed loop through the access function against the stations: throughput, delay, and what is lost and why."""
    airtime_ns, seconds = lrwpan_airtime_ns(size), proof.size(10, 60)
    motes = Motes(n, airtime_ns // 1_000, seed=proof.seed)
    motes.run(seconds * 1_000_000)
    done = motes.count["ok"] + motes.count["collision"] + motes.count["busy"]
    packets, stations = proof.size(2_500, 25_000), f"802.15.4, {n:2} saturated stations, {size} B: "
    loop = saturated(n, packets, lambda words, k: csma_access(words, k, 0, airtime_ns), seed=proof.seed)
    proof.ratio("T16", stations + "packets/s", loop.rate_hz, motes.count["ok"] / seconds, 0.125, packets)
    proof.ratio("T16", stations + "mean delay in ms", loop.delay_ms, motes.delay_us / done / 1e3, 0.17, packets)
    assert sensing(n, airtime_ns, True).p == pytest.approx(motes.count["hit"] / motes.count["sent"], abs=0.08)
    assert loop.outcomes["busy"] / loop.packets == pytest.approx(motes.count["busy"] / done, abs=0.07)


def test_802154_alone() -> None:
    """Backoff of 0 to 7 periods, sensing, turnaround, frame, turnaround, ACK: nothing is shared."""
    airtime_ns = lrwpan_airtime_ns(50)
    got = [csma_access(words_of(n), 1, 0, airtime_ns) for n in range(500)]
    exchange_ns = 128_000 + 192_000 + airtime_ns + 192_000 + 352_000
    periods = {(access.occupancy_ns - exchange_ns) / LRWPAN.unit_backoff_ns for access in got}
    assert periods == set(range(8))
    assert all(access.outcome == "ok" and access.occupancy_ns - access.delay_ns == 192_000 + 352_000 for access in got)
    shout = csma_access(words_of(0), 1, 0, airtime_ns, unicast=False)
    assert shout.delay_ns == shout.occupancy_ns == got[0].delay_ns


def test_802154_errors_are_repeated_three_times() -> None:
    airtime_ns, count = lrwpan_airtime_ns(50), 4_000
    got = [csma_access(words_of(k), 1, chance_threshold(0.5), airtime_ns) for k in range(count)]
    assert abs(binomial_z(sum(access.outcome == "error" for access in got), count, 0.5**4)) < Z_ALPHA
    assert {access.retries for access in got} == {0, 1, 2, 3}
    once = csma_access(words_of(0), 1, UNIT, airtime_ns, unicast=False)
    assert (once.outcome, once.retries) == ("error", 0)


@pytest.mark.parametrize("unicast", [False, True])
def test_802154_shares_are_shares(unicast: bool) -> None:
    points = [sensing(n, lrwpan_airtime_ns(50), unicast) for n in range(1, CONTENDERS_MAX + 1)]
    assert points[0].busy == points[0].p == 0.0 and points[0].idle_share == pytest.approx(1.0)
    assert all(few.p < many.p and few.busy < many.busy for few, many in pairwise(points))
    assert all(0.0 <= point.collision_share <= 0.5 for point in points)
    assert points[-1].p < 1.0 and points[-1].access_threshold < UNIT
