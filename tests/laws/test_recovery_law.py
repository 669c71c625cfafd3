"""Law 3: a run that lost nodes and got them back is the run that would have been, to the last bit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any, Final

import pytest

from foosim.common.units import Pace
from foosim.protocol import channels
from foosim.protocol.channels import SUPERVISOR
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.settings import Traced
from foosim.simulation.system import Settings, System
from foosim.supervisor.node_loss import NodeLoss
from tests.deployed import TABLE, TEXT

TICKS: Final = 300
IMPATIENT: Final = (
    "engine=pure",
    "deadlines={heartbeat: 200 ms, tick_named: 100 ms, tick_lost: 200 ms, lockstep_realtime: 400 ms}",
)
"""In real time a node is lost by its silence, and back, within TICKS."""
MS: Final = 1_000_000
NODES: Final = ("n1", "n2", "n3")
PURE: Final = ("engine=pure",)
Fault = tuple[int, Callable[[System], object]]
"""When frame `tick` is committed, what happens."""


def kill(name: str) -> Callable[[System], object]:
    return lambda system: system.kill(name) if name in system.processes else None


def start(name: str) -> Callable[[System], object]:
    return lambda system: None if name in system.processes else system.start(name)


def pause(name: str, for_ms: int) -> Callable[[System], object]:
    return lambda system: system.pause(name, for_ms * MS) if name in system.processes else None


def move(robot: str, node: str) -> Callable[[System], object]:
    return lambda system: system.request("move", robot=robot, node=node)


@cache
def undisturbed(sets: tuple[str, ...] = PURE, ticks: int = TICKS) -> Rehearsed:
    return rehearse(TEXT, TABLE.name, ticks, 1, sets)


def disturbed(
    faults: Sequence[Fault], nodes: int = 3, sets: tuple[str, ...] = PURE, ticks: int = TICKS, **chosen: Any
) -> Rehearsed:
    def prepare(system: System) -> None:
        for tick, fault in faults:
            system.at_tick(tick, partial(fault, system))

    pace = chosen.pop("pace", None)
    return rehearse(TEXT, TABLE.name, ticks, nodes, sets, Settings(**chosen), pace=pace, prepare=prepare)


def told(run: Rehearsed) -> list[tuple[str, str]]:
    return [(entry["what"], entry["name"]) for entry in run.json["recoveries"]]


def test_robots_go_back_to_the_node_that_they_were_adopted_from() -> None:
    owned: list[dict[str, list[str]]] = []

    def look(system: System) -> None:
        owned.append(
            {name: sorted(r for r, o in system.supervisor.state.owners.items() if o == name) for name in NODES}
        )

    run = disturbed([(20, look), (30, kill("n2")), (60, look), (70, start("n2")), (120, look)])
    before, without, after = owned
    assert before == after and without["n2"] == [] and before["n2"]
    assert sorted(robot for robots in without.values() for robot in robots) == sorted(undisturbed_robots(run))
    assert max(map(len, without.values())) - min(len(without[name]) for name in ("n1", "n3")) <= 1, "evenly"


def undisturbed_robots(run: Rehearsed) -> list[str]:
    return [robot for node in run.json["nodes"].values() for robot in node["owned"]]


def test_the_last_node_is_lost_and_the_world_waits_for_one() -> None:
    stands: list[int] = []

    def soon(system: System) -> None:
        stands.append(system.supervisor.state.frame.tick)
        system.start("n3")

    def fault(system: System) -> None:
        for name in NODES:
            system.kill(name)
        soon(system)

    run = disturbed([(100, fault), (200, start("n1")), (220, start("n2"))])
    assert run.digests == undisturbed().digests
    assert told(run)[:4] == [("node", "n1"), ("node", "n2"), ("node", "n3"), ("join", "n3")]
    assert stands and {name: len(node["owned"]) > 0 for name, node in run.json["nodes"].items()} == dict.fromkeys(
        NODES, True
    )


def test_a_zombie_writes_nothing_and_comes_back_by_the_handshake() -> None:
    """Stopped for longer than its deadline, the node is lost by its silence; then it goes on with what it has."""
    run = disturbed([(100, pause("n2", 300))], sets=IMPATIENT, pace=Pace("realtime"))
    assert run.digests == undisturbed().digests
    assert told(run) == [("node", "n2"), ("join", "n2")]
    assert "overdue" in run.json["recoveries"][0]["reason"] or "heartbeat" in run.json["recoveries"][0]["reason"]


def test_a_newcomer_that_is_silent_while_it_builds_is_let_in_when_it_is_ready() -> None:
    """It is given up between its hello and its ready, and nobody but its ready tells that it is here after all."""

    def start_slowly(system: System) -> None:
        system.start("n2")
        system.pause("n2", 300 * MS)

    run = disturbed([(40, kill("n2")), (80, start_slowly)], sets=IMPATIENT, pace=Pace("realtime"))
    assert told(run) == [("node", "n2"), ("join", "n2")]
    assert run.json["nodes"]["n2"]["owned"] and run.digests == undisturbed().digests


def test_an_epoch_without_a_node_is_no_answer_to_its_ready() -> None:
    """A zombie's ready is lost, and the epoch that told it so comes once more: it says ready again."""
    systems: list[System] = []
    epochs: list[Traced] = []
    readies: list[int] = []

    def see(traced: Traced) -> None:
        if traced.channel == channels.EPOCH.name:
            epochs.append(traced)
        elif systems and traced.process == "n2" and traced.channel == channels.READY.name:
            readies.append(traced.now_ns)
            if len(readies) == 1:
                bus, last = systems[0].bus, epochs[-1]
                bus.cut_off("n2", traced.now_ns + 1, input_=False)
                bus.put(SUPERVISOR, channels.EPOCH, last.name, last.payload, traced.now_ns)

    faults = [(100, systems.append), (100, pause("n2", 300))]
    run = disturbed(faults, sets=IMPATIENT, pace=Pace("realtime"), observer=see, observes=("publish",))
    assert told(run) == [("node", "n2"), ("join", "n2")] and len(readies) > 1
    assert run.digests == undisturbed().digests


@pytest.mark.parametrize("sets", ["nodes.n2.required=true", "on_node_loss=stop"])
def test_a_lost_node_ends_the_run_where_the_deployment_requires_it(sets: str) -> None:
    run = disturbed([(100, kill("n2"))], sets=(*PURE, sets))
    assert run.json["failed"] and run.json["reason"] == "lost n2: its connection closed"
    assert run.digests == undisturbed().digests[: len(run.digests)] and 100 <= run.json["ticks"] <= 105


def restart(down_ms: int = 0, amid: int = 0) -> Callable[[System], object]:
    """End the supervisor amid its next turn, `amid` actions into it, and start it again."""

    def start_again(system: System) -> None:
        if SUPERVISOR in system.processes:
            system.later(MS, partial(start_again, system))
        else:
            system.start(SUPERVISOR)

    def do(system: System) -> None:
        if SUPERVISOR in system.processes and not system.is_dying(SUPERVISOR):
            system.end_amid(SUPERVISOR, amid)
            system.later(max(1, down_ms * MS), partial(start_again, system))

    return do


@pytest.mark.parametrize("call", [1, 2])
@pytest.mark.parametrize("amid", range(1, 5))
def test_robots_go_back_also_when_the_supervisor_ends_amid_an_epoch(
    monkeypatch: pytest.MonkeyPatch, call: int, amid: int
) -> None:
    """In the turn that opens the epoch without a node, or the one with it again."""
    calls: list[int] = []
    systems: list[System] = []

    def opens(self: NodeLoss, *arguments: Any) -> None:
        calls.append(amid)
        if len(calls) == call:
            restart(0, amid)(systems[0])
        before(self, *arguments)

    before = NodeLoss.open
    monkeypatch.setattr(NodeLoss, "open", opens)
    owners: list[dict[str, str]] = []
    looks: list[Fault] = [
        (tick, lambda system: owners.append(dict(system.supervisor.state.owners))) for tick in (1, TICKS)
    ]
    run = disturbed([(1, systems.append), *looks, (40, kill("n2")), (80, start("n2"))], keeps_journals=True)
    assert len(calls) > call and run.digests == undisturbed().digests
    first, last = owners
    assert last == first


def test_a_node_that_does_not_come_back_to_the_supervisor_is_lost() -> None:
    def both(system: System) -> None:
        system.kill(SUPERVISOR)
        system.kill("n2")
        system.start(SUPERVISOR)

    run = disturbed([(100, both)], keeps_journals=True)
    assert run.digests == undisturbed().digests
    assert run.json["recoveries"][1]["reason"] == "it has not come back to the supervisor"
    assert told(run) == [("supervisor", "supervisor"), ("node", "n2")]


FREEZE: Final = (*PURE, "on_node_loss=freeze")


def add_those_down(found: list[list[str]], system: System) -> None:
    """Note the robots that are out of service."""
    frame = system.supervisor.state.frame
    found.append([robot.name for robot in frame.layout.robots if frame.at(robot.name, "down") != 0.0])


def test_with_freeze_the_robots_of_a_lost_node_are_down_until_it_is_back() -> None:
    down: list[list[str]] = []
    look = partial(add_those_down, down)
    faults: list[Fault] = [(20, look), (40, kill("n2")), (42, look), (60, move("red.attack", "n1")), (90, look)]
    run = disturbed([*faults, (100, start("n2")), (200, look)], sets=FREEZE)
    before, lost, moved, back = down
    assert before == back == []
    assert len(lost) > 1 and "red.attack" in lost and moved == [name for name in lost if name != "red.attack"]
    assert run.digests[:40] == undisturbed().digests[:40] and run.digests != undisturbed().digests
    assert run.json["reason"] == "done" and not run.json["failed"]


def test_with_freeze_an_operators_down_holds_when_the_node_is_back() -> None:
    """Set before the loss, and while the robot is down by it; what is set to be up runs at once."""
    down: list[list[str]] = []
    look = partial(add_those_down, down)
    its: list[str] = []

    def note(system: System) -> None:
        its.extend(sorted(robot for robot, owner in system.supervisor.state.owners.items() if owner == "n2"))

    def put(number: int, value: bool) -> Callable[[System], object]:
        return lambda system: system.request("set", name=its[number], field="down", value=value)

    faults: list[Fault] = [(10, note), (20, put(0, True)), (40, kill("n2")), (60, put(1, True)), (60, put(2, False))]
    run = disturbed([*faults, (90, look), (100, start("n2")), (200, look)], sets=FREEZE)
    assert down == [[*its[:2], *its[3:]], its[:2]]
    assert run.json["reason"] == "done" and not run.json["failed"]
