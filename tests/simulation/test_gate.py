"""The gate: bugs planted in the cores, each found by the seed that is recorded with it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

from foosim.node.core import NodeCore
from tests.gate.direct import DIRECT, DirectMutant, Failed, run_all
from tests.gate.planting import Mutant
from tests.gate.search import MUTANTS, find
from tests.swarm.campaign import fly

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
SEEDS_MAX: Final = 1000
FIRST_SEEDS: Final = 12


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_a_planted_bug_is_found(mutant: Mutant) -> None:
    """By the seed that is noted; where a change of the faults has made others of the seeds, by one of the first."""
    found = find(mutant.name, [mutant.seed, *range(1, FIRST_SEEDS + 1)])
    assert found.seed >= 0, f"{mutant.rule}: `make swarm-gate ARGS='\"{mutant.name}\"'` looks for a seed that finds it"
    assert not found.broken.startswith(("TypeError", "AttributeError")), f"the bug itself is broken: {found.broken}"


@pytest.mark.parametrize("seed", sorted({mutant.seed for mutant in MUTANTS}))
def test_without_the_bug_its_seed_holds_all_laws(seed: int) -> None:
    assert fly(TABLE.read_text(), TABLE.name, seed).broken == ""


@pytest.fixture(scope="module")
def direct(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Failed]:
    return run_all(tmp_path_factory.mktemp("direct"))


@pytest.mark.parametrize("mutant", DIRECT, ids=lambda mutant: mutant.name)
def test_a_planted_bug_that_the_swarm_seldom_meets_fails_its_own_test(
    direct: dict[str, Failed], mutant: DirectMutant
) -> None:
    code, output = direct[mutant.name]
    assert code == pytest.ExitCode.TESTS_FAILED, f"{mutant.rule}:\n{output}"
    assert "AssertionError" in output or "assert " in output, f"the bug itself is broken:\n{output}"


def test_the_gate_is_wide() -> None:
    assert len(MUTANTS) >= 25
    names = [mutant.name for mutant in MUTANTS] + [mutant.name for mutant in DIRECT]
    assert len(set(names)) == len(names)
    assert all(1 <= mutant.seed <= SEEDS_MAX for mutant in MUTANTS)


def test_what_was_planted_is_taken_out_again() -> None:
    before = NodeCore._request_missing
    mutant = next(mutant for mutant in MUTANTS if mutant.name == "node does not ask again")
    with mutant.planted():
        assert NodeCore._request_missing is not before
    assert NodeCore._request_missing is before


def test_the_gate_tells_what_it_did_not_find() -> None:
    assert find(MUTANTS[0].name, []).seed == -1
