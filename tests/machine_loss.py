"""Loss of a rehearsal's machine with the journal records that had not reached its disk."""

from __future__ import annotations

from foosim.protocol import channels
from foosim.protocol.codec import decode_any
from foosim.simulation.journals import HubJournal
from foosim.simulation.system import HUB_BACK_NS, System
from foosim.supervisor.records import CommitRecord, Record
from foosim.vhub.state.records import HubRecord, TickRecord


def lose_hub(system: System, records: int, back_ns: int = HUB_BACK_NS) -> None:
    """Lose the vHub's machine with the last records of its journal; the vHub is restarted after a delay."""
    if channels.VHUB not in system.processes or system.hub.ended is not None:
        return
    _lose_last(system.hub_journal, records)
    system.hub_journal.ending = None
    system.kill_hub("now", back_ns)


def lose_supervisor(system: System, records: int) -> None:
    """Lose the supervisor's machine with the last records of its journal, all but those up to the first commit."""
    journal = system.journal
    begun = next(at for at, raw in enumerate(journal) if isinstance(decode_any(Record, raw), CommitRecord))
    del journal[max(begun + 1, len(journal) - records) :]
    system.kill(channels.SUPERVISOR)


def _lose_last(journal: HubJournal, count: int) -> None:
    """Lose the last records of the vHub's journal, but for one tick; another machine holds it from now on."""
    found = [decode_any(HubRecord, raw) for raw in journal.records]
    ticks = [at for at, record in enumerate(found) if isinstance(record, TickRecord)]
    if not ticks:
        return
    left = max(ticks[0] + 1, len(found) - count)
    del journal.records[left:]
    journal.machine = f"machine-{int(journal.machine.rpartition('-')[2]) + 1}"
    journal.heads = [at for at in journal.heads if at < left]
