"""Numbered messages to clients outside of lockstep, kept so that a client that returns gets what it has not received.

They are kept for as long as a client may be away, at most `DOWNLINKS_KEPT_MAX` for one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from foosim.common import limits

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

    def behind(self, client: str, received: int) -> Iterable[bytes]:
        """Return what a client that has got `received` has not."""
        return [payload for _, number, payload in self._by_client.get(client, ()) if number > received]
