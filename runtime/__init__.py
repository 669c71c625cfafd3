"""What every process has: loop, journal, signals, run folder, health; and its transport."""

from typing import Final

GC_THRESHOLDS: Final = (20_000, 20, 100)
"""Of garbage collections, which are rare: what is loaded lives as long as the process."""
