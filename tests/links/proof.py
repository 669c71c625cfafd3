"""What a statistical test of a link asks of its run.

`make test` runs with fixed seeds and small samples at ALPHA; `make stats` with a seed that it prints, the full samples,
and an alpha of 1e-6 so that a hundred runs of the whole suite do not flake once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tests.links.statistics import ALPHA, Z_ALPHA

FULL_ALPHA: Final = 1e-6
FULL_Z: Final = 4.89
"""A standard normal number is beyond it, on either side, with FULL_ALPHA."""


@dataclass(frozen=True, slots=True)
class Proof:
    """The sizes and the acceptance of one run."""

    seed: int
    is_full: bool

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
        self._accept(test, what, p > self.alpha, f"p {p:.3g}, accepted is > {self.alpha:g}", n)

    def normal(self, test: str, what: str, z: float, n: int) -> None:
        """Accept a deviation in standard deviations."""
        self._accept(test, what, abs(z) < self.z, f"z {z:+.2f}, accepted is within {self.z:.2f}", n)

    def ratio(self, test: str, what: str, measured: float, expected: float, within: float, n: int) -> None:
        """Accept a figure that is off by no more than a share."""
        holds = abs(measured / expected - 1.0) <= within
        self._accept(test, what, holds, f"{measured:.5g}, accepted is {expected:.5g} within {within:.2g} of it", n)

    def within(self, test: str, what: str, measured: float, expected: float, off: float, n: int) -> None:
        """Accept a figure that is off by no more than an amount."""
        holds = abs(measured - expected) <= off
        self._accept(test, what, holds, f"{measured:.4g}, accepted is {expected:.4g} within {off:.2g}", n)

    def below(self, test: str, what: str, measured: float, limit: float, n: int) -> None:
        """Accept a figure up to a limit."""
        self._accept(test, what, measured <= limit, f"{measured:.4g}, accepted is at most {limit:.4g}", n)

    def exact(self, test: str, what: str, measured: object, expected: object, n: int) -> None:
        """Accept nothing but this."""
        self._accept(test, what, measured == expected, f"{measured}, accepted is {expected}", n)

    def _accept(self, test: str, what: str, holds: bool, figure: str, n: int) -> None:
        assert holds, f"{test} {what}: {figure} (n = {n}, seed {self.seed})"
