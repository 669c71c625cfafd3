"""The supervisor's side of the handshake: hello, fetch, ready, heartbeat and farewell of nodes and the vHub.

It admits processes and keeps the roster; the core decides what follows from a process that is ready or reports.
"""

from __future__ import annotations

from collections.abc import Callable

from foosim.common.json_text import decode_json
from foosim.protocol import channels
from foosim.protocol.asset_transfer import piece_of
from foosim.protocol.messages import Build, Farewell, Fetch, Heartbeat, Hello, Ready, Recall
from foosim.supervisor.roster import IN_FLIGHT_NS, Process, refuse
from foosim.supervisor.state import RunState


class Handshake:
    """Takes what processes report of themselves."""

    def __init__(self, state: RunState, connection_closed: Callable[[str, int], None]) -> None:
        """`connection_closed` takes the name of a process that has ended, and the time."""
        self._state = state
        self._connection_closed = connection_closed

    def on_hello(self, hello: Hello, payload: bytes, now_ns: int) -> None:
        """Answer the hello of a process with a build or a refusal."""
        state = self._state
        if state.roster.has_silent_namesake(hello, now_ns):
            return  # the one before it may have ended; the hello is repeated
        reason = state.roster.reason_against(hello)
        if reason:
            state.actions += refuse(hello.role, hello.name, hello.boot, reason)
            return
        closes_capture = state.is_resuming and hello.role == "vhub"
        if state.end is not None and not closes_capture:
            state.publish_end()
            return
        known = state.roster.by_name.get(hello.name)
        if known is not None and known.in_doubt and known.boot != hello.boot:
            self._connection_closed(hello.name, now_ns)  # there is no doubt left
        state.roster.take(hello, now_ns)
        run, pace = state.settings, str(state.pacer.pace)
        deployment = run.deployment_name, run.deployment_text
        build = Build(hello.name, hello.boot, state.boot, run.run, *deployment, pace, run.origin)
        state.publish(channels.BUILD, hello.name, build)

    def on_fetch(self, fetch: Fetch, payload: bytes, now_ns: int) -> None:
        """Answer with the requested piece of a file that the deployment refers to."""
        self._state.publish(channels.PIECE, fetch.name, piece_of(self._state.deployment, fetch))

    def on_ready(self, ready: Ready, now_ns: int) -> Process | None:
        """Record that a process has built the world; return the process when the run continues with it."""
        state = self._state
        process = state.roster.by_name.get(ready.name)
        is_known = process is not None and process.boot == ready.boot and ready.name not in state.roster.stopped
        if process is None or not is_known or (process.lost and process.closed_ns):
            state.repeated += 1
            return None
        process.last_message_ns = now_ns
        process.lost = False  # it may have been silent for too long while it was building
        if state.end is not None:
            state.publish_end()
            return None
        reason = state.roster.note_ready(process, ready, state.frame.layout.digest)
        if reason:
            state.actions += refuse(process.role, process.name, process.boot, reason)
            return None
        return process

    def on_heartbeat(self, heartbeat: Heartbeat, now_ns: int) -> Process | None:
        """Note that a process lives, and its report; recall one of the run without a hello to this supervisor. Return
        the process."""
        state = self._state
        process = state.roster.by_name.get(heartbeat.sender)
        if process is None:
            if heartbeat.sender in state.roster.expected:
                state.found_living = True
                state.publish(channels.RECALL, channels.SUPERVISOR, Recall(state.boot))
            state.repeated += 1
            return None
        process.last_message_ns = now_ns
        if not process.lost and now_ns > process.closed_ns + IN_FLIGHT_NS:
            process.in_doubt, process.closed_ns = False, 0  # messages from before have come by then
        return process

    def keep_report(self, process: Process, heartbeat: Heartbeat) -> None:
        """Keep a heartbeat with a report."""
        process.heartbeat = heartbeat
        report = decode_json(heartbeat.report)
        self._state.roster.hear(process, report if isinstance(report, dict) else {})

    def on_farewell(self, farewell: Farewell, payload: bytes, now_ns: int) -> None:
        """The vHub's last message: its capture is closed."""
        process = self._state.roster.by_name.get(farewell.name)
        if process is not None:
            process.farewell = True
            report = decode_json(farewell.report)
            if isinstance(report, dict) and report:
                self._state.roster.hear(process, report)
