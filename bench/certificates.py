"""What certificates cost: runs of the table as fast as they go, by turns plain and with mutual TLS on both planes.

The turns are pairs that follow each other, since the load of a shared machine drifts; the figure is the median of both.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Final

from bench.runs import TABLE, watch
from foosim.deployment.loader import load_deployment
from foosim.deployment.text.files import read_source_file
from foosim.launcher.pki import certificates as pki
from foosim.protocol.identity import identities_of

COST_MAX: Final = 0.2
"""How much of the tick rate mutual TLS may take."""


@dataclass(frozen=True, slots=True)
class Certificates:
    """Ticks a second of the runs, in the order in which they were made, and the share of the medians that is lost."""

    plain: list[int]
    secured: list[int]
    cost: float


def certificates(seconds: float = 6.0, pairs: int = 5) -> Certificates:
    """Measure; `seconds` is the simulated time of each run."""
    plain, secured = [], []
    with tempfile.TemporaryDirectory() as folder:
        pki.init(Path(folder))
        pki.issue(Path(folder), identities_of(load_deployment(read_source_file(TABLE), TABLE.name)))
        for _ in range(pairs):
            plain.append(_ticks_per_s(seconds, None))
            secured.append(_ticks_per_s(seconds, Path(folder)))
    return Certificates(plain, secured, round(1.0 - median(secured) / median(plain), 4))


def _ticks_per_s(seconds: float, folder: Path | None) -> int:
    run = watch("fast", seconds, pki=folder)
    return round(float(run.result["rtf"]) / run.tick_s)


def lines(row: Certificates) -> list[str]:
    """Return the figures for people."""
    return [
        f"plain {median(row.plain):6.0f} ticks/s (runs {' '.join(map(str, row.plain))})",
        f"TLS   {median(row.secured):6.0f} ticks/s (runs {' '.join(map(str, row.secured))})",
        f"cost  {row.cost:6.1%} of the tick rate, at most {COST_MAX:.0%} wanted",
    ]
