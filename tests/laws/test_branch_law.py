"""A machine is lost with the end of the vHub's journal: the run goes on as a branch, in which all laws hold."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Final

import pytest

from foosim.client.core import ClientCore
from foosim.common import limits
from foosim.node.inputs import Inputs
from foosim.protocol import channels
from foosim.protocol.codec import decode_any
from foosim.protocol.hub_messages import ResumeState
from foosim.protocol.messages import ClientWelcome, Epoch
from foosim.rehearsal.bus import CALM, Weather
from foosim.rehearsal.failures import Broken
from foosim.rehearsal.machine_loss import lose_hub, lose_supervisor
from foosim.rehearsal.settings import Settings
from foosim.rehearsal.swarm.campaign import Flight, Plan
from foosim.rehearsal.swarm.faults import TICKS, Fault, ask
from foosim.rehearsal.swarm.invariants import Laws
from foosim.rehearsal.system import System
from foosim.supervisor.records import Checkpoint, Record, fold
from foosim.supervisor.state import RunState
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import Closing
from foosim.world.edits import Add, Push

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
MS: Final = 1_000_000
SEED: Final = 1
NAMES: Final = ("n1", "n2", "n3")
BEGUN: Final = "goes on as branch from tick "
BRANCH: Final = r"branch from tick (\d+): (\d+) ticks are lost"
BAD: Final = Weather(SEED, MS, 2 * MS, loss=0.02, repeat=0.1)


class Flown(Flight):
    """A flight with faults of its own, and the closings and warnings that it gave."""

    def __init__(self, faults: Sequence[tuple[int, Callable[[System], object]]], weather: Weather = CALM) -> None:
        self.closings: list[Closing] = []
        self.warnings: list[tuple[str, str]] = []
        planned = tuple(Fault(tick, "test", "", do) for tick, do in faults)
        plan = Plan(SEED, len(NAMES), weather, planned, (), TICKS)
        super().__init__(TABLE.read_text(), TABLE.name, plan, Settings(on_say=self._say))
        self.system.settings.on_closing = self._close
        self.run()

    def _close(self, closing: Closing) -> None:
        self.closings.append(closing)
        self.laws.close(closing)

    def _say(self, who: str, level: str, text: str) -> None:
        if level == "warning":
            self.warnings.append((who, text))

    @property
    def branches(self) -> list[tuple[int, int]]:
        """The tick and the lost ticks of each branch, as the account has it."""
        told = [entry for entry in self.system.supervisor.state.recovered if entry.what == "vhub"]
        found = [(re.fullmatch(BRANCH, entry.reason), entry.tick) for entry in told]
        assert all(match is None or int(match[1]) == tick for match, tick in found)
        return [(tick, int(match[2])) for match, tick in found if match is not None]

    @property
    def frames(self) -> dict[int, bytes]:
        """The digest of each tick, the last one that was told."""
        return {closing.frame.tick: closing.digest for closing in self.closings}


@cache
def undisturbed() -> Flown:
    return Flown([])


def lose(records: int, back_ns: int = 300 * MS) -> Callable[[System], object]:
    return lambda system: lose_hub(system, records, back_ns)


@pytest.mark.parametrize("weather", [CALM, BAD])
def test_the_run_goes_on_from_the_vhubs_last_record(weather: Weather) -> None:
    """Players go on there, too, and a supervisor that is started again stands in the branch."""

    def restart(system: System) -> None:
        system.kill(channels.SUPERVISOR)
        system.later(30 * MS, partial(system.start, channels.SUPERVISOR))

    flown = Flown([(110, lose(40)), (150, restart)], weather)
    (branch,) = flown.branches
    assert 60 < branch[0] < 110 <= sum(branch) <= 110 + limits.RELEASE_AHEAD
    assert ("supervisor", f"goes on as branch from tick {branch[0]}: {branch[1]} ticks are lost") in flown.warnings
    assert {tick: flown.frames[tick] for tick in range(branch[0] + 1)}.items() <= undisturbed().frames.items()
    assert [*flown.frames] == list(range(TICKS + 1)), "each tick, in order"
    told = {who: text for who, text in flown.warnings if f"branch from tick {branch[0]}:" in text}
    assert told.keys() == {"supervisor", "player-blue", "player-red", "prober"}
    assert re.search(r": [1-9]\d* ticks of this client's and [1-9]\d* packets .* are lost", told["player-red"])
    player = flown.system.players["player-red"].core.statistics()
    assert player.lost > 0 and player.missing == 0 and player.answered > undisturbed_answers()


def undisturbed_answers() -> int:
    """Of a player: those of a branch come again."""
    return undisturbed().system.players["player-red"].core.statistics().answered


def test_a_vhub_that_was_only_killed_begins_no_branch() -> None:
    flown = Flown([(90, lambda system: system.kill_hub("torn"))])
    assert flown.branches == [] and flown.frames == undisturbed().frames


def test_requests_keep_their_ticks_and_answers() -> None:
    asked: list[str] = []

    def request(system: System) -> None:
        asked.append(ask(system, "push", impulse=[0.01, 0.0, 0.0]))
        asked.append(ask(system, "add", name="b2", position=[0.1, 0.0, 0.05]))

    flown = Flown([(90, request), (130, lose(70)), (140, lose(90))])
    (first, second) = [tick for tick, _ in flown.branches]
    answers = [flown.system.answers[identity] for identity in asked]
    pushed, added = [answer.tick for answer in answers]
    assert second <= first < pushed and all(answer.accepted for answer in answers)
    edits = {closing.frame.tick: list(closing.edits) for closing in flown.closings}
    last = edits[added + 1][-1]
    assert edits[pushed + 1][0] == Push("ball", (0.01, 0.0, 0.0)) and isinstance(last, Add) and last.name == "b2"
    assert sum(len(each) for each in edits.values()) == 2, "once in the branch"
    assert "b2" in flown.closings[-1].frame.layout


def test_edits_that_are_not_known_any_more_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "EDITED_TICKS_KEPT", 1)

    def push(system: System) -> None:
        ask(system, "push", impulse=[0.01, 0.0, 0.0])

    monkeypatch.setattr(Flight, "run", lambda self: self.system.run())  # what is lost breaks the laws
    monkeypatch.setattr(Laws, "see", lambda self, traced: None)
    monkeypatch.setattr(Laws, "close", lambda self, closing: None)
    monkeypatch.setattr(Laws, "lose_hub", lambda self, records, captured: None)
    flown = Flown([(90, push), (100, push), (130, lose(70))])
    (entry,) = [entry for entry in flown.system.supervisor.state.recovered if "branch" in entry.reason]
    assert re.fullmatch(BRANCH + r", and what requests changed up to tick 9\d", entry.reason)


@pytest.mark.parametrize(("hub", "supervisor"), [(40, 9), (20, 120), (300, 60), (1, 1)])
@pytest.mark.parametrize("nodes_too", [False, True])
def test_both_journals_have_lost_their_ends(hub: int, supervisor: int, nodes_too: bool) -> None:
    """As after a power cut, with nodes that live on other machines and without."""

    def cut_power(system: System) -> None:
        lose_supervisor(system, supervisor)
        lose_hub(system, hub, 50 * MS)
        for name in NAMES if nodes_too else ():
            system.kill(name)
            system.later(20 * MS, partial(system.start, name))
        system.later(40 * MS, partial(system.start, channels.SUPERVISOR))

    flown = Flown([(3, lambda system: ask(system, "move", robot="camera", node="n2")), (130, cut_power)])
    (entry,) = [entry for entry in flown.system.supervisor.state.recovered if entry.reason.startswith("branch")]
    assert entry.tick <= 130 - min(hub, 120) + 1
    assert {tick: flown.frames[tick] for tick in range(entry.tick + 1)}.items() <= undisturbed().frames.items()


def test_a_supervisor_that_has_lost_the_branch_learns_of_it_from_the_vhub() -> None:
    """Its journal ends in what is void, and further than the vHub, which lives in the branch."""
    ends: list[int] = []

    def state(system: System) -> HubState:
        assert system.hub.state is not None
        return system.hub.state

    def lose_branch(system: System) -> None:
        heads = [decode_any(Record, raw) for raw in system.journal]
        at = next(at for at, head in enumerate(heads) if isinstance(head, Checkpoint) and head.branch[0])
        lose_supervisor(system, len(system.journal) - at)
        ends.extend([fold(system.supervisor.state.deployment, system.journal).frame.tick, state(system).closed])
        system.later(30 * MS, partial(system.start, channels.SUPERVISOR))

    flown = Flown([(110, lose(60)), (110, lambda system: system.later(310 * MS, partial(lose_branch, system)))])
    assert 0 < ends[1] < ends[0] - 1, "the vHub lives before the journal's end"
    assert flown.system.supervisor.state.branch == state(flown.system).branch > 0


@pytest.mark.parametrize("more", [0, 30])
def test_a_supervisor_that_ends_before_the_branchs_first_epoch_goes_on_with_it(
    more: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The branch is told once; where the vHub's machine is lost once more meanwhile, another one begins before it."""

    def cut_power(system: System) -> None:
        begin = system.supervisor.rollback.begin

        def end_behind(standing: ResumeState, now_ns: int) -> None:
            begin(standing, now_ns)
            system.end_amid(channels.SUPERVISOR, len(system.supervisor.actions))
            system.later(100 * MS, partial(system.start, channels.SUPERVISOR))
            if more:
                system.later(10 * MS, partial(lose_hub, system, more, 50 * MS))

        monkeypatch.setattr(system.supervisor.rollback, "begin", end_behind)
        lose_hub(system, 40)

    flown = Flown([(110, cut_power)])
    told = [entry.what for entry in flown.system.supervisor.state.recovered]
    assert told == ["vhub", *["vhub"] * (more > 0), "supervisor"]
    (first, *second) = flown.branches
    assert sum(first) >= 110 and all(tick < first[0] == tick + lost for tick, lost in second)
    assert flown.system.supervisor.state.branch == 2, "that of the epoch that nobody had heard of"


def test_a_vhub_that_ends_before_the_branchs_first_epoch_goes_on_with_it() -> None:
    """No node is here with which the epoch could begin; the branch is told once."""

    def cut_power(system: System) -> None:
        for name in NAMES:
            system.kill(name)
            system.later(900 * MS, partial(system.start, name))
        lose_hub(system, 40, 50 * MS)
        system.later(400 * MS, partial(system.kill_hub, "now", 50 * MS))

    flown = Flown([(110, cut_power)])
    ((tick, lost),) = flown.branches
    said = [text for who, text in flown.warnings if who == "supervisor" and text.startswith(BEGUN)]
    assert said == [f"{BEGUN}{tick}: {lost} ticks are lost"]


@pytest.mark.parametrize("supervisor", [50, 120])
def test_a_branch_is_named_behind_epochs_that_only_nodes_know(supervisor: int) -> None:
    """Both journals have lost the epoch of the move, which is asked for once more."""
    epochs: list[int] = []

    def move(system: System) -> None:
        ask(system, "move", robot="camera", node="n2")

    def cut_power(system: System) -> None:
        epochs.append(system.supervisor.state.epoch)
        lose_supervisor(system, supervisor)
        left = fold(system.supervisor.state.deployment, system.journal).epoch
        epochs.append(0 if left is None else left.epoch)
        lose_hub(system, 60, 50 * MS)
        system.later(40 * MS, partial(system.start, channels.SUPERVISOR))

    flown = Flown([(110, move), (130, cut_power), (160, move)])
    assert epochs == [2, 1] and flown.system.supervisor.state.branch == 3


def _keeps_deliveries(monkeypatch: pytest.MonkeyPatch) -> None:
    def begin(self: Inputs, epoch: Epoch) -> bool:
        kept = dict(self._deliveries)
        is_branch = before(self, epoch)
        self._deliveries.update(kept)
        return is_branch

    before = Inputs.begin
    monkeypatch.setattr(Inputs, "begin", begin)


def _goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def set_back(self: ClientCore, welcome: ClientWelcome) -> None:
        self.branch = welcome.branch

    monkeypatch.setattr(ClientCore, "_set_back", set_back)


def _forgets_requests(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RunState, "reorder_from", lambda self, tick: self.coming_edits.clear())


@pytest.mark.parametrize("plant", [_keeps_deliveries, _goes_on, _forgets_requests])
def test_a_planted_fault_is_found(plant: Callable[[pytest.MonkeyPatch], None], monkeypatch: pytest.MonkeyPatch) -> None:
    plant(monkeypatch)
    with pytest.raises((Broken, AssertionError)):
        Flown([(95, lambda system: ask(system, "push", impulse=[0.02, 0.0, 0.0])), (110, lose(40))])
