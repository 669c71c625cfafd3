"""Tolerant access to the plain data of a deployment, for checks between its fields.

Whatever is missing or malformed reads as empty, since the schema reports it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from typing import Any, Final

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.finding import Finding, Location, path_text
from foosim.common.names import nearest_name

TEXTS_MAX: Final = 4096
NEAREST_MAX: Final = 128
"""How often a nearest name is looked for: among thousands of names that takes 20 ms, and not all problems are shown."""


class PlainData:
    """The plain data of a deployment: a value of an unexpected kind reads as empty."""

    def __init__(self, data: object) -> None:
        self.data = data
        self._nearest = 0

    def get(self, *path: str | int) -> Any:
        """Return the value at a path, None where there is none."""
        value = self.data
        for step in path:
            if isinstance(value, dict) and isinstance(step, str):
                value = value.get(step)
            elif isinstance(value, list) and isinstance(step, int) and step < len(value):
                value = value[step]
            else:
                return None
        return value

    def mapping(self, *path: str | int) -> Mapping[str, Any]:
        """Return the mapping at a path."""
        value = self.get(*path)
        return value if isinstance(value, dict) else {}

    def texts(self, *path: str | int) -> list[tuple[int, str]]:
        """Return the texts of a list, or the single text in place of it, with their indices."""
        value = self.get(*path)
        items = value if isinstance(value, list) else [value]
        return [(index, item) for index, item in enumerate(items[:TEXTS_MAX]) if isinstance(item, str)]

    def length(self, *path: str | int) -> Fraction | None:
        """Return a length in metres, exact; None if it is not one."""
        return self.quantity(units.LENGTH, *path)

    def quantity(self, dimension: units.Dimension, *path: str | int) -> Fraction | None:
        """Return a quantity in SI units, exact; None if it is not one."""
        try:
            return units.parse(self.get(*path), dimension)
        except BadValue:
            return None

    def nearest(self, value: str, choices: Iterable[str]) -> str | None:
        """Return the valid name most similar to a wrong one, in quotes; it is looked for so many times."""
        self._nearest += 1
        return quoted(nearest_name(value, choices)) if self._nearest <= NEAREST_MAX else None

    def too_big(self, small: Location, big: Location, why: str, times: int = 1) -> Iterator[Finding]:
        """Yield a length of which `times` as much is not below another one; `why` that is wrong."""
        least, most = self.length(*small), self.length(*big)
        if least is None or most is None or times * least < most:
            return
        twice, half = ("twice that is ", "twice ") if times > 1 else ("", "")
        below = f"{why}{twice}not below {path_text(big)} ({mm(most)}), valid is below {mm(most / times)}"
        above = f"{why}not above {half}{path_text(small)} ({mm(least)}), valid is above {mm(least * times)}"
        yield Finding(small, below, self.get(*small), other=Finding(big, above, self.get(*big)))


def quoted(nearest: str | None) -> str | None:
    """Return a name in quotes, None without one."""
    return None if nearest is None else repr(nearest)


def mm(length: Fraction) -> str:
    """Return a length as text in millimetres."""
    return f"{float(length * 1000):g} mm"
