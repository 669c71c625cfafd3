"""Laws 1 to 3 where sensors and players do not act in step: whoever computes and whoever dies, the same world."""

from __future__ import annotations

from functools import cache
from typing import Final

from foosim.protocol import channels
from foosim.protocol.codec import decode
from foosim.protocol.messages import Deliveries
from foosim.rehearsal.bus import Traced
from foosim.rehearsal.rehearse import Rehearsed, rehearse
from foosim.rehearsal.system import Settings
from tests.laws.test_hub_recovery_law import SETS, TABLE, Seen, assert_the_same, fly, kill_hub

TICKS: Final = 120
OFFSETS: Final = (
    *SETS,
    "robots.camera.sensors.ball.offset=2 ms",
    "robots.red.goal.sensors.encoder.offset=6 ms",
    "players.player-red.offset=4 ms",
    "players.player-blue.rate=50 Hz",
    "players.player-blue.offset=16 ms",
)


@cache
def with_offsets() -> Seen:
    return fly([], TICKS, OFFSETS)


def run(nodes: int, sets: tuple[str, ...]) -> tuple[Rehearsed, list[Deliveries]]:
    """Rehearse the table on so many nodes; return the result, and what the vHub said to nodes."""
    said: list[Deliveries] = []

    def watch(traced: Traced) -> None:
        if traced.channel == channels.DELIVERIES.name:
            said.append(decode(Deliveries, traced.payload))

    settings = Settings(observer=watch, observes=("publish",))
    return rehearse(TABLE.read_text(), TABLE.name, TICKS, nodes, sets, settings), said


def test_players_and_sensors_with_offsets_act_at_their_ticks() -> None:
    seen = with_offsets()
    assert seen.told.keys() == {"player-red", "player-blue"}
    sent = {(f.source, f.channel, f.sent_ns // 2_000_000 % 10) for c in seen.closings for f in c.fates}
    assert {at for source, _, at in sent if source == "player-red"} == {2, 7}
    assert {at for source, _, at in sent if source == "player-blue"} == {8}
    assert {at for source, _, at in sent if source == "camera"} == {1, 6}
    assert {at for source, _, at in sent if source == "red.goal"} == {3, 8}
    assert {at for source, _, at in sent if source == "red.attack"} == {0, 5}
    joined = {joining.name: closing.frame.tick for closing in seen.closings for joining in closing.joins}
    assert joined == {"player-red": 2, "player-blue": 8}


def test_with_offsets_one_node_or_three_are_the_same_world() -> None:
    alone, _ = run(1, OFFSETS)
    many, said = run(3, OFFSETS)
    assert alone.digests == many.digests == with_offsets().run.digests
    assert many.json["packets"]["delivered"] > 0
    assert max(deliveries.following for deliveries in said) > 0, "there are ticks between theirs at which nobody sends"


def test_with_offsets_a_vhub_that_is_killed_loses_nothing() -> None:
    killed = [(3, kill_hub("now")), (58, kill_hub("torn")), (90, kill_hub("now", 5_000_000))]
    assert_the_same(fly(killed, TICKS, OFFSETS), with_offsets())
