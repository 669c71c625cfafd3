"""The metrics of a run: what clients reported, and figures of the network by channel. Part of the vHub's state."""

from __future__ import annotations

from typing import Final, NamedTuple

from foosim.common import limits
from foosim.vhub.network.ages import Ages
from foosim.vhub.network.memory import MetricsState
from foosim.vhub.network.packet import ChannelCounts

OTHERS: Final = "others"
"""The name under which channels above `METRIC_CHANNELS_MAX` are counted together."""
Reports = dict[str, dict[str, float]]
"""Values of metrics by client and name."""


class Metric(NamedTuple):
    """The value of a metric from the closing of a tick on: `players.CLIENT.NAME` or `network.CHANNEL.FIGURE`."""

    tick: int
    name: str
    value: float


class Metrics:
    """The metrics up to the last closed tick."""

    def __init__(self, ages: Ages) -> None:
        self.reported: dict[str, dict[str, float]] = {}
        """The last values, by client and name."""
        self.channels: dict[str, ChannelCounts] = {}
        self._ages = ages
        self._taken: dict[str, float] = {}
        """The figures of the network in the last rows of them."""

    def counts(self, channel: str) -> ChannelCounts:
        """Return the counts of a channel."""
        if channel not in self.channels and len(self.channels) >= limits.METRIC_CHANNELS_MAX:
            channel = OTHERS
        return self.channels.setdefault(channel, ChannelCounts())

    def report(self, tick: int, reports: Reports) -> list[Metric]:
        """Take what clients report up to the closing of a tick; return the changes."""
        changes = []
        for client, metrics in sorted(reports.items()):
            known = self.reported.setdefault(client, {})
            for name, value in sorted(metrics.items()):
                if known.get(name) != value:
                    known[name] = value
                    changes.append(Metric(tick, f"players.{client}.{name}", value))
        return changes

    def take(self, tick: int) -> list[Metric]:
        """Return the figures of the network that have changed since they were taken last."""
        changed = self.unreported(tick)
        self._taken |= {one.name: one.value for one in changed}
        return changed

    def unreported(self, tick: int) -> list[Metric]:
        """Return what `take` would, and leave the state as it is."""
        figures = self._figures().items()
        return [Metric(max(tick, 0), name, value) for name, value in figures if self._taken.get(name) != value]

    def values(self) -> dict[str, float]:
        """Return all metrics, by name."""
        reported = [(client, sorted(metrics.items())) for client, metrics in sorted(self.reported.items())]
        return {
            **{f"players.{client}.{name}": value for client, metrics in reported for name, value in metrics},
            **self._figures(),
        }

    def _figures(self) -> dict[str, float]:
        """Return the figures of each channel over all links: its loss, mean delay and mean age at use in ms."""
        found: dict[str, float] = {}
        means_ns = self._ages.means_ns()
        for channel, counts in sorted(self.channels.items()):
            start = f"network.{channel}"
            found[f"{start}.loss"] = counts.dropped / (counts.delivered + counts.dropped)
            if counts.delivered:
                found[f"{start}.delay_ms"] = counts.delay_ns / counts.delivered / 1e6
            if channel in means_ns:
                found[f"{start}.age_ms"] = means_ns[channel] / 1e6
        return found

    def state(self) -> MetricsState:
        """Return the snapshot."""
        reported = [(client, dict(sorted(metrics.items()))) for client, metrics in sorted(self.reported.items())]
        counts = [(name, one.delivered, one.dropped, one.delay_ns) for name, one in sorted(self.channels.items())]
        return MetricsState(reported, counts, dict(sorted(self._taken.items())))

    def restore(self, state: MetricsState) -> None:
        """Restore a snapshot."""
        self.reported, self._taken = dict(state.reported), state.taken
        self.channels.update({name: ChannelCounts(*counts) for name, *counts in state.channels})
