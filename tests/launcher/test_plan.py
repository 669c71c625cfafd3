"""What is asked for, checked: a plan has everything that was asked for, and the child is asked for the same."""

import io
import os
import socket
import sys
from pathlib import Path
from typing import Any

import pytest

from foosim.cli import main, run
from foosim.common import wall_clock
from foosim.common.addresses import Address
from foosim.common.errors import Refused
from foosim.launcher.begin import begin
from foosim.launcher.display import Display
from foosim.launcher.plan import make_plan
from foosim.launcher.run_options import RunOptions
from foosim.launcher.up import Up
from foosim.library.table.settings import table_of
from foosim.protocol.channels import SUPERVISOR

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


@pytest.mark.parametrize("options", [RunOptions(TABLE), EVERYTHING], ids=["bare", "everything"])
def test_the_supervisors_process_makes_the_same_plan(
    options: RunOptions, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(sys, "argv", ["foosim", "run", *options.arguments(), "--run", "mine"])
    served: list[Any] = []

    def serve(*given: object, **more: object) -> int:
        served.extend((*given, more))
        return 0

    monkeypatch.setattr(run, "run_roles", serve)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    name, (plan, folder), more = served
    assert (name, folder.name, plan) == (SUPERVISOR, "mine", make_plan(options))
    assert more == {"pki": None, "progress": None}


def test_ports_that_are_taken_and_paths_that_are_no_text_are_refused_before_anything_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The port of the vHub, which listens later than the supervisor, is one of them."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)

    def refusal(options: RunOptions, capture: Path | None = None) -> str:
        with pytest.raises(Refused) as refused:
            begin(options, capture, True, None, False, Display(io.StringIO()), None)
        return str(refused.value)

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = int(taken.getsockname()[1])
        for first in (port, port - 1):
            said = refusal(RunOptions(TABLE, listen=f"127.0.0.1:{first}"))
            assert said.startswith("cannot listen on tcp/127.0.0.1:") and "take another port (--listen" in said
    name = os.fsdecode(b"caf\xe9")
    assert "path is not valid UTF-8, '" in refusal(RunOptions(TABLE), Path(f"{name}.mcap"))
    (tmp_path / f"{name}.yaml").write_bytes(TABLE.read_bytes())
    assert "path is not valid UTF-8, '" in refusal(RunOptions(Path(f"{name}.yaml")))
    assert [one.name for one in tmp_path.iterdir()] == [f"{name}.yaml"]


def test_run_and_capture_have_the_same_time_in_their_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(wall_clock, "now_stamp", map("20260301-13000{}".format, range(10)).__next__)
    up = begin(RunOptions(TABLE), None, True, None, False, Display(io.StringIO()), None)
    assert isinstance(up, Up) and up.capture is not None
    assert up.folder.name == up.capture.stem == "table-20260301-130000"
