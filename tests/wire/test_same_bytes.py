"""Rehearsal and processes say the same, byte for byte: frames, orders, deliveries, packets of every tick, and Gos."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from foosim.capture.reader import open_capture
from foosim.common.units import parse_pace
from foosim.simulation.run import rehearse
from tests.simulation.test_verify import messages_of
from tests.wire.test_run import assert_finished, last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House

TICKS = 300
KEYS = {
    *("ticks", "tick_ns", "rtf", "lag_ms", "digest", "packets", "nodes", "moves", "handovers", "score", "capture"),
}
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
    code, out, err = house.end(house.up("--pace", "fast", "--for", "600 ms", "--json", *sets, players=True))
    assert code == 0, err
    content = last_json(out)
    assert_told(house, content, err)
    text, fast = house.table.read_text(), parse_pace("fast")
    capture = rehearsed / "run.mcap"
    same = rehearse(text, "table.yaml", TICKS, None, [*common, *scribes(rehearsed)], pace=fast, capture=capture).json
    for name in ("digest", "packets", "nodes", "handovers", "score"):
        assert content[name] == same[name], name

    found, expected = messages_of(house.folder / content["capture"]), messages_of(capture)
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


def assert_told(house: House, content: dict[str, Any], err: str) -> None:
    """What the result of a run of two nodes and two players has, and what is left of it."""
    assert content.keys() >= KEYS
    assert (content["ticks"], content["tick_ns"], content["lag_ms"], content["reason"]) == (
        *(TICKS, 2_000_000, None, "done"),
    )
    assert content["rtf"] > 0
    assert all(node["solved_ticks"] > 0 and node["owned"] for node in content["nodes"].values())
    assert content["packets"]["dropped"] > 0 and content["packets"]["delivered"] > 0
    assert_finished(house, content)
    assert "capture captures/table-" in err, "people are told where it is"
    assert house.processes_with(str(house.folder)) == {}
    (run,) = (house.folder / "state" / "foosim" / "runs").iterdir()
    assert list((run / "journals").iterdir()) == [], "nothing is left to recover"
