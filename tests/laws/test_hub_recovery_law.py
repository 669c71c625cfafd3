"""Law 3 and 5: a run whose vHub was killed and came back is the run that would have been, to the last packet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any, Final

import pytest

from foosim.capture.rows import RECOVERIES
from foosim.common import limits
from foosim.protocol import channels
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import Deliveries, Epoch, Go
from foosim.runtime.roles.bus import Weather
from foosim.simulation import journals
from foosim.simulation.journals import ENDINGS, Ending
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.settings import Traced
from foosim.simulation.system import Settings, System
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import Closing
from tests.deployed import DEPLOYMENT, TABLE, TEXT
from tests.frames import rows_of

TICKS: Final = 240
MS: Final = 1_000_000
SETS: Final = ("engine=pure", "table.rules.kickoff_delay=20 ms")
SLOW: Final = Weather(1, delay_ns=8 * MS)
"""Time passes between what is said and heard."""
HUB_HEARD: Final = {channel.name for channel in (channels.HELLO, channels.READY, channels.HEARTBEAT)}
Fault = tuple[int, Callable[[System], object]]


@dataclass
class Seen:
    """What a run gave to the world outside: rows of the capture, deliveries, and what each player was told."""

    run: Rehearsed = field(default_factory=lambda: Rehearsed({}))
    closings: list[Closing] = field(default_factory=list)
    deliveries: dict[int, set[bytes]] = field(default_factory=dict)
    told: dict[str, dict[int, set[bytes]]] = field(default_factory=dict)
    """Go by player and number."""
    systems: list[System] = field(default_factory=list)
    shown: list[tuple[bool, int, int, int]] = field(default_factory=list)
    """What the supervisor's status said as it heard the vHub: whether it is away, packets offered, links, clients."""
    lost: list[dict[str, Any] | None] = field(default_factory=list)
    """And of its loss."""

    def watch(self, traced: Traced) -> None:
        if traced.process == channels.SUPERVISOR and traced.channel in HUB_HEARD and traced.name == channels.VHUB:
            said = self.systems[0].supervisor.status(traced.now_ns)
            counts = said["packets"]["offered"], said["links_in_all"], len(said["clients"])
            self.shown.append((said["vhub_away"], *counts))
            self.lost.append(said["vhub_lost"])
        if traced.what == "publish" and traced.channel == channels.DELIVERIES.name:
            self.deliveries.setdefault(decode(Deliveries, traced.payload).tick, set()).add(traced.payload)
        elif traced.what == "receive" and traced.channel == channels.DOWN.name:
            message = decode_any(channels.DOWN.message, traced.payload)
            if isinstance(message, Go):
                self.told.setdefault(traced.process, {}).setdefault(message.number, set()).add(traced.payload)

    def rows(self) -> list[Any]:
        """The rows of all closings in their order, without the wall's time and losses."""
        return rows_of(self.closings, DEPLOYMENT, RECOVERIES)


def fly(faults: Sequence[Fault], ticks: int = TICKS, sets: Sequence[str] = SETS, **chosen: Any) -> Seen:
    seen = Seen()

    def prepare(system: System) -> None:
        seen.systems.append(system)
        for tick, fault in faults:
            system.at_tick(tick, partial(fault, system))

    chosen = {"observer": seen.watch, "on_closing": seen.closings.append, **chosen}
    seen.run = rehearse(TEXT, TABLE.name, ticks, 2, sets, Settings(**chosen), prepare=prepare)
    return seen


@cache
def undisturbed(ticks: int = TICKS) -> Seen:
    return fly([], ticks)


def kill_hub(ending: Ending = "now", back_ns: int = 300 * MS) -> Callable[[System], object]:
    return lambda system: system.kill_hub(ending, back_ns)


def assert_the_same(seen: Seen, usual: Seen) -> None:
    """Equal frames, fates and deliveries; each tick was captured once; each player received everything once."""
    assert seen.run.json["reason"] == "done" and not seen.run.json["failed"]
    assert seen.run.digests == usual.run.digests
    assert [c.frame.tick for c in seen.closings] == [c.frame.tick for c in usual.closings]
    assert seen.rows() == usual.rows(), "every packet with its fate, every delivery, every join"
    assert seen.run.json["packets"] == usual.run.json["packets"]
    for tick, payloads in seen.deliveries.items():
        assert len(payloads) == 1, f"deliveries {tick} are said in {len(payloads)} ways"
    assert seen.told == usual.told, "the same Gos with the same numbers, byte for byte"


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_vhub_that_is_killed_comes_back_and_nothing_is_lost(ending: Ending) -> None:
    seen = fly([(1, kill_hub(ending)), (73, kill_hub(ending)), (150, kill_hub(ending, 5 * MS)), (151, kill_hub("now"))])
    assert_the_same(seen, undisturbed())
    told = [(entry["what"], entry["name"]) for entry in seen.run.json["recoveries"]]
    assert set(told) == {("vhub", "vhub")} and len(told) in (3, 4), "the last one may come before anything is committed"
    assert all(entry["outage_ms"] is not None for entry in seen.run.json["recoveries"])
    assert max(entry["outage_ms"] for entry in seen.run.json["recoveries"]) >= 300
    assert_counts_stay(seen)


def assert_counts_stay(seen: Seen) -> None:
    """What the vHub has counted stays while it is away and while another one has not counted anything yet."""
    away = [shown for shown, *_ in seen.shown]
    counted = [counts for _, *counts in seen.shown]
    assert [lost is not None for lost in seen.lost] == away, "and says since when, and why"
    assert all(lost["reason"] and lost["for_s"] >= 0 for lost in seen.lost if lost is not None)
    assert len({lost["tick"] for lost in seen.lost if lost is not None}) > 1
    first = next(at for at, counts in enumerate(counted) if counts[0])
    assert {*away} == {True, False}
    assert all(all(counts) for counts in counted[first:])
    offered = [counts[0] for counts in counted]
    assert offered == sorted(offered)


def test_a_journal_whose_files_began_anew_gives_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Heads between the ticks: a fold begins at one of them, and older ones go."""
    monkeypatch.setattr(limits, "CHECKPOINT_TICKS", 7)
    monkeypatch.setattr(journals, "HEADS_KEPT", 22)
    seen = fly([(100, kill_hub("torn")), (180, kill_hub("unpublished"))], sets=(*SETS, "deadlines.client_back=250 ms"))
    assert_the_same(seen, undisturbed())


def test_a_vhub_that_does_not_come_back_ends_the_run_in_order() -> None:
    seen = fly([(100, kill_hub("now", 10_000 * MS))], sets=(*SETS, "deadlines.vhub_back=3 s"))
    json = seen.run.json
    assert json["failed"] and json["reason"] == "lost vhub: its connection closed; it did not come back within 3 s"
    assert seen.run.digests == undisturbed().run.digests[: len(seen.run.digests)] and 100 <= json["ticks"] <= 106
    (entry,) = json["recoveries"]
    assert (entry["what"], entry["outage_ms"]) == ("vhub", None)


def test_an_epoch_that_is_older_than_the_newest_in_the_journal_is_refused() -> None:
    cores: list[HubCore] = []
    epochs: list[int] = []

    def forge(system: System) -> None:
        cores.append(system.hub)
        epochs.append(system.supervisor.state.epoch)
        owners = [(robot, "n2") for robot in system.supervisor.state.owners]
        old = Epoch(1, 0, bytes(32), ["n1", "n2"], owners, b"")
        system.bus.put("nobody", channels.EPOCH, channels.SUPERVISOR, encode(old), system.bus.now_ns)

    move: Fault = (20, lambda system: system.request("move", robot="camera", node="n2"))
    seen = fly([move, (60, kill_hub()), (100, forge), (130, kill_hub()), (160, forge)])
    assert_the_same(seen, undisturbed())
    assert cores[0] is not cores[1] and epochs == [2, 2]
    assert all(core.epoch == 2 and set(core._owners.values()) == {"n1", "n2"} for core in cores)


class _Forgetful(HubCore):
    """Goes on with the state of the journal, and has forgotten what it said to whom."""

    def begin(self, past: Any, now_ns: int) -> None:
        if past is not None:
            for member in past.fold.state.members.values():
                member.downlink += 1
        super().begin(past, now_ns)


class _Hasty(HubCore):
    """Takes its capture to be complete."""

    def begin(self, past: Any, now_ns: int) -> None:
        if past is not None:
            past.kept.clear()
        super().begin(past, now_ns)


@pytest.mark.parametrize("planted", [_Forgetful, _Hasty])
def test_a_planted_fault_is_found(planted: type[HubCore]) -> None:
    with pytest.raises(AssertionError):
        assert_the_same(fly([(73, kill_hub("unpublished"))], hub=planted), undisturbed())


def test_a_vhub_that_dies_before_the_run_begins_is_waited_for() -> None:
    """It is no loss of the run: the one that comes instead begins with all others, and the run goes on to its end."""

    early: list[bool] = []

    def kill(system: System) -> None:
        early.append(not system.supervisor.state.is_open)
        system.kill_hub("now", 40 * MS)

    def prepare(system: System) -> None:
        system.later(30 * MS, partial(kill, system))

    chosen = Settings(weather=SLOW, restart_ns=500 * MS)
    run = rehearse(TEXT, TABLE.name, 60, 2, (*SETS, "deadlines.vhub_back=250 ms"), chosen, prepare=prepare)
    assert run.json["reason"] == "done" and run.json["recoveries"] == [] and early == [True]
    assert run.digests == undisturbed().run.digests[:60]


@pytest.mark.parametrize("what", ["publish", "receive"])
def test_a_vhub_dies_that_a_supervisor_has_just_recalled(what: str) -> None:
    """Whether its hello comes behind the news that it is gone, or before: it does not keep the next one out."""
    systems: list[System] = []
    kills: list[int] = []

    def watch(traced: Traced) -> None:
        who = channels.VHUB if what == "publish" else channels.SUPERVISOR
        is_hello = (traced.process, traced.what, traced.channel, traced.name) == (who, what, "hello", channels.VHUB)
        if is_hello and systems and systems[0].supervisor.state.is_resuming and not kills:
            kills.append(traced.now_ns)
            systems[0].later(what == "receive", partial(systems[0].kill_hub, "now", 40 * MS))

    def restart(system: System) -> None:
        systems.append(system)
        system.kill(channels.SUPERVISOR)
        system.later(50 * MS, partial(system.start, channels.SUPERVISOR))

    sets = (*SETS, "deadlines.orphan=5 s", "deadlines.vhub_back=250 ms")
    chosen = {"weather": SLOW, "restart_ns": 500 * MS, "keeps_journals": True, "observer": watch}
    seen = fly([(80, restart)], 120, sets, **chosen)
    assert seen.run.json["reason"] == "done" and len(kills) == 1
    assert seen.run.digests == undisturbed().run.digests[:120]
    assert [entry["what"] for entry in seen.run.json["recoveries"]] == ["supervisor"]


def test_an_epoch_of_before_is_no_answer_to_a_supervisor_that_was_started_again() -> None:
    """A late copy of it comes to a vHub that was recalled, whose first word of where it stands is lost."""
    systems: list[System] = []
    losses: list[int] = []

    def watch(traced: Traced) -> None:
        is_resuming = (traced.process, traced.what, traced.channel) == (channels.VHUB, "publish", "resume_state")
        if is_resuming and systems and systems[0].supervisor.state.is_resuming and not losses:
            losses.append(traced.now_ns)
            bus, epoch = systems[0].bus, systems[0].supervisor.state.epoch_payload
            bus.put("nobody", channels.EPOCH, channels.SUPERVISOR, epoch, bus.now_ns)
            bus.cut_off(channels.VHUB, bus.now_ns + MS, input_=False)

    def restart(system: System) -> None:
        systems.append(system)
        system.kill(channels.SUPERVISOR)
        system.later(50 * MS, partial(system.start, channels.SUPERVISOR))

    chosen = {"weather": SLOW, "keeps_journals": True, "observer": watch}
    seen = fly([(80, restart)], 120, (*SETS, "deadlines.orphan=5 s"), **chosen)
    assert seen.run.json["reason"] == "done" and len(losses) == 1
    assert seen.run.digests == undisturbed().run.digests[:120]
