"""Loss of a rehearsal's machine with the journal records that had not reached its disk."""

from __future__ import annotations

from foosim.protocol import channels
from foosim.protocol.codec import decode_any
from foosim.simulation.system import HUB_BACK_NS, System
from foosim.supervisor.records import CommitRecord, Record


def lose_hub(system: System, records: int, back_ns: int = HUB_BACK_NS) -> None:
    """Lose the vHub's machine with the last records of its journal; the vHub is restarted after a delay."""
    if channels.VHUB not in system.processes or system.hub.ended is not None:
        return
    system.hub_journal.lose(records)
    system.hub_journal.ending = None
    system.kill_hub("now", back_ns)


def lose_supervisor(system: System, records: int) -> None:
    """Lose the supervisor's machine with the last records of its journal, all but those up to the first commit."""
    journal = system.journal
    begun = next(at for at, raw in enumerate(journal) if isinstance(decode_any(Record, raw), CommitRecord))
    del journal[max(begun + 1, len(journal) - records) :]
    system.kill(channels.SUPERVISOR)
