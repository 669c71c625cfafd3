"""Checks between the settings of a football table: lengths that fit each other, one rod for each line."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from foosim.common import units
from foosim.common.errors import Refused
from foosim.common.finding import Finding, Location
from foosim.common.plain_data import PlainData, mm
from foosim.world.forms import registry
from foosim.world.parameters.table import LINE_NAMES, TABLE


def table_findings(data: PlainData) -> Iterator[Finding]:
    """Yield what is wrong between the settings of a table, and of its robots."""
    yield from _robots(data)
    yield from _lines(data)
    yield from _shapes(data)
    yield from _drives(data)


def _robots(data: PlainData) -> Iterator[Finding]:
    """Lines exist and have one rod a team; other models may have such keys, too."""
    rods: dict[tuple[str, str], str] = {}
    lines = data.get(TABLE, "lines")
    for name in data.mapping("robots"):
        team, line = data.get("robots", name, "team"), data.get("robots", name, "line")
        if not (isinstance(team, str) and isinstance(line, str) and _is_rod(data.get("robots", name, "model"))):
            continue
        if line in LINE_NAMES and isinstance(lines, dict) and line not in lines:
            yield Finding(("robots", name, "line"), "not in table.lines", line, data.nearest(line, lines))
        first = rods.setdefault((team, line), name)
        if first != name:
            yield Finding(("robots", name, "line"), f"{team}'s line is already the rod {first}", line)


def _is_rod(model: object) -> bool:
    """Whether robots of a model are rods; what is wrong with its name is found elsewhere."""
    try:
        found = registry.lookup("model", model) if isinstance(model, str) else None
    except Refused:
        return False
    return found is not None and found.name == "rod"


def _lines(data: PlainData) -> Iterator[Finding]:
    """Figures stay off the side walls, rods span the field, at either end of the stroke."""
    width, foot = data.length(TABLE, "field", "width"), data.length(TABLE, "rod", "foot", "width")
    rod = data.length(TABLE, "rod", "length")
    for line in data.mapping(TABLE, "lines"):
        at: Location = (TABLE, "lines", line)
        figures = data.get(*at, "figures")
        pitch, stroke = data.length(*at, "pitch"), data.length(*at, "half_stroke")
        if width is None or stroke is None:
            continue
        location = (*at, "half_stroke")
        value = data.get(*location)
        if foot is not None and pitch is not None and isinstance(figures, int) and 1 <= figures <= 11:
            free = (width - pitch * (figures - 1) - foot) / 2
            if stroke > free:
                yield Finding(location, "figures would reach the side wall", value, _millimetres(free))
        if rod is not None and rod / 2 - stroke < width / 2:
            yield Finding(location, "the rod would leave the field uncovered", value, _millimetres((rod - width) / 2))


def _shapes(data: PlainData) -> Iterator[Finding]:
    """The table's lengths describe a table that can be built."""
    for small, big, why in (
        (("rod", "inner_radius"), ("rod", "radius"), ""),
        (("rod", "foot_radius"), ("rod", "axis_height"), "the feet would reach the floor: "),
        (("rod", "figure_com_below_axis"), ("rod", "foot_radius"), ""),
        (("goal", "width"), ("field", "width"), ""),
        (("goal", "height"), ("walls", "height"), ""),
    ):
        yield from data.too_big((TABLE, *small), (TABLE, *big), why)
    for side in ("depth", "width", "height"):
        yield from data.too_big((TABLE, "ball", "radius"), (TABLE, "goal", side), "the ball would not fit: ", 2)


def _drives(data: PlainData) -> Iterator[Finding]:
    """Position loops run once a tick: at twice its inverse an error changes its sign and stays, above it grows."""
    tick_ns = data.quantity(units.TIME, "tick")
    for axis in ("slide", "spin"):
        location = (TABLE, "drive", axis, "gain")
        gain = data.get(*location)
        if not isinstance(gain, int | float) or tick_ns is None or tick_ns <= 0:
            continue
        most = 2e9 / float(tick_ns)
        if gain >= most:
            yield Finding(location, f"a gain that cannot be stable: valid is below 2 / tick, {most:g} 1/s", gain)


def _millimetres(length: Fraction) -> str | None:
    return None if length <= 0 else f"'{mm(length)}'"
