"""What is marked on the time line of a running system out of its statuses: losses and returns, requests.

Pure.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foosim.launcher.display import recovery_text


class StatusMarks:
    """Remembers what has been marked."""

    def __init__(self) -> None:
        self._recoveries = 0
        self._requests: set[tuple[Any, ...]] = set()

    def new(self, status: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the marks that a status adds."""
        marks = []
        for entry in status["recoveries"][self._recoveries :]:
            if entry["outage_ms"] is None:
                break  # it is marked when it has ended
            marks.append({"tick": entry["tick"], "kind": "recovery", "text": recovery_text(entry)})
            self._recoveries += 1
        requests = [(asked["tick"], asked["verb"], asked["text"], asked["who"]) for asked in status["requests"]]
        for tick, verb, text, who in requests:
            if (tick, verb, text, who) not in self._requests:
                marks.append({"tick": tick, "kind": "request", "text": f"{who}: {text}"})
        self._requests = set(requests)
        return marks
