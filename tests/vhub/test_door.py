"""Clients that go while the run waits for them, and come back as others."""

from __future__ import annotations

import pytest

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
    assert hub.core.lost == ("" if answers else "hand: its connection closed")
    assert hub.state.closed == (0 if answers else -1)
