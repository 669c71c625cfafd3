"""What a node has been told for its ticks: orders and deliveries, each by tick.

Both may be about several ticks at once. Deliveries are final.
"""

from __future__ import annotations

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.protocol import channels
from foosim.protocol.codec import encode
from foosim.protocol.messages import Deliveries, Epoch, Order
from foosim.world.edits import Edit, check_edits


class Inputs:
    """Orders and deliveries of the last ticks and of those to come."""

    def __init__(self) -> None:
        self._orders: dict[int, list[Edit]] = {}
        self._deliveries: dict[int, tuple[bytes, Deliveries]] = {}

    def begin(self, epoch: Epoch) -> None:
        """A new epoch issues orders again. Deliveries stay true.

        A node that was away for long has some of ticks that nobody asks for any more.
        """
        self._orders.clear()
        oldest = epoch.tick - limits.KEPT_TICKS
        self._deliveries = {tick: kept for tick, kept in self._deliveries.items() if tick >= oldest}

    def take_order(self, order: Order, own_tick: int) -> bool:
        """Take an order; False for a repeat. Raises `Malformed` for edits that none can carry out."""
        last = order.tick + order.following
        if last < own_tick or last in self._orders:
            return False
        check_near(last, own_tick)
        check_edits(order.edits)
        for tick in range(order.tick, last + 1):
            self._orders[tick] = order.edits if tick == order.tick else []
        return True

    def take_deliveries(self, deliveries: Deliveries, payload: bytes, own_tick: int) -> bool:
        """Take deliveries as they came; False for a repeat."""
        if deliveries.tick in self._deliveries or deliveries.tick < own_tick - limits.KEPT_TICKS:
            return False
        check_near(deliveries.last, own_tick)
        self._deliveries[deliveries.tick] = payload, deliveries
        for tick in range(deliveries.tick + 1, deliveries.last + 1):
            empty = Deliveries(tick, [])
            self._deliveries.setdefault(tick, (encode(empty), empty))
        return True

    def edits(self, tick: int) -> list[Edit] | None:
        """Return what the order of a tick changes; None while it has not come."""
        return self._orders.get(tick)

    def deliveries(self, tick: int) -> tuple[bytes, Deliveries] | None:
        """Return the deliveries of a tick with their bytes; None while they have not come."""
        return self._deliveries.get(tick)

    def missing(self, tick: int) -> list[channels.Channel]:
        """Return what has not come of a tick's inputs."""
        missing = [] if tick in self._orders else [channels.ORDER]
        return missing if tick in self._deliveries else [*missing, channels.DELIVERIES]

    def forget(self, tick: int) -> None:
        """Nobody computes this tick again."""
        self._orders.pop(tick, None)
        self._deliveries.pop(tick, None)


def check_near(tick: int, own_tick: int) -> None:
    """Refuse what is for a tick so far off that nobody can have reached it."""
    if tick > own_tick + limits.KEPT_TICKS:
        raise Malformed(f"tick {tick}, this node is at {own_tick}")
