"""Numbered messages to clients outside of lockstep, kept so that a client that returns receives those it lacks.

They are kept for as long as a client may be away, at most `DOWNLINKS_KEPT_MAX` for one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from foosim.common import limits

_Kept = tuple[int, int, bytes]
"""When it expires, its number, its bytes."""


class Downlinks:
    """The last downlinks of every client, each kept for `kept_ns`."""

    def __init__(self) -> None:
        self.kept_ns = limits.DOWNLINK_KEPT_NS
        self._by_client: dict[str, deque[_Kept]] = {}

    def keep(self, client: str, number: int, payload: bytes, now_ns: int) -> None:
        """Add a downlink, and drop expired ones."""
        kept = self._by_client.setdefault(client, deque(maxlen=limits.DOWNLINKS_KEPT_MAX))
        while kept and kept[0][0] < now_ns:
            kept.popleft()
        kept.append((now_ns + self.kept_ns, number, payload))

    def restore(self, downlinks: dict[str, list[tuple[int, bytes]]], now_ns: int) -> None:
        """Restore the downlinks of the vHub process before this one."""
        for client, said in downlinks.items():
            for number, payload in said:
                self.keep(client, number, payload, now_ns)

    def behind(self, client: str, received: int) -> Iterable[bytes]:
        """Return the downlinks with numbers above `received`, in order."""
        return [payload for _, number, payload in self._by_client.get(client, ()) if number > received]
