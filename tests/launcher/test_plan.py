"""What is asked for, checked: a plan has everything that was asked for, and the child is asked for the same."""

import sys
from pathlib import Path
from typing import Any

import pytest

from foosim.cli import supervisor
from foosim.common.addresses import Address, Insecure
from foosim.common.errors import BadValue
from foosim.launcher.plan import make_plan
from foosim.launcher.run_options import RunOptions
from foosim.runtime.run_folder import RunFolder
from foosim.supervisor import main as supervisor_main
from foosim.supervisor.settings import RunSettings
from foosim.world.parameters.table import table_of

TABLE = Path(__file__).parent.parent.parent / "deploy" / "table.yaml"
EVERYTHING = RunOptions(
    TABLE,
    "2x",
    "1.5 s",
    7,
    sets=("engine=bullet", "table.ball.mass=27 g"),
    engine="pure",
    listen="0.0.0.0:7447",
    insecure=True,
    balance=True,
)


def test_a_plan_has_what_was_asked_for() -> None:
    plan = make_plan(EVERYTHING)
    assert (plan.deployment.seed, plan.deployment.engine, table_of(plan.deployment).ball.mass) == (7, "pure", 0.027)
    assert (str(plan.pace), plan.ticks, plan.address) == ("2x", 750, Address("0.0.0.0", 7447))


def test_what_is_not_asked_for_is_what_the_file_says() -> None:
    plan = make_plan(RunOptions(TABLE))
    assert (plan.deployment.seed, str(plan.pace), plan.ticks) == (1, "realtime", 0)
    assert plan.address.is_loopback and plan.address.port == 0


def test_a_time_that_ends_within_a_tick_lasts_to_its_end() -> None:
    assert make_plan(RunOptions(TABLE, duration="1 ns")).ticks == 1
    assert make_plan(RunOptions(TABLE, duration="2 ms")).ticks == 1
    assert make_plan(RunOptions(TABLE, duration="2001 us")).ticks == 2


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(Insecure):
        make_plan(RunOptions(TABLE, listen="0.0.0.0"))
    with pytest.raises(BadValue):
        make_plan(RunOptions(TABLE, duration="0 s"))


@pytest.mark.parametrize("options", [RunOptions(TABLE), EVERYTHING], ids=["bare", "everything"])
def test_the_supervisors_process_makes_the_same_plan(
    options: RunOptions, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(sys, "argv", ["foosim-supervisor", "run", *options.arguments(), "--run", "mine"])
    served: list[Any] = []

    def serve(settings: RunSettings, address: Address, pki: Path | None, folder: RunFolder, *others: Any) -> int:
        served.extend((settings, address, pki, folder.name))
        return 0

    monkeypatch.setattr(supervisor_main, "serve", serve)
    with pytest.raises(SystemExit) as ended:
        supervisor.main()
    assert ended.value.code == 0
    settings, address, pki, name = served
    plan = make_plan(options)
    assert name == "mine" and settings == plan.settings("mine") and address == plan.address
    assert pki == (None if plan.options.pki is None else plan.options.pki.absolute())
