"""The frames in which a packet travels over a link with an mtu."""

from __future__ import annotations

from foosim.common.limits import FRAMES_MAX
from foosim.deployment.network.radios import Radio


def frames_of(size: int, mtu: int | None) -> tuple[int, ...]:
    """Return the sizes of the frames in which a packet of `size` bytes travels over a link with an mtu (bytes)."""
    if mtu is None or size <= mtu:
        return (size,)
    whole, rest = divmod(size, mtu)
    return (mtu,) * whole + ((rest,) if rest else ())


def longest_of(settings: Radio) -> int | None:
    """Return the greatest size of a packet (bytes) that a link carries; None without a limit."""
    return None if settings.payload_max is None else settings.payload_max * FRAMES_MAX
