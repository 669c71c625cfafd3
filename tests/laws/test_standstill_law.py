"""Who stood still itself blames nobody for that time, and a client's time runs only while the run can go on.

Supervisor, vHub and players with the deadlines of every day, in virtual time; the run goes on and is the run that would
have been. Those of nodes and of the launcher are in `test_standstill.py` of `protocol` and `supervisor`; that each
process's loop tells of it is at the end, for all of them at once.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import pytest

from foosim.client.client import Link
from foosim.client.core import ClientCore
from foosim.client.main import ClientShell
from foosim.common.units import Pace
from foosim.launcher.plan import make_plan
from foosim.launcher.run_options import RunOptions
from foosim.node.main import NodeShell
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.runtime.journal import Journal
from foosim.runtime.roles import loop as loops
from foosim.runtime.roles.shell import Process, Runnable
from foosim.runtime.run_folder import RunFolder
from foosim.runtime.supervisor_timeout import SupervisorTimeout
from foosim.runtime.transport.session import Session
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings, System
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.main import SupervisorShell
from foosim.vhub.core import HubCore
from foosim.vhub.main import HubOptions, HubShell
from tests.deployed import TABLE, TEXT

TICKS: Final = 60
MS: Final = 1_000_000
FAST: Final = Pace("fast")
REALTIME: Final = Pace("realtime")
PLAYERS: Final = ("player-blue", "player-red")


def fly(fault: Callable[[System], object], pace: Pace = FAST, *sets: str, **chosen: Any) -> Rehearsed:
    """A run in which something happens at tick 20, and which no node may leave."""
    settings = ["engine=pure", "on_node_loss=stop", *sets]

    def prepare(system: System) -> None:
        system.at_tick(20, partial(fault, system))

    text = TEXT
    return rehearse(text, TABLE.name, TICKS, 2, settings, Settings(**chosen), pace=pace, prepare=prepare)


@cache
def undisturbed() -> Rehearsed:
    return fly(lambda system: None)


def assert_nobody_was_lost(run: Rehearsed, *recoveries: str) -> None:
    assert run.json["reason"] == "done" and run.digests == undisturbed().digests
    assert [entry["what"] for entry in run.json["recoveries"]] == [*recoveries]


def client(system: System, name: str) -> ClientCore:
    core = system.processes[name].core
    assert isinstance(core, ClientCore)
    return core


def lose_clients(system: System) -> None:
    """Clients and vHub lose each other."""
    for name in PLAYERS:
        system.hub.client_gone(name, system.bus.now_ns)
        client(system, name).hub_gone(system.bus.now_ns)


# --- the supervisor --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pace", [FAST, REALTIME], ids=str)
def test_a_supervisor_whose_machine_slept_loses_no_process(pace: Pace) -> None:
    """It wakes, and has heard nobody for ten seconds."""
    said: list[str] = []
    run = fly(lambda system: system.set_forward(SUPERVISOR, 10_000 * MS), pace, on_log=lambda *say: said.append(say[2]))
    assert_nobody_was_lost(run)
    (line,) = [line for line in said if "blocked" in line]
    assert line == "event loop was blocked for 10.0 s; peer deadlines extended"


def test_connections_that_ended_while_it_stood_still_are_no_losses() -> None:
    def sleep(system: System) -> None:
        system.pause(SUPERVISOR, 3_000 * MS)
        for name in ("n1", VHUB):
            system.later(3_010 * MS, partial(system._supervisor_sees_gone, name))

    assert_nobody_was_lost(fly(sleep, REALTIME))


def test_the_time_of_a_vhub_that_is_gone_rests() -> None:
    def sleep(system: System) -> None:
        system.kill_hub("now", 2_000 * MS)
        system.later(500 * MS, partial(system.set_forward, SUPERVISOR, 60_000 * MS))

    assert_nobody_was_lost(fly(sleep, FAST, "deadlines.vhub_back=5 s"), "vhub")


def test_its_successor_is_let_in_at_once() -> None:
    """The one before is as silent as one that only lost its connection; the next one is beyond doubt."""

    def sleep(system: System) -> None:
        system.pause(SUPERVISOR, 3_000 * MS)
        system.later(3_010 * MS, partial(system.kill, "n1"))
        system.later(3_040 * MS, partial(system.start, "n1"))

    run = fly(sleep, REALTIME, "on_node_loss=adopt")
    assert run.json["reason"] == "done" and run.digests == undisturbed().digests
    assert [(entry["what"], entry["reason"]) for entry in run.json["recoveries"]] == [
        ("node", "its connection closed"), ("join", "back"),
    ]  # fmt: skip


# --- the vHub and its clients ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("pace", [FAST, REALTIME], ids=str)
def test_a_vhub_that_stood_still_gives_its_clients_their_whole_time(pace: Pace) -> None:
    """A client was away for 1.5 s of its 2 s when the vHub stopped for 3 s; it needs another 1.5 s to come back."""

    def stop(system: System) -> None:
        for name in PLAYERS:
            system.pause(name, 6_000 * MS)
        lose_clients(system)
        system.later(1_500 * MS, partial(system.set_forward, VHUB, 3_000 * MS))
        for name in PLAYERS:
            system.later(3_000 * MS, partial(system.resume, name))

    assert_nobody_was_lost(fly(stop, pace, "deadlines.lockstep_fast=1 s", "deadlines.lockstep_realtime=1 s"))


@pytest.mark.parametrize("pace", [FAST, REALTIME], ids=str)
@pytest.mark.parametrize(("hears", "says"), [(False, False), (False, True), (True, False)])
def test_a_cut_of_the_vhubs_host_costs_no_client(hears: bool, says: bool, pace: Pace) -> None:
    """For 3 s; each connection is given up after one, or a little later, the clients' sooner than the supervisor's."""

    def cut(system: System) -> None:
        until_ns = system.bus.now_ns + 3_000 * MS
        system.bus.cut_off(VHUB, until_ns, output=not says, input_=not hears)
        system.later(1_100 * MS, partial(lose_clients, system))
        system.later(1_200 * MS, partial(system._hub_hears, False))
        system.later(1_200 * MS, partial(system._supervisor_sees_gone, VHUB))
        system.later(3_200 * MS, partial(system._hub_hears, True))

    assert_nobody_was_lost(fly(cut, pace, "deadlines.lockstep_fast=2 s"), "vhub")


def test_a_vhub_that_waits_for_its_supervisor_loses_no_client() -> None:
    """Both are killed, and a node. The supervisor waits 2 s for the node before it tells the vHub how to go on, which
    lets nobody in before that."""

    def all_three(system: System) -> None:
        system.kill(SUPERVISOR)
        system.kill("n2")
        system.kill_hub("now", 50 * MS)
        system.later(500 * MS, partial(system.start, SUPERVISOR))

    sets = ("on_node_loss=adopt", "deadlines.client_back=1 s", "deadlines.lockstep_fast=1 s")
    assert_nobody_was_lost(fly(all_three, FAST, *sets, keeps_journals=True), "supervisor", "node")


def test_of_a_clients_two_deadlines_the_longer_one_counts() -> None:
    """A player that a tick waits for stands still for 3 s: `lockstep_fast` gives it 10 s, `client_back` 2 s."""

    def stop(system: System) -> None:
        name = "player-red"
        system.pause(name, 3_000 * MS)
        system.later(500 * MS, lambda: system.hub.client_gone(name, system.bus.now_ns))
        system.later(2_999 * MS, lambda: client(system, name).hub_gone(system.bus.now_ns))

    alone = "players.player-red.restart=false"
    assert_nobody_was_lost(fly(stop, FAST, alone))
    run = fly(stop, FAST, alone, "deadlines.lockstep_fast=1 s", "deadlines.client_back=1 s")
    assert run.json["reason"] == "lost player-red: its connection closed"


def test_a_client_whose_machine_slept_waits_for_its_vhub_as_long_as_it_is_awake() -> None:
    clients: list[ClientCore] = []

    def sleep(system: System) -> None:
        clients.extend(client(system, name) for name in PLAYERS)
        system.kill_hub("now", 2_000 * MS)
        for name in PLAYERS:
            system.later(500 * MS, partial(system.set_forward, name, 60_000 * MS))

    assert_nobody_was_lost(fly(sleep, FAST, "deadlines.vhub_back=5 s"), "vhub")
    assert [core.lost for core in clients] == [False, False]


def test_a_client_that_has_the_time_of_a_start_keeps_it_when_the_clock_rests() -> None:
    """Behind a restart of the vHub its clients may have ended, too, and are started again."""

    def both(system: System) -> None:
        for name in PLAYERS:
            system.pause(name, 8_000 * MS)
        system.kill_hub("now", 50 * MS)
        system.later(1_000 * MS, partial(system.set_forward, VHUB, 3_000 * MS))

    assert_nobody_was_lost(fly(both, FAST, "deadlines.start=10 s", "deadlines.lockstep_fast=1 s"), "vhub")


# --- the shells: whose loop stood still tells it to what has deadlines there -----------------------------------------


@pytest.fixture(scope="module")
def plane() -> Iterator[Session]:
    with Session.router("tcp/127.0.0.1:0") as session:
        yield session


def supervisor_of(process: Process, session: Session, folder: Path) -> SupervisorShell:
    plan = make_plan(RunOptions(TABLE, duration="1 s", sets=("engine=pure",)))
    with Journal(folder / "journals", SUPERVISOR) as journal:
        return SupervisorShell(process, plan.settings(folder.name), None, RunFolder(folder), session, journal, None)


SHELLS: Final[dict[str, tuple[Callable[[Process, Session, Path], Runnable], type, str]]] = {
    "supervisor": (supervisor_of, SupervisorCore, "on_standstill"),
    "vhub": (
        lambda process, session, _: HubShell(process, session, lambda deployment: session, HubOptions()),
        HubCore,
        "rest",
    ),
    "node": (lambda process, session, _: NodeShell(process, "n1", session), SupervisorTimeout, "rest"),
    "player": (lambda process, session, _: ClientShell(process, PLAYERS[0], session), ClientCore, "rest"),
}


@pytest.mark.parametrize("shell", [*SHELLS, "client"])
def test_each_role_counts_for_how_long_its_own_loop_stood_still(
    shell: str, plane: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make, has_deadlines, method = SHELLS.get(shell, (None, ClientCore, "rest"))
    told: list[tuple[int, int]] = []
    monkeypatch.setattr(has_deadlines, method, lambda self, *what: told.append(what[-2:]))
    clock = [time.monotonic_ns()]  # cores are made by the same one
    monkeypatch.setattr(loops, "time", SimpleNamespace(monotonic_ns=lambda: clock[0]))
    if make is None:
        link = Link(ClientCore("ear", "boot", time.monotonic_ns()), plane)
        loop, inbox = link._loop, link._inbox
    else:
        process = Process("test")
        process.add(make(process, plane, tmp_path))
        loop, inbox = process.loop, process.inbox
    for pass_ns in (60_000 * MS, 10_000 * MS):
        told.clear()
        clock[0] += pass_ns
        inbox.wake()
        loop.go_round()
    assert [now_ns for _, now_ns in told] == [clock[0]]
    assert all(9_000 * MS < stood_ns <= 10_000 * MS for stood_ns, _ in told), "less the time at which it meant to look"
