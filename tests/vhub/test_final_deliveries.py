"""Deliveries that are final before their tick is near: when the vHub knows that nothing reaches robots for a while."""

from __future__ import annotations

import pytest
from msgspec import structs

from foosim.common import limits
from foosim.deployment.loader import apply_sets
from foosim.protocol import channels
from foosim.protocol.messages import ClientHello, Epoch, Join, Subscription, Want
from tests.vhub.test_sessions import BUILD, DEPLOYMENT, FRAME, OWNERS, PERIODS, TEXT, Hub, sent

W = limits.RELEASE_AHEAD
OWNED = list(DEPLOYMENT.robots)
BALL = Subscription("camera", "ball")


def covered(hub: Hub) -> list[tuple[int, int]]:
    """What was said since the last look: (first tick, last tick) of each message."""
    return [(said.tick, said.last) for said in hub.said(channels.DELIVERIES)]


def test_they_reach_to_the_next_tick_at_which_somebody_sends() -> None:
    hub = Hub().begin()
    hub.said()
    hub.close(0)
    assert covered(hub) == [(1, 5)], "hand is due at 5, and what it sends reaches robots at 6"
    for tick in range(1, 5):
        assert not hub.state.hears_clients or tick == hub.state.final
        hub.close(tick)
        assert covered(hub) == [], f"closing {tick} has nothing new to say"
    hub.close(5)
    assert covered(hub) == [(6, 10)]


def test_a_packet_in_flight_ends_them() -> None:
    hub = Hub().begin()
    hub.commit(0)
    hub.said()
    hub.done("hand", 0, sent(1))
    hub.done("knee", 0)
    (deliveries,) = hub.said(channels.DELIVERIES)
    assert [packet.sequence for packet in deliveries.packets] == [1]
    assert deliveries.last == 1, "it is answered, and the answer's tick is not known to be empty"
    hub.close(1)
    assert covered(hub) == [(2, 2)], "frame 2 has the answer in an outbox"
    hub.close(2)
    assert covered(hub) == [(3, 5)]


def test_there_are_none_while_a_free_running_client_is_here() -> None:
    hub = Hub().begin()
    hub.enter("ear")
    hub.said()
    for tick in range(8):
        hub.close(tick)
        assert covered(hub) == [(tick + 1, tick + 1)]


def test_who_comes_goes_or_sends_in_between_waits_for_their_end() -> None:
    hub = Hub().begin()
    hub.close(0)
    hub.close(1)
    hub.enter("ear")
    for tick in range(2, 5):
        hub.close(tick)
        assert "ear" not in hub.state.members
    hub.close(5)
    assert hub.state.members["ear"].joined_tick == 5
    hub.core.client_gone("ear", 0)
    hub.close(6)
    assert not hub.state.members["ear"].active


def test_each_tick_of_them_is_said_again_when_asked_for() -> None:
    hub = Hub().begin()
    hub.close(0)
    hub.said()
    for tick, last in ((1, 5), (3, 3), (5, 5)):
        hub.say(channels.WANT, "n1", Want("n1", channels.DELIVERIES.name, tick, 1, []))
        assert covered(hub) == [(tick, last)]


def test_they_are_no_more_than_the_supervisor_lets_nodes_go() -> None:
    hub = Hub()
    for name in PERIODS:
        hub.enter(name, 100)
    hub.say(channels.EPOCH, "supervisor", Epoch(1, 0, FRAME.digest, ["n1"], OWNERS, b""))
    hub.said()
    hub.commit(0)
    hub.done("hand", 0)
    hub.done("knee", 0)
    assert covered(hub) == [(1, 1 + W)]


def test_they_end_at_ticks_that_offsets_say_and_where_an_absent_client_may_join() -> None:
    sets = ["clients.hand.offset=6 ms", "clients.knee.offset=14 ms", "robots.camera.sensors.ball.offset=2 ms"]
    sets += [f"robots.{robot}.sensors.encoder.offset=2 ms" for robot in OWNED if robot != "camera"]
    hub = Hub(structs.replace(BUILD, deployment=apply_sets(TEXT, "table.yaml", sets)))
    for name, period, offset in (("hand", 5, 3), ("knee", 10, 7)):
        hub.say(channels.CLIENT_HELLO, name, ClientHello(name, "one", limits.PROTOCOL_VERSION, "", 0))
        hub.say(channels.UP, name, Join(name, "one", period, [], offset))
    hub.say(channels.EPOCH, "supervisor", Epoch(1, 0, FRAME.digest, ["n1"], OWNERS, b""))
    hub.said()
    asked, reached = [], []
    for tick in range(20):
        hub.commit(tick)
        while hub.core.waiting_for.startswith("Done of "):
            name = hub.core.waiting_for.removeprefix("Done of ").partition(",")[0]
            asked.append((tick, name))
            hub.done(name, tick)
        reached += covered(hub)
    assert asked == [(3, "hand"), (7, "knee"), (8, "hand"), (13, "hand"), (17, "knee"), (18, "hand")]
    assert reached[:7] == [(tick, tick) for tick in range(1, 8)], "one of them may join at any tick that it says"
    assert reached[7:] == [(8, 8), (9, 11), (12, 13), (14, 16), (17, 17), (18, 18), (19, 21)]


@pytest.mark.parametrize(
    ("join", "what"),
    [
        (Join("hand", "one", 5, [], 5), "joins with an offset of 5 ticks, its period is 5"),
        (Join("ear", "one", 0, [], 1), "joins with an offset of 1 ticks, its period is 0"),
        (Join("hand", "one", 5, [BALL], 1, [BALL]), "an offset of 1 ticks, its period is 5, and acts at arrival"),
        (Join("ear", "one", 0, [BALL], 0, [BALL]), "acts at arrival and joins free-running"),
        (Join("hand", "one", 5, [], 0, [BALL]), "acts at the arrival of camera ball, which it does not hear"),
    ],
)
def test_a_join_whose_times_do_not_fit_is_refused(join: Join, what: str) -> None:
    hub = Hub()
    hub.say(channels.CLIENT_HELLO, join.name, ClientHello(join.name, "one", limits.PROTOCOL_VERSION, "", 0))
    hub.say(channels.UP, join.name, join)
    assert what in hub.lines()[-1]
    assert hub.core.malformed == 1 and not hub.core.sessions.joins
