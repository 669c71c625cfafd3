"""Recorded poses as a table of text: the reality that a simulation is compared with, as motion capture writes it.

The first line names the columns, in any order; the separator is a comma, a semicolon or a tab, and lines that begin
with `#` are passed by. What `foosim capture export CAPTURE --what poses` writes is such a table.

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
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import cos, isfinite, radians, sin, sqrt
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
ROWS_MAX: Final = 20_000_000
ENTITIES_MAX: Final = 10_000
METRES_MAX: Final = 1e6
NS_MAX: Final = 2**62

Number = Callable[[Sequence[str]], float]


class BadPoses(Refused):
    """A table of poses that cannot be read: file, line, what is wrong and what is valid."""

    exit_code = 2


@dataclass(slots=True)
class _Samples:
    """What was read of one entity."""

    times: array[int] = field(default_factory=lambda: array("q"))
    poses: array[float] = field(default_factory=lambda: array("d"))


class _Table:
    """The columns of a table, and how a line is read by them."""

    def __init__(self, place: str, header: Sequence[str]) -> None:
        self._names = [name.strip().lower() for name in header]
        self._place = place
        double = sorted(name for name, count in Counter(self._names).items() if count > 1 and name)
        if double:
            raise BadPoses(f"{place}: column {double[0]!r} stands there twice")
        time = self._one("time", TIMES)
        self._time, self._ns = self._names.index(time), TIMES[time]
        self._name = self._names.index(self._one("what moves", NAMES))
        self._lengths = [self._length(axis) for axis in "xyz"]
        turns = [name for name in YAWS if name in self._names]
        parts = [name for name in QUATERNION if name in self._names]
        if parts and len(parts) < len(QUATERNION):
            missing = ", ".join(sorted({*QUATERNION} - {*parts}))
            raise BadPoses(f"{place}: an orientation needs {', '.join(QUATERNION)}; {missing} is missing")
        if len(turns) > 1 or (turns and parts):
            raise BadPoses(f"{place}: one orientation, not {', '.join([*turns, *parts])}")
        self._yaw = turns[0] if turns else ""
        self._quaternion = [self._names.index(name) for name in parts]

    def _one(self, what: str, names: Iterable[str]) -> str:
        found = [name for name in names if name in self._names]
        if len(found) == 1:
            return found[0]
        if found:
            raise BadPoses(f"{self._place}: one column for {what}, not {' and '.join(found)}")
        close = [nearest for name in self._names if (nearest := nearest_name(name, [*names])) is not None]
        columns = ", ".join(name for name in self._names if name) or "none"
        hint = f", nearest is {close[0]}" if close else ""
        raise BadPoses(f"{self._place}: no column for {what} ({', '.join(names)}) among {columns}{hint}")

    def _length(self, axis: str) -> tuple[int, float] | None:
        found = [f"{axis}{unit}" for unit in LENGTHS if f"{axis}{unit}" in self._names]
        if not found and axis == "z":
            return None
        name = self._one(axis, [f"{axis}{unit}" for unit in LENGTHS])
        return self._names.index(name), LENGTHS[name[1:]]

    def row(self, place: str, cells: Sequence[str]) -> tuple[str, int, list[float]]:
        """Return a line's values: name, time in ns, the pose's seven numbers."""
        if len(cells) != len(self._names):
            raise BadPoses(f"{place}: {len(cells)} values, the first line names {len(self._names)} columns")
        name = cells[self._name].strip()
        if not name:
            raise BadPoses(f"{place}: column {self._names[self._name]!r} is empty")
        time_ns = self._time_ns(place, cells[self._time].strip())
        position = [
            0.0 if length is None else self._number(place, length[0], cells, METRES_MAX / length[1]) * length[1]
            for length in self._lengths
        ]
        return name, time_ns, [*position, *self._orientation(place, cells)]

    def _time_ns(self, place: str, text: str) -> int:
        column = self._names[self._time]
        # A float has too few digits for ns of a day and more.
        if self._ns == 1 and text.removeprefix("-").isdigit():
            time_ns = int(text[:32])
        else:
            time_ns = round(self._number(place, self._time, {self._time: text}, NS_MAX / self._ns) * self._ns)
        if abs(time_ns) > NS_MAX:
            raise BadPoses(describe(f"{place}: column {column!r} is out of range", text))
        return time_ns

    def _number(self, place: str, column: int, cells: Sequence[str] | Mapping[int, str], most: float) -> float:
        text = cells[column].strip()
        try:
            number = float(text)
        except ValueError:
            number = float("nan")
        if not isfinite(number):
            raise BadPoses(describe(f"{place}: column {self._names[column]!r} is not a number", text))
        if abs(number) > most:
            raise BadPoses(describe(f"{place}: column {self._names[column]!r} is out of range ({most:g})", text))
        return number

    def _orientation(self, place: str, cells: Sequence[str]) -> tuple[float, float, float, float]:
        if self._yaw:
            angle = YAWS[self._yaw](self._number(place, self._names.index(self._yaw), cells, METRES_MAX))
            return 0.0, 0.0, sin(angle / 2), cos(angle / 2)
        if not self._quaternion:
            return 0.0, 0.0, 0.0, 1.0
        x, y, z, w = (self._number(place, column, cells, 2.0) for column in self._quaternion)
        length = sqrt(x * x + y * y + z * z + w * w)
        if abs(length - 1.0) > LENGTH_OFF:
            raise BadPoses(f"{place}: a quaternion of length {length:.4g}, it has 1")
        return x / length, y / length, z / length, w / length


def read_tracks(lines: Iterable[str], name: str) -> dict[str, Track]:
    """Return the track of each entity or link in a table, by name. `name` is that of the file. Raises BadPoses."""
    table: _Table | None = None
    found: dict[str, _Samples] = {}
    rows, separator = 0, ","
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
        rows += 1
        if rows > ROWS_MAX:
            raise BadPoses(f"{place}: more than {ROWS_MAX} lines")
        _add(found, place, *table.row(place, cells))
    if table is None:
        raise BadPoses(f"{name}: it is empty, the first line names the columns")
    if not found:
        raise BadPoses(f"{name}: no line behind that of the columns")
    return {entity: _track(samples) for entity, samples in sorted(found.items())}


def _add(found: dict[str, _Samples], place: str, entity: str, time_ns: int, pose: Sequence[float]) -> None:
    samples = found.get(entity)
    if samples is None:
        if len(found) >= ENTITIES_MAX:
            raise BadPoses(f"{place}: more than {ENTITIES_MAX} entities")
        samples = found[entity] = _Samples()
    if samples.times and time_ns <= samples.times[-1]:
        before = samples.times[-1] / 1e9
        raise BadPoses(f"{place}: {entity} at {time_ns / 1e9:.9g} s comes behind {before:.9g} s; times ascend")
    samples.times.append(time_ns)
    samples.poses.extend(pose)


def _track(samples: _Samples) -> Track:
    times = np.array(samples.times, dtype=np.int64)
    return Track(times, np.array(samples.poses, dtype=np.float64).reshape(len(times), 7))
