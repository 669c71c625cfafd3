"""Numbered messages to clients outside of lockstep, kept so that a client that returns gets what it has not received.

They are kept for as long as a client may be away, at most `DOWNLINKS_KEPT_MAX` for one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import TypeVar

import msgspec

from foosim.common import limits
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Deliveries, Down

Sent = TypeVar("Sent", Deliveries, Down)

_Kept = tuple[int, int, bytes]
"""Until when it is kept, its number, its bytes."""


class Downlinks:
    """The last downlinks of every client. `kept_ns` is for how long."""

    def __init__(self) -> None:
        self.kept_ns = limits.DOWNLINK_KEPT_NS
        self._by_client: dict[str, deque[_Kept]] = {}

    def keep(self, client: str, number: int, payload: bytes, now_ns: int) -> None:
        """Note what is said, and forget what is too old."""
        kept = self._by_client.setdefault(client, deque(maxlen=limits.DOWNLINKS_KEPT_MAX))
        while kept and kept[0][0] < now_ns:
            kept.popleft()
        kept.append((now_ns + self.kept_ns, number, payload))

    def restore(self, downlinks: dict[str, list[tuple[int, bytes]]], now_ns: int) -> None:
        """Take over those of a vHub that is gone."""
        for client, said in downlinks.items():
            for number, payload in said:
                self.keep(client, number, payload, now_ns)

    def turn_to(self, branch: int) -> None:
        """Name another branch in all of them: those of one that is void are not among them."""
        for client, kept in self._by_client.items():
            again = ((until_ns, number, retag(Down, payload, branch)) for until_ns, number, payload in kept)
            self._by_client[client] = deque(again, limits.DOWNLINKS_KEPT_MAX)

    def behind(self, client: str, received: int) -> Iterable[bytes]:
        """Return what a client that has got `received` has not."""
        return [payload for _, number, payload in self._by_client.get(client, ()) if number > received]


def retag(kind: type[Sent], payload: bytes, branch: int) -> bytes:
    """Return a message that was sent before a branch with the branch's number."""
    message = decode(kind, payload)
    return payload if message.branch == branch else encode(msgspec.structs.replace(message, branch=branch))
