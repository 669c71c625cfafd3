"""Readable texts of times, bit rates and lengths."""

from __future__ import annotations

from math import inf

EXACT = 15
"""Digits that show every nanosecond of a run."""


def time_text(ns: float, digits: int = 3) -> str:
    """Return a time in the unit that fits: `57.3 ms`."""
    for unit, size in (("h", 3.6e12), ("min", 6e10), ("s", 1e9), ("ms", 1e6), ("us", 1e3)):
        if ns >= size and not (unit in ("h", "min") and ns % size):
            return f"{ns / size:.{digits}g} {unit}"
    return f"{ns:.{digits}g} ns" if ns else "0"


def rate_text(bps: float) -> str:
    """Return a bit rate in the unit that fits: `5.47 kbit/s`."""
    for unit, size in (("Gbit/s", 1e9), ("Mbit/s", 1e6), ("kbit/s", 1e3)):
        if bps >= size:
            return f"{bps / size:.4g} {unit}"
    return f"{bps:.4g} bit/s"


def range_text(meters: float | None) -> str:
    """Return a range, `-` where there is none."""
    if meters is None:
        return "-"
    if meters == inf:
        return "no end"
    return f"{meters / 1000:.3g} km" if meters >= 1000 else f"{meters:.3g} m"
