"""The frames in which a packet travels over a link with an mtu."""

from __future__ import annotations

from foosim.common.limits import FRAMES_MAX
from foosim.deployment.network.radios import Radio


def frame_count(size: int, mtu: int | None) -> int:
    """Return the number of frames in which a packet of `size` bytes travels over a link with an mtu (bytes)."""
    return 1 if mtu is None or size <= mtu else -(-size // mtu)


def frames_of(size: int, mtu: int | None) -> tuple[int, ...]:
    """Return the sizes of these frames."""
    more = frame_count(size, mtu) - 1
    return (*(mtu or 0,) * more, size - more * (mtu or 0))


def longest_of(settings: Radio) -> int | None:
    """Return the greatest size of a packet (bytes) that a link carries; None without a limit."""
    return None if settings.payload_max is None else settings.payload_max * FRAMES_MAX
