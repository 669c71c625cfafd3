"""The swarm: some seeds of it. What it must find, also what it once found: `test_gate`."""

from __future__ import annotations

import json
from contextlib import redirect_stdout
from dataclasses import asdict, replace
from io import StringIO
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.node.core import NodeCore
from foosim.node.tick import Work
from foosim.protocol.codec import encode
from foosim.protocol.messages import Deliveries, Done, Sent
from foosim.runtime.roles.bus import CALM
from foosim.simulation.settings import Clock
from foosim.simulation.system import Settings
from foosim.vhub.state.records import TickRecord
from tests.swarm.__main__ import main
from tests.swarm.campaign import FAULTS, NODES, WORLDS, Flight, Plan, fly, plan_of, undisturbed
from tests.swarm.faults import (
    CHANGES_THE_WORLD,
    FAULT_OF,
    HEALED_TICK,
    HOUR_NS,
    KINDS,
    TICKS,
    Dice,
    loses_players,
)
from tests.swarm.packet_invariants import Broken, PacketLaws

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
LIVING: Final = Path(__file__).parents[1] / "swarm" / "living.yaml"
MINUTE_TICKS: Final = 30_000
FIRST: Final = 1001
SEEDS: Final = 5
"""The gate flies a dozen more without their bugs."""


@pytest.fixture(scope="module")
def told() -> dict[str, Any]:
    """What the command that flies seeds tells of each."""
    printed = StringIO()
    with redirect_stdout(printed):
        code = main([str(TABLE), "--seed", str(FIRST), "--seeds", str(SEEDS), "--json"])
    assert code == 0, printed.getvalue()
    found: dict[str, Any] = json.loads(printed.getvalue().splitlines()[-1])
    return found


def test_the_laws_hold_under_random_faults_and_a_seed_flies_equally_each_time(told: dict[str, Any]) -> None:
    assert [flown["seed"] for flown in told["seeds"]] == [*range(FIRST, FIRST + SEEDS)] and told["broken"] == []
    assert {flown["ticks"] for flown in told["seeds"]} == {TICKS}
    lost = next(flown for flown in told["seeds"] if flown["losses"])
    assert asdict(fly(TABLE.read_text(), TABLE.name, lost["seed"])) == lost


def test_the_laws_hold_in_a_world_that_lives() -> None:
    """Jobs over bad links, crates that are held, what comes and goes and is set, and faults that hit just these."""
    text, files = pin_assets(LIVING.read_text(), LIVING.name, LIVING.parent)
    flown = fly(text, LIVING.name, 10, files=tuple(files.items()))
    assert flown.broken == "" and flown.ticks == TICKS and {"strike", "set"} <= {*flown.kinds}


def test_the_laws_hold_where_links_make_copies() -> None:
    """Which are in no account but one of their own. Questions for echoes are not doubled: each comes back once."""
    text, rules = TABLE.read_text(), "\n  links:"
    assert text.count(rules) == 1
    doubled = "{id: doubled, from: '*', to: '*', channels: [ball, encoder, position], delay: 3 ms, duplicate: 20 %}"
    before, _, behind = text.partition(rules)
    comment, _, rest = behind.partition("\n")
    flown = fly(f"{before}{rules}{comment}\n    - {doubled}\n{rest}", TABLE.name, 1001)
    assert flown.broken == "" and flown.ticks == TICKS


def test_a_seed_is_a_plan() -> None:
    assert plan_of(7) != plan_of(8)
    worlds = set()
    for seed in range(200):
        plan = plan_of(seed)
        players = [fault for fault in plan.faults if fault.kind == "player"]
        assert bool(players) == loses_players(seed)
        worlds |= {seed % WORLDS == WORLDS - 1} if players else set()
        extra = len(players) + sum(fault.kind == "set" for fault in plan.faults)
        assert plan.nodes in NODES and FAULTS[0] - 3 <= len(plan.faults) - extra <= FAULTS[1]
        assert len(plan.kinds) >= 3 and len(plan.faults) >= 5
        assert all(0 < fault.tick < HEALED_TICK for fault in plan.faults)
        again = plan_of(seed)
        assert [(f.tick, f.what) for f in plan.faults] == [(f.tick, f.what) for f in again.faults]
    assert {fault.kind for seed in range(200) for fault in plan_of(seed).faults} == {*KINDS, "player", "set"}
    assert worlds == {False, True}, "where players act at arrival, and where they have ticks of their own"


def test_what_was_answered_and_is_in_no_record_is_found() -> None:
    laws = PacketLaws(load_deployment(TABLE.read_text(), TABLE.name))
    record = TickRecord(0, b"", [], [], [], [], [], encode(Deliveries(1, [])))
    laws.answers(Done("player-red", "boot", 0, [Sent(1, "red.goal", "echo", 0, b"")]), b"done")
    with pytest.raises(Broken, match="a crash has lost some"):
        laws.closes(record, b"")


def test_clocks_decide_nothing() -> None:
    """Where processes' clocks began changes nothing, how fast they go only when things are asked again."""
    plan = replace(plan_of(4), weather=CALM, faults=())
    chains = []
    for offset_ns in (0, HOUR_NS):
        clocks = tuple((name, Clock(offset_ns * place)) for place, (name, _) in enumerate(plan.clocks))
        flight = Flight(TABLE.read_text(), TABLE.name, replace(plan, clocks=clocks), Settings())
        flight.run()
        chains.append((flight.system.supervisor.state.chain, flight.seen, flight.system.bus.now_ns))
    assert chains[0] == chains[1]


class _Loaded(Dice):
    """Gives what it is told to."""

    def __init__(self, *picks: int) -> None:
        super().__init__(0)
        self._picks = list(picks)

    def between(self, low: int, high: int) -> int:
        return self._picks.pop(0)


def test_faults_leave_a_node_that_may_take_part() -> None:
    """The last one is stopped while it is not yet back, and the others come back at ticks: one of them does at once."""
    names = ["n1", "n2", "n3"]
    kinds = (("kill", 0, 40, 50), ("stop", 1, 50), ("kill", 2, 40, 52), ("stop", 2, 52))
    faults = tuple(FAULT_OF[kind](_Loaded(*picks), names) for kind, *picks in kinds)
    flight = Flight(TABLE.read_text(), TABLE.name, Plan(0, 3, CALM, faults, ()), Settings())
    flight.run()
    assert flight.system.supervisor.state.chain == undisturbed(TABLE.read_text(), TABLE.name, 0, TICKS)
    assert all(answer.accepted for answer in flight.system.answers.values())


class _Dizzy(NodeCore):
    """Computes another world in each epoch."""

    def solved(self, work: Work) -> None:
        work.numbers[0] += 1e-9 * self.epoch
        super().solved(work)


def test_another_world_than_the_undisturbed_one_is_found() -> None:
    assert fly(TABLE.read_text(), TABLE.name, 1, Settings(node=_Dizzy)).broken


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(1, 101))
def test_a_minute_under_faults_is_the_minute_that_would_have_been(seed: int) -> None:
    """Law 3: 60 s of the table with about a thousand faults; all digests are those of the undisturbed run."""
    plan = plan_of(seed, MINUTE_TICKS)
    same = replace(plan, faults=tuple(fault for fault in plan.faults if fault.kind not in CHANGES_THE_WORLD))
    flight = Flight(TABLE.read_text(), TABLE.name, same, Settings())
    flight.run()
    expected = undisturbed(TABLE.read_text(), TABLE.name, seed % WORLDS, MINUTE_TICKS)
    assert flight.system.supervisor.state.chain == expected and flight.laws.ticks == MINUTE_TICKS
