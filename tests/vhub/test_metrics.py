"""Metrics in the vHub's state: what the wire brings, the bounds, and the snapshot."""

from __future__ import annotations

from math import nan

import pytest

from foosim.common import limits
from foosim.protocol import channels
from foosim.protocol.codec import encode
from foosim.protocol.messages import Up
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.metrics import Metric
from tests.client.test_core import DEPLOYMENT, Air


@pytest.mark.parametrize("metrics", [[("a", nan)], [("a.b", 1.0)], [("c", 1.0), ("d", 1.0)]])
def test_invalid_metrics_of_a_client_are_dropped_and_counted(
    metrics: list[tuple[str, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "METRICS_OF_RUN_MAX", 3)
    air = Air()
    air.start()
    air.enter("ear", 0)
    for number, reported in enumerate([[("a", 1.0), ("b", 2.0)], metrics, [("a", 3.0)]], 1):
        air.tell(channels.UP, "ear", encode(Up("ear", "one", [], reported, number)))
    air.close()
    assert air.hub.malformed == 1 and not air.hub.lost and air.hub.state is not None
    assert air.hub.state.metrics.reported == {"ear": {"a": 3.0, "b": 2.0}}


def test_a_snapshot_has_the_metrics_and_further_channels_share_their_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "METRIC_CHANNELS_MAX", 2)
    state = HubState(DEPLOYMENT)
    for number, channel in enumerate("abcd"):
        counts = state.metrics.counts(channel)
        counts.dropped += 1
        counts.delivered, counts.delay_ns = counts.delivered + number, counts.delay_ns + 1_000_000 * number
    assert state.metrics.report(3, {"ear": {"way": 1.5}}) == [Metric(3, "players.ear.way", 1.5)]
    assert state.metrics.report(4, {"ear": {"way": 1.5}}) == [], "nothing has changed"
    figures = {"a.loss": 1.0, "b.loss": 0.5, "b.delay_ms": 1.0, "others.loss": 2 / 7, "others.delay_ms": 1.0}
    taken = state.metrics.take(4)
    assert taken == [Metric(4, f"network.{name}", value) for name, value in figures.items()]
    restored = HubState.restore(DEPLOYMENT, state.snapshot())
    assert restored.metrics.values() == state.metrics.values() and restored.metrics.unreported(5) == []
    restored.metrics.counts("a").dropped += 1
    assert restored.metrics.unreported(5) == [], "a loss of 100 % before and after"
    restored.metrics.counts("b").dropped += 1
    assert restored.metrics.unreported(5) == [Metric(5, "network.b.loss", 2 / 3)]
