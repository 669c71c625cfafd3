"""The inputs of a node's ticks: orders and deliveries, each by tick, and messages of epochs to come.

Both may be about several ticks at once. Deliveries are final.
"""

from __future__ import annotations

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.protocol import channels
from foosim.protocol.channels import Channel
from foosim.protocol.codec import encode
from foosim.protocol.messages import Deliveries, Epoch, Order
from foosim.world.edits import Edit, check_edits


class Inputs:
    """Orders and deliveries of the last and the next ticks."""

    def __init__(self) -> None:
        self._orders: dict[int, list[Edit]] = {}
        self._deliveries: dict[int, tuple[bytes, Deliveries]] = {}

    def begin(self, epoch: Epoch) -> None:
        """A new epoch issues orders again. Deliveries stay true.

        A node that was away for long drops those of ticks that no node requests any more.
        """
        self._orders.clear()
        oldest = epoch.tick - limits.KEPT_TICKS
        self._deliveries = {tick: kept for tick, kept in self._deliveries.items() if tick >= oldest}

    def take_order(self, order: Order, own_tick: int) -> bool:
        """Take an order; False for a repeat. Raises `Malformed` for impossible edits."""
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
        """Return the edits of a tick's order; None before it has come."""
        return self._orders.get(tick)

    def deliveries(self, tick: int) -> tuple[bytes, Deliveries] | None:
        """Return the deliveries of a tick with their bytes; None before they have come."""
        return self._deliveries.get(tick)

    def missing(self, tick: int) -> list[channels.Channel]:
        """Return the missing inputs of a tick."""
        missing = [] if tick in self._orders else [channels.ORDER]
        return missing if tick in self._deliveries else [*missing, channels.DELIVERIES]

    def forget(self, tick: int) -> None:
        """Drop the inputs of a finished tick."""
        self._orders.pop(tick, None)
        self._deliveries.pop(tick, None)


def check_near(tick: int, own_tick: int) -> None:
    """Raise `Malformed` for a tick too far ahead of this node."""
    if tick > own_tick + limits.KEPT_TICKS:
        raise Malformed(f"tick {tick}, this node is at {own_tick}")


class PendingEpochMessages:
    """Messages of an epoch that this node has not entered, in order of arrival: (channel, name in its key).

    Each message is kept once, since it may be requested and published many times. When there are too many, because the
    other nodes continue without this one, the oldest is dropped.
    """

    def __init__(self) -> None:
        self._messages: dict[bytes, tuple[Channel, str]] = {}

    def __len__(self) -> int:
        return len(self._messages)

    def add(self, channel: Channel, name: str, payload: bytes) -> None:
        """Keep a message."""
        if len(self._messages) >= limits.HELD_MESSAGES_MAX:
            self._messages.pop(next(iter(self._messages)))
        self._messages[payload] = channel, name

    def take(self) -> list[tuple[Channel, str, bytes]]:
        """Return and remove all messages."""
        taken = [(channel, name, payload) for payload, (channel, name) in self._messages.items()]
        self._messages.clear()
        return taken
