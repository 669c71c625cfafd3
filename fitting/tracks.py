"""Reads measured tracks of a ball from CSV.

The header names the columns, each quantity with its unit: `time [s]`, `x [mm]`, `y [mm]`, or `time_s`, `x_mm`, `y_mm`;
`t` is short for `time`. A column `track` separates tracks of one file; without one, a file is a track. Other columns
are passed over. Places are in the table's frame of reference.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Final

import numpy as np

from foosim.common import units
from foosim.common.errors import BadValue, Refused, no_such, show
from foosim.fitting.motion import Array, Field
from foosim.library.table.settings import Goal

TRACK: Final = "track"
QUANTITIES: Final = {"time": units.TIME, "x": units.LENGTH, "y": units.LENGTH}
ALIASES: Final = {"t": "time"}
LINES_MAX: Final = 1_000_000
POINTS_MIN: Final = 20
"""A track with fewer points determines little more than its start."""
TRACKS_MAX: Final = 50
POINTS_MAX: Final = 20_000
"""The fit's time grows with more than the square of the tracks: 8 s for 10, 43 s for 25, a minute and more beyond."""
PROBLEMS_MAX: Final = 20
_HEADER: Final = re.compile(r"\s*([a-z]+)\s*(?:\[\s*([^\]]+?)\s*\]|_([a-z]+))?\s*")


class BadTracks(Refused):
    """A file with tracks that cannot be read: all problems, one a line, `file:line:column: what`."""

    exit_code = 2


@dataclass(frozen=True, slots=True)
class Track:
    """A track: its name in messages, its file, its rows of time (s), x and y (m), and the line of each."""

    name: str
    file: str
    rows: Array
    lines: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Column:
    """Where a quantity is, and by how much its numbers are multiplied for SI units."""

    index: int
    factor: float


def read_tracks(text: str, name: str) -> list[Track]:
    """Return the tracks in the text of a file called `name`. Raises BadTracks."""
    lines = csv.reader(io.StringIO(text), strict=True)
    problems: list[str] = []
    found: dict[str, list[tuple[float, float, float]]] = {}
    numbers: dict[str, list[int]] = {}
    try:
        header = next(lines, None)
        if not header:
            raise BadTracks(f"{name}:1:1: no header with the columns time, x and y, each with its unit")
        columns, track = _columns(header, name)
        for row in lines:
            at = f"{name}:{lines.line_num}"
            if lines.line_num > LINES_MAX:
                raise BadTracks(f"{at}: more than {LINES_MAX} lines")
            values = _values(row, columns, at, problems) if any(map(str.strip, row)) else None
            if values is not None:
                key = name if track is None else f"{name} track {row[track].strip() if track < len(row) else ''}"
                rows = found.setdefault(key, [])
                if rows and values[0] <= rows[-1][0]:
                    problems.append(f"{at}:{columns['time'].index + 1}: time is not later than on the line before")
                rows.append(values)
                numbers.setdefault(key, []).append(lines.line_num)
            if len(problems) >= PROBLEMS_MAX:
                break
    except csv.Error as error:
        problems.append(f"{name}:{max(lines.line_num, 1)}: no CSV: {error}")
    if not found and not problems:
        problems.append(f"{name}: a header, and no measured places below it")
    if problems:
        raise BadTracks("\n".join(problems))
    return [Track(key, name, np.array(rows), tuple(numbers[key])) for key, rows in found.items()]


def _columns(header: Sequence[str], name: str) -> tuple[dict[str, _Column], int | None]:
    """Return the columns by quantity, and that of tracks. Raises BadTracks, columns counted from 1."""
    found: dict[str, _Column] = {}
    track = None
    problems = []
    for index, text in enumerate(header):
        match = _HEADER.fullmatch(text.lower())
        if match is None:
            continue
        quantity = ALIASES.get(match[1], match[1])
        unit = match[2] or match[3]
        at = f"{name}:1:{index + 1}"
        if quantity in found or (quantity == TRACK and track is not None):
            problems.append(f"{at}: a second column of {quantity}, {show(text)}")
        elif quantity == TRACK:
            track = index
        elif quantity in QUANTITIES:
            try:
                found[quantity] = _Column(index, _factor(quantity, unit))
            except BadValue as bad:
                problems.append(f"{at}: {bad}")
                found[quantity] = _Column(index, 1.0)
    missing = [quantity for quantity in QUANTITIES if quantity not in found]
    if missing:
        have = ", ".join(map(show, header[:12]))
        written = ", ".join(f"{quantity}_{_example(quantity)}" for quantity in missing)
        problems.append(f"{name}:1: no column of {', '.join(missing)}, as {written} (there are: {have})")
    if problems:
        raise BadTracks("\n".join(problems))
    return found, track


def _factor(quantity: str, unit: str | None) -> float:
    """Return the value of a unit in SI units. Raises BadValue."""
    dimension = QUANTITIES[quantity]
    if unit is None:
        example = _example(quantity)
        raise BadValue(f"{quantity} has no unit: write {quantity} [{example}] or {quantity}_{example}")
    if unit not in dimension.units:
        raise no_such(f"no unit of {quantity} (there are: {', '.join(dimension.units)})", unit, dimension.units)
    size = dimension.units[unit]
    return float(size) / 1e9 if quantity == "time" else float(size)


def _example(quantity: str) -> str:
    return "s" if quantity == "time" else "mm"


def _values(
    row: Sequence[str], columns: dict[str, _Column], at: str, problems: list[str]
) -> tuple[float, float, float] | None:
    """Return time, x and y of a row in SI units; None where one is missing, noted, or the place was not seen."""
    texts = {name: row[column.index].strip() if column.index < len(row) else "" for name, column in columns.items()}
    if texts["time"] and not texts["x"] and not texts["y"]:
        return None  # the ball was not found in this picture
    values = []
    for name, column in columns.items():
        try:
            value = float(texts[name]) * column.factor
        except ValueError:
            value = float("nan")
        if not isfinite(value):
            problems.append(f"{at}:{column.index + 1}: {name} is no number, {show(texts[name])}")
            return None
        values.append(value)
    by_name = dict(zip(columns, values, strict=True))
    return by_name["time"], by_name["x"], by_name["y"]


def usable(tracks: Sequence[Track], field: Field, ramps: float, goal: Goal) -> tuple[list[Track], list[str]]:
    """Return the parts of tracks that are over the level floor, and messages about the rest.

    A track ends where it comes over a corner ramp (a right triangle with legs of `ramps`, m) or to a goal. Raises
    BadTracks where a place before that is off the field, a track is there twice, or nothing is left.
    """
    kept: list[Track] = []
    notes = []
    for track in tracks:
        count = _count_on_floor(track, field, ramps, goal)
        is_cut = count < len(track.rows)
        if count < POINTS_MIN:
            why = "before a ramp or a goal" if is_cut else "in all"
            notes.append(f"{track.name}: left out, {count} points {why}, at least {POINTS_MIN} are needed")
            continue
        if is_cut:
            notes.append(
                f"{track.name}: used up to line {track.lines[count - 1]}, then the ball comes to a ramp or a goal"
            )
        rows = track.rows[:count]
        for other in kept:
            if np.array_equal(other.rows, rows):
                raise BadTracks(f"{track.name} and {other.name} are the same track: it would count twice")
        kept.append(Track(track.name, track.file, rows, track.lines[:count]))
    if not kept:
        raise BadTracks("\n".join([*notes, "no track is long enough"]))
    points = sum(len(track.rows) for track in kept)
    if len(kept) > TRACKS_MAX or points > POINTS_MAX:
        raise BadTracks(
            f"{len(kept)} tracks of {points} points, at most {TRACKS_MAX} and {POINTS_MAX} are fitted at once"
        )
    return kept, notes


def _count_on_floor(track: Track, field: Field, ramps: float, goal: Goal) -> int:
    """Return how many points a track has before a ramp or a goal. Raises BadTracks for one off the field up to there.

    A ball may be in the pocket of a goal, and, by the noise of a camera, beyond a wall by its radius.
    """
    x, y = np.abs(track.rows[:, 1]), np.abs(track.rows[:, 2])
    is_before_goal = y < goal.width / 2
    to_corner = (field.x + field.radius - x) + (field.y + field.radius - y)
    left = (to_corner < ramps + field.radius) | ((x > field.x - field.radius) & is_before_goal)
    count = int(np.argmax(left)) if left.any() else len(track.rows)
    depth = np.where(is_before_goal, goal.depth, 0.0)
    beyond = (x > field.x + depth + field.radius) | (y > field.y + field.radius)
    if beyond[: count + 1].any():
        row = int(np.argmax(beyond))
        place = ", ".join(f"{value * 1e3:.0f} mm" for value in track.rows[row, 1:])
        raise BadTracks(
            f"{track.file}:{track.lines[row]}: off the field ({place}; |x| is up to {field.x * 1e3:.1f} mm and "
            f"|y| up to {field.y * 1e3:.1f} mm): the origin is in the middle, and units are those of the header"
        )
    return count
