"""What has come for the ticks that are not committed: parts of nodes, deliveries of the vHub."""

from __future__ import annotations

from collections.abc import Collection

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.protocol.codec import encode
from foosim.protocol.messages import Deliveries, Part


class Arrivals:
    """Parts and deliveries, by tick."""

    def __init__(self) -> None:
        self.parts: dict[int, list[Part]] = {}
        """By the tick of the frame that they are parts of."""
        self.deliveries: dict[int, bytes] = {}
        self.delivered = 0
        """The last tick whose deliveries are here."""
        self.branch = 0
        """The branch whose deliveries count."""

    def stand_at(self, tick: int, branch: int) -> None:
        """Forget all that has come: the last commit is another one now."""
        self.parts.clear()
        self.deliveries.clear()
        self.delivered, self.branch = tick - 1, branch

    def take_part(self, part: Part, committed: int, members: Collection[str]) -> bool:
        """Take a part of the present epoch; False for a repeat. Raises Malformed for a stranger's."""
        if not committed < part.tick <= committed + limits.KEPT_TICKS:
            return False
        if part.node not in members:
            raise Malformed(f"a part of {part.node}, the roster is {', '.join(members)}")
        parts = self.parts.setdefault(part.tick, [])
        if any(known.node == part.node for known in parts):
            return False
        parts.append(part)
        return True

    def take_deliveries(self, deliveries: Deliveries, payload: bytes, committed: int) -> bool:
        """Take deliveries as they came; False for a repeat, and for those of another branch.

        Raises Malformed for a tick too far off.
        """
        is_known = deliveries.tick in self.deliveries or deliveries.tick < committed
        if is_known or deliveries.branch != self.branch:
            return False
        if deliveries.last > committed + limits.KEPT_TICKS:
            raise Malformed(f"deliveries of tick {deliveries.last}, the last commit is {committed}")
        self.deliveries[deliveries.tick] = payload
        self.delivered = max(self.delivered, deliveries.last)
        for tick in range(deliveries.tick + 1, deliveries.last + 1):
            self.deliveries.setdefault(tick, encode(Deliveries(tick, [], branch=self.branch)))
        return True

    def missing(self, tick: int, members: Collection[str]) -> list[str]:
        """Return the nodes whose parts of frame `tick` have not come."""
        known = {part.node for part in self.parts.get(tick, ())}
        return [node for node in members if node not in known]

    def drop(self, tick: int, nodes: Collection[str]) -> None:
        """Forget the parts of these nodes: they did not fit, and are asked for again."""
        self.parts[tick] = [part for part in self.parts[tick] if part.node not in nodes]

    def committed(self, tick: int) -> None:
        """Tick `tick` is computed: its parts are done with, its deliveries soon."""
        self.parts.pop(tick + 1)
        self.deliveries.pop(tick - limits.KEPT_TICKS, None)
