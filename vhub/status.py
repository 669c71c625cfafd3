"""The vHub's statistics in heartbeats and in its farewell, as JSON: totals, refusals, a line per link."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import msgspec

from foosim.common.histogram import Lags
from foosim.common.json_text import encode_json
from foosim.vhub.links.fabric import LinkKey, name_of
from foosim.vhub.network.ages import quantile
from foosim.vhub.state.hub_state import HubState

LINKS_REPORTED_MAX: Final = 200
LINKS_REPORTED_EVERY: Final = 5
"""Heartbeats, which are half a second."""


@dataclass(slots=True)
class ShellStatus:
    """The shell's part of the report: path and state of the capture, progress of the disk, the radio address."""

    capture: str = ""
    recording: dict[str, Any] = field(default_factory=dict)
    disk_progress: int = 0
    radio_address: str = ""


class LinkLines:
    """The lines of links and the metrics, which several heartbeats share: for hundreds of links they cost as much as a
    few ticks."""

    def __init__(self) -> None:
        self._lines: dict[str, msgspec.Raw] = {}
        self._heartbeats = 0

    def lines(self, state: HubState, watched: Collection[tuple[str, str]], *, anew: bool) -> Mapping[str, msgspec.Raw]:
        """Return `links` and `metrics` as JSON for one more heartbeat, renewed when they are due: the links with the
        most traffic and the watched ones."""
        if anew or self._heartbeats % LINKS_REPORTED_EVERY == 0:
            parts = {"links": _links(state, watched), "metrics": state.metrics.values()}
            self._lines = {name: msgspec.Raw(encode_json(part)) for name, part in parts.items()}
        self._heartbeats += 1
        return self._lines


def report(
    state: HubState,
    refused: Mapping[str, Any],
    lines: Mapping[str, msgspec.Raw],
    watched: Mapping[str, Any],
    absences: Mapping[str, Any],
    lateness: Lags,
    shell: ShellStatus,
) -> bytes:
    """Return the statistics, the addresses of the radio plane and the capture, and the state of the recording.

    `lines` are of `LinkLines`. Its `links` are the links with the most traffic, and the watched ones: [from, to,
    offered, delivered, dropped, mean delay in ns, rule, how long its queue is in ns, dropped by cause, ages at use],
    and `links_in_all` how many had any.
    Ages at use are [channel, uses, p50 in ns, p99 in ns] of each channel that goes by the link. `refused` counts
    messages by channel and sender, `refusals` packets by reason; `lateness_ms` is how late packets left in realtime,
    null if none did. Watched links and readings are under `watched` (`WatchList.report`).
    """
    packets = state.packets
    return encode_json(
        {
            "packets": {
                "offered": packets.offered,
                "delivered": packets.delivered,
                "dropped": packets.dropped,
                "in_flight": packets.in_flight,
                "refused": packets.refused,
            },
            "refused": refused,
            "refusals": state.refusals,
            **lines,
            "links_in_all": len(state.fabric.states),
            "clients": sorted(state.members),
            **watched,
            "absences": absences,
            "lateness_ms": lateness.as_json() if lateness.count else None,
            "capture": shell.capture,
            "recording": shell.recording,
            "disk_progress": shell.disk_progress,
            "radio_address": shell.radio_address,
        }
    )


def _links(state: HubState, watched: Collection[tuple[str, str]]) -> list[list[Any]]:
    """Return the lines of the reported links, by name."""
    fabric, now_ns = state.fabric, state.closed * state.tick_ns
    ages: dict[LinkKey, list[tuple[str, int, int, int]]] = {}
    for name in state.members:
        for age in state.ages.of(name, state.closed):
            key = age.source, name, name_of(fabric.profiles.find(age.source, name, age.channel))
            p50, p99 = (quantile(age.counts, share) * state.tick_ns for share in (0.5, 0.99))
            ages.setdefault(key, []).append((age.channel, sum(age.counts.values()), p50, p99))
    order = sorted(fabric.states.items(), key=lambda item: (-item[1].offered, item[0]))
    chosen = order[:LINKS_REPORTED_MAX] + [item for item in order[LINKS_REPORTED_MAX:] if item[0][:2] in watched]
    return [
        [
            *key[:2],
            *(its.offered, its.delivered, its.dropped, its.delay_ns // its.delivered if its.delivered else 0),
            *(key[2], fabric.queue_ns(key, now_ns), dict(sorted(its.causes.items())), ages.get(key, [])),
        ]
        for key, its in sorted(chosen, key=lambda item: item[0])
    ]
