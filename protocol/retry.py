"""The back-off of a core that requests missing messages: max(20 ms, 2 T), then doubled up to 1 s."""

from __future__ import annotations

from foosim.common import limits


class RetryTimer:
    """The time of the next request, `at_ns`."""

    def __init__(self, now_ns: int) -> None:
        self.at_ns = now_ns
        self._after_ns = limits.WANT_AFTER_NS

    def progress(self, tick_ns: int, now_ns: int) -> None:
        """Restart the back-off, because there was progress."""
        self._after_ns = max(limits.WANT_AFTER_NS, 2 * tick_ns)
        self.at_ns = now_ns + self._after_ns

    def is_over(self, now_ns: int) -> bool:
        return now_ns >= self.at_ns

    def requested(self, now_ns: int) -> None:
        """Double the back-off, after a request."""
        self._after_ns = min(2 * self._after_ns, limits.WANT_EVERY_NS_MAX)
        self.at_ns = now_ns + self._after_ns
