"""Parts of a run's status that several packages write or show."""

from __future__ import annotations

from typing import Final

CLOSING: Final = "closing"
"""State of a recording whose run has ended, and which is still written."""
UNFINISHED: Final = "unfinished"
"""State of a recording that no vHub has reported as closed: its file has no end, or was closed later."""
NOT_RECORDED: Final = {"state": "off", "problem": "", "offered": 0, "written": 0, "refused": 0, "bytes": 0}
NO_PACKETS: Final = {"offered": 0, "delivered": 0, "dropped": 0, "in_flight": 0, "refused": 0}
NO_COMMANDS: Final = {"clamped": 0, "refused": 0}
