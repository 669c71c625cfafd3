"""Rehearsal and processes say the same, byte for byte: commits, samples, Gos, Dones and deliveries of every tick."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.codec import decode_any
from foosim.protocol.journal import read_journal
from foosim.protocol.messages import Commit
from foosim.rehearsal.rehearse import rehearse
from foosim.rehearsal.system import Settings
from foosim.supervisor.records import Record
from foosim.vhub.records import HubRecord, TickRecord

if TYPE_CHECKING:
    from tests.wire.conftest import House

TICKS = 500
PLAYERS = Path(__file__).parent / "players"


def scribes(folder: Path) -> list[str]:
    """Settings that give both teams to players who write down what they are given."""
    sets = []
    for team in ("red", "blue"):
        sets.append(f"players.player-{team}.class=scribe:Scribe")
        sets.append(f"players.player-{team}.parameters={{team: {team}, path: '{folder / team}.txt'}}")
    return sets


def ticks_of(records: list[bytes]) -> list[TickRecord]:
    decoded = [decode_any(HubRecord, raw) for raw in records]
    return [record for record in decoded if isinstance(record, TickRecord)]


def commits_of(records: list[bytes]) -> list[bytes]:
    return [raw for raw in records if isinstance(decode_any(Record, raw), Commit)]


@pytest.mark.parametrize("engine", ["bullet", "pure"])
def test_processes_say_what_a_rehearsal_says(house: House, monkeypatch: pytest.MonkeyPatch, engine: str) -> None:
    monkeypatch.setenv("PYTHONPATH", str(PLAYERS))
    monkeypatch.syspath_prepend(str(PLAYERS))
    real, rehearsed = house.folder / "real", house.folder / "rehearsed"
    real.mkdir()
    rehearsed.mkdir()
    sets = [argument for setting in scribes(real) for argument in ("--set", setting)]
    up = house.up("--pace", "fast", "--for", "1s", "--engine", engine, "--json", *sets, players=True)
    journals = house.live().journals
    code, _, err = house.end(up)
    assert code == 0, err

    said: dict[str, list[bytes]] = {VHUB: [], SUPERVISOR: []}
    settings = Settings(on_journal=lambda process, record: said[process].append(record))
    text = house.table.read_text()
    rehearse(text, "table.yaml", TICKS, None, [f"engine={engine}", *scribes(rehearsed)], settings)

    expected, found = ticks_of(said[VHUB]), ticks_of(list(read_journal(journals, VHUB)))
    assert [record.tick for record in found] == list(range(TICKS))
    for one, other in zip(found, expected, strict=True):
        assert one.commit == other.commit and one.deliveries == other.deliveries, one.tick
        assert sorted(one.samples) == sorted(other.samples), one.tick
        assert [(name, [packet.payload for packet in sent]) for name, sent in one.admitted] == [
            (name, [packet.payload for packet in sent]) for name, sent in other.admitted
        ], one.tick
    assert sum(len(record.admitted) for record in found) == 2 * (TICKS // 5 - 1), "at tick 0 nobody has seen anything"
    assert commits_of(list(read_journal(journals, SUPERVISOR))) == commits_of(said[SUPERVISOR])
    for team in ("red", "blue"):
        assert (real / f"{team}.txt").read_text() == (rehearsed / f"{team}.txt").read_text()
        assert len((real / f"{team}.txt").read_text().splitlines()) == TICKS // 5
