"""Every fault of tests/faults once, on real processes: what must hold however slow the machine is.

`make faults` repeats each at random times and asserts the figures.
"""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Final

import pytest

from foosim.capture.reader import open_capture
from tests.faults.cluster import Cluster, FaultError
from tests.faults.digest import FAULTS
from tests.faults.kinds import NODE, Trial, twin_refused
from tests.faults.outside import OUTSIDE
from tests.faults.outside import SETS as WITH_CLIENT
from tests.wire.proxy import Weather

if TYPE_CHECKING:
    from tests.wire.conftest import House

SETS: Final = (
    "engine=pure",
    "deadlines={heartbeat: 5 s, tick_named: 50 s, tick_lost: 100 s, lockstep_fast: 100 s, lockstep_realtime: 100 s,"
    " start: 100 s}",
)
"""A process is lost when its link is, or when it does not go round for longer than a busy machine holds one up."""
BAD: Final = Weather(delay_s=0.001, jitter_s=0.002, bytes_per_s=20e6, stall=0.01, stall_s=0.03)
SEED: Final = 5


def test_a_run_disturbed_by_every_fault_is_the_run_that_would_have_been(house: House) -> None:
    """On links that delay and stall; `end` compares the digests of all ticks with an undisturbed rehearsal's."""
    nodes = dict.fromkeys(("red", "blue"), NODE)
    with Cluster(house.folder, "faults", SETS, pace="0.05x", seed=SEED, weather=BAD, programs=nodes) as cluster:
        trial = Trial(cluster, random.Random(SEED), calm_s=(0.0, 0.05))
        for fault in (*FAULTS, twin_refused):
            fault(trial)
        result = cluster.end()
    cluster.text = cluster.text.replace("seed: 1\n", "seed: 2\n")
    with pytest.raises(FaultError, match=r"digest: .*, undisturbed "):
        cluster.compare(result)
    assert result["handovers"] + result["moves"] > 0
    told = [(it["what"], it["name"], it["reason"], it["tick"], it["epoch"]) for it in result["recoveries"]]
    assert {what for what, *_ in told} == {"node", "join", "supervisor", "vhub"}
    rows = open_capture(cluster.capture).recoveries
    assert [(row.what, row.name, row.reason, row.tick, row.epoch) for row in rows] == told
    assert house.processes_with(str(house.folder)) == {}


def test_what_comes_from_outside_costs_a_run_nothing_but_packets(house: House) -> None:
    """`end` computes the capture again: it is equal, and everything in it is finite."""
    with Cluster(house.folder, "outside", (*SETS, *WITH_CLIENT), pace="0.1x", seed=SEED) as cluster:
        for kind in OUTSIDE:
            kind.trial(Trial(cluster, random.Random(SEED), calm_s=(0.0, 0.05)))
        result = cluster.end(altered=True)
    capture = open_capture(cluster.capture)
    assert capture.frames.column("ball", "quarantined", 1).max() == 1.0, "the ball was hit too hard"
    causes = capture.packets.cause[capture.packets.source == "flooder"]
    assert "rx_full" in set(causes) and result["packets"]["refused"] > 0
    assert result["recoveries"] == [] and house.processes_with(str(house.folder)) == {}
