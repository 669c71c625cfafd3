"""Deliveries that are final before their tick is near: when the vHub knows that nothing reaches robots for a while."""

from __future__ import annotations

from foosim.protocol import channels, limits
from foosim.protocol.messages import Epoch, Want
from foosim.vhub.state import HubState
from tests.vhub.test_sessions import FRAME, OWNERS, PERIODS, Hub, sent

W = limits.RELEASE_AHEAD


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
    hub.say(channels.EPOCH, "supervisor", Epoch(1, 0, FRAME.digest, ["n1"], OWNERS, [], b""))
    hub.said()
    hub.commit(0)
    hub.done("hand", 0)
    hub.done("knee", 0)
    assert covered(hub) == [(1, 1 + W)]


def test_they_are_part_of_the_state() -> None:
    hub = Hub().begin()
    hub.close(0)
    hub.close(1)
    again = HubState.restore(hub.state.deployment, hub.state.snapshot())
    assert (again.final, again.was_final, again.hears_clients) == (5, True, False)
    assert again.snapshot() == hub.state.snapshot()
