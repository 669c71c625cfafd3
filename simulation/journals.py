"""The in-memory journal of a rehearsal's vHub, with its capture position, and crashes during a write."""

from __future__ import annotations

from typing import Final, Literal, get_args

from foosim.capture.left import Progress
from foosim.protocol.codec import decode_any
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import HeadRecord, HubRecord
from foosim.vhub.state.resume import Past, recall

Ending = Literal["now", "torn", "unpublished"]
"""When a vHub dies: at once; during its next write, which leaves a torn record; after it, before publishing."""
ENDINGS: Final[tuple[Ending, ...]] = get_args(Ending)
HEADS_KEPT: Final = 5


class HubJournal:
    """The records that a rehearsal's vHubs have written."""

    def __init__(self) -> None:
        self.records: list[bytes] = []
        self.captured = Progress()
        self.machine = "machine-1"
        """The machine that holds the journal; another one after a machine loss."""
        self.ending: Ending | None = None
        """How the vHub dies at its next record; None: it does not."""
        self.heads: list[int] = []

    def append(self, record: bytes) -> None:
        """Write a record; drop the ones that no fold needs."""
        if isinstance(decode_any(HubRecord, record), HeadRecord):
            self.heads.append(len(self.records))
            if len(self.heads) > HEADS_KEPT:
                gone = self.heads[1]
                del self.records[:gone]
                self.heads = [at - gone for at in self.heads[1:]]
        self.records.append(record)

    def past(self, hub: HubCore, run: str) -> Past | None:
        """Return the records that a new vHub resumes from; None for the first vHub."""
        assert hub.deployment is not None
        return recall(hub.deployment, run, self.records, self.captured, hub.deployment.deadlines.client_back_ns)
