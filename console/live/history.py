"""The console's history of a run, so that a page that is opened later can scroll back.

Numbers of frames, values of the status, figures of links and readings that were plotted: of each the rows of the last
minutes, so far apart that they fit a number of bytes. It keeps what the console receives anyway. Pure.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping
from math import isnan
from typing import Any, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from foosim.console.shown.curves import link_figure
from foosim.console.shown.source import FIGURES, Curve, Link, Reading, Wanted

WINDOW_NS: Final = 300_000_000_000
"""Simulated time for which rows are kept."""
APART_NS: Final = 100_000_000
"""Between rows, simulated time, where there is room."""
FRAMES_BYTES: Final = 16 * 1024 * 1024
STATUSES_BYTES: Final = 8 * 1024 * 1024
LINKS_BYTES: Final = 8 * 1024 * 1024
READINGS_MAX: Final = 64
"""The count of channels with kept readings: the most recently received ones."""
READINGS_BYTES: Final = 32 * 1024 * 1024 // READINGS_MAX
ROW_BYTES: Final = 256
"""Of a row in addition to its numbers."""

Points = list[tuple[float, float]]
Numbers = NDArray[np.floating[Any]]
Row = tuple[int, Any, Numbers]
"""The tick, the names of the numbers, the numbers; empty where a gap precedes the next row."""
_HOLE: Final[Numbers] = np.empty(0)


class Rows:
    """The last rows of one kind."""

    def __init__(self, tick_ns: int, bytes_max: int, dtype: DTypeLike = np.float64) -> None:
        self._rows: deque[Row] = deque()
        self._tick_ns, self._bytes_max, self._dtype = tick_ns, bytes_max, dtype
        self._is_interrupted = False

    def interrupt(self) -> None:
        """Have a hole before the next row."""
        self._is_interrupted = bool(self._rows)

    def is_due(self, tick: int, count: int) -> bool:
        """Whether a row of `count` numbers is to be kept at a tick. Later rows are forgotten: time went back."""
        while self._rows and self._rows[-1][0] > tick:
            self._rows.pop()
        if not self._rows:
            return True
        size = count * np.dtype(self._dtype).itemsize + ROW_BYTES
        apart_ns = max(APART_NS, WINDOW_NS * size // self._bytes_max)
        return (tick - self._rows[-1][0]) * self._tick_ns >= apart_ns

    def keep(self, tick: int, what: Any, numbers: Any) -> None:
        """Keep a row that is due."""
        if self._is_interrupted and self._rows:
            self._rows.append((self._rows[-1][0] + 1, None, _HOLE))
        self._is_interrupted = False
        self._rows.append((tick, what, np.array(numbers, self._dtype)))
        while (tick - self._rows[0][0]) * self._tick_ns > WINDOW_NS:
            self._rows.popleft()

    @property
    def newest(self) -> Any:
        """What the numbers of the newest row are, None without one."""
        return self._rows[-1][1] if self._rows else None

    def reader(self, place_in: Callable[[Any], int | None], *, has_gaps: bool = False) -> Callable[[], Points]:
        """Return a function for the points of one number of the kept rows, for any thread.

        `place_in` gives its place from what the numbers of a row are. Not a number is the value of a hole; in a row it
        is a hole too where the rows have gaps, else no point.
        """
        rows = list(self._rows)
        return lambda: [*_points(rows, place_in, has_gaps)]


def _points(rows: list[Row], place_in: Callable[[Any], int | None], has_gaps: bool) -> Iterator[tuple[float, float]]:
    what: Any = None
    place: int | None = None
    for tick, known, numbers in rows:
        if numbers is _HOLE:
            yield tick, np.nan
            continue
        if known is not what:
            what, place = known, place_in(known)
        if place is not None and place < len(numbers):
            value = float(numbers[place])
            if has_gaps or not isnan(value):  # as of a link that had no packet
                yield tick, value


class History:
    """The history of one run."""

    def __init__(self, tick_ns: int) -> None:
        self._tick_ns = tick_ns
        self._frames = Rows(tick_ns, FRAMES_BYTES, np.float32)
        self._statuses = Rows(tick_ns, STATUSES_BYTES)
        self._links = Rows(tick_ns, LINKS_BYTES)
        self._readings: dict[Reading, Rows] = {}
        self._watched: Collection[Reading] = ()

    def listen(self, wanted: Wanted) -> None:
        """Set the received data from now on: frames while a browser watches, readings that a browser plots."""
        if not (wanted.readers and wanted.hz):
            self._frames.interrupt()
        self._watched = wanted.readings  # readings of other viewers last as long as their lease
        for reading, rows in self._readings.items():
            if reading not in wanted.readings:
                rows.interrupt()

    def keep_frame(self, tick: int, values: NDArray[np.float64]) -> None:
        """Keep the numbers of a frame that are shown."""
        if self._frames.is_due(tick, len(values)):
            self._frames.keep(tick, "frame", values)

    def keep(self, message: Mapping[str, Any]) -> None:
        """Record a message of `status`, `links` or `readings`."""
        kind = message["type"]
        if kind == "status":
            status, before = message["status"], self._statuses.newest or {}
            if self._statuses.is_due(status["ticks"], len(before)):
                numbers = dict(_numbers(status, ""))
                self._statuses.keep(status["ticks"], _places(before, numbers), [*numbers.values()])
        elif kind == "links":
            self._keep_links(message["at"], message["links"])
        elif kind == "readings":
            self._keep_readings((message["robot"], message["channel"]), message["points"])

    def _keep_links(self, tick: int, links: list[Mapping[str, Any]]) -> None:
        if not self._links.is_due(tick, len(links) * len(FIGURES)):
            return
        rows: dict[Link, list[Mapping[str, Any]]] = {}
        for row in links:
            rows.setdefault((row["from"], row["to"]), []).append(row)
        numbers = [
            found[0][figure] if len(found) == 1 else link_figure(found, figure)
            for found in rows.values()
            for figure in FIGURES
        ]
        self._links.keep(tick, _places(self._links.newest or {}, rows), numbers)

    def _keep_readings(self, reading: Reading, points: list[tuple[int, list[float]]]) -> None:
        if reading not in self._watched:
            return
        rows = self._readings.pop(reading, None) or Rows(self._tick_ns, READINGS_BYTES)
        self._readings[reading] = rows  # the one received last
        if len(self._readings) > READINGS_MAX:
            del self._readings[next(iter(self._readings))]
        for tick, numbers in points:
            if rows.is_due(tick, len(numbers)):
                rows.keep(tick, reading, numbers)

    def reader(self, curve: Curve) -> Callable[[], Points]:
        """Return a function for the points of a curve."""
        if curve.field is not None:
            return self._frames.reader(lambda _: curve.field, has_gaps=True)
        if curve.status:
            return self._statuses.reader(lambda places: places.get(curve.status))
        if curve.link is not None:
            link, figure = curve.link, FIGURES.index(curve.figure)
            return self._links.reader(lambda places: places[link] * len(FIGURES) + figure if link in places else None)
        rows = None if curve.reading is None else self._readings.get(curve.reading)
        return list if rows is None else rows.reader(lambda reading: curve.index)


def _numbers(content: Mapping[str, Any], stem: str) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a status by their path; lists are left out."""
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from _numbers(value, f"{stem}{key}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield f"{stem}{key}", value


def _places(before: Mapping[Any, int], names: Mapping[Any, Any]) -> Mapping[Any, int]:
    """Return the places of names; the mapping of before where it has the same ones in the same order."""
    return before if [*before] == [*names] else {name: place for place, name in enumerate(names)}
