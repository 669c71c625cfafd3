"""WatchList details: the last drops of a link, explained, and a sensor's readings, as the vHub reports them.

Pure; explaining takes milliseconds a packet, so it is done in a thread, and once for each packet.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

import msgspec

from foosim.analysis.explain import Explained, explain_row
from foosim.capture.rows import ClientRow, PacketRow
from foosim.common.errors import Refused
from foosim.console.shown.links import drop_message
from foosim.console.shown.rule_text import RuleTexts
from foosim.console.shown.source import Link
from foosim.deployment.schema import Deployment
from foosim.vhub.network.custom_models import model_versions
from foosim.vhub.stages.explanation import Evidence
from foosim.world.frame import Frame

FRAMES_KEPT: Final = 64
"""Recent frames, for the obstacles between the ends of a dropped packet."""
FRAMES_APART_TICKS: Final = 20


class WatchList:
    """The last published details."""

    def __init__(self, deployment: Deployment) -> None:
        self._deployment = deployment
        self._frames: deque[Frame] = deque(maxlen=FRAMES_KEPT)
        self._last_drops: dict[Link, Any] = {}
        """The drops of each link as they were explained last."""
        self._rules = RuleTexts(deployment)
        self._last_rules: dict[Link, str] = {}
        """The last published rule of each link."""
        self._read: dict[str, int] = {}
        """The tick of the last published reading, by robot and channel."""

    def keep(self, frame: Frame) -> None:
        """Keep a frame that was shown, some ticks apart."""
        if self._frames and frame.tick < self._frames[-1].tick:
            self._frames.clear()
        if not self._frames or frame.tick >= self._frames[-1].tick + FRAMES_APART_TICKS:
            self._frames.append(frame)

    def readings(self, report: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the messages with the readings that came since."""
        messages = []
        for name, readings in report.get("readings", {}).items():
            last = self._read.get(name, -1)
            if readings and readings[-1][0] < last:
                last = -1  # time went back
            new = [reading for reading in readings if reading[0] > last]
            if new:
                self._read[name] = new[-1][0]
                robot, _, channel = name.partition("/")
                messages.append({"type": "readings", "robot": robot, "channel": channel, "points": new})
        return messages

    def drops(
        self, report: Mapping[str, Any], links: Iterable[Link], at_ns: int = 0, who: Mapping[int, str] | None = None
    ) -> list[dict[str, Any]]:
        """Return the messages about links whose drops or whose rule have changed by this time; `who` names the
        requester of the events of the network of a tick."""
        drops: dict[Link, Any] = {}
        rules: dict[Link, str] = {}
        messages = []
        for source, destination in links:
            link, rows = (source, destination), report.get("drops", {}).get(f"{source}>{destination}", [])
            events = [(tick, event) for tick, event in report.get("events", [])]
            drops[link], rules[link] = rows, self._rules.text(source, destination, at_ns, events, who)
            if self._last_drops.get(link) != rows or self._last_rules.get(link) != rules[link]:
                messages.append(self._message(report, source, destination, rules[link]))
        self._last_drops, self._last_rules = drops, rules
        return messages

    def _message(self, report: Mapping[str, Any], source: str, destination: str, rule: str) -> dict[str, Any]:
        frames = list(self._frames)  # more of them come meanwhile

        def frame(tick: int) -> Frame | None:
            return next((frame for frame in reversed(frames) if frame.tick <= tick), None)

        try:
            found = explain_drops(self._deployment, report, (source, destination), frame)
        except Refused:  # such as a model of links that is not installed here
            found = []
        return {
            "type": "watched",
            "link": [source, destination],
            "rule": rule,
            "drops": [drop_message(row.sent_ns // self._deployment.tick_ns, explained) for row, explained in found],
        }


def explain_drops(
    deployment: Deployment, report: Mapping[str, Any], link: Link, frame: Callable[[int], Frame | None]
) -> list[tuple[PacketRow, Explained]]:
    """Return the last drops of a link that the vHub reports under `watched`, oldest first, each explained.

    `frame(tick)` is the newest frame that was shown at or before a tick: None hides what each wall took of a signal.
    """
    rows = msgspec.convert(report["drops"].get(f"{link[0]}>{link[1]}", []), list[PacketRow])
    here = [ClientRow(0, name, "joins", 0, []) for name in report["here"]]
    events = [(tick, event) for tick, event in report["events"]]
    evidence = Evidence(deployment, model_versions(deployment.network), events, frame, lambda: here)
    return [(row, explain_row(evidence, row)) for row in rows]
