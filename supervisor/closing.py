"""When a run that has ended is over: once its vHub has closed the capture, which may take as long as it goes on.

The account of the capture in the vHub's heartbeats shows whether it does, and what the disk does while the file is
brought to it. One that stands still for `deadlines.close`, or whose vHub ends meanwhile, is cut off: an error, though
the run itself may have been in order. A vHub has ended when its connection has, and nothing is heard of it for
`deadlines.heartbeat` behind that. The shell looks into the file before that is said: a capture that has its end was
closed, whatever was heard of its vHub.
Neighbours: `core` asks, `status` has the result, `vhub.core` is the other side.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from foosim.protocol.channels import VHUB
from foosim.supervisor.roster import Process

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore


class Closing:
    """Waits for the vHub of one run that has ended."""

    def __init__(self, core: SupervisorCore) -> None:
        self.cut_off = ""
        """Why the capture has no end; empty where it has, or where there is none."""
        self._core = core
        self._account: Any = None
        self._moved_ns = 0

    def rest(self, stood_ns: int, now_ns: int) -> None:
        """The supervisor stood still for so long: it could not hear of any progress (`protocol.standstill`)."""
        self._moved_ns = min(now_ns, self._moved_ns + stood_ns)

    def is_over(self, now_ns: int) -> bool:
        """Whether nothing is waited for any more."""
        core = self._core
        hub, deadlines = core.roster.by_name.get(VHUB), core.deployment.deadlines
        if hub is None or hub.farewell:
            return True
        account = hub.report.get("recording"), hub.report.get("disk_progress")
        if account != self._account:
            self._account, self._moved_ns = account, now_ns
        silent_ns = now_ns - max(hub.gone_ns, hub.heard_ns)
        if hub.gone_ns and silent_ns > deadlines.heartbeat_ns and not hub.in_doubt:
            self._cut_off(hub, "its vHub ended before it was closed")
            return True
        if now_ns > max(self._moved_ns, core.watch.ended_ns) + deadlines.close_ns:
            wait_s = deadlines.close_ns / 1e9
            self._cut_off(hub, f"its vHub has made no progress in closing it for {wait_s:g} s (deadlines.close)")
            return True
        return False

    def _cut_off(self, hub: Process, why: str) -> None:
        if hub.report.get("capture"):
            self.cut_off = f"the capture is cut off: {why}"
