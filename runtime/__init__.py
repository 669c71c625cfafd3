"""What every process has: loop, journal, signals, run folder, health; and its transport."""

from typing import Final

GC_THRESHOLDS: Final = (20_000, 20, 100)
"""Of garbage collections, which are rare: loaded modules live as long as the process."""
