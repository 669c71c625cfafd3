"""Rehearsal and processes say the same, byte for byte: frames, orders, deliveries, packets of every tick, and Gos."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from foosim.rehearsal.rehearse import rehearse
from foosim.vhub.capture_reader import open_capture
from tests.replay.test_verify import messages_of

if TYPE_CHECKING:
    from tests.wire.conftest import House

TICKS = 250
PLAYERS = Path(__file__).parent / "players"


def scribes(folder: Path) -> list[str]:
    """Settings that give both teams to players who write down what they are given."""
    sets = []
    for team in ("red", "blue"):
        sets.append(f"players.player-{team}.class=scribe:Scribe")
        sets.append(f"players.player-{team}.parameters={{team: {team}, path: '{folder / team}.txt'}}")
    return sets


def test_processes_say_what_a_rehearsal_says(house: House, monkeypatch: pytest.MonkeyPatch) -> None:
    """With Bullet; that runs with the pure engine have a rehearsal's digests, others say."""
    monkeypatch.setenv("PYTHONPATH", str(PLAYERS))
    monkeypatch.syspath_prepend(str(PLAYERS))
    real, rehearsed = house.folder / "real", house.folder / "rehearsed"
    real.mkdir()
    rehearsed.mkdir()
    common = ["capture.frames_every=1 tick", "engine=bullet"]
    sets = [argument for setting in [*common, *scribes(real)] for argument in ("--set", setting)]
    code, _, err = house.end(
        house.up("--pace", "fast", "--for", "500 ms", "--capture", real / "run.mcap", *sets, players=True)
    )
    assert code == 0, err
    text = house.table.read_text()
    capture = rehearsed / "run.mcap"
    rehearse(text, "table.yaml", TICKS, None, [*common, *scribes(rehearsed)], capture=capture)

    found, expected = messages_of(real / "run.mcap"), messages_of(capture)
    assert {"/epochs", "/tick", "/frame", "/packets", "/clients", "/tf", "/scene"} <= set(found)
    assert len(found["/tick"]) == len(found["/frame"]) == TICKS + 1
    for topic in sorted(expected):
        assert found[topic] == expected[topic], topic
    packets = open_capture(capture).packets
    for team in ("red", "blue"):
        assert (real / f"{team}.txt").read_text() == (rehearsed / f"{team}.txt").read_text()
        asked = [int(line.split()[0]) for line in (real / f"{team}.txt").read_text().splitlines()]
        balls = (packets.source == "camera") & (packets.destination == f"player-{team}") & (packets.fate == "delivered")
        assert asked == sorted(set(asked)) and len(asked) > TICKS // 6
        assert set(packets.where(balls).arrival_tick.tolist()) <= set(asked), "it acts when the ball comes"
