"""What an unclean end left unfinished is made a valid capture: cut at its last whole chunk, completed from the journal.

The vHub writes its journal before its capture, so the journal has what the capture lacks: the ticks, frames, packets
and fates behind the last chunk, and what was in flight. What only a clock or a person knew is not in it: fields that
begin with `wall_` are 0 in completed rows (but outages, which commits tell), lines of the log that were not flushed
are gone.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Final

import msgspec

from foosim.capture.contents import CHUNK_BYTES
from foosim.capture.parts import whole_path
from foosim.capture.reader import About, deployment_of, read_about
from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.deployment.schema import Deployment
from foosim.protocol.channels import VHUB
from foosim.protocol.codec import decode_any
from foosim.protocol.messages import Epoch
from foosim.runtime.journal import JournalError, journal_files, lock_journal, read_journal
from foosim.vhub.network.packet import IN_FLIGHT
from foosim.vhub.recording.file import CaptureFile, Described, Line
from foosim.vhub.recording.unfinished import Journalled
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import Closing, HeadRecord, HubRecord, fold

UNCLEAN: Final = "unclean end"


@dataclass(frozen=True, slots=True)
class Recovered:
    """What a recovery found and did. `tick` is the last tick of the capture, -1 when it has none.

    `torn_bytes` were cut off behind the last whole chunk; `added_ticks` came from the journal; `problem` says why the
    journal could not be used, or not to its end.
    """

    path: Path
    tick: int
    torn_bytes: int
    added_ticks: int
    problem: str = ""

    @property
    def is_whole(self) -> bool:
        """Whether all that was recorded is there again: the journal had what the file lacked."""
        return not self.problem

    def __str__(self) -> str:
        added = f", {self.added_ticks} of them from its journal" if self.added_ticks else ""
        problem = f"; {self.problem}" if self.problem else ""
        return f"capture {self.path} of an unclean end is recovered: {self.tick + 1} ticks{added}{problem}"


def recover_capture(path: Path, journals: Path | None = None) -> Recovered | None:
    """Make an unfinished capture a valid one, in place; None when it has its end already.

    Of a capture that is split that is done to its last file, whichever is named. `journals` is the folder of the vHub's
    journal, which stays. Raises CaptureError when the file is no capture, when
    it is damaged before its end and no journal tells what would be cut off, or when the disk refuses; JournalError when
    a vHub still writes the journal.
    """
    about = read_about(whole_path(path))
    if about.finished:
        return None
    if journals is None or not journal_files(journals, VHUB):
        return _recover(about, [])
    lock = lock_journal(journals, VHUB)
    try:
        return _recover(about, read_journal(journals, VHUB))
    finally:
        os.close(lock)


def _recover(about: About, records: Iterable[bytes]) -> Recovered:
    deployment = deployment_of(about)
    described = Described(deployment, about.deployment_name, about.deployment_text, about.metadata)
    completion = _Completion(deployment, about.metadata.get("run", ""), records)
    file = CaptureFile(about.path, described, Journalled(completion.first_tick))
    try:
        had = file.done.tick
        completion.write(file)
        tick = file.done.tick
        recovered = Recovered(about.path, tick, file.torn_bytes, tick - had, completion.problem)
        file.write(Line("warning", str(recovered), max(0, tick)))
        end = {"reason": UNCLEAN, "torn_bytes": str(file.torn_bytes), "added_ticks": str(tick - had)}
        file.finish({**end, "problem": recovered.problem} if recovered.problem else end)
    except OSError as error:
        raise file.disk_error(error) from None
    finally:
        file.close()
    return recovered


class _Completion:
    """What a journal has for a capture. `first_tick` is where it starts, `problem` what is wrong with it."""

    def __init__(self, deployment: Deployment, run: str, records: Iterable[bytes]) -> None:
        self.problem = ""
        self.first_tick = limits.COUNTER_MAX
        self._deployment = deployment
        self._records = iter(records)
        self._head = b""
        try:
            self._head = next(self._records, b"")
            head = decode_any(HubRecord, self._head)
            if not isinstance(head, HeadRecord) or head.run != run:
                raise Malformed(f"it is not that of run {run}")
            self.first_tick = HubState.restore(deployment, head.state).closed + 1
        except (Malformed, JournalError, msgspec.DecodeError, KeyError, ValueError, TypeError) as error:
            is_there = self._head or isinstance(error, JournalError)
            self.problem = f"its journal cannot be used: {error}" if is_there else "there is no journal of it"

    def write(self, file: CaptureFile) -> None:
        """Write what the file lacks, and what was in flight at the end."""
        if not self.problem and self.first_tick > file.done.tick + 1:
            self.problem = f"its journal starts at tick {self.first_tick} only"
        if self.problem:
            return
        last: tuple[HubState, Closing] | None = None
        try:
            for last in fold(self._deployment, self._told_of(file)):
                if file.begins_next(last[1]):
                    file.go_on(last[1])
                file.write(last[1])
                if file.mcap.chunk_bytes > CHUNK_BYTES:
                    file.end_chunk()
        except (Malformed, JournalError) as error:
            self.problem = f"its journal cannot be used to its end: {error}"
        if last is None or file.done.in_flight or last[1].frame.tick < file.done.tick:
            return
        state, closing = last
        flights = state.in_flight()
        for flight in flights:
            flight.cause = IN_FLIGHT
        file.write(Closing(closing.frame, closing.digest, [], [], fates=flights, ages=state.ages.untold(state.closed)))

    def _told_of(self, file: CaptureFile) -> Iterator[bytes]:
        """Yield the records, and write the epochs among them that the file lacks."""
        for raw in chain([self._head], self._records):
            record = decode_any(HubRecord, raw)
            if isinstance(record, Epoch):
                file.write(record)
            yield raw
