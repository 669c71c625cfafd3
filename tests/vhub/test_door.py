"""Clients that go while the run waits for them, and come back as others."""

from __future__ import annotations

import pytest

from foosim.vhub.keeping import Keep
from tests.vhub.test_sessions import MS, Hub


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
    hub.core.wake(1_999 * MS)
    assert not hub.core.lost, "it may come back"
    hub.core.wake(2_000 * MS)
    assert hub.core.lost == ("" if answers else "lost hand: its connection closed")
    assert hub.state.closed == (0 if answers else -1)


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
