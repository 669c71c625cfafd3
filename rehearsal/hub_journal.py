"""The journal of a rehearsal's vHub: its records in memory, how far the capture is, how a vHub ends while it writes.

Neighbours: `system` appends and restarts, `vhub.resume` reads.
"""

from __future__ import annotations

from typing import Final, Literal, get_args

from foosim.protocol.codec import decode_any
from foosim.vhub.core import HubCore
from foosim.vhub.records import HeadRecord, HubRecord
from foosim.vhub.resume import Captured, Past, recall

Ending = Literal["now", "torn", "unsaid"]
"""When a vHub dies: at once; while it writes its next record, which is torn then; behind that, with nothing said."""
ENDINGS: Final[tuple[Ending, ...]] = get_args(Ending)
HEADS_KEPT: Final = 5


class HubJournal:
    """What the vHubs of a rehearsal have written."""

    def __init__(self) -> None:
        self.records: list[bytes] = []
        self.captured_tick = -1
        self.captured_epoch = 0
        self.ending: Ending | None = None
        """How the vHub ends at its next record; None: it does not."""
        self._heads: list[int] = []

    def append(self, record: bytes) -> None:
        """Write a record; what no fold needs any more goes."""
        if isinstance(decode_any(HubRecord, record), HeadRecord):
            self._heads.append(len(self.records))
            if len(self._heads) > HEADS_KEPT:
                gone = self._heads[1]
                del self.records[:gone]
                self._heads = [at - gone for at in self._heads[1:]]
        self.records.append(record)

    def past(self, hub: HubCore, run: str) -> Past | None:
        """Return what a new vHub goes on from; None when it is the first."""
        assert hub.deployment is not None
        captured = Captured(self.captured_tick, self.captured_epoch)
        return recall(hub.deployment, run, self.records, captured, hub.deployment.deadlines.client_back_ns)
