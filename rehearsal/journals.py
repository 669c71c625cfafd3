"""The journal of a rehearsal's vHub: its records in memory, how far the capture is, how a vHub ends while it writes,
and what is left of both when its machine is lost.
"""

from __future__ import annotations

from typing import Final, Literal, get_args

from foosim.protocol.codec import decode_any
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import HeadRecord, HubRecord, TickRecord
from foosim.vhub.state.resume import Captured, Past, recall

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
        self.machine = "machine-1"
        """Which one it is written on; another one after a machine was lost, as one that was started again."""
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

    def lose(self, count: int) -> int:
        """The machine is lost with its last records, as far as a tick is left; return how many these are."""
        found = [decode_any(HubRecord, raw) for raw in self.records]
        ticks = [(at, record.tick) for at, record in enumerate(found) if isinstance(record, TickRecord)]
        if not ticks:
            return 0
        left = max(ticks[0][0] + 1, len(found) - count)
        lost = len(found) - left
        del self.records[left:]
        self.machine = f"machine-{int(self.machine.rpartition('-')[2]) + 1}"
        self._heads = [at for at in self._heads if at < left]
        return lost

    def past(self, hub: HubCore, run: str) -> Past | None:
        """Return what a new vHub goes on from; None when it is the first."""
        assert hub.deployment is not None
        captured = Captured(self.captured_tick, self.captured_epoch)
        return recall(hub.deployment, run, self.records, captured, hub.deployment.deadlines.client_back_ns)
