"""The process `foosim-vhub`: the vHub's core between both planes, its journal and the capture.

It is a client of the simulation plane and the router of the radio plane. Nothing bridges the two but the core. What the
core writes goes to the journal before it is spoken; the capture follows behind, from a thread of its own. Neighbours:
`core` decides, `capture_writer`, `protocol.journal`, `protocol.loop`.
"""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from foosim.protocol import channels, limits, wall
from foosim.protocol.actions import Say
from foosim.protocol.addresses import LOOPBACK, check_listen
from foosim.protocol.channels import SUPERVISOR, VHUB, Plane
from foosim.protocol.codec import encode
from foosim.protocol.command import DONE, FAILED, REFUSED, VersionOption, new_app, run_app
from foosim.protocol.deployment import Deployment
from foosim.protocol.errors import BadValue
from foosim.protocol.fingerprint import library_fingerprint
from foosim.protocol.inbox import Inbox
from foosim.protocol.journal import Journal, read_journal, remove_journal
from foosim.protocol.loop import Loop, Wire
from foosim.protocol.messages import Build, End
from foosim.protocol.orphan import Orphan
from foosim.protocol.process import Stop, die_with_parent, new_boot, start_log
from foosim.protocol.session import Session
from foosim.vhub.capture_file import origin_metadata
from foosim.vhub.capture_writer import CaptureWriter
from foosim.vhub.core import HubCore
from foosim.vhub.keeping import Keep, KeepEpoch
from foosim.vhub.records import Closing
from foosim.vhub.resume import Captured, first_tick_of, recall, was_captured

CONNECT_S = 60.0
FORGET_EVERY_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class HubOptions:
    """What a vHub is started with. `capture` None: where captures go by default; `keeps` False: none is written."""

    capture: Path | None = None
    keeps: bool = True
    folder: Path | None = None


class HubProcess:
    """The vHub on its two sessions, until the run ends, the supervisor is gone for too long, or `stop`."""

    def __init__(self, simulation: Session, radio: Session, inbox: Inbox, options: HubOptions) -> None:
        self.core = HubCore(new_boot(), library_fingerprint(), time.monotonic_ns())
        self.core.radio_address = radio.locator
        self._options = options
        self._inbox = inbox
        self._journal: Journal | None = None
        self._capture: CaptureWriter | None = None
        self._forget_ns = 0
        self._is_abandoned = False
        self._orphan = Orphan()
        self._why_abandoned = "the vHub was told to end"
        self._log: logging.Logger = start_log(VHUB)
        self._wire = Wire(simulation, Plane.SIMULATION, inbox, VHUB)
        self._radio = Wire(radio, Plane.RADIO, inbox, VHUB)
        self._loop = Loop(self.core, inbox, self._log, lambda now_ns: self.core.deadline_ns())
        self._loop.connect(self._wire)
        self._loop.connect(self._radio)
        self._loop.turn = self._turn
        self._loop.took = self.core.waits.took
        self._loop.lacking = lambda: self.core.lacking
        self._loop.other = self._keep
        self._loop.on_alive = self._on_alive
        self._loop.on_say = self._on_say
        self._wire.read(channels.VHUB_READS, channels.VHUB_WAITS)
        self._radio.read(channels.VHUB_READS)
        self._wire.watch_alive(SUPERVISOR)
        self._radio.watch_alive()
        self._radio.declare_alive()

    def run(self) -> int:
        """Take part until the end, close the capture, say farewell; return the exit code."""
        try:
            self._loop.run(self._is_over)
            self._loop.perform()
        finally:
            self._close()
        if self.core.member.refusal:
            return REFUSED
        if self.core.failure:
            self._log.error(self.core.failure)
            return FAILED
        farewell = self.core.farewell()
        self._wire.put(farewell.channel, farewell.name, farewell.payload)
        return FAILED if self._is_abandoned else DONE

    def stop(self) -> None:
        """Have `run` end what it has and return; a signal handler may call this."""
        self._is_abandoned = True
        self._inbox.wake()

    def _is_over(self) -> bool:
        core = self.core
        if core.state is None and (self._is_abandoned or core.ended is not None):
            return True
        return core.finished or bool(core.member.refusal or core.failure)

    # --- rounds of the loop ------------------------------------------------------------------------------------------

    def _turn(self, now_ns: int) -> None:
        core = self.core
        core.busy = self._loop.busy
        if core.member.build is not None and self._journal is None:
            self._begin(core.member.build, now_ns)
        if self._orphan.is_over(core.deployment, now_ns) and core.ended is None and not self._is_abandoned:
            self._why_abandoned = "lost the supervisor, and it has not come back"
            core.actions.append(Say("error", self._why_abandoned))
            self._is_abandoned = True
        if self._is_abandoned and core.ended is None and core.state is not None:
            end = End(core.state.closed + 1, self._why_abandoned, True)
            core.receive(channels.END, SUPERVISOR, encode(end), now_ns)
        core.advance(now_ns)
        if now_ns >= self._forget_ns and self._journal is not None and core.state is not None:
            self._forget_ns = now_ns + FORGET_EVERY_NS
            self._turn_journal(self._journal, core.state.closed)

    def _begin(self, build: Build, now_ns: int) -> None:
        """Be present, since the supervisor has let us in, open the journal and the capture, and go on from them.

        Present first: whoever cannot open them ends, and the supervisor knows by the presence that it did.
        """
        self._wire.declare_alive()
        core, deployment = self.core, self.core.deployment
        assert deployment is not None
        folder = (self._options.folder or Path(f"{build.run}.vhub")) / "journals"
        self._journal = self._loop.journal = Journal(folder, VHUB)
        records = list(read_journal(folder, VHUB))
        captured = self._open_capture(build, deployment, records)
        past = recall(deployment, build.run, records, captured, deployment.deadlines.client_back_ns)
        if self._capture is not None and past is not None and past.known is not None:
            self._capture.keep(Closing(past.known, past.known.digest, [], []))  # which it has: it goes on from there
        core.begin(past, now_ns)

    def _open_capture(self, build: Build, deployment: Deployment, records: list[bytes]) -> Captured | None:
        """Begin the capture, or go on with the one that the vHub before has begun; return how far it is."""
        before, options = was_captured(records), self._options
        if not (options.keeps if before is None else before):
            return None
        path = Path(before) if before else options.capture
        path = path or Path("captures") / f"{deployment.world}-{wall.now_stamp()}.mcap"
        metadata = {
            "run": build.run,
            "started": wall.now_text(),
            "pace": build.pace,
            "fingerprint": library_fingerprint().hex(),
            **origin_metadata(build.origin),
        }
        described = build.deployment_name, build.deployment, metadata, self._say, first_tick_of(records)
        self._capture = CaptureWriter(path, deployment, *described)
        self.core.capture = str(path)
        return self._capture.begun_with

    def _turn_journal(self, journal: Journal, closed: int) -> None:
        """Between ticks, begin a new file when one is full; what the capture has on the disk may go."""
        if self.core.is_between_ticks and not self.core.actions:
            journal.rotate_if_full(self.core.head, closed)
        assert self.core.deployment is not None
        kept = closed - self.core.deployment.deadlines.client_back_ns // self.core.deployment.tick_ns
        journal.forget_before(kept if self._capture is None else min(kept, self._capture.synced_tick))

    def _keep(self, action: Keep | KeepEpoch) -> None:
        if self._capture is not None:
            self._capture.keep(action.closing if isinstance(action, Keep) else action.epoch)

    def _on_say(self, say: Say) -> None:
        if self._capture is not None:
            self._capture.log(say.level, say.text, self.core.statistics().closed + 1)

    def _say(self, level: str, text: str) -> None:
        self._log.log(logging.getLevelNamesMapping()[level.upper()], text)

    def _on_alive(self, plane: Plane, name: str, is_alive: bool) -> None:
        if is_alive:
            if name == SUPERVISOR:
                self._orphan.hear(True, time.monotonic_ns())
            return
        if plane is Plane.RADIO:
            self.core.client_gone(name, time.monotonic_ns())
        elif name == SUPERVISOR and self.core.ended is None:
            self.core.actions.append(Say("warning", "lost the supervisor: holds until it is back"))
            self._orphan.hear(False, time.monotonic_ns())

    def _close(self) -> None:
        """Finish the capture; only then is the journal done with."""
        if self._capture is not None:
            end = self.core.ended
            reason = "not ended in order" if end is None else end.reason
            self._capture.finish({"reason": reason, "ended": wall.now_text()})
        if self._journal is not None:
            self._journal.close()
            if self.core.finished and self.core.ended is not None and not self.core.ended.failed:
                remove_journal(self._journal.folder, VHUB)


def run_vhub(connect: str, listen: str, insecure: bool, options: HubOptions) -> int:
    """Run the vHub until its run ends; return the exit code. Raises Refused when there is nobody to connect to."""
    address = check_listen(listen, insecure)
    inbox = Inbox(limits.INBOX_MESSAGES_MAX)
    stop = Stop()
    with (
        Session.router(str(address), limits.RADIO_MESSAGE_BYTES_MAX) as radio,
        Session.client(connect, CONNECT_S, give_up=stop.is_set) as simulation,
    ):
        hub = HubProcess(simulation, radio, inbox, options)
        stop.then(hub.stop)
        return hub.run()


app = new_app()


@app.command()
def vhub(
    connect: Annotated[str, typer.Option(help="Address of the supervisor: tcp/HOST:PORT.")],
    listen: Annotated[str, typer.Option(help="Where clients find it; port 0 lets the system choose.")] = LOOPBACK,
    insecure: Annotated[bool, typer.Option("--insecure", help="Listen where other machines reach it.")] = False,
    capture: Annotated[Path | None, typer.Option(help="What to write; by default captures/WORLD-TIME.mcap.")] = None,
    no_capture: Annotated[bool, typer.Option("--no-capture", help="Write no capture.")] = False,
    run_folder: Annotated[Path | None, typer.Option(help="Where its journal goes; by default RUN.vhub.")] = None,
    version: VersionOption = False,
) -> None:
    """Take part in a run as its virtual hub.

    It exits with 0 when the run ended and the capture is finished, with 1 when the supervisor was lost for longer than
    the deployment's `deadlines.orphan`, and with 3 when the supervisor would not have it.
    """
    die_with_parent()
    if no_capture and capture is not None:
        raise BadValue("--no-capture and --capture exclude each other", str(capture))
    raise typer.Exit(run_vhub(connect, listen, insecure, HubOptions(capture, not no_capture, run_folder)))


def main() -> None:
    """Entry of `foosim-vhub`."""
    run_app(app, "foosim-vhub")


if __name__ == "__main__":
    main()
