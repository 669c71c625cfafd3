"""Hellos that come late, of processes that are gone: the one that lives gets in, whichever comes first."""

from __future__ import annotations

from typing import Final

import pytest

from foosim.client.core import ClientCore
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.codec import encode
from foosim.protocol.messages import ClientRefusal
from tests.client.test_core import Air, published
from tests.client.test_return import Storm

PERIOD: Final = 1
TAKEN: Final = "a client hand is already here"


def carry_up(air: Air, messages: list[Publish]) -> None:
    for message in messages:
        air.tell(message.channel, message.name, message.payload)


def hear(air: Air, *cores: ClientCore) -> None:
    """Let clients hear what the vHub has said, and keep back what they say to it."""
    for message in air.said():
        for core in cores:
            core.receive(message.channel, message.name, message.payload, air.now_ns)


def play(air: Air, core: ClientCore, ticks: int) -> None:
    """Let a client play some ticks, each of which waits for it."""
    for _ in range(ticks):
        if core.go is None:
            air.close()
            air.carry(core)
        assert core.go is not None and not core.refusal
        core.done([])
        air.carry(core)
        assert air.closed() == core.tick


def lost(air: Storm) -> list[Publish]:
    """A client plays, the vHub dies, and the client too: return its last hello, which may come later."""
    dead = air.enter("hand", PERIOD, boot="dead")
    air.start()
    play(air, dead, 3)
    air.die([dead])
    dead.wake(air.now_ns)
    return published(dead)


@pytest.mark.parametrize("is_known", [False, True], ids=["started meanwhile", "was in the run"])
@pytest.mark.parametrize("comes", ["before its hello", "before its welcome", "before its join", "again and again"])
def test_the_process_that_lives_gets_in_whenever_the_hello_of_a_dead_one_comes(comes: str, is_known: bool) -> None:
    air = Storm()
    late_hello = lost(air)
    living = ClientCore("hand", "living", air.now_ns)
    if is_known:  # it has played with the vHub before this one
        air.come_back()
        air.carry(living)
        living.join(PERIOD, [])
        play(air, living, 2)
        air.die([living])
    air.come_back()

    def come(when: str) -> None:
        if comes in (when, "again and again"):
            carry_up(air, late_hello)

    come("before its hello")
    living.wake(air.now_ns)
    carry_up(air, published(living))
    come("before its welcome")
    hear(air, living)
    said = published(living)
    come("before its join")
    assert living.welcome is not None and not living.is_away and not living.refusal
    carry_up(air, said)
    if not is_known:
        living.join(PERIOD, [])
    air.carry(living)
    play(air, living, 5)
    carry_up(air, late_hello)
    play(air, living, 5)
    assert air.hub.sessions.by_name["hand"].boot == "living"
    assert living.statistics().missing == 0 and not living.refusal


def test_a_late_join_of_a_dead_process_takes_no_name() -> None:
    """It answers the welcome of a vHub before: it says nothing of who lives, and keeps nobody out."""
    air = Storm()
    dead = air.enter("hand", PERIOD, boot="dead")
    air.start()
    play(air, dead, 3)
    dead._say_join()
    joins = published(dead)
    air.die([dead])
    dead.wake(air.now_ns)
    late = [*published(dead), *joins]
    assert [message.channel for message in late] == [channels.CLIENT_HELLO, channels.UP]
    air.come_back()
    carry_up(air, late)
    assert not air.hub.sessions.by_name["hand"].is_present
    living = ClientCore("hand", "living", air.now_ns)
    air.carry(living)
    living.join(PERIOD, [])
    air.carry(living)
    play(air, living, 5)


def test_whoever_says_a_late_hello_only_is_not_waited_for_without_end() -> None:
    air = Storm()
    late_hello = lost(air)
    air.come_back()
    carry_up(air, late_hello)
    session = air.hub.sessions.by_name["hand"]
    assert session.boot == "dead" and session.away_ns > air.now_ns
    air.hub.wake(session.away_ns)
    assert air.hub.lost == "lost hand: its connection closed"


@pytest.mark.parametrize("first", [0, 1])
def test_of_two_that_live_the_first_that_joins_is_in_and_the_other_one_is_refused(first: int) -> None:
    air = Storm()
    lost(air)
    air.come_back()
    twins = [ClientCore("hand", boot, air.now_ns) for boot in ("one", "two")]
    for twin in twins:
        air.carry(twin)
        assert twin.welcome is not None
    winner, loser = twins[first], twins[1 - first]
    winner.join(PERIOD, [])
    air.carry(winner)
    loser.join(PERIOD, [])
    lost_join = published(loser)  # the refusal of this one is lost: it joins again
    carry_up(air, lost_join)
    air.said()
    air.now_ns = loser.deadline_ns()
    air.carry(loser)
    assert (winner.refusal, loser.refusal) == ("", TAKEN)
    third = ClientCore("hand", "three", air.now_ns)
    air.carry(third)
    assert (third.welcome, third.refusal) == (None, TAKEN)
    play(air, winner, 5)
    assert air.hub.sessions.by_name["hand"].boot == winner.boot


def test_a_client_that_is_in_takes_no_refusal_of_a_hello_and_one_that_is_away_none_of_a_join() -> None:
    air = Storm()
    hand = air.enter("hand", PERIOD)
    air.start()
    play(air, hand, 1)
    hand.receive(channels.CLIENT_REFUSAL, "hand", encode(ClientRefusal("hand", "one", TAKEN)), air.now_ns)
    assert not hand.refusal
    air.die([hand])
    hand.receive(channels.CLIENT_REFUSAL, "hand", encode(ClientRefusal("hand", "one", TAKEN, joins=True)), air.now_ns)
    assert not hand.refusal
