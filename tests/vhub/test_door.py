"""Clients that go while the run waits for them, and come back as others."""

from __future__ import annotations

import pytest

from foosim.protocol import channels, limits
from foosim.protocol.client_messages import Failure
from foosim.protocol.messages import ClientHello, ClientRefusal, ClientWelcome, Join
from foosim.vhub.keeping import Keep
from tests.vhub.test_sessions import MS, PERIODS, Hub, sent


@pytest.mark.parametrize("answers", [False, True])
def test_whoever_has_the_name_of_a_client_that_a_tick_waits_for_is_waited_for(answers: bool) -> None:
    """A lockstep client dies amid its tick, another program joins free-running under its name, and goes too."""
    hub = Hub().begin()
    hub.commit(0)
    hub.done("knee", 0)
    hub.core.client_gone("hand", 0)
    hub.enter("hand", period=0, boot="two")
    if answers:
        hub.done("hand", 0, boot="two")
    hub.core.client_gone("hand", 0)
    assert hub.core.deadline_ns() >= 0
    hub.core.wake(9_999 * MS)
    assert not hub.core.lost, "it may come back, or go on: in fast an answer has 10 s"
    hub.core.wake(10_000 * MS)
    assert hub.core.lost == ("" if answers else "lost hand: its connection closed")
    assert hub.state.closed == (0 if answers else -1)


def test_a_vhub_that_stood_still_is_no_orphan_by_that() -> None:
    hub = Hub().begin()
    orphan_ns = hub.core.deployment.deadlines.orphan_ns  # type: ignore[union-attr]
    hub.core.orphan.hear(False, 0)
    hub.core.door.rest(2 * orphan_ns, 2 * orphan_ns)
    assert not hub.core.orphan.is_over(hub.core.deployment, 3 * orphan_ns - 1)
    assert hub.core.orphan.is_over(hub.core.deployment, 3 * orphan_ns)


def test_a_client_leaves_once_however_often_it_comes_and_goes() -> None:
    hub = Hub().begin()
    hub.enter("ear")
    hub.close(0)
    for boot in ("two", "three"):
        hub.core.client_gone("ear", 0)
        hub.enter("ear", boot=boot)
    hub.core.client_gone("ear", 0)
    for tick in range(1, 5):
        hub.close(tick)
    left = [action.closing.leaves for action in hub.core.actions if isinstance(action, Keep)]
    assert [leaves for leaves in left if leaves] == [["ear"]]
    for tick in range(5, 15):
        if hub.state.hears_clients:
            hub.enter("ear", boot=f"at {tick}")
            hub.core.client_gone("ear", 0)
        hub.close(tick)
    left = [action.closing.leaves for action in hub.core.actions if isinstance(action, Keep)]
    assert [leaves for leaves in left if leaves] == [["ear"]], "who has left cannot leave"


def hello(hub: Hub, name: str, boot: str, returns: int = 0) -> list[ClientWelcome | ClientRefusal]:
    """What a hello is answered."""
    hub.said()
    hub.say(channels.CLIENT_HELLO, name, ClientHello(name, boot, limits.PROTOCOL_VERSION, "", 0, returns))
    return hub.said(channels.CLIENT_WELCOME, channels.CLIENT_REFUSAL)


def test_numbers_of_a_process_whose_answer_waits_to_be_recorded_are_taken() -> None:
    """It has answered and died, the tick waits for another client still: who comes goes on behind its numbers."""
    hub = Hub().begin()
    hub.commit(0)
    hub.done("hand", 0, sent(1), sent(2))
    hub.core.client_gone("hand", 0)
    (welcome,) = hello(hub, "hand", "two")
    assert isinstance(welcome, ClientWelcome) and welcome.sequence == 2
    hub.enter("hand", boot="two")
    hub.done("knee", 0)
    assert hub.state.closed == 0
    tick = PERIODS["hand"]
    for each in range(1, tick):
        hub.close(each)
    hub.commit(tick)
    hub.done("hand", tick, sent(3), boot="two")
    hub.done("knee", tick)
    assert hub.state.members["hand"].sequence == 3 and hub.state.refusals == {}


def test_what_comes_late_of_a_process_that_is_gone_is_of_nobody() -> None:
    """Its hello or its Join would make it one that is here, and for whom all wait."""
    hub = Hub().begin()
    hub.commit(0)
    hub.core.client_gone("hand", 0)
    assert hello(hub, "hand", "one") == [], "said before it went"
    hub.say(channels.UP, "hand", Join("hand", "one", PERIODS["hand"], []))
    assert hub.core.sessions.by_name["hand"].away_ns == 2_000 * MS
    (welcome,) = hello(hub, "hand", "two")
    assert isinstance(welcome, ClientWelcome)
    assert hello(hub, "hand", "one") == [], "another one has its place"
    (refusal,) = hello(hub, "hand", "three")
    assert isinstance(refusal, ClientRefusal) and refusal.reason == "a client hand is already here"
    hub.core.client_gone("hand", 0)
    (again,) = hello(hub, "hand", "two", returns=1)
    assert isinstance(again, ClientWelcome), "the same, whose connection was cut"


def test_a_client_that_is_no_player_does_not_end_the_run_by_saying_so() -> None:
    hub = Hub().begin()
    hub.say(channels.UP, "hand", Failure("hand", "one", "hand failed at tick 0: it says so"))
    assert not hub.core.lost and hub.core.statistics().malformed == 1
