"""A machine is lost with the end of the vHub's journal: the run ends in order and says how a new one begins."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Final

import pytest

from foosim.common.units import Pace
from foosim.protocol import channels
from foosim.protocol.hub_messages import ResumeGrant
from foosim.runtime.roles.bus import CALM, Weather
from foosim.simulation.run import with_nodes
from foosim.simulation.settings import Settings
from foosim.simulation.system import System
from foosim.supervisor import core as supervisor_core
from foosim.supervisor import failover
from foosim.supervisor.records import fold
from foosim.supervisor.settings import RunSettings
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import Closing
from foosim.vhub.state.resume import Past
from tests.deployed import TABLE, TEXT
from tests.machine_loss import lose_hub, lose_supervisor
from tests.swarm.faults import ask

MS: Final = 1_000_000
TICKS: Final = 160
NAMES: Final = ("n1", "n2", "n3")
CAPTURE: Final = "/captures/a run.mcap"
BAD: Final = Weather(1, MS, 2 * MS, loss=0.02, repeat=0.1)
ENDS: Final = (
    r"vhub has lost the end of its journal: it ends at tick (\d+), {why}\. A new run begins with the last captured "
    rf"frame: foosim up table\.yaml --for 5s --from '{CAPTURE}@last'"
)
KNOWN: Final = ENDS.format(why=r"deliveries are known up to tick (\d+)")
UNKNOWN: Final = ENDS.format(why="its machine was lost meanwhile")


class _Hub(HubCore):
    """Has a capture."""

    def begin(self, past: Past | None, now_ns: int) -> None:
        self.capture_file = CAPTURE
        super().begin(past, now_ns)


class Cut:
    """A run with faults, and what it gave."""

    def __init__(
        self,
        faults: Sequence[tuple[int, Callable[[System], object]]],
        weather: Weather = CALM,
        hub: type[HubCore] = _Hub,
    ) -> None:
        self.closings: list[Closing] = []
        text = with_nodes(TEXT, TABLE.name, len(NAMES), ["engine=pure", "substeps=1"])
        run = RunSettings("run", TABLE.name, text, Pace("fast"), TICKS, options=(TABLE.name, "--for", "5s"))
        settings = Settings(
            weather=weather, hub=hub, keeps_journals=True, restart_ns=500 * MS, on_closing=self.closings.append
        )
        self.system = System(run, settings)
        for tick, do in faults:
            self.system.at_tick(tick, partial(do, self.system))
        try:
            self.system.run()
        finally:
            self.system.close()
        self.state = self.system.supervisor.state

    @property
    def closed(self) -> int:
        assert self.system.hub.state is not None
        return self.system.hub.state.closed

    @property
    def frames(self) -> dict[int, bytes]:
        """The captured digests by tick."""
        return {closing.frame.tick: closing.digest for closing in self.closings}

    def ends(self, pattern: str) -> re.Match[str]:
        """Hold that the run has ended for this reason, in order: at its last captured tick, with all that was told."""
        end = self.state.end
        assert end is not None and end.failed and self.state.finished
        match = re.fullmatch(pattern, end.reason)
        assert match is not None, end.reason
        assert end.tick == int(next(filter(None, match.groups()))) == self.closed
        assert [*self.frames] == list(range(max(self.frames) + 1)) and max(self.frames) >= end.tick
        assert self.frames.items() <= undisturbed().items()
        assert self.system.hub.finished and channels.VHUB not in self.system.processes, "the capture is closed"
        result = self.system.supervisor.result()
        assert result["reason"] == end.reason and result["failed"] and result["ticks"] == self.state.frame.tick
        assert fold(self.state.deployment, self.system.journal).kept.end == end
        return match


@cache
def undisturbed() -> dict[int, bytes]:
    return Cut([]).frames


def lose(records: int, back_ns: int = 300 * MS) -> Callable[[System], object]:
    return lambda system: lose_hub(system, records, back_ns)


@pytest.mark.parametrize("weather", [CALM, BAD], ids=["calm", "bad"])
def test_the_run_ends_at_the_vhubs_last_record(weather: Weather) -> None:
    """Its account has what happened before, and the clients hear of the end."""

    def kill(system: System) -> None:
        system.kill("n2")
        system.later(30 * MS, partial(system.start, "n2"))

    cut = Cut([(60, kill), (110, lose(40))], weather)
    match = cut.ends(KNOWN)
    assert 60 < int(match[1]) < 110 <= cut.state.frame.tick <= int(match[2]) + 1
    assert [entry["what"] for entry in cut.system.supervisor.result()["recoveries"]] == ["node", "join", "vhub"]
    if weather is CALM:
        assert all(player.core.ended for player in cut.system.players.values())


def test_a_machine_that_was_lost_is_enough() -> None:
    """Its journal may have lost what nobody but clients has heard."""
    cut = Cut([(110, lambda system: system.kill_hub("now", 300 * MS)), (110, _reboot)])
    cut.ends(UNKNOWN)


def _reboot(system: System) -> None:
    system.hub_journal.machine = "machine-2"


@pytest.mark.parametrize(("hub", "supervisor"), [(40, 9), (20, 120), (300, 60), (1, 1)])
@pytest.mark.parametrize("nodes_too", [False, True])
def test_a_supervisor_that_was_started_again_ends_it_too(hub: int, supervisor: int, nodes_too: bool) -> None:
    """Where nobody has lived on, as behind `up --resume`, the run stays as it is."""

    def cut_power(system: System) -> None:
        lose_supervisor(system, supervisor)
        lose_hub(system, hub, 50 * MS)
        for name in NAMES if nodes_too else ():
            system.kill(name)
            system.later(20 * MS, partial(system.start, name))
        system.later(40 * MS, partial(system.start, channels.SUPERVISOR))

    cut = Cut([(130, cut_power)])
    if not nodes_too:
        cut.ends(f"{KNOWN}|{UNKNOWN}")
        return
    state = cut.state
    assert state.end is None and re.fullmatch(f"{KNOWN}|{UNKNOWN}", state.abandoned)
    assert fold(state.deployment, cut.system.journal).kept.end is None and not cut.system.hub.finished


def test_a_supervisor_that_alone_has_lost_its_machine_continues_from_the_vhubs_commit() -> None:
    """What was ordered up to there is not ordered again."""

    def add(system: System) -> None:
        ask(system, "add", name="ball", at="0.15,0,0.05")

    def cut_power(system: System) -> None:
        lose_supervisor(system, 9)
        system.later(40 * MS, partial(system.start, channels.SUPERVISOR))

    cut, whole = Cut([(90, add), (130, cut_power)]), Cut([(90, add)])
    assert cut.state.end is not None and cut.state.end.reason == "done" and cut.frames == whole.frames


def _goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (supervisor_core, failover):
        monkeypatch.setattr(module, "lacks_inputs", lambda state, standing: False)


def _does_not_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    """A vHub that goes on from a journal closes nothing until it may."""
    before = HubCore._resume

    def go_on(self: HubCore, past: Past, now_ns: int) -> None:
        before(self, past, now_ns)
        if self.handshake.waits:
            self._readers[ResumeGrant] = lambda grant, payload, now_ns: None
            self.handshake.granted_from = 0
            self._enter()

    monkeypatch.setattr(HubCore, "_resume", go_on)


@pytest.mark.parametrize("plant", [_goes_on, _does_not_wait])
def test_a_planted_fault_is_found(plant: Callable[[pytest.MonkeyPatch], None], monkeypatch: pytest.MonkeyPatch) -> None:
    plant(monkeypatch)
    with pytest.raises(AssertionError):
        Cut([(110, lose(40))]).ends(KNOWN)
