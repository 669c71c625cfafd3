"""`foosim-net` on a run of real processes: a partition and a heal, whose packets `explain` then knows."""

from __future__ import annotations

import json
import signal
from typing import TYPE_CHECKING

from foosim.vhub.capture_reader import open_capture
from foosim.vhub.rows import PacketRow
from tests.wire.test_run import assert_finished, last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House


def test_a_partition_by_request_cuts_and_a_heal_joins_again(house: House) -> None:
    """A Ctrl-C then ends the run in order."""
    up = house.up("--capture", "run.mcap", "--set", "engine=pure", "--json", players=True)
    house.ticking(50)
    code, out, err = house.ask("foosim-net", "partition", "player-red", "rest", "--json")
    assert code == 0, err
    cut = json.loads(out)["tick"]
    assert house.ask("foosim-net", "partition", "player-rde", "rest") == (
        3,
        "",
        "partition[0][0]: a selector that matches no endpoint, 'player-rde', nearest is 'player-red'\n",
    )
    house.ticking(cut + 20)
    code, out, err = house.run("foosim-net", "heal", "--json")
    healed = json.loads(out)["tick"]
    assert (code, json.loads(out)["text"]) == (0, f"heal of all at tick {healed}")
    status = house.ticking(healed + 20)
    assert [told["tick"] for told in status["disruptions"]["last"]] == [cut, healed]

    top = house.start("foosim-net", "top")
    first = house.read_until(top.stdout, "· tick ")
    line = house.read_until(top.stdout, "camera to player-red")
    assert "links" in first and "partition" in line and "/s, offered" in line
    top.send_signal(signal.SIGINT)
    assert house.end(top)[0] == 0

    up.send_signal(signal.SIGINT)
    code, out, err = house.end(up)
    assert code == 0, err
    assert (last_json(out)["reason"], last_json(out)["failed"]) == ("stopped", False)
    assert_finished(house, last_json(out))
    capture = open_capture(house.folder / "run.mcap")
    rows = [row for row in capture.rows("/packets") if isinstance(row, PacketRow)]
    lost = [row for row in rows if row.cause == "partition" and row.arrival_tick < 0]
    ticks = {row.sent_ns // capture.deployment.tick_ns for row in lost}
    assert ticks and min(ticks) >= cut and max(ticks) < healed
    one = next(row for row in lost if row.source == "camera")
    code, out, err = house.ask("foosim-net", "explain", "run.mcap", f"camera:{one.sequence}:player-red")
    assert code == 0, err
    assert "policy    at sending cut by request 0, from " in out and ": partition\n" in out
    assert out.endswith("dropped at sending: partition (policy)\n")
