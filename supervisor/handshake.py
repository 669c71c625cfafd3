"""The supervisor's side of the handshake: hello, ready, heartbeat and farewell of nodes and the vHub.

Neighbours: `roster` checks and keeps who is here, `recovery` takes nodes in that come to a running world, `core` opens
the first epoch; `protocol.member` is the other side.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.protocol import channels
from foosim.protocol.actions import Publish, Say
from foosim.protocol.codec import encode
from foosim.protocol.fetching import piece_of
from foosim.protocol.json_text import decode_json
from foosim.protocol.messages import Build, Farewell, Fetch, Heartbeat, Hello, Ready, Recall, Refusal
from foosim.supervisor.absence import SAID_NS

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore


class Handshake:
    """Takes what processes say of themselves."""

    def __init__(self, core: SupervisorCore) -> None:
        self._core = core

    def hello(self, hello: Hello, payload: bytes, now_ns: int) -> None:
        """Answer who asks to take part: with what to build, or with a refusal."""
        core = self._core
        if core.roster.has_silent_namesake(hello, now_ns):
            return  # the one before it may have ended; it says hello again
        reason = core.roster.reason_against(hello)
        if reason:
            self.refuse(hello.role, hello.name, hello.boot, reason)
            return
        closes = core.take_over is not None and hello.role == "vhub"  # its capture, where the run has ended
        if not closes and self._has_ended():
            return
        known = core.roster.by_name.get(hello.name)
        if known is not None and known.in_doubt and known.boot != hello.boot:
            core.process_gone(hello.name, now_ns)  # there is no doubt left
        core.roster.take(hello, now_ns)
        run, pace, added = core.settings, str(core.pacer.pace), core.added_to(core.frame.layout)
        deployment = run.deployment_name, run.deployment_text
        build = Build(hello.name, hello.boot, core.boot, run.run, *deployment, pace, added, run.origin)
        core.actions.append(Publish(channels.BUILD, hello.name, encode(build)))

    def fetch(self, fetch: Fetch, payload: bytes, now_ns: int) -> None:
        """Answer who lacks a file that the deployment refers to with the piece of it that is asked for."""
        piece = piece_of(self._core.deployment, fetch)
        self._core.actions.append(Publish(channels.PIECE, fetch.name, encode(piece)))

    def _has_ended(self) -> bool:
        """Whether the run is over; say it again to who comes late."""
        core = self._core
        if core.end is not None:
            core.actions.append(Publish(channels.END, channels.SUPERVISOR, encode(core.end)))
        return core.end is not None

    def refuse(self, role: str, name: str, boot: str, reason: str) -> None:
        """Tell a process that it does not take part, and why."""
        self._core.actions.append(Say("warning", f"{role} {name} refused: {reason}"))
        self._core.actions.append(Publish(channels.REFUSAL, name, encode(Refusal(name, boot, reason))))

    def ready(self, ready: Ready, payload: bytes, now_ns: int) -> None:
        """A layout is built: the run may begin, a node may join, a change of the world may be ordered."""
        core = self._core
        process = core.roster.by_name.get(ready.name)
        is_known = process is not None and process.boot == ready.boot and ready.name not in core.roster.stopped
        if process is None or not is_known or (process.lost and process.gone_ns):
            core.count_repeat()
            return
        process.heard_ns = now_ns
        process.lost = False  # building, it may have been silent for too long
        if self._has_ended():
            return
        reason = core.roster.note_ready(process, ready)
        if reason:
            self.refuse(process.role, process.name, process.boot, reason)
            return
        if process.name == channels.VHUB:
            core.viewing.hub_ready()
        if core.take_over is not None:
            core.take_over.wake(now_ns)
        elif not core.is_open:
            core.start_if_ready(now_ns)
        elif process.name == channels.VHUB:
            core.absence.ready(now_ns)
        elif process.name in core.members:
            if ready.layout == core.frame.layout.digest:
                core.say_epoch()
        elif ready.layout == core.frame.layout.digest:
            core.recovery.join(process, now_ns)
        else:
            core.prepare(core.frame.layout)  # the world has changed since the build was said
        core.requests.layout_ready(now_ns)

    def heartbeat(self, heartbeat: Heartbeat, payload: bytes, now_ns: int) -> None:
        """Note that a process lives, and tell it again what it has missed."""
        core = self._core
        process = core.roster.by_name.get(heartbeat.sender)
        if process is None:
            if heartbeat.sender in core.roster.expected:
                core.beginning.found_living = True
                core.actions.append(Publish(channels.RECALL, channels.SUPERVISOR, encode(Recall(core.boot))))
            core.count_repeat()
            return
        process.heard_ns = now_ns
        if not process.lost and now_ns > process.gone_ns + SAID_NS:
            process.in_doubt, process.gone_ns = False, 0  # it is here: what was said before it went has come by then
        if process.lost and process.name != channels.VHUB:
            core.recovery.hear(process, now_ns)
        if not heartbeat.report:
            core.watch.told(heartbeat)
            return
        process.heartbeat = heartbeat
        report = decode_json(heartbeat.report)
        core.roster.hear(process, report if isinstance(report, dict) else {})
        core.absence.players.hear(process)
        if process.lost and process.name == channels.VHUB:
            core.absence.hear(now_ns)
        if core.end is not None:
            core.actions.append(Publish(channels.END, channels.SUPERVISOR, encode(core.end)))
        elif core.is_open and heartbeat.epoch < core.epoch:
            core.say_epoch()
            if heartbeat.sender == channels.VHUB:
                core.actions.append(Publish(channels.TEMPO, channels.SUPERVISOR, core.tempo()))
        if heartbeat.lost and heartbeat.sender == channels.VHUB and core.end is None:
            core.finish(heartbeat.lost, failed=True)

    def farewell(self, farewell: Farewell, payload: bytes, now_ns: int) -> None:
        """The vHub's last word: its capture is closed."""
        process = self._core.roster.by_name.get(farewell.name)
        if process is not None:
            process.farewell = True
            report = decode_json(farewell.report)
            if isinstance(report, dict) and report:
                self._core.roster.hear(process, report)
