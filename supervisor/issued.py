"""What was ordered beside the plain permission to compute, by tick: what a branch orders again.

Bounded: of a long run with many requests the last are known.
"""

from __future__ import annotations

from collections.abc import Sequence

from foosim.common import limits
from foosim.world.edits import Edit


class Issued:
    """The edits of the last ticks that have any."""

    def __init__(self) -> None:
        self.by_tick: dict[int, list[Edit]] = {}
        self.forgotten = -1
        """The last tick whose edits are not known any more."""

    def add(self, tick: int, edits: Sequence[Edit]) -> None:
        """Note what is added to the order of a tick."""
        if edits:
            self.by_tick.setdefault(tick, []).extend(edits)
        while len(self.by_tick) > limits.EDITED_TICKS_KEPT:
            self.forgotten = min(self.by_tick)
            self.by_tick.pop(self.forgotten)

    def behind(self, tick: int) -> dict[int, list[Edit]]:
        """Return the edits of a tick and of those behind it."""
        return {known: list(edits) for known, edits in sorted(self.by_tick.items()) if known >= tick}
