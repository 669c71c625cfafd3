"""What a statistical test of a link asks of its run, and where its figures go.

`make test` runs with fixed seeds and small samples at ALPHA; `make stats` with a seed that it prints, the full samples,
and an alpha of 1e-6 so that a hundred runs of the whole suite do not flake once. Each figure is a row of a table, which
`make stats` writes (captures/network-validation.md).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, NoReturn

import pytest

from tests.links.statistics import ALPHA, Z_ALPHA

FULL_ALPHA: Final = 1e-6
FULL_Z: Final = 4.89
"""A standard normal number is beyond it, on either side, with FULL_ALPHA."""
HOLDS: Final = "holds"
FAILS: Final = "**fails**"
SKIPPED: Final = "skipped"
Row = tuple[str, str, str, str, str, int, str]
"""Test, what, statistic, measured, accepted, n, verdict."""


@dataclass(slots=True)
class Proof:
    """The sizes and the acceptance of one run, and the rows of one test."""

    seed: int
    is_full: bool
    rows: list[Row] = field(default_factory=list)

    @property
    def alpha(self) -> float:
        return FULL_ALPHA if self.is_full else ALPHA

    @property
    def z(self) -> float:
        return FULL_Z if self.is_full else Z_ALPHA

    def size(self, small: int, full: int) -> int:
        """Return the size of a sample."""
        return full if self.is_full else small

    def likely(self, test: str, what: str, p: float, n: int) -> None:
        """Accept a p-value."""
        self._row(test, what, "p", f"{p:.3g}", f"> {self.alpha:g}", n, p > self.alpha)

    def normal(self, test: str, what: str, z: float, n: int) -> None:
        """Accept a deviation in standard deviations."""
        self._row(test, what, "z", f"{z:+.2f}", f"within {self.z:.2f}", n, abs(z) < self.z)

    def ratio(self, test: str, what: str, measured: float, expected: float, within: float, n: int) -> None:
        """Accept a figure that is off by no more than a share."""
        off = measured / expected - 1.0
        accepted = f"{expected:.5g} within {within:.2g}"
        self._row(test, what, "ratio", f"{measured:.5g} ({off:+.2%})", accepted, n, abs(off) <= within)

    def within(self, test: str, what: str, measured: float, expected: float, off: float, n: int) -> None:
        """Accept a figure that is off by no more than so much."""
        holds = abs(measured - expected) <= off
        self._row(test, what, "figure", f"{measured:.4g}", f"{expected:.4g} within {off:.2g}", n, holds)

    def below(self, test: str, what: str, measured: float, limit: float, n: int) -> None:
        """Accept a figure up to a limit."""
        self._row(test, what, "figure", f"{measured:.4g}", f"at most {limit:.4g}", n, measured <= limit)

    def exact(self, test: str, what: str, measured: object, expected: object, n: int) -> None:
        """Accept nothing but this."""
        self._row(test, what, "exact", str(measured), str(expected), n, measured == expected)

    def skip(self, test: str, what: str, reason: str) -> NoReturn:
        """End a test that cannot be made here; the table says why."""
        self.rows.append((test, what, "", f"skipped: {reason}", "", 0, SKIPPED))
        pytest.skip(reason)

    def _row(self, test: str, what: str, statistic: str, measured: str, accepted: str, n: int, holds: bool) -> None:
        self.rows.append((test, what, statistic, measured, accepted, n, HOLDS if holds else FAILS))
        assert holds, f"{test} {what}: {statistic} {measured}, accepted is {accepted} (n = {n}, seed {self.seed})"
