"""The process `foosim run`: the supervisor's core as the router of the simulation plane.

It holds the run's folder: the run file has the run's addresses, the journal its decisions, and `result.json` at the end
its result. Started again in the folder of an unfinished run, it listens at the same addresses and continues from the
journal.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import msgspec

from foosim.capture.parts import is_complete
from foosim.common import wall_clock
from foosim.common.addresses import Address
from foosim.common.errors import Malformed, Refused
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.access import access_to
from foosim.protocol.channels import SUPERVISOR, VHUB, Plane
from foosim.protocol.fingerprint import library_fingerprint
from foosim.runtime.command import DONE, FAILED, REFUSED
from foosim.runtime.disk import JournalRoom
from foosim.runtime.journal import Journal, JournalError, journal_files
from foosim.runtime.process import clock_name, new_boot
from foosim.runtime.roles.shell import Process, RoleShell
from foosim.runtime.run_folder import RESULT_FILE, RunFolder, RunInfo
from foosim.runtime.transport.certificates import check_host, load_credentials, warn_of_end
from foosim.runtime.transport.session import Session
from foosim.runtime.transport.settings import Security
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.records import History, fold
from foosim.supervisor.settings import RunSettings


class SupervisorShell:
    """The supervisor on its session, until the run has ended."""

    def __init__(
        self,
        process: Process,
        settings: RunSettings,
        pki: Path | None,
        folder: RunFolder,
        session: Session,
        journal: Journal,
        history: History | None,
    ) -> None:
        start = time.monotonic_ns(), new_boot(), clock_name()
        self.core = SupervisorCore(settings, library_fingerprint(), *start, history)
        self.session: Final = session
        self._folder = folder
        self._end_requested = False
        self._info = RunInfo(
            folder.name,
            self.core.state.deployment.world,
            str(Path(settings.deployment_name).absolute()),
            os.getpid(),
            wall_clock.now_text(),
            session.locator,
            pki="" if pki is None else str(pki.absolute()),
        )
        known = folder.info()
        if history is not None and known is not None:
            self._info = msgspec.structs.replace(self._info, started=known.started, radio=known.radio)
        self._shell = RoleShell(process, SUPERVISOR, self.core, self.core.deadline_ns)
        self._shell.listens(session.locator)
        self.role: Final = self._shell.role
        self.log: Final = self._shell.log
        self._journal = self.role.journal = journal
        self._turned_tick = 0
        self.role.turn = self._turn
        self.role.on_unwritten = self._on_unwritten
        reserve = self.core.state.deployment.capture.reserve_bytes
        self._room = JournalRoom(folder.journals, reserve)
        self.role.took = self.core.progress.took
        self.role.stood = self.core.on_standstill
        self.role.lacking = lambda: self.core.lacking
        self.role.on_alive = self._on_alive
        wire = self._shell.connect(session, Plane.SIMULATION)
        wire.read(channels.SUPERVISOR_READS, channels.SUPERVISOR_WAITS)
        wire.watch_alive()
        wire.declare_alive()
        self._folder.write_info(self._info)
        listens = f"run {self._info.run} listens at {self._info.simulation}"
        self.core.state.log("info", f"{listens}; its folder is {folder.path}")

    def is_over(self) -> bool:
        """Whether the run has ended and the vHub has closed the capture."""
        core = self.core
        if core.state.end is not None and core.failover.waits_for_hub(time.monotonic_ns()) and self._is_captured():
            return True  # the vHub was done before this start
        return core.state.finished

    def finish(self) -> int:
        """Write the result of the run; return the exit code.

        Nothing is written for a resumed run that could not be resumed, so that it can be resumed again.
        """
        self.role.perform()
        if self.core.state.abandoned:
            return REFUSED
        if self.core.state.cut_off and self._has_capture():
            self.core.state.cut_off = ""
        result = self.core.result()
        self._folder.write_result(result)
        return FAILED if result["failed"] else DONE

    def leave(self) -> None:
        """Leave the journal as it is: a restarted supervisor resumes from it."""

    def _has_capture(self) -> bool:
        """Whether the capture's file is marked as closed. A file on another machine cannot be checked from here."""
        capture = self._folder.capture()
        return capture is not None and is_complete(capture)

    def _is_captured(self) -> bool:
        """Whether no capture is written, or its file is closed: no vHub has anything left to do."""
        launch = self._folder.launch()
        return launch is not None and (not launch.capture or self._has_capture())

    def stop(self) -> None:
        """End the run in order, as the command `down` does; a signal handler may call this."""
        self._end_requested = True

    def _turn(self, now_ns: int) -> None:
        self.core.state.busy = self.role.busy
        self._shell.check(now_ns)
        if self._end_requested:
            self._end_requested = False
            self.core.stop()
        if not self.core.actions and self.role.journal is not None:
            self._turn_journal(now_ns)
        self.core.advance(now_ns)
        self._note_radio()

    def _turn_journal(self, now_ns: int) -> None:
        """Begin a new file when one is full; the one before it stays until the next turn, when this one is synced."""
        tick = self.core.state.frame.tick
        warning, why = self._room.look(now_ns)
        if warning:
            self.core.state.log("warning", warning)
        if why:
            self.core.fail(f"lost room for the journal: {why}")
        try:
            if self._journal.rotate_if_full(self.core.state.checkpoint, tick):
                self._journal.forget_before(self._turned_tick)
                self._turned_tick = tick
        except JournalError as error:
            self.role.journal = None
            self._on_unwritten(error)

    def _on_unwritten(self, error: JournalError) -> None:
        """The journal has failed: the run ends. Frames committed by then are published, so the capture has them."""
        self.core.fail(f"lost the journal: {error}")

    def _note_radio(self) -> None:
        """Write the address of the vHub for clients into the run file, once the vHub reports it."""
        hub = self.core.state.roster.by_name.get(VHUB)
        address = "" if hub is None else hub.report.get("radio_address", "")
        if isinstance(address, str) and address not in ("", self._info.radio):
            self._info = msgspec.structs.replace(self._info, radio=address)
            self._folder.write_info(self._info)
            self.core.state.log("info", f"clients find the vHub at {address}")

    def _on_alive(self, plane: Plane, name: str, is_alive: bool) -> None:
        if plane is Plane.SIMULATION and not is_alive:
            self.core.connection_closed(name, time.monotonic_ns())


@contextmanager
def open_supervisor(
    process: Process,
    settings: RunSettings,
    address: Address,
    pki: Path | None,
    folder: RunFolder,
    read_records: Callable[[], list[bytes]],
) -> Iterator[SupervisorShell]:
    """Open the journal and the session of a run's supervisor, in a process.

    `read_records` returns the records of its journal, and raises Refused when it is damaged. The journal stays: after a
    run without failure the caller removes it. Raises Refused before the run has begun.
    """
    folder.hold()
    deployment = settings.load_deployment()
    history = _history(settings, deployment, folder, read_records)
    known = folder.info()
    listen = str(address) if history is None or known is None else known.simulation
    credentials = load_credentials(pki, SUPERVISOR)
    security = None if credentials is None else Security(credentials, access_to(Plane.SIMULATION, deployment))
    with Journal(folder.journals, SUPERVISOR) as journal, Session.router(listen, security=security) as session:
        check_host(credentials, session.locator)
        supervisor = SupervisorShell(process, settings, pki, folder, session, journal, history)
        warn_of_end(credentials, supervisor.log)
        yield supervisor


def _history(
    settings: RunSettings, deployment: Deployment, folder: RunFolder, read_records: Callable[[], list[bytes]]
) -> History | None:
    """Return the history in the run folder's journal; None for a new run. Raises Refused when it is another's."""
    if folder.result() is not None:
        raise Refused(f"run {folder.name} has ended, its result is {folder.path / RESULT_FILE}")
    if not any(path.stat().st_size for path in journal_files(folder.journals, SUPERVISOR)):
        return None  # the one before may have ended when it had only made the file
    try:
        history = fold(deployment, read_records())
    except (JournalError, Malformed) as error:
        raise Refused(f"run {folder.name} cannot be resumed: {error}") from None
    if history.kept.run.deployment != settings.deployment_text:
        raise Refused(f"run {folder.name} was started with another deployment than {settings.deployment_name} is now")
    return history
