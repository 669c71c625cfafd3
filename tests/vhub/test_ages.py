"""Ages at use: what a controller feels, beside what a link's delay says."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.capture.reader import open_capture
from foosim.capture.rows import AGES, AgeRow
from foosim.common.json_text import decode_json
from foosim.console.report.collect import gather
from foosim.console.report.page import page
from foosim.protocol.codec import decode_any
from foosim.protocol.messages import Farewell
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.simulation.what_if import what_if
from foosim.vhub.network.ages import Ages, quantile
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import HubRecord, TickRecord
from tests.turns import BY_PERIOD
from tests.vhub.conftest import WATCHER, HubRun

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
MS: Final = 1_000_000
TICKS: Final = 620
QUICK: Final = ("engine=pure", "table.rules.kickoff_delay=20 ms")
LOCKED: Final = (*QUICK, *BY_PERIOD)


def delayed(delay: str, *sets: str) -> tuple[str, ...]:
    return (*LOCKED, f"network.links=[{{id: w, from: '*', to: '*', delay: {delay}}}]", *sets)


def told(sets: tuple[str, ...]) -> dict[tuple[str, str], tuple[float, float]]:
    """The median and the 99th percentile, in ms, by receiver and channel, as the vHub reports them in the end."""
    systems: list[System] = []
    rehearse(TABLE.read_text(), TABLE.name, 100, 1, sets, Settings(), prepare=systems.append)
    links = decode_json(decode_any(Farewell, systems[0].hub.farewell().payload).report)["links"]
    return {
        (link[1], f"{link[0]} {channel}"): (p50_ns / MS, p99_ns / MS)
        for link in links
        for channel, _, p50_ns, p99_ns in link[9]
    }


@pytest.mark.parametrize(
    ("sets", "age_ms"),
    [
        (delayed("1300 us"), 10.0),
        (delayed("7 ms"), 10.0),
        (delayed("1300 us", "players.player-red.offset=2 ms"), 2.0),
        (delayed("7 ms", "players.player-red.offset=2 ms"), 12.0),
        (delayed("7 ms", "players.player-red.offset=8 ms"), 8.0),
        (delayed("7 ms", "players.player-red.act=arrival", "players.player-red.arrivals={camera: [ball]}"), 8.0),
        (delayed("0 s"), 0.0),
    ],
)
def test_it_says_what_delay_and_periods_make_of_it(sets: tuple[str, ...], age_ms: float) -> None:
    """Sensor and player in phase: the age is a whole period whatever the delay is."""
    if "arrival" in str(sets):  # the period comes between where it is as short as that of the camera
        sets = (*sets, "players.player-red.rate=10 Hz")
    ages = told(sets)
    assert ages["player-red", "camera ball"] == (age_ms, age_ms)
    assert len(ages) == 10, "each team hears its rods and the camera"


def test_of_a_free_running_client_each_tick_counts_that_admits_its_packets(hub_run: HubRun) -> None:
    """By the records alone: the watcher of the driven hub comes, goes and comes back, and hears some channels."""
    records = [record for raw in hub_run.records if isinstance(record := decode_any(HubRecord, raw), TickRecord)]
    arrived = [f for closing in hub_run.closings for f in closing.fates if not f.cause and f.destination == WATCHER]
    expected: dict[tuple[str, str], Counter[int]] = {}
    heard, last, joined = set[tuple[str, str]](), 0, 0
    for record in records:
        for joining in record.joins:
            if joining.name == WATCHER:
                heard, joined = set(joining.subscriptions), record.tick
        taken = [packet.sequence for name, sent in record.admitted if name == WATCHER for packet in sent]
        if max(taken, default=0) <= last:
            continue  # nothing, or only what was taken before
        last = max(taken)
        for pair in heard:
            came = [f.sent_ns for f in arrived
                    if (f.source, f.channel) == pair and joined <= f.arrival_tick <= record.tick]  # fmt: skip
            if came:
                expected.setdefault(pair, Counter())[record.tick - max(came) // hub_run.deployment.tick_ns] += 1
    state = hub_run.core.state
    assert state is not None and expected and sum(sum(counts.values()) for counts in expected.values()) > 5
    assert {(age.source, age.channel): age.counts for age in state.ages.of(WATCHER, state.closed)} == expected
    assert HubState.restore(hub_run.deployment, state.snapshot()).ages.state() == state.ages.state()


def test_a_capture_tells_each_second_and_whatif_and_report_have_it(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    rehearse(TABLE.read_text(), TABLE.name, TICKS, 1, delayed("7 ms"), Settings(), capture=path)
    capture = open_capture(path)
    rows = [row for row in capture.rows(AGES) if isinstance(row, AgeRow)]
    assert {row.tick for row in rows} == {499, TICKS - 1}, "a row a second, and the rest at the end"
    ball = [row for row in rows if (row.client, row.source) == ("player-red", "camera")]
    assert [(row.uses, row.p50_ns, row.p99_ns, row.most_ns) for row in ball] == [
        (98, 10 * MS, 10 * MS, 10 * MS), (24, 10 * MS, 10 * MS, 10 * MS),
    ]  # fmt: skip
    assert all(sum(row.counts) == row.uses and sorted(row.ages_ns) == row.ages_ns for row in rows)
    same = what_if(capture)
    assert same.changed == 0 and len(same.ages) == 10 and all(age.before == age.after for age in same.ages)
    found = gather(capture, "run")
    (use,) = [use for use in found["uses"] if (use["source"], use["destination"]) == ("camera", "player-red")]
    assert (use["channel"], use["delay_mean_ms"], use["p99_ms"], use["uses"]) == ("ball", 7.0, 10.0, 122)
    assert "<h2>Age at use</h2>" in page(found)


@given(st.lists(st.integers(0, 2**40), min_size=1, max_size=200))
def test_counts_are_few_and_their_quantiles_near(gaps: list[int]) -> None:
    ages = Ages(2)
    ages.joins("a", [("b", "c")])
    ages.reached("a", "b", "c", 0)
    for gap in gaps:
        ages.used("a", gap)
    (age,) = ages.of("a", 9)
    for share in (0.5, 0.99):
        exact = sorted(gaps)[max(0, -(-round(share * 100) * len(gaps) // 100) - 1)]
        assert quantile(age.counts, share) <= exact <= quantile(age.counts, share) * 33 / 32 + 1
    assert all(known < 64 or known % (1 << (known.bit_length() - 6)) == 0 for known in age.counts)
    again = Ages(2)
    again.restore(ages.state())
    assert again.state() == ages.state() and [a.counts for a in again.unreported(9)] == [
        a.counts for a in ages.unreported(9)
    ]


def test_a_run_that_ends_before_its_first_closing_has_a_row_at_tick_0() -> None:
    ages = Ages(2)
    ages.joins("a", [("b", "c")])
    ages.reached("a", "b", "c", 0)
    ages.used("a", 0)
    assert [age.tick for age in ages.unreported(-1)] == [0], "its log time is not below 0"


def test_what_a_client_does_not_hear_is_not_counted_and_a_new_process_knows_nothing() -> None:
    ages = Ages(2)
    ages.joins("a", [("b", "c")])
    ages.reached("a", "b", "other", 4)
    ages.reached("nobody", "b", "c", 4)
    ages.used("a", 5)
    assert ages.of("a", 9) == []
    ages.reached("a", "b", "c", 8)
    ages.reached("a", "b", "c", 4)
    ages.used("a", 5)
    ages.joins("a", [("b", "c")])
    ages.used("a", 6)
    (age,) = ages.of("a", 9)
    assert age.counts == {1: 1}, "what came late does not make it older; what the process before had is gone"
