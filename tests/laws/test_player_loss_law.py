"""Players whose process is lost and started again: what follows from it is in journals and capture, to the last bit.

In fast the run waits for the new process, which answers the Go that is open. In realtime it goes on without the player
after `client_back`: it leaves at the tick whose Done it owes, and comes back at a later one.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.capture.rows import CLIENTS, ClientRow
from foosim.common.units import Pace
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.codec import decode_any, encode
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.simulation.what_if import what_if
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import AbsencesRecord, Fold, HubRecord, InputsRecord, TickRecord
from tests.deployed import TABLE, TEXT
from tests.turns import BY_PERIOD

RED: Final = "player-red"
SETS: Final = ("engine=pure", "substeps=1", "table.rules.kickoff_delay=20 ms", *BY_PERIOD)
AT_ARRIVAL: Final = (f"players.{RED}.act=arrival", f"players.{RED}.arrivals={{camera: [ball]}}")
SOON: Final = ("deadlines.client_back=200 ms", "deadlines.lockstep_realtime=100 ms", "deadlines.tick_lost=5 s")
MS: Final = 1_000_000
TICKS: Final = 400


class Run:
    """A rehearsal in which a player is killed at a tick, and started again after some virtual time."""

    def __init__(
        self,
        path: Path,
        pace: str,
        back_ms: int,
        *sets: str,
        also: Callable[[System], None] | None = None,
        hub: type[HubCore] = HubCore,
    ) -> None:
        self.records: list[bytes] = []
        self.path = path

        def prepare(system: System) -> None:
            self.system = system

            def kill() -> None:
                system.kill(RED)
                if back_ms:
                    system.later(back_ms * MS, lambda: system.start(RED))

            system.at_tick(100, kill)
            if also is not None:
                also(system)

        settings = Settings(hub=hub)
        settings.on_journal = lambda name, record: self.records.append(record) if name == "vhub" else None
        kind = Pace("fast") if pace == "fast" else Pace("realtime", Fraction(1))
        told: dict[str, Any] = {"prepare": prepare, "capture": path, "pace": kind}
        self.json = rehearse(TEXT, TABLE.name, TICKS, 2, (*SETS, *sets), settings, **told).json

    def comings(self) -> list[tuple[int, str]]:
        rows = [row for row in open_capture(self.path).rows(CLIENTS) if isinstance(row, ClientRow)]
        return [(row.tick, row.event) for row in rows if row.client == RED]

    def check(self) -> None:
        """The run is whole: it verifies, its journal gives its state, and its network judged again is the same."""
        assert (self.json["reason"], self.json["ticks"]) == ("done", TICKS)
        assert verify_capture(self.path, 3).equal
        state = self.system.hub.state
        assert state is not None
        fold = Fold(state.deployment, self.records)
        assert [*fold] and fold.state.snapshot() == state.snapshot()
        assert what_if(open_capture(self.path)).changed == 0
        assert state.packets.refused == 0, state.refusals


def test_in_fast_the_run_waits_and_the_new_process_answers_the_open_go(tmp_path: Path) -> None:
    run = Run(tmp_path / "run.mcap", "fast", 5_000)
    run.check()
    assert run.comings() == [(0, "joins")], "to the run it was never away"
    (entry,) = run.json["recoveries"]
    assert (entry["what"], entry["name"], entry["reason"]) == ("player", RED, "its connection closed")
    assert entry["tick"] == 100 and entry["outage_ms"] == pytest.approx(5_000, rel=0.01)
    statistics = run.system.players[RED].core.statistics()
    assert statistics.missing == 0 and statistics.answered == (TICKS - 100) // 5, "with new memory"


class LateNews(HubCore):
    """Its heartbeats that tell at once of what is over are lost: the next one does, behind commits of many ticks, and
    one from before it, in which a player is away, comes between."""

    away, left = b"", -1

    def send_heartbeat(self) -> None:
        assert self.state is not None
        if self.clients.absences.report()["over"]:
            self.left = self.left if self.left >= 0 else self.state.closed
        else:
            super().send_heartbeat()
            self.away = encode(self.heartbeat())

    def advance(self, now_ns: int) -> None:
        super().advance(now_ns)
        if self.left >= 0 and self.state is not None and self.state.closed == self.left + 3:
            self.actions.append(Publish(channels.HEARTBEAT, channels.VHUB, self.away))


@pytest.mark.parametrize(
    ("sets", "hub"), [((), HubCore), (AT_ARRIVAL, LateNews)], ids=["by period", "at arrival, with late news"]
)
def test_in_realtime_it_leaves_at_the_tick_that_it_owes_and_comes_back_at_a_later_one(
    sets: tuple[str, ...], hub: type[HubCore], tmp_path: Path
) -> None:
    run = Run(tmp_path / "run.mcap", "realtime", 500, *SOON, *sets, hub=hub)
    run.check()
    (joined, left, back) = run.comings()
    assert joined == (0, "joins") and left[1] == "leaves_owing" and back[1] == "joins"
    assert 100 <= left[0] <= 105 and left[0] < back[0]
    assert sets or left[0] % 5 == back[0] % 5 == 0
    lost, came = run.json["recoveries"]
    assert lost["reason"] == "its connection closed"
    assert (lost["what"], lost["tick"], came["what"], came["tick"]) == ("away", left[0], "return", back[0])
    assert lost["outage_ms"] == pytest.approx(200, abs=15), "deadlines.client_back, whenever that is told"
    assert came["outage_ms"] < 15
    found = [decode_any(HubRecord, raw) for raw in run.records]
    ticks = {record.tick: record for record in found if isinstance(record, TickRecord)}
    assert ticks[left[0]].owing == [RED]
    meanwhile = [ticks[tick] for tick in range(left[0], back[0])]
    assert not any(dict(record.admitted).get(RED) for record in meanwhile), "it is closed without its packets"
    joins = [record for record in found if isinstance(record, InputsRecord) and record.tick == back[0]]
    assert [joining.name for record in joins for joining in record.joins] == [RED]


@pytest.mark.parametrize(
    ("pace", "line"), [("fast", 0), ("fast", 1), ("realtime", 0), ("realtime", 1), ("realtime", 2), ("realtime", -1)]
)
def test_a_line_of_the_account_outlives_the_vhub_that_was_to_report_it(tmp_path: Path, pace: str, line: int) -> None:
    """The vHub dies at the record of an absence, when that is written and nothing is said of it; or (-1), of the tick
    at which a player leaves, when the record of the tick alone is written."""

    def also(system: System) -> None:
        written, ends = 0, system.settings.on_journal
        assert ends is not None

        def look(name: str, raw: bytes) -> None:
            nonlocal written
            ends(name, raw)
            record = None if name != "vhub" else decode_any(HubRecord, raw)
            leaves = isinstance(record, TickRecord) and bool(record.owing)
            written += isinstance(record, AbsencesRecord)
            if (leaves and line < 0) or (isinstance(record, AbsencesRecord) and written == line + 1):
                system.kill_hub("now", 50 * MS)

        system.settings.on_journal = look

    run = Run(tmp_path / "run.mcap", pace, 500, *SOON, also=also)
    run.check()
    (lost, *came), again = (
        [entry for entry in run.json["recoveries"] if (entry["what"] == "vhub") == is_hub] for is_hub in (False, True)
    )
    assert len(again) == 1
    (_, *events) = run.comings()
    on = pace == "realtime"
    assert (lost["what"], lost["name"], lost["reason"]) == ("away" if on else "player", RED, "its connection closed")
    assert [(entry["what"], entry["name"]) for entry in came] == ([("return", RED)] if on else [])
    assert [entry["tick"] for entry in (lost, *came)] == ([tick for tick, _ in events] if on else [lost["tick"]])


@pytest.mark.parametrize(
    ("sets", "reason"),
    [
        (("players.player-red.restart=false", "deadlines.client_back=200 ms"), f"lost {RED}: its connection closed"),
        (("deadlines.start=3 s", "deadlines.client_back=200 ms"),
         f"lost {RED}: it was not started again within 3 s (deadlines.start)"),
    ],
)  # fmt: skip
def test_one_that_is_not_started_again_ends_the_run(sets: tuple[str, ...], reason: str, tmp_path: Path) -> None:
    run = Run(tmp_path / "run.mcap", "fast", 0, *sets)
    assert run.json["failed"] and run.json["reason"] == reason
