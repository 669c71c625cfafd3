"""Makes a new, valid capture from an unfinished one: its valid chunks, and the records of the vHub's journal.

The vHub writes its journal before its capture, so the journal has what the capture lacks: the ticks, frames, packets
and fates after the last chunk, and the packets in flight. It lacks what only a clock or a person knew: fields that
begin with `wall_` are 0 in completed rows (but outages, which commits report), lines of the log that were not flushed
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

from foosim.capture.contents import CUT, CUT_CHAIN, CUT_DIGEST, CUT_TICK, check_new
from foosim.capture.file import CaptureFile, Line, described_as, one_file
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.parts import files_from, whole_path
from foosim.capture.reader import TICK_MARKS, About, Scan, deployment_of, read_about
from foosim.capture.rows import TICK
from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.units import format_ns
from foosim.deployment.schema import Deployment
from foosim.protocol.channels import VHUB
from foosim.protocol.codec import decode_any
from foosim.protocol.messages import Epoch
from foosim.runtime.disk import room_on_disk, size_like
from foosim.runtime.journal import JournalError, journal_files, lock_journal, read_journal
from foosim.vhub.network.packet import IN_FLIGHT
from foosim.vhub.recording.rows_of_closing import tick_of
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import Closing, Fold, HeadRecord, HubRecord

UNCLEAN: Final = "unclean end"


@dataclass(frozen=True, slots=True)
class Recovered:
    """The result of a recovery: `path` from `source`. `tick` is the last tick, -1 when there is none.

    `torn_bytes` follow the last whole chunk of `source`; `added_ticks` came from the journal; `problem` is what
    both `source` and its journal lack.
    """

    source: Path
    path: Path
    tick: int
    torn_bytes: int
    added_ticks: int
    problem: str = ""

    @property
    def is_whole(self) -> bool:
        """Whether nothing recorded is missing: the journal had the rows that the file lacked."""
        return not self.problem

    def __str__(self) -> str:
        added = f", {self.added_ticks} of them from its journal" if self.added_ticks else ""
        problem = f"; {self.problem}" if self.problem else ""
        ticks = f"{self.tick + 1} ticks{added}{problem}"
        return f"capture {self.source} of an unclean end is recovered to {self.path}: {ticks}"


def recovered_path(path: Path) -> Path:
    """Return the default path of a recovered capture: `run.recovered.mcap` for `run.mcap`."""
    return path.with_name(f"{path.stem}.recovered{path.suffix}")


def recover_capture(path: Path, journals: Path | None = None, out: Path | None = None) -> Recovered | None:
    """Make a valid capture of an unfinished one, in a new file; None when it is finished.

    Of a capture that is split all files become one, whichever is named. `journals` is the folder of the vHub's journal,
    which stays, as the capture does. Raises CaptureError when the file is no capture, when `out` (None:
    `recovered_path`) is there or cannot be written; JournalError when a vHub still writes the journal.
    """
    about = read_about(whole_path(path))
    if about.finished:
        return None
    out = recovered_path(about.path) if out is None else out
    if journals is None or not journal_files(journals, VHUB):
        return _recover(about, [], out)
    lock = lock_journal(journals, VHUB)
    try:
        return _recover(about, read_journal(journals, VHUB), out)
    finally:
        os.close(lock)


def check_finished(path: Path) -> None:
    """Read a finished capture to its end. Raises CaptureError for damage, with the command that cuts out what precedes
    it."""
    about = read_about(whole_path(path))
    scan, tick = Scan(about.path), -1
    try:
        for message in scan.messages(frozenset({TICK})):
            tick = scan.decode(TICK_MARKS, message).tick
    except CaptureError as error:
        problem = f"capture {about.path} is finished and damaged; it is left as it is: {error}"
        if tick < 2:
            raise CaptureError(problem) from None
        time = format_ns((tick - 1) * deployment_of(about).tick_ns).replace(" ", "")
        part = f"foosim capture cut {about.path} --to {time} -o PART"
        raise CaptureError(f"{problem}\n  what is before the damage: {part}") from None


def _recover(about: About, records: Iterable[bytes], out: Path) -> Recovered:
    """Write the new file: the rows of the old one, then those of the journal beyond them."""
    check_new(out)
    deployment = deployment_of(about)
    cut = {key: about.metadata[key] for key in (CUT, CUT_TICK, CUT_DIGEST, CUT_CHAIN) if key in about.metadata}
    with one_file(out, described_as(about, cut)) as file:
        needed = sum(left.stat().st_size for left in files_from(about.path))
        room = room_on_disk(out.parent, deployment.capture.reserve_bytes)
        if room.left - needed < room.reserve:
            raise CaptureError(f"{out}: needs {size_like(needed, room.reserve)} or more, there are {room}")
        _, torn_bytes, damage = file.take(about.path)
        had = file.done.tick
        completion = _Completion(deployment, about.metadata.get("run", ""), records)
        completion.write(file)
        problem = "; ".join(filter(None, (damage, completion.problem))) if completion.problem else ""
        found = Recovered(about.path, out, file.done.tick, torn_bytes, file.done.tick - had, problem)
        file.write(Line("warning", str(found), max(0, found.tick)))
        end = {"reason": UNCLEAN, "torn_bytes": str(torn_bytes), "added_ticks": str(found.added_ticks)}
        file.finish({**end, "problem": problem} if problem else end)
    return found


class _Completion:
    """A journal's part of a capture. `first_tick` is its first tick, `problem` why it cannot be used."""

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
        """Write the rows that the file lacks, and the packets in flight at the end."""
        if not self.problem and self.first_tick > file.done.tick + 1:
            self.problem = f"its journal starts at tick {self.first_tick} only"
        if self.problem:
            return
        last: tuple[HubState, Closing] | None = None
        try:
            fold = Fold(self._deployment, self._folded(file))
            for folded in fold:
                last = fold.state, folded.closing
                file.write(tick_of(folded.closing, self._deployment))
                file.end_large_chunk()
        except (Malformed, JournalError) as error:
            self.problem = f"its journal cannot be used to its end: {error}"
        if last is not None:
            state, closing = last
            flights = state.in_flight()
            for flight in flights:
                flight.cause = IN_FLIGHT
            ages, metrics = state.ages.unreported(state.closed), state.metrics.unreported(state.closed)
            end = Closing(closing.frame, closing.digest, [], [], fates=flights, ages=ages, metrics=metrics)
            file.write(tick_of(end, self._deployment))

    def _folded(self, file: CaptureFile) -> Iterator[bytes]:
        """Yield the records, and write the epochs among them that the file lacks."""
        for raw in chain([self._head], self._records):
            record = decode_any(HubRecord, raw)
            if isinstance(record, Epoch):
                file.write(record)
            yield raw
