"""A run that is started or resumed: until its first commit only `deadlines.start` counts; who comes late is taken."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Final

import pytest

from foosim.common.units import Pace
from foosim.protocol import channels
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.messages import Epoch
from foosim.simulation.run import Rehearsed, with_nodes
from foosim.simulation.system import Settings, System
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.records import fold
from foosim.supervisor.settings import RunSettings

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
MS: Final = 1_000_000
S: Final = 1000 * MS
TICKS: Final = 120
PATIENT: Final = ("engine=pure", "deadlines.vhub_back=1 h", "deadlines.lockstep_fast=1 h")
NODES: Final = ("n1", "n2")


class Run:
    """A rehearsal on two nodes whose processes may end all at once."""

    def __init__(self, sets: Sequence[str] = ()) -> None:
        text = with_nodes(TABLE.read_text(), TABLE.name, len(NODES), [*PATIENT, *sets])
        self.seen = Rehearsed({})
        self.lines: list[str] = []
        settings = Settings(keeps_journals=True, on_log=lambda process, level, line: self.lines.append(line))
        settings.on_commit = lambda frame: self.seen.digests.append(frame.digest)
        self.system = System(RunSettings("run", TABLE.name, text, Pace("fast"), TICKS), settings)

    @property
    def core(self) -> SupervisorCore:
        return self.system.supervisor

    def go(self) -> Run:
        self.system.run()
        self.seen.json = self.core.result()
        return self

    def end_all(self) -> None:
        """The launcher dies, and every process of the run with it; players of a rehearsal live on."""
        for name in (SUPERVISOR, *NODES):
            if name in self.system.processes:
                self.system.kill(name)
        self.system.kill_hub("now", 3600 * S)

    def start_later(self, after_s: dict[str, float]) -> None:
        """Start processes again, each after its time."""
        for name, seconds in after_s.items():
            start: Callable[[], object] = self.system._start_hub if name == VHUB else partial(self.system.start, name)
            self.system.later(int(seconds * S), start)

    def resume_at(self, tick: int, after_s: dict[str, float]) -> None:
        def resume() -> None:
            self.end_all()
            self.start_later(after_s)

        self.system.at_tick(tick, resume)


@cache
def undisturbed() -> list[bytes]:
    return Run().go().seen.digests


def test_a_node_that_was_cut_off_while_players_start_takes_part() -> None:
    run = Run()
    for player in ("player-red", "player-blue"):
        run.system.pause(player, 12 * S)
    run.system.later(2 * S, lambda: run.system.pause("n1", 4 * S))
    run.system.later(3 * S, lambda: run.core.connection_closed("n1", run.system.bus.now_ns))
    begun: list[bool] = []
    run.system.later(11 * S, lambda: begun.append(run.core.status(0)["begun"]))
    run.go()
    assert run.seen.json["reason"] == "done" and run.seen.digests == undisturbed()
    assert run.seen.json["recoveries"] == [] and run.core.state.epoch == 1
    silent = "lost node n1: its connection closed: nothing was heard of it for 1.1 s; the run waits"
    assert any(line.startswith(silent) for line in run.lines), "it was stopped, its lease ran out"
    assert begun == [False] and run.core.status(0)["begun"]


@pytest.mark.parametrize("when", ["first", "later"])
def test_a_node_that_stands_for_a_while_is_lost_only_when_the_run_has_begun(when: str) -> None:
    run = Run()

    def stand() -> None:
        run.system.pause("n1", 4 * S)

    if when == "later":
        run.system.at_tick(60, stand)
    else:
        run.system.settings.on_epoch = lambda epoch: stand() if epoch.epoch == 1 else None
    run.go()
    assert [entry["what"] for entry in run.seen.json["recoveries"]] == (["node"] if when == "later" else [])
    assert run.seen.json["reason"] == "done" and run.seen.digests == undisturbed()


def test_a_vhub_that_ends_before_the_first_tick_has_the_time_of_a_start() -> None:
    """For the supervisor and for the players. Frame 1 needs no vHub, so a node is slow as well."""
    run = Run(("deadlines.vhub_back=5 s",))

    def lose(epoch: Epoch) -> None:
        if epoch.epoch == 1:
            run.system.pause("n1", 45 * S)
            run.system.soon(lambda: run.system.kill_hub("now", 40 * S))

    run.system.settings.on_epoch = lose
    run.go()
    assert run.seen.json["reason"] == "done" and run.seen.digests == undisturbed()
    assert [entry["what"] for entry in run.seen.json["recoveries"]] == ["vhub"]
    assert [player.core.lost for player in run.system.players.values()] == [False, False]


@pytest.mark.parametrize(
    ("sets", "slept_s"),
    [((), 0), (("nodes.n2.required=true",), 0), (("nodes.n2.required=true",), 100)],
    ids=["", "required", "slept"],
)
def test_a_resumed_run_waits_for_all_as_long_as_for_a_start(sets: tuple[str, ...], slept_s: int) -> None:
    """The time for which the supervisor itself stood still meanwhile does not count."""
    run = Run(sets)
    run.resume_at(60, {SUPERVISOR: 0.1, "n1": 3.0, "n2": 50.0, VHUB: 45.0})
    sleep = partial(run.system.set_forward, SUPERVISOR, slept_s * S)
    for at_s in (10, 47):
        run.system.at_tick(60, partial(run.system.later, at_s * S, sleep))
    run.go()
    assert run.seen.json["reason"] == "done" and run.seen.digests == undisturbed()
    told = [(entry["what"], entry["name"]) for entry in run.seen.json["recoveries"]]
    assert told == [("supervisor", "supervisor")], "nobody is lost who only starts slowly"


@pytest.mark.parametrize(
    ("when", "sets"),
    [
        ("before the first tick", ()),
        ("before the first tick", ("players.player-red.restart=false",)),
        ("with the vHub", ()),
    ],
    ids=["before the first tick", "not to be restarted", "with the vHub"],
)
def test_a_client_whose_process_is_started_again_has_the_time_of_a_start(when: str, sets: tuple[str, ...]) -> None:
    run = Run(sets)
    system = run.system

    def gone() -> None:
        system.hub.client_gone("player-red", system.bus.now_ns)
        system.players["player-red"].core.hub_gone(system.bus.now_ns)
        system.pause("player-red", 10 * S)

    def both_gone() -> None:
        system.kill_hub()
        system.pause("player-red", 10 * S)

    if when == "with the vHub":
        system.at_tick(60, both_gone)
    else:
        system.pause("player-blue", 15 * S)
        system.later(2 * S, gone)
    run.go()
    assert run.seen.json["reason"] == "done" and run.seen.digests == undisturbed()
    assert system.bus.now_ns > 10 * S


def test_a_supervisor_that_alone_was_started_again_waits_no_longer_than_before() -> None:
    run = Run()

    def restart() -> None:
        run.system.kill(SUPERVISOR)
        run.system.kill("n2")
        run.start_later({SUPERVISOR: 0.1, "n2": 20.0})

    run.system.at_tick(60, restart)
    run.go()
    told = [(entry["what"], entry["name"], entry["reason"]) for entry in run.seen.json["recoveries"]]
    assert ("node", "n2", "it has not come back to the supervisor") in told
    assert run.seen.json["reason"] == "done" and run.seen.digests == undisturbed()


@pytest.mark.parametrize(
    ("sets", "late", "reason"),
    [
        ((), VHUB, "lost vhub: it has not come to the supervisor within 30 s"),
        (("nodes.n2.required=true",), "n2", "lost n2: it has not come back to the supervisor"),
    ],
)
def test_a_resume_that_fails_leaves_the_run_as_it_was(sets: tuple[str, ...], late: str, reason: str) -> None:
    run = Run((*sets, "deadlines.start=5 s", "deadlines.orphan=30 s"))
    run.resume_at(60, {SUPERVISOR: 0.1, "n1": 1.0, "n2": 1.0, VHUB: 1.0, late: 58.0})
    run.go()
    assert run.core.state.end is None and run.core.state.abandoned == reason
    assert f"the run does not continue from tick {run.core.state.frame.tick}: {reason}" in run.lines
    assert fold(run.core.state.deployment, run.system.journal).kept.end is None and not run.system.hub.finished
    run.end_all()
    run.system._timers.clear()
    run.system.start(SUPERVISOR)
    run.start_later({"n1": 1.0, "n2": 1.0, VHUB: 1.0})
    run.go()
    assert run.seen.json["reason"] == "done" and run.seen.digests == undisturbed()


def test_a_loss_that_only_its_launcher_knows_of_ends_the_run_with_that_reason() -> None:
    run = Run()
    run.system.at_tick(60, lambda: run.system.request("down", lost="vhub: it ended with exit code 3"))
    run.go()
    assert run.core.state.end is not None and run.core.state.end.failed
    assert run.core.state.end.reason == "lost vhub: it ended with exit code 3"


def test_a_run_that_had_ended_waits_for_the_vhub_that_closes_its_capture() -> None:
    run = Run()

    def end() -> None:
        run.system.kill_hub("now", 3600 * S)
        run.core.finish("enough", failed=False)
        run.system.take_turn(run.system.processes[SUPERVISOR])
        run.system.kill(SUPERVISOR)
        run.start_later({SUPERVISOR: 0.1, VHUB: 40.0})

    run.system.at_tick(60, end)
    run.go()
    hub = run.core.state.roster.by_name[VHUB]
    assert run.core.state.end is not None and run.core.state.end.reason == "enough" and run.system.hub.finished
    assert hub.farewell and run.seen.json["packets"]["offered"] > 0
    assert run.system.hub.state is not None and hub.name == channels.VHUB


def test_who_asks_for_the_end_while_a_run_is_resumed_waits_for_the_vhub() -> None:
    run = Run()
    run.resume_at(60, {SUPERVISOR: 0.1, "n1": 1.0, "n2": 1.0, VHUB: 20.0})
    run.system.at_tick(60, lambda: run.system.later(2 * S, lambda: run.core.stop() and None))
    run.go()
    assert run.core.state.end is not None and (run.core.state.end.reason, run.core.state.end.failed) == (
        "stopped",
        False,
    )
    assert run.system.hub.finished and run.core.state.roster.by_name[VHUB].farewell
