"""The swarm: some seeds of it, those that found faults before, and planted faults that it must find."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import pytest
from typer.testing import CliRunner

from foosim.node.core import NodeCore
from foosim.rehearsal.rehearse_command import app
from foosim.rehearsal.swarm import FAULTS, HEALED_TICK, KINDS, NODES, TICKS, fly, plan_of
from foosim.rehearsal.system import Settings
from foosim.supervisor.core import SupervisorCore
from foosim.vhub.core import HubCore

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
FOUND: Final = {
    6: "a vHub that forgets commits that come early never catches up",
    168: "a supervisor that notices a loss does not ask again",
    188: "a newcomer that waits for its first frame does not ask again; the last node, lost and alive, is never let in",
    2126: "a node that was refused for its own ghost is not started again",
}


@pytest.mark.parametrize("seed", [*FOUND, 1001, 1002, 1003, 1004])
def test_the_laws_hold_under_random_faults(seed: int) -> None:
    flown = fly(TABLE.read_text(), TABLE.name, seed)
    assert flown.broken == "" and flown.ticks == TICKS


def test_a_seed_is_a_plan() -> None:
    assert plan_of(7) != plan_of(8)
    for seed in range(200):
        plan = plan_of(seed)
        assert NODES[0] <= plan.nodes <= NODES[1] and FAULTS[0] <= len(plan.faults) <= FAULTS[1]
        assert len({fault.kind for fault in plan.faults}) >= 3
        assert all(0 < fault.tick < HEALED_TICK for fault in plan.faults)
        again = plan_of(seed)
        assert [(f.tick, f.what) for f in plan.faults] == [(f.tick, f.what) for f in again.faults]
    assert {fault.kind for seed in range(200) for fault in plan_of(seed).faults} == set(KINDS)


def test_a_seed_flies_equally_each_time() -> None:
    first, second = (fly(TABLE.read_text(), TABLE.name, 5) for _ in range(2))
    assert first == second and first.losses > 0


class _Impatient(NodeCore):
    """Asks for nothing again."""

    def _ask_again(self, now_ns: int) -> None:
        self._patience.asked(now_ns)


class _Hasty(HubCore):
    """Says deliveries before it writes their record."""

    def _close_clients(self, now_ns: int) -> bool:
        before = len(self.actions)
        closed = super()._close_clients(now_ns)
        self.actions[before:] = reversed(self.actions[before:])
        return closed


class _Forgetful(SupervisorCore):
    """Opens an epoch without issuing the orders from its commit on again."""

    def open_epoch(self, *given: object, **named: object) -> None:
        said = self.released
        self.released = self.frame.tick
        super().open_epoch(*given, **named)  # type: ignore[arg-type]
        self.released = said

    def _on_want(self, *given: object) -> None:
        """Nor answers who asks."""


PLANTED: Final = {
    "nodes that ask for nothing again": (4, Settings(node=_Impatient)),
    "a vHub that speaks before it writes": (1, Settings(hub=_Hasty)),
    "a supervisor that forgets its orders": (2, Settings(supervisor=_Forgetful)),
}
"""By what is wrong: a seed that finds it."""


@pytest.mark.parametrize("fault", PLANTED)
def test_a_planted_fault_is_found(fault: str) -> None:
    seed, settings = PLANTED[fault]
    assert fly(TABLE.read_text(), TABLE.name, seed, settings).broken


def test_the_command_tells_how_seeds_went() -> None:
    done = CliRunner().invoke(app, [str(TABLE), "--swarm", "--seed", "1", "--seeds", "2", "--json"])
    assert done.exit_code == 0
    told = json.loads(done.stdout.splitlines()[-1])
    assert [flown["seed"] for flown in told["seeds"]] == [1, 2] and told["broken"] == []
    assert CliRunner().invoke(app, [str(TABLE)]).exit_code != 0, "without --swarm it needs --for"
