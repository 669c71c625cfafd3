"""A histogram of lags, with bounded memory and a bounded relative error."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

CELL_NS: Final = 10_000
CELL_BITS: Final = 10
LAG_CELLS: Final = 1_000_000
"""10 s; larger lags count as this one."""


@dataclass(slots=True)
class Lags:
    """Lags so far: cells of 10 us up to 10 ms, of 1/512 to 1/1024 of the lag up to 10 s."""

    cells: dict[int, int] = field(default_factory=dict)
    """Counts by the upper edge of the cell, in units of 10 us."""
    count: int = 0
    max_ns: int = 0

    def add(self, lag_ns: int, times: int = 1) -> None:
        edge = min(lag_ns // CELL_NS, LAG_CELLS) + 1
        width = 1 << max(0, edge.bit_length() - CELL_BITS)
        edge = -(-edge // width) * width
        self.cells[edge] = self.cells.get(edge, 0) + times
        self.count += times
        self.max_ns = max(self.max_ns, lag_ns)

    def quantile_ms(self, share: float) -> float:
        """Return the lag, in ms, that the fraction `share` does not exceed (upper edge of its cell)."""
        left = share * self.count
        for edge in sorted(self.cells):
            left -= self.cells[edge]
            if left <= 0:
                return min(edge * CELL_NS / 1e6, self.max_ns / 1e6)
        return 0.0

    def as_json(self) -> dict[str, float]:
        """Return the summary for a run's result, in ms."""
        return {"p50": self.quantile_ms(0.5), "p99": self.quantile_ms(0.99), "max": self.max_ns / 1e6}
