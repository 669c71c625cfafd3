"""Balancing: what moves where, and when nothing does; a run that is balanced is the same world."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.common.units import Pace
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.supervisor.load_balancing import EVERY_NS, SETTLE_NS, STAY_NS, Balancer, Shift, shifts_at_once

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
OWNERS = {"a": "n1", "b": "n1", "c": "n1", "d": "n2"}
"""Robots of two nodes."""


def test_a_robot_moves_from_the_busiest_node_to_the_idlest() -> None:
    balancer = Balancer(OWNERS)
    assert balancer.look({"n1": 0.9, "n2": 0.2, "n3": 0.3}, OWNERS, 0) == Shift("a", "n1", "n2", 0.9, 0.2)


def test_it_moves_home_rather_than_another_one() -> None:
    balancer = Balancer({**OWNERS, "c": "n2"})
    shift = balancer.look({"n1": 0.9, "n2": 0.2}, OWNERS, 0)
    assert shift is not None and shift.robot == "c"


@pytest.mark.parametrize(
    ("loads", "owners"),
    [
        ({"n1": 0.30, "n2": 0.20}, OWNERS),  # a small difference
        ({"n1": 0.90, "n2": 0.65}, OWNERS),  # a robot's share is more than the difference
        ({"n1": 0.90, "n2": 0.10}, {"a": "n1", "d": "n2"}),  # the only robot: the other node would have it all
        ({"n1": 0.90}, OWNERS),
    ],
)
def test_nothing_moves_when_nothing_is_won(loads: dict[str, float], owners: dict[str, str]) -> None:
    assert Balancer(OWNERS).look(loads, owners, 0) is None


def test_loads_settle_before_the_next_move_and_a_robot_stays_where_it_came() -> None:
    balancer = Balancer({})
    loads = {"n1": 0.9, "n2": 0.1}
    shift = balancer.look(loads, OWNERS, 0)
    assert shift is not None and shift.robot == "a"
    owners = {**OWNERS, "a": "n2"}
    assert balancer.look(loads, owners, SETTLE_NS - 1) is None
    back = {"n1": 0.1, "n2": 0.9}
    second = balancer.look(back, owners, SETTLE_NS)
    assert second is not None and second.robot == "d", "not the one that has just come"
    last = balancer.look(back, {**owners, "d": "n1", "e": "n2"}, STAY_NS)
    assert last is not None and last.robot == "a"


def test_one_busy_second_moves_nothing() -> None:
    balancer = Balancer({})
    assert balancer.look({"n1": 0.3, "n2": 0.3}, OWNERS, 0) is None
    assert balancer.look({"n1": 0.6, "n2": 0.3}, OWNERS, EVERY_NS) is None, "the mean is 0.45"
    assert balancer.look({"n1": 0.9, "n2": 0.3}, OWNERS, 2 * EVERY_NS) is not None


def test_a_run_that_is_balanced_is_the_same_world() -> None:
    def busy(system: System) -> None:
        for name, load in (("n1", 0.9), ("n2", 0.1), ("n3", 0.2)):
            system.processes[name].core.busy = load

    def prepare(system: System) -> None:
        system.supervisor.balancer = Balancer(system.supervisor.state.deployment.owners())
        system.at_tick(5, lambda: busy(system))

    text, sets, pace = TABLE.read_text(), ["engine=pure"], Pace("realtime")
    ticks = 700
    usual = rehearse(text, TABLE.name, ticks, 1, sets)
    balanced = rehearse(text, TABLE.name, ticks, 3, sets, Settings(), pace=pace, prepare=prepare)
    assert balanced.json["moves"] == 1 and balanced.digests == usual.digests


def test_at_once_all_move_of_which_it_is_expected_that_they_make_nodes_alike() -> None:
    owners = dict.fromkeys("abcdefgh", "n1") | {"x": "n2"}
    shifts = shifts_at_once({"n1": 0.8, "n2": 0.1, "n3": 0.0}, owners, {"h": "n3"})
    told = [(shift.robot, shift.target) for shift in shifts]
    assert told == [("h", "n3"), ("a", "n2"), ("b", "n3"), ("c", "n2"), ("d", "n3")], "then each has 30 %"
    assert {(shift.source_load, shift.target_load) for shift in shifts} == {(0.8, 0.0), (0.8, 0.1)}, "as measured"
    assert shifts_at_once({"n1": 0.3, "n2": 0.2, "n3": 0.2}, owners, {}) == []


def test_an_operator_has_it_done_once_and_is_told_what_moved_and_why() -> None:
    asked: list[str] = []

    def busy(system: System) -> None:
        for name, load in (("n1", 0.9), ("n2", 0.1), ("n3", 0.2)):
            system.processes[name].core.busy = load

    def prepare(system: System) -> None:
        def ask() -> None:
            asked.append(system.people.request("balance", 0, {}))

        system.at_tick(5, lambda: busy(system))
        system.at_tick(650, ask)
        system.at_tick(660, ask)
        system.at_tick(690, lambda: told.update({each: system.people.answers[each].text for each in asked}))

    told: dict[str, str] = {}
    text, sets, pace = TABLE.read_text(), ["engine=pure"], Pace("realtime")
    usual = rehearse(text, TABLE.name, 700, 1, sets)
    balanced = rehearse(text, TABLE.name, 700, 3, sets, Settings(), pace=pace, prepare=prepare)
    assert balanced.digests == usual.digests and balanced.json["moves"] > 0
    loads = "n1 90%, n2 10%, n3 20%"
    assert [told[each] for each in asked] == [
        f"moved at tick 650, for loads were {loads}: blue.attack from n1 to n2; blue.midfield from n1 to n3",
        f"nothing moves at tick 660: loads are {loads}; no move would win more than a robot's share, or 15%",
    ]
