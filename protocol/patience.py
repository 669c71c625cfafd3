"""How long a core waits before it asks again for what it lacks: max(20 ms, 2 T), then doubled up to 1 s.

Neighbours: the cores of node, vHub and supervisor, which say `Want` when patience is over.
"""

from __future__ import annotations

from foosim.protocol import limits


class Patience:
    """When to ask again. `at_ns` is the next time."""

    def __init__(self, now_ns: int) -> None:
        self.at_ns = now_ns
        self._after_ns = limits.WANT_AFTER_NS

    def progress(self, tick_ns: int, now_ns: int) -> None:
        """Something went on: wait anew."""
        self._after_ns = max(limits.WANT_AFTER_NS, 2 * tick_ns)
        self.at_ns = now_ns + self._after_ns

    def is_over(self, now_ns: int) -> bool:
        return now_ns >= self.at_ns

    def asked(self, now_ns: int) -> None:
        """It was asked for again: wait twice as long for the next time."""
        self._after_ns = min(2 * self._after_ns, limits.WANT_EVERY_NS_MAX)
        self.at_ns = now_ns + self._after_ns
