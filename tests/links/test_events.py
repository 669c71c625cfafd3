"""Events by simulated time: partitions at sending and at arrival, clogs, changes, and what heals them."""

from __future__ import annotations

import json
from math import expm1
from typing import Any, Final

import pytest

from foosim.deployment.network.rules import event_of
from foosim.protocol.messages import Sent
from foosim.vhub.links.fabric import Fabric
from foosim.world.edits import Disrupt
from tests.links.offered import ENDS, MS, Hub, S, deployment_of, every, fabric_of, fates, rule
from tests.links.proof import Proof
from tests.links.statistics import ks

PAIRS = [(one, other) for one in ENDS for other in ENDS if one != other]


def events(*lines: str) -> str:
    return f"network.events=[{', '.join(lines)}]"


def cut_at(sets: tuple[str, ...], ends: tuple[str, str], period_ns: int = MS, count: int = 100) -> list[int]:
    """The times (ms) at which a packet is lost by a partition, sent every ms."""
    fabric = Fabric(deployment_of(*sets))
    return [f.sent_ns // MS for f in fates(fabric, every(period_ns, count), ends=ends) if f.cause == "partition"]


def test_a_partition_cuts_what_is_sent_and_what_arrives() -> None:
    """With 10 ms of delay, what was sent 10 ms before it begins arrives in it; `deliver` lets that through."""
    when = events("{at: 30 ms, for: 20 ms, partition: [[a], [rest]]}")
    delay = rule("delay: 10 ms", "from: '*', to: '*'")
    assert cut_at((delay, when), ("a", "b")) == list(range(20, 50))
    deliver = "network.defaults={in_flight_on_partition: deliver}"
    assert cut_at((delay, when, deliver), ("a", "b")) == list(range(30, 50))


def test_who_is_on_which_side() -> None:
    """The first group that selects an endpoint is its; who is in none talks to everybody."""
    when = events("{at: 10 ms, for: 5 ms, partition: [[a, b], [c]]}")
    cut = {pair for pair in PAIRS if cut_at((when,), pair)}
    assert cut == {("a", "c"), ("b", "c"), ("c", "a"), ("c", "b")}
    rest = events("{at: 10 ms, for: 5 ms, partition: [[a], [rest], [d]]}")
    assert {p for p in PAIRS if not cut_at((rest,), p)} == {("b", "c"), ("c", "b")}
    first = events("{at: 10 ms, for: 5 ms, partition: [[a], [a, b]]}")
    assert {p for p in PAIRS if cut_at((first,), p)} == {("a", "b"), ("b", "a")}


def test_a_partition_of_one_direction() -> None:
    when = events("{at: 10 ms, for: 5 ms, partition: [[a], [rest]], symmetric: false}")
    assert {pair for pair in PAIRS if cut_at((when,), pair)} == {("a", "b"), ("a", "c"), ("a", "d")}


@pytest.mark.parametrize("heal", ["all", "partitions", "clogs", "settings"])
def test_each_heals_its_own(heal: str) -> None:
    lines = (
        "{at: 10 ms, partition: [[a], [rest]]}",
        "{at: 10 ms, clog: {from: b, to: c}}",
        "{at: 10 ms, set: {link: tried, delay: 3 ms}}",
        f"{{at: 50 ms, heal: {heal}}}",
    )
    sets = (rule("delay: 1 ms", "from: d, to: '*'"), events(*lines))
    assert max(cut_at(sets, ("a", "b"))) == (49 if heal in ("all", "partitions") else 99)
    held = [f.due_ns for f in fates(Fabric(deployment_of(*sets)), every(MS, 100), ends=("b", "c"))]
    if heal in ("all", "clogs"):
        assert held[10:50] == [50 * MS + n for n in range(40)] and held[51] == 51 * MS
    else:
        assert min(held[10:]) > 1000 * S, "no end"
    flights = fates(Fabric(deployment_of(*sets)), every(MS, 100), ends=("d", "c"))
    changed = [(f.due_ns - f.sent_ns) // MS for f in flights]
    assert changed[:50] == [1] * 10 + [3] * 40 and changed[-1] == (1 if heal in ("all", "settings") else 3)


@pytest.mark.parametrize("first", ["heal", "partition"])
def test_of_two_events_at_one_time_the_later_one_has_the_last_word(first: str) -> None:
    """What begins behind a heal is not healed by it, in a file and on request."""
    lines = ["{at: 20 ms, heal: all}", "{at: 20 ms, for: 30 ms, partition: [[a], [rest]]}"]
    lines = lines if first == "heal" else lines[::-1]
    expected = list(range(20, 50)) if first == "heal" else []
    assert cut_at((events(*lines),), ("a", "b")) == expected
    fabric = Fabric(deployment_of())
    actions = [{"heal": "all"}, {"partition": [["a"], ["rest"]], "for": "30 ms"}]
    for action in actions if first == "heal" else actions[::-1]:
        fabric.take(10, 20 * MS, json.dumps(action))
    found = [f.sent_ns // MS for f in fates(fabric, every(MS, 100)) if f.cause]
    assert found == expected


def test_a_clog_holds_and_lets_go() -> None:
    """What would come within it comes when it ends, in order; the other direction is as it was."""
    when = events("{at: 20 ms, for: 30 ms, clog: {from: a, to: [b, c]}}")
    for ends in (("a", "b"), ("a", "c"), ("b", "a"), ("a", "d")):
        fabric = Fabric(deployment_of(rule("delay: 5 ms", "from: '*', to: '*'"), when))
        due = [f.due_ns for f in fates(fabric, every(MS, 100), ends=ends)]
        plain = [n * MS + 5 * MS for n in range(100)]
        if ends in (("a", "b"), ("a", "c")):
            plain[15:45] = [50 * MS + n for n in range(30)]
            plain[45] = 50 * MS + 30  # due at the end itself, behind those that waited
        assert due == plain, ends


def test_random_lengths_are_exponential(proof: Proof) -> None:
    """Of clogs that are asked for one by one: each has a length of its own, drawn by its number."""
    n = proof.size(200, 1000)
    deployment = deployment_of()
    fabric = Fabric(deployment, deployment.network.model_copy(update={"seed": proof.seed}))
    clog = {"clog": {"from": "a", "to": "b"}, "for": {"exponential": "200 ms"}}
    lengths = []
    for k in range(n):
        fabric.timeline.add(event_of(json.dumps(clog), 10 * S * k))
        hold = fabric.timeline.holds[-1]
        lengths.append((hold.end_ns - hold.start_ns) / S)
    found = [f.due_ns - f.sent_ns for f in fates(fabric, every(10 * S, n))]
    assert [x / S for x in found] == lengths
    proof.likely("T6", "clogs with exponential lengths: Kolmogorov", ks(lengths, lambda x: -expm1(-x / 0.2)), n)


def test_changes_are_over_one_another_and_heal_at_once() -> None:
    lines = (
        "{at: 10 ms, set: {link: tried, loss: 100 %}}",
        "{at: 20 ms, set: {link: tried, delay: 2 ms}}",
        "{at: 30 ms, set: {link: tried, loss: 0 %}}",
        "{at: 40 ms, heal: settings}",
    )
    found = list(fates(fabric_of("delay: 1 ms", 1, events(*lines)), every(MS, 50)))
    lost = [f.sent_ns // MS for f in found if f.cause]
    assert lost == list(range(10, 30))
    assert [(f.due_ns - f.sent_ns) // MS for f in found if not f.cause] == [1] * 10 + [2] * 10 + [1] * 10


@pytest.mark.parametrize(
    ("chain", "is_burst"),
    [
        ("p13: 100 %, p31: 0 %", True),
        ("p13: 100 %, p31: 0 %, p32: 100 %", False),
        ("p13: 0 %, p31: 0 %, p14: 100 %", False),
    ],
    ids=["burst", "delivery within a burst", "single loss"],
)
def test_a_burst_goes_on_in_another_model_of_bursts(chain: str, is_burst: bool) -> None:
    """Of the four states only the burst is the bad one of two, and the other way round; singles are over."""
    to_two = events("{at: 9 ms, set: {link: tried, gilbert_elliott: {p: 0.0001 %, r: 0.0001 %}}}")
    found = [bool(f.cause) for f in fates(fabric_of(f"markov4: {{{chain}}}", 1, to_two), every(MS, 30))]
    assert found[9:] == [is_burst] * 21
    to_runs = events("{at: 9 ms, set: {link: tried, burst: {loss: 0.0001 %, mean_burst: 1000000}}}")
    assert [bool(f.cause) for f in fates(fabric_of(f"markov4: {{{chain}}}", 1, to_runs), every(MS, 30))] == found
    to_four = events("{at: 9 ms, set: {link: tried, markov4: {p13: 0.0001 %, p31: 0.0001 %}}}")
    two = "gilbert_elliott: {p: 99 %, r: 0.0001 %}" if is_burst else "gilbert_elliott: {p: 0.0001 %, r: 100 %}"
    assert [bool(f.cause) for f in fates(fabric_of(two, 1, to_four), every(MS, 30))] == [is_burst] * 30


REORDER: Final = {"set": {"link": "tried", "reorder": {"probability": "100 %", "extra": "5 ms"}}}
CLOG: Final = {"clog": {"from": "a", "to": "b"}, "for": "46 ms"}


@pytest.mark.parametrize(
    ("asked", "due_ns"),
    [
        ({3: REORDER, 4: CLOG}, [54 * MS, 54 * MS + 1, 54 * MS + 2, 61 * MS, 63 * MS, 65 * MS]),
        ({3: REORDER, 4: {"heal": "settings"}, 8: CLOG}, [62 * MS + place for place in (0, 1, 2, 0, 3, 4)]),
    ],
    ids=["before new reordering", "behind old reordering"],
)
def test_a_clog_leaves_the_order_in_which_packets_were_sent(asked: dict[int, Any], due_ns: list[int]) -> None:
    """What is overtaken by the settings of when it was sent is, and nothing else, whatever the link does by then."""
    hub = Hub(deployment_of(rule("delay: 50 ms")))
    for tick in range(9):
        sent = [Sent(tick + 1, "b", "data", 0, b"x")] if tick < 6 else []
        hub.close({"a": sent}, edits=[Disrupt(json.dumps(asked[tick]))] if tick in asked else [])
    due = {flight.sequence: flight.due_ns for flight in hub.state.in_flight()}
    assert [due[number] for number in range(1, 7)] == due_ns


def test_what_is_fast_again_does_not_overtake() -> None:
    """A perfect link that was slow for a time: what is sent then comes behind it, and at once when that is through."""
    lines = events("{at: 10 ms, set: {link: tried, delay: 50 ms}}", "{at: 30 ms, heal: settings}")
    times = [n // 2 * MS for n in range(200)]
    due = [f.due_ns for f in fates(fabric_of("order: fifo", 1, lines), times)]
    assert due[:20] == times[:20] and due[160:] == times[160:]
    assert due[20:60] == [times[n] + 50 * MS + n % 2 for n in range(20, 60)]
    assert due[60:160] == [79 * MS + 2 + n for n in range(100)]
    free = [f.due_ns for f in fates(fabric_of("order: free", 1, lines), times)]
    assert free == [at_ns + 50 * MS * (10 <= n // 2 < 30) for n, at_ns in enumerate(times)]


def test_channels_of_one_link_keep_their_order_behind_a_clog() -> None:
    """Whether or not a rule of others names channels, a clog that is asked for and healed lets go in order."""
    lines = {5: {"clog": {"from": "a", "to": "b"}, "for": "90 ms"}, 20: {"heal": "clogs"}}
    found = []
    for others in ("", "{id: other, from: c, to: d, channels: [z]}, "):
        hub = Hub(deployment_of(f"network.links=[{others}{{id: tried, from: a, to: b, delay: 3 ms}}]"))
        for tick in range(30):
            sent = [Sent(3 * tick + n, "b", channel, 0, b"x") for n, channel in enumerate("xyx", 1)]
            edits = [Disrupt(json.dumps(lines[tick]))] if tick in lines else []
            hub.close({"a": sent}, edits=edits)
        due = {f.sequence: f.due_ns for f in (*hub.fates, *hub.state.in_flight())}
        found.append([due[number] for number in range(1, 91)])
    assert found[0] == found[1] == sorted(set(found[0]))
