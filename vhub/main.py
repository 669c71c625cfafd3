"""The process `foosim role vhub`: connects the vHub's core to both planes, the journal and the capture.

It is a client of the simulation plane and the router of the radio plane; only the core passes data from one to the
other. The core's records are in the journal before its messages are sent. A thread writes the capture.
"""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from msgspec.structs import replace

from foosim.capture.contents import check_new, ending_metadata, origin_metadata
from foosim.capture.left import Progress
from foosim.capture.parts import first_there
from foosim.common import limits, wall_clock
from foosim.common.addresses import LOOPBACK, Address, check_listen
from foosim.common.errors import BadValue, DeploymentError, Refused
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.access import access_to
from foosim.protocol.actions import Log, Publish
from foosim.protocol.channels import SUPERVISOR, VHUB, Plane
from foosim.protocol.codec import encode
from foosim.protocol.fingerprint import library_fingerprint
from foosim.protocol.messages import CAPTURE, Build, Epoch
from foosim.runtime.command import DONE, FAILED, REFUSED, PkiOption, new_app
from foosim.runtime.disk import Level
from foosim.runtime.health import ProgressOption
from foosim.runtime.journal import (
    Journal,
    JournalDamaged,
    JournalError,
    journal_files,
    read_journal,
    read_whole,
    remove_journal,
)
from foosim.runtime.process import Stop, die_with_parent, machine_start, new_boot
from foosim.runtime.roles.shell import Process, RoleShell, client_session
from foosim.runtime.transport.certificates import (
    Credentials,
    check_host,
)
from foosim.runtime.transport.session import Session
from foosim.runtime.transport.settings import Security
from foosim.vhub.core import HubCore
from foosim.vhub.links.summary import summaries
from foosim.vhub.links.summary_text import start_lines
from foosim.vhub.network.custom_models import check_link_models
from foosim.vhub.recording.disk_watch import RoomWatch
from foosim.vhub.recording.recorder import Recorder
from foosim.vhub.state.records import Closing, first_head
from foosim.vhub.state.resume import first_tick_of, last_tick_of, recall, was_captured
from foosim.world.components.view import ComponentError

SWITCH_S = 0.0001
"""The interpreter's switch interval. Python's default of 5 ms would delay ticks: at each call of the loop into journal
and network, several a tick, the capture's thread may take the interpreter's lock."""
FORGET_EVERY_NS = 1_000_000_000
LOOK_EVERY_NS = 50_000_000


@dataclass(frozen=True, slots=True)
class HubOptions:
    """The options of a vHub. `capture` None: the default path; `keeps` False: no capture is written."""

    capture: Path | None = None
    keeps: bool = True
    folder: Path | None = None
    progress: Path | None = None


def needs_record(message: Publish) -> bool:
    """Whether a message depends on the journal: all do but heartbeats and requests for missing messages."""
    return message.channel not in (channels.HEARTBEAT, channels.WANT)


class HubShell:
    """The vHub on its two sessions, until the run ends, the supervisor's timeout passes, or `stop` is called."""

    def __init__(
        self,
        process: Process,
        simulation: Session,
        open_radio: Callable[[Deployment], Session],
        options: HubOptions,
        credentials: Credentials | None = None,
    ) -> None:
        """`open_radio` opens the radio plane for the clients of the deployment, which the handshake delivers."""
        self.core = HubCore(new_boot(), library_fingerprint(), time.monotonic_ns(), machine=machine_start())
        self._options = options
        self._open_radio = open_radio
        self._inbox = process.inbox
        self._journal: Journal | None = None
        self._capture: Recorder | None = None
        self._room: RoomWatch | None = None
        self._forget_ns = self._look_ns = 0
        self._why_abandoned = ""
        """Why this vHub leaves before its run ends."""
        self._shell = RoleShell(process, VHUB, self.core, lambda now_ns: self.core.deadline_ns(), credentials)
        self._log: Final = self._shell.log
        self.role: Final = self._shell.role
        self.role.turn = self._turn
        self.role.took, self.role.stood = self.core.waits.took, self.core.rest
        self.role.lacking = lambda: self.core.lacking
        self.role.other = self._keep
        self.role.on_alive = self._on_alive
        self.role.on_log = self._on_log
        self.role.on_unwritten = self._on_unwritten
        self._wire = self._shell.connect(simulation, Plane.SIMULATION)
        self._wire.read(channels.VHUB_READS, channels.VHUB_WAITS)
        self._shell.watch_router(self._wire, SUPERVISOR)
        sys.setswitchinterval(SWITCH_S)

    def is_over(self) -> bool:
        """Whether the run has ended and the capture is closed, or this vHub leaves it."""
        core = self.core
        if core.ended is not None and core.state is None:
            return True
        if core.finished:
            return self._has_closed()
        return self._is_abandoned or bool(core.member.refusal or core.failure)

    def finish(self) -> int:
        """Close the capture and send the farewell; return the exit code.

        Every end but that of the run, the supervisor's timeout among them, leaves the journal and an unfinished
        capture, with which a restarted vHub resumes.
        """
        self.role.perform()
        if self.core.finished:
            self._close()
        else:
            if self._is_abandoned:
                self.core.actions.append(Log("error", self._why_abandoned))
                self.role.perform()
            self.leave()
        if self.core.member.refusal:
            return REFUSED
        if self.core.failure:
            self._log.error(self.core.failure)
            return FAILED
        if self._is_abandoned:
            return FAILED
        farewell = self.core.farewell()
        self._wire.put(farewell.channel, farewell.name, farewell.payload)
        return DONE

    def leave(self) -> None:
        """Leave capture and journal as a kill would, for a vHub that resumes the run."""
        if self._capture is not None:
            self._capture.leave()
            self._log.warning("leaves its capture %s unfinished: a restarted vHub can resume it", self._capture.path)
        if self._journal is not None:
            with suppress(JournalError):
                self._journal.close()

    def stop(self) -> None:
        """Have the vHub leave journal and capture as they are; a signal handler may call this."""
        self._why_abandoned = self._why_abandoned or "was ordered to stop during the run"

    def _has_closed(self) -> bool:
        """Begin to close the capture once its queue has everything; return whether it is closed.

        Until then heartbeats continue and report the progress.
        """
        capture, ended = self._capture, self.core.ended
        if capture is None:
            return True
        if not self.core.is_closing:
            assert ended is not None
            self.role.perform()
            self.core.is_closing = True
            capture.on_end = self._inbox.wake
            capture.begin_finish({**ending_metadata(ended), "ended": wall_clock.now_text()})
        return capture.has_ended

    @property
    def _is_abandoned(self) -> bool:
        return bool(self._why_abandoned) and self.core.ended is None

    # --- rounds of the loop ------------------------------------------------------------------------------------------

    def _turn(self, now_ns: int) -> None:
        core = self.core
        core.busy = self.role.busy
        self._shell.check(now_ns)
        if core.member.build is not None and self._journal is None:
            self._begin(core.member.build, now_ns)
        if core.orphan.is_over(core.deployment, now_ns) and core.ended is None and not self._why_abandoned:
            self._why_abandoned = "lost the supervisor, and it has not come back"
        sent_ns = now_ns
        while core.step(now_ns, sent_ns):
            self.role.perform()
            sent_ns = time.monotonic_ns()
        if now_ns >= self._look_ns and self._room is not None:
            self._look_ns = now_ns + LOOK_EVERY_NS
            self._look_at_room(self._room, now_ns)
        if now_ns >= self._forget_ns and self.role.journal is not None and core.state is not None:
            self._forget_ns = now_ns + FORGET_EVERY_NS
            try:
                self._turn_journal(core.state.closed)
            except JournalError as error:
                self.role.journal = None
                self._on_unwritten(error)

    def _look_at_room(self, room: RoomWatch, now_ns: int) -> None:
        """Log low disk space, and end the run while the rest of its records still fits."""
        core = self.core
        core.actions += [Log(level, text) for level, text in room.look(now_ns)]
        core.shell.recording, core.shell.disk_progress = room.recording, room.disk_progress(now_ns)
        if room.ends is not None and not core.lost and not core.finished:
            core.lose(*room.ends)

    def _wait_for_capture(self) -> None:
        """Send a heartbeat with what the vHub waits for, while the capture's full queue blocks the loop."""
        core = self.core
        if self._room is not None:
            core.shell.recording = self._room.recording
        self._wire.put(channels.HEARTBEAT, VHUB, encode(replace(core.heartbeat(), waiting_for=CAPTURE)))

    def _on_unwritten(self, error: JournalError) -> None:
        """End the run, since the journal has failed; messages that depend on it are withheld.

        Committed frames are still written to the capture.
        """
        core = self.core
        self.role.holds_back = lambda message: needs_record(message) and not core.finished
        core.lose("the journal", str(error))

    def _begin(self, build: Build, now_ns: int) -> None:
        """Declare presence after the supervisor's grant; open journal and capture, resume from them, listen.

        Presence comes first: the supervisor notices the end of a vHub that cannot open its files by its disconnect.
        """
        self._wire.declare_alive()
        core, deployment = self.core, self.core.deployment
        assert deployment is not None
        try:
            check_link_models(deployment.network, build.deployment, build.deployment_name)
        except DeploymentError as error:
            core.failure = "cannot judge packets without its link models"
            core.lose("the network", error.problems[0])
            return
        folder = (self._options.folder or Path(f"{build.run}.vhub")) / "journals"
        resumes = bool(journal_files(folder, VHUB))
        self._journal = self.role.journal = Journal(folder, VHUB)
        try:
            self._open_records(build, deployment, folder, now_ns)
        except Refused as error:
            if not resumes:
                raise
            if self._capture is not None:  # left unchanged: no log row about this
                self._capture.leave()
                self._capture = None
            core.failure = f"cannot continue: {error}"
            core.lose(VHUB, f"it cannot continue: {error}")
            return
        self._listen(deployment)

    def _open_records(self, build: Build, deployment: Deployment, folder: Path, now_ns: int) -> None:
        """Begin, or resume from the journal and capture that are there. Raises Refused where that is impossible."""
        core = self.core
        records, damaged = read_whole(read_journal(folder, VHUB))
        if damaged is not None:
            raise self._refusal(build, records, damaged)
        captured = self._open_capture(build, deployment, records)
        self._room = RoomWatch(self._capture, folder, deployment.capture.reserve_bytes)
        core.shell.recording = self._room.recording
        past = recall(deployment, build.run, records, captured, deployment.deadlines.client_back_ns)
        if self._capture is not None and past is not None and past.known is not None:
            self._capture.keep(past.known)  # with which the capture that was left ends
        core.begin(past, now_ns)
        for line in start_lines(summaries(deployment), build.deployment_name) if past is None else ():
            self._log.info(line)

    def _refusal(self, build: Build, records: list[bytes], damaged: JournalDamaged) -> Refused:
        """Return the refusal of a damaged journal, with the command that begins a new run."""
        from foosim.capture.start_frame import branch_command  # imports the capture reader: slow, and rarely needed

        before = was_captured(records)
        capture = self._options.capture if before is None else Path(before) if before else None
        what = f"{damaged}; tick {last_tick_of(records)} is the last before it"
        return Refused(f"{what}. {branch_command([build.deployment_name], capture)}")

    def _open_capture(self, build: Build, deployment: Deployment, records: list[bytes]) -> Progress | None:
        """Begin the capture, or resume that of the process before; return how far it is."""
        before, options = was_captured(records), self._options
        if not (options.keeps if before is None else before):
            return None
        path = Path(before) if before else options.capture
        path = path or Path("captures") / f"{deployment.world}-{wall_clock.now_stamp()}.mcap"
        self.core.shell.capture, self.core.capture_file = str(options.capture or path), str(path.absolute())
        if before is None:  # a vHub that is killed before the file exists finds here that the path is its own
            check_new(path)
            assert self._journal is not None
            self._journal.append(first_head(build, deployment, self.core.capture_file))
        metadata = {
            "run": build.run,
            "started": wall_clock.now_text(),
            "pace": build.pace,
            "fingerprint": library_fingerprint().hex(),
            **origin_metadata(build.origin),
        }
        described = build.deployment_name, build.deployment, metadata, self._log_text
        self._capture = Recorder(path, deployment, *described, first_tick_of(deployment, records))
        self._capture.while_waiting = self._wait_for_capture
        return self._capture.begun_with

    def _listen(self, deployment: Deployment) -> None:
        """Open the radio plane to the clients that the deployment declares."""
        session = self._open_radio(deployment)
        self.core.shell.radio_address = session.locator
        self._shell.listens(session.locator)
        radio = self._shell.connect(session, Plane.RADIO)
        radio.read(channels.VHUB_READS, channels.VHUB_WAITS)
        radio.watch_alive()
        radio.declare_alive()

    def _turn_journal(self, closed: int) -> None:
        """Between ticks, begin a new file when one is full; drop records that the capture has on disk."""
        journal = self._journal
        assert journal is not None
        if self.core.is_between_ticks and not self.core.actions:
            journal.rotate_if_full(self.core.head, closed)
        assert self.core.deployment is not None
        kept = closed - self.core.deployment.deadlines.client_back_ns // self.core.deployment.tick_ns
        if self._capture is not None and self._capture.state.level < Level.OUT:
            kept = min(kept, self._capture.synced_tick)
        journal.forget_before(kept)

    def _keep(self, action: Closing | Epoch) -> None:
        if self._capture is not None:
            self._write(self._capture.keep, action)

    def _on_log(self, log: Log) -> None:
        if self._capture is not None and not self.core.is_closing:
            closed = -1 if self.core.state is None else self.core.state.closed
            self._write(self._capture.log, log.level, log.text, closed + 1)

    def _write(self, put: Callable[..., None], *arguments: Any) -> None:
        """Hand something to the capture, which ends, and the run with it, where a body cannot be drawn."""
        try:
            put(*arguments)
        except ComponentError as error:
            assert self._capture is not None
            self._capture.leave()
            self._capture = None
            self.core.fail(error)

    def _log_text(self, level: str, text: str) -> None:
        self._log.log(logging.getLevelNamesMapping()[level.upper()], text)

    def _on_alive(self, plane: Plane, name: str, is_alive: bool) -> None:
        if plane is Plane.SIMULATION:
            self._shell.on_alive(name, is_alive)
        if is_alive:
            if name == SUPERVISOR:
                self.core.orphan.hear(True, time.monotonic_ns())
            return
        if plane is Plane.RADIO:
            self.core.client_gone(name, time.monotonic_ns())
        elif name == SUPERVISOR and self.core.ended is None:
            self.core.actions.append(Log("warning", "lost the supervisor: waits until it is back"))
            self.core.orphan.hear(False, time.monotonic_ns())

    def _close(self) -> None:
        """Finish the capture, then close the journal, and remove it after a run without failure."""
        assert self.core.ended is not None
        if self._capture is not None:
            self._capture.finish()
            self.core.shell.capture = str(first_there(Path(self.core.shell.capture)))
        if self._room is not None:
            self.core.shell.recording = self._room.recording
        if self._journal is not None:
            try:
                self._journal.close()
            except JournalError as error:
                self._log.error(str(error))
                return
            if not self.core.ended.failed:
                remove_journal(self._journal.folder, VHUB)


def run_vhub(connect: str, listen: str, insecure: bool, options: HubOptions, pki: Path | None = None) -> int:
    """Run the vHub until its run ends; return the exit code. Raises Refused when it cannot connect.

    `pki` is the folder with its certificate.
    """
    address = check_listen(listen, insecure, secured=pki is not None)
    stop = Stop()
    process = Process(VHUB, options.progress)
    with ExitStack() as opened:
        simulation, credentials = opened.enter_context(client_session(connect, VHUB, pki, stop))
        process.add(opened.enter_context(open_vhub(process, simulation, address, options, credentials)))
        stop.then(process.stop)
        return process.run()


@contextmanager
def open_vhub(
    process: Process,
    simulation: Session,
    address: Address,
    options: HubOptions,
    credentials: Credentials | None,
    on_radio: Callable[[Session], None] = lambda session: None,
) -> Iterator[HubShell]:
    """Open a vHub in a process; it listens for clients at `address` once the supervisor has admitted it.

    `on_radio` is called with the radio plane's session when it is open.
    """
    with ExitStack() as opened:

        def open_radio(deployment: Deployment) -> Session:
            session = opened.enter_context(_radio_session(address, credentials, deployment))
            check_host(credentials, session.locator)
            on_radio(session)
            return session

        yield HubShell(process, simulation, open_radio, options, credentials)


def _radio_session(address: Address, credentials: Credentials | None, deployment: Deployment) -> Session:
    """Listen as the router of the radio plane, which lets in the clients of a deployment."""
    security = None if credentials is None else Security(credentials, access_to(Plane.RADIO, deployment))
    return Session.router(str(address), limits.RADIO_MESSAGE_BYTES_MAX, security)


InsecureOption = Annotated[bool, typer.Option("--insecure", help="Listen for other machines without certificates.")]
CaptureOption = Annotated[Path | None, typer.Option(help="The capture to write; by default captures/WORLD-TIME.mcap.")]
NoCaptureOption = Annotated[bool, typer.Option("--no-capture", help="Write no capture.")]
RunFolderOption = Annotated[Path | None, typer.Option(help="Folder of the vHub's journal; by default RUN.vhub.")]


def read_options(
    capture: Path | None, no_capture: bool, run_folder: Path | None, progress: Path | None = None
) -> HubOptions:
    """Return the options of a vHub as a command has them. Raises BadValue for a contradiction."""
    if no_capture and capture is not None:
        raise BadValue("--no-capture and --capture exclude each other", str(capture))
    return HubOptions(capture, not no_capture, run_folder, progress)


app = new_app()


@app.command()
def vhub(  # a command's options
    connect: Annotated[str, typer.Option(help="Address of the supervisor: tcp/HOST:PORT, or run:NAME.")],
    listen: Annotated[str, typer.Option(help="Address for clients; port 0 is any free port.")] = LOOPBACK,
    insecure: InsecureOption = False,
    capture: CaptureOption = None,
    no_capture: NoCaptureOption = False,
    run_folder: RunFolderOption = None,
    pki: PkiOption = None,
    progress_file: ProgressOption = None,
) -> None:
    """Run the virtual hub of a run.

    Restarted with the same run folder and the same address, it resumes from its journal and its capture.

    Exit codes: 0 when the run ended and the capture is finished, 1 when the supervisor was lost for longer than the
    deployment's `deadlines.orphan` or another failure ended it, 3 when the supervisor refused it.
    """
    die_with_parent()
    options = read_options(capture, no_capture, run_folder, progress_file)
    raise typer.Exit(run_vhub(connect, listen, insecure, options, pki))
