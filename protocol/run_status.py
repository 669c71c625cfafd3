"""Parts of a run's status that several packages write or show."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

CLOSING: Final = "closing"
"""State of a recording whose run has ended, and which is still written."""
UNFINISHED: Final = "unfinished"
"""State of a recording that no vHub has reported as closed: its file has no end, or was closed later."""
NOT_RECORDED: Final = {"state": "off", "problem": "", "offered": 0, "written": 0, "refused": 0, "bytes": 0}
NO_PACKETS: Final = {"offered": 0, "delivered": 0, "dropped": 0, "in_flight": 0, "refused": 0}
NO_COMMANDS: Final = {"clamped": 0, "refused": 0}
REPORTED: Final = "players."
"""Before the names of metrics that players and clients report."""
REPORTED_SHOWN_MAX: Final = 8


def reported_text(metrics: Mapping[str, float | None]) -> list[str]:
    """Return `reported: hand.trips 3, hand.way 12.5` as the only line, of the first metrics by name; none without
    any."""
    found = [f"{name.removeprefix(REPORTED)} {metrics[name]:g}" for name in metrics if name.startswith(REPORTED)]
    more = [f"and {len(found) - REPORTED_SHOWN_MAX} more"] if len(found) > REPORTED_SHOWN_MAX else []
    return [f"reported: {', '.join([*found[:REPORTED_SHOWN_MAX], *more])}"] if found else []
