"""Capacity: how many packets are on their way at once, and whose place one takes that comes beyond it."""

from __future__ import annotations

from collections import Counter
from typing import Final

from foosim.protocol.messages import Sent
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.packet import Flight
from foosim.vhub.stages.capacity import EVICTED
from tests.links.offered import MS, Hub, deployment_of, fabric_of, rule
from tests.links.proof import Proof
from tests.links.statistics import chi_square

MOST: Final = 5


def flown(fabric: Fabric, n: int, late_ns: int) -> tuple[Counter[str], Counter[int]]:
    """Send packets of a to b, one a millisecond, each due after `late_ns`; return their causes, and whose place each
    newcomer took, counted from the oldest of those on their way."""
    link = fabric.link("a", "b", "data")
    causes: Counter[str] = Counter()
    taken: Counter[int] = Counter()
    flying: list[Flight] = []
    for k in range(1, n + 1):
        while flying and flying[0].due_ns <= k * MS:
            link.arrive(flying[0], "")
            causes[flying.pop(0).cause] += 1
        under_way = link.state.under_way
        before = [entry[:2] for entry in under_way if not entry[2]]
        flight = Flight("a", "b", "data", k, k * MS, 0, bytes(9))
        assert link.send(flight) and flight.due_ns == k * MS + late_ns
        flying.append(flight)
        after = [entry[:2] for entry in under_way if not entry[2]]
        assert len(after) <= MOST and after[-1] == (k, 0)
        gone = [place for place, entry in enumerate(before) if entry not in after]
        assert len(gone) == (len(before) == MOST)
        taken.update(gone)
    for flight in flying:
        link.arrive(flight, "")
        causes[flight.cause] += 1
    assert link.state.under_way == []
    return causes, taken


def test_one_more_takes_the_place_of_a_random_one(proof: Proof) -> None:
    n = proof.size(4_000, 40_000)
    fabric = fabric_of(f"delay: 20 ms, capacity: {MOST}", proof.seed)
    causes, taken = flown(fabric, n, 20 * MS)
    assert causes[EVICTED] == taken.total() and causes[""] + causes[EVICTED] == n
    p = chi_square([taken[place] for place in range(MOST)], [taken.total() / MOST] * MOST)
    proof.likely("T24", "capacity: whose place is taken, chi-square", p, taken.total())
    account = fabric.link("a", "b", "data").state
    assert (account.offered, account.dropped, account.causes) == (n, causes[EVICTED], {EVICTED: causes[EVICTED]})


def test_what_fits_is_let_alone() -> None:
    """As many as the capacity are on their way: nothing happens."""
    for capacity in (f"capacity: {MOST}", "capacity: 10000"):
        causes, taken = flown(fabric_of(f"delay: 4.5 ms, {capacity}"), 200, 9 * MS // 2)
        assert causes == {"": 200} and not taken


def test_a_place_is_free_again_whatever_became_of_its_packet() -> None:
    """What a partition cut at arrival, and what came too late, is on its way no more; copies have places, too."""
    cut = "network.events=[{at: 8 ms, for: 9 ms, partition: [[a], [b]]}]"
    sets = rule(f"delay: 6 ms, duplicate: 100 %, capacity: {MOST}"), cut
    whole, half = Hub(deployment_of(*sets)), Hub(deployment_of(*sets))
    for tick in range(12):
        for hub in (whole, half):
            hub.close({"a": [Sent(3 * tick + n, "b", "data", 0, b"") for n in (1, 2, 3)]} if tick < 3 else {})
        if tick == 4:
            half = Hub(deployment_of(*sets), half.state.restore(half.deployment, half.state.snapshot()))
    assert whole.state.snapshot() == half.state.snapshot()
    causes = Counter(flight.cause for flight in whole.fates)
    assert causes[EVICTED] > 0 and causes["partition"] > 0 and whole.state.packets.in_flight == 0
    assert whole.state.fabric.states["a", "b", "tried"].under_way == []


def test_chaos_bounds_paths() -> None:
    """Between 2 and 20, as in TigerBeetle's simulator, by its seed; its preset in the middle."""
    found = set()
    deployment = deployment_of(rule("delay: 1 ms"), "network.events=[{at: 0 s, chaos: {}, until: 1 s}]")
    for seed in range(40):
        fabric = Fabric(deployment, deployment.network.model_copy(update={"seed": seed}))
        found.add(fabric.link("a", "b", "data").setup_at(MS).settings.capacity)
    assert found <= {*range(2, 21)} and len(found) > 12
    assert deployment_of("network.radios={c: {preset: chaos}}").network.radios["c"].capacity == 11
