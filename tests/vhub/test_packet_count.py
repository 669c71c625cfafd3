"""Every packet that the vHub's core gets is explained, and a planted bug shows as packets that are not."""

from __future__ import annotations

from typing import Any, Final

import pytest

from foosim.vhub.network.packet import Flight
from foosim.vhub.state.hub_state import HubState
from tests.vhub.packet_load import Count, Load, run

TICKS: Final = 180
LOAD: Final = Load(packets=8, deaths_every=60)


def count() -> Count:
    return run(TICKS, LOAD)


def test_every_packet_is_explained() -> None:
    found = count()
    assert found.unexplained == 0
    assert found.dropped.keys() == {"node_down", "random_loss", "rx_down"}
    assert found.refused.keys() == {"duplicate", "malformed", "no_route"}
    assert found.crashes == 3 and found.lost_in_crash > 0 and found.in_flight > 0 and found.delivered > 3_000
    assert found.asked == sum(
        (found.delivered, *found.dropped.values(), *found.refused.values(), found.in_flight, found.lost_in_crash)
    )


def test_a_packet_that_is_lost_without_a_fate_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    arrive = HubState._arrive_at_robots

    def leak(self: HubState, tick: int, fates: list[Flight]) -> Any:
        found = arrive(self, tick, fates)
        if tick == 50:
            fates.pop()
        return found

    monkeypatch.setattr(HubState, "_arrive_at_robots", leak)
    assert count().unexplained > 0


def test_a_repeat_that_is_taken_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    admit = HubState._admit

    def forget(self: HubState, source: str, sent: Any) -> bool:
        if self.closed == 70 and source in self.members:
            self.members[source].sequence = 0
        return admit(self, source, sent)

    monkeypatch.setattr("foosim.vhub.sessions.Session.take", lambda self, packets: self.inbox.extend(packets) or 0)
    monkeypatch.setattr(HubState, "_admit", forget)
    assert count().unexplained > 0


@pytest.mark.campaign
def test_ten_million_packets_are_explained() -> None:
    found = run(10_000, Load())
    assert found.unexplained == 0 and found.asked > 10_000_000
