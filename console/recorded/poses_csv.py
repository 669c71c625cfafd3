"""Recorded poses as a table of text: the reality that a simulation is compared with, as motion capture writes it.

The first line names the columns, in any order; the separator is a comma, a semicolon or a tab, and lines that begin
with `#` are passed by. `foosim capture export CAPTURE --what poses` writes such a table.

| column | what | unit |
|---|---|---|
| `time_s` (or `time`), `time_ms`, `time_us`, `time_ns` | when; one of them | as its name says |
| `entity`, `link`, `name` or `body` | an entity (`arm`) or one of its links (`arm/slide`) | |
| `x`, `y`, perhaps `z` | where, in the world frame; no `z` is 0; `x_mm`, `x_cm` ... in these units | m |
| `qx`, `qy`, `qz`, `qw` | orientation; all four, of length 1 | |
| `yaw` or `yaw_deg`, in their place | turn about the vertical axis, counter-clockwise from x | rad, or degrees |

Without an orientation all are upright. Further columns are passed by. Times of one entity ascend. Pure: the caller
gives the lines.
"""

from __future__ import annotations

import csv
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import cos, hypot, isfinite, radians, sin
from typing import Final

import numpy as np

from foosim.common.errors import Refused, describe
from foosim.common.names import nearest_name
from foosim.console.shown.tracks import Track

TIMES: Final = {"time": 10**9, "time_s": 10**9, "time_ms": 10**6, "time_us": 10**3, "time_ns": 1}
"""ns in the unit of each."""
NAMES: Final = ("entity", "link", "name", "body")
LENGTHS: Final = {"": 1.0, "_m": 1.0, "_cm": 0.01, "_mm": 0.001}
QUATERNION: Final = ("qx", "qy", "qz", "qw")
YAWS: Final[Mapping[str, Callable[[float], float]]] = {"yaw": float, "yaw_rad": float, "yaw_deg": radians}
SEPARATORS: Final = ",;\t"
LENGTH_OFF: Final = 0.01
"""By how much the length of a quaternion may differ from 1: tables are rounded."""
METRES_MAX: Final = 1e6
NS_MAX: Final = 2**62


class BadPoses(Refused):
    """An unreadable table of poses: file, line, the problem and valid content."""

    exit_code = 2


@dataclass(slots=True)
class _Samples:
    """The samples of one entity."""

    times: array[int] = field(default_factory=lambda: array("q"))
    poses: array[float] = field(default_factory=lambda: array("d"))


class _Table:
    """The columns of a table by name, and how a line is read by them."""

    def __init__(self, place: str, header: Sequence[str]) -> None:
        names = [name.strip().lower() for name in header]
        self._place, self._columns = place, {name: column for column, name in enumerate(names)}
        self._count = len(names)
        double = sorted(name for column, name in enumerate(names) if name and self._columns[name] != column)
        if double:
            raise BadPoses(f"{place}: column {double[0]!r} is there twice")
        self._time, self._name = self._one("time", TIMES), self._one("what moves", NAMES)
        axes = "xyz" if any(f"z{unit}" in self._columns for unit in LENGTHS) else "xy"
        self._lengths = [self._one(axis, [f"{axis}{unit}" for unit in LENGTHS]) for axis in axes]
        self._turn = [name for name in (*YAWS, *QUATERNION) if name in self._columns]
        if self._turn and self._turn[0] in QUATERNION and len(self._turn) < len(QUATERNION):
            missing = ", ".join(sorted({*QUATERNION} - {*self._turn}))
            raise BadPoses(f"{place}: an orientation needs {', '.join(QUATERNION)}; {missing} is missing")
        if len(self._turn) > 1 and self._turn[0] in YAWS:
            raise BadPoses(f"{place}: several orientations; give one of {', '.join(self._turn)}")

    def _one(self, what: str, names: Iterable[str]) -> str:
        """Return the name of the one column of these names. Raises BadPoses."""
        found = [name for name in names if name in self._columns]
        if len(found) == 1:
            return found[0]
        if found:
            raise BadPoses(f"{self._place}: several columns for {what}; give one of {' and '.join(found)}")
        close = [nearest for name in self._columns if (nearest := nearest_name(name, [*names])) is not None]
        columns = ", ".join(name for name in self._columns if name) or "none"
        hint = f", nearest is {close[0]}" if close else ""
        raise BadPoses(f"{self._place}: no column for {what} ({', '.join(names)}) among {columns}{hint}")

    def row(self, place: str, cells: Sequence[str]) -> tuple[str, int, list[float]]:
        """Return a line's values: name, time in ns, the pose's seven numbers."""
        if len(cells) != self._count:
            raise BadPoses(f"{place}: {len(cells)} values, the first line names {self._count} columns")
        name = cells[self._columns[self._name]].strip()
        if not name:
            raise BadPoses(f"{place}: column {self._name!r} is empty")
        units = [(length, LENGTHS[length[1:]]) for length in self._lengths]
        position = [self._number(place, length, cells, METRES_MAX / unit) * unit for length, unit in units]
        return name, self._time_ns(place, cells), [*position, 0.0][:3] + self._orientation(place, cells)

    def _time_ns(self, place: str, cells: Sequence[str]) -> int:
        text, unit = cells[self._columns[self._time]].strip(), TIMES[self._time]
        # A float has too few digits for ns of a day and more.
        if unit == 1 and text.removeprefix("-").isdigit() and abs(int(text[:32])) <= NS_MAX:
            return int(text)
        return round(self._number(place, self._time, cells, NS_MAX / unit) * unit)

    def _number(self, place: str, column: str, cells: Sequence[str], most: float) -> float:
        text = cells[self._columns[column]].strip()
        try:
            number = float(text)
        except ValueError:
            number = float("nan")
        if not isfinite(number):
            raise BadPoses(describe(f"{place}: column {column!r} is not a number", text))
        if abs(number) > most:
            raise BadPoses(describe(f"{place}: column {column!r} is out of range ({most:g})", text))
        return number

    def _orientation(self, place: str, cells: Sequence[str]) -> list[float]:
        numbers = [self._number(place, column, cells, METRES_MAX) for column in self._turn]
        if not numbers:
            return [0.0, 0.0, 0.0, 1.0]
        if len(numbers) == 1:
            angle = YAWS[self._turn[0]](numbers[0])
            return [0.0, 0.0, sin(angle / 2), cos(angle / 2)]
        length = hypot(*numbers)
        if abs(length - 1.0) > LENGTH_OFF:
            raise BadPoses(f"{place}: a quaternion of length {length:.4g}; expected 1")
        return [number / length for number in numbers]


def read_tracks(lines: Iterable[str], name: str) -> dict[str, Track]:
    """Return the track of each entity or link in a table, by name. `name` is that of the file. Raises BadPoses."""
    table: _Table | None = None
    found: dict[str, _Samples] = {}
    separator = ","
    for number, line in enumerate(lines, 1):
        place = f"{name}:{number}"
        text = line.lstrip("\ufeff") if number == 1 else line
        if not text.strip() or text.startswith("#"):
            continue
        if table is None:
            separator = max(SEPARATORS, key=text.count)
        try:
            (cells,) = list(csv.reader([text.rstrip("\r\n")], delimiter=separator, strict=True))
        except (csv.Error, ValueError) as error:
            raise BadPoses(f"{place}: not a line of a table, {error}") from None
        if table is None:
            table = _Table(place, cells)
            continue
        entity, time_ns, pose = table.row(place, cells)
        samples = found.setdefault(entity, _Samples())
        if samples.times and time_ns <= samples.times[-1]:
            at_s, before_s = time_ns / 1e9, samples.times[-1] / 1e9
            raise BadPoses(f"{place}: {entity} at {at_s:.9g} s is not later than {before_s:.9g} s; times ascend")
        samples.times.append(time_ns)
        samples.poses.extend(pose)
    if table is None:
        raise BadPoses(f"{name}: the file is empty; the first line names the columns")
    if not found:
        raise BadPoses(f"{name}: no line after the header")
    return {entity: _track(samples) for entity, samples in sorted(found.items())}


def _track(samples: _Samples) -> Track:
    times = np.array(samples.times, dtype=np.int64)
    return Track(times, np.array(samples.poses, dtype=np.float64).reshape(len(times), 7))
