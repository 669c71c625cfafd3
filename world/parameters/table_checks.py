"""Checks between the settings of a football table: lengths that fit each other, one rod for each line."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import pairwise
from math import hypot

from foosim.common import units
from foosim.common.errors import Refused
from foosim.common.finding import Finding, Location
from foosim.common.plain_data import PlainData, mm
from foosim.world.forms import registry
from foosim.world.parameters.table import FIGURES_MAX, LINE_NAMES, TABLE


def table_findings(data: PlainData) -> Iterator[Finding]:
    """Yield what is wrong between the settings of a table, and of its robots."""
    yield from _robots(data)
    yield from _lines(data)
    yield from _neighbours(data)
    yield from _corners(data)
    yield from _shapes(data)
    yield from _drives(data)
    yield from _match(data)


def _match(data: PlainData) -> Iterator[Finding]:
    """A match ends by something."""
    location = (TABLE, "rules", "match")
    match = data.get(*location)
    if isinstance(match, dict) and match.get("duration") is None and match.get("goals") is None:
        what = "a match that nothing ends: it has a duration, a number of goals, or both; without match play has no end"
        yield Finding(location, what, match)


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
        if foot is not None and pitch is not None and isinstance(figures, int) and 1 <= figures <= FIGURES_MAX:
            free = (width - pitch * (figures - 1) - foot) / 2
            if stroke > free:
                yield Finding(location, "figures would reach the side wall", value, _millimetres(free))
        if rod is not None and rod / 2 - stroke < width / 2:
            yield Finding(location, "the rod would leave the field uncovered", value, _millimetres((rod - width) / 2))


def _neighbours(data: PlainData) -> Iterator[Finding]:
    """Figures of neighbouring rods pass each other, also where one of them is level, and those of the last rods the end
    walls. Blue's rods are red's, mirrored."""
    length, radius = data.length(TABLE, "rod", "foot", "length"), data.length(TABLE, "rod", "foot_radius")
    end, height = data.length(TABLE, "field", "length"), data.length(TABLE, "rod", "axis_height")
    places: list[tuple[Fraction, str, Location]] = []
    for line in data.mapping(TABLE, "lines"):
        at: Location = (TABLE, "lines", line, "x")
        x = data.length(*at)
        if x is not None and line in LINE_NAMES:
            places += [(x, f"red's {line}", at), (-x, f"blue's {line}", at)]
    if length is None or radius is None or height is None or radius >= height or not places:
        return
    reach = Fraction(hypot(length / 2, radius))
    places.sort()
    told: set[frozenset[Location]] = set()
    for (x, name, at), (there, other, by) in pairwise(places):
        if there - x < 2 * reach and frozenset((at, by)) not in told:
            told.add(frozenset((at, by)))
            apart = f"{mm(there - x)} apart, and their figures reach {float(reach * 1000):.1f} mm"
            what = f"{name} and {other} would overlap: they are {apart}"
            yield Finding(at, what, data.get(*at), other=Finding(by, what, data.get(*by)))
    if end is not None and places[-1][0] + reach > end / 2:
        _, name, at = places[-1]
        nearer = f"valid is nearer to the middle than {float((end / 2 - reach) * 1000):.1f} mm"
        yield Finding(at, f"the figures of {name} would reach the end wall: {nearer}", data.get(*at))


def _corners(data: PlainData) -> Iterator[Finding]:
    """Ramps leave the goals free, strips each other and the figures' feet."""
    length, width = data.length(TABLE, "field", "length"), data.length(TABLE, "field", "width")
    goal, leg = data.length(TABLE, "goal", "width"), data.length(TABLE, "ramps", "leg")
    if None not in (length, width, goal, leg):
        assert length is not None and width is not None and goal is not None and leg is not None, "for the types"
        most = min((width - goal) / 2, length / 2)
        if leg > most > 0:
            location: Location = (TABLE, "ramps", "leg")
            yield Finding(
                location, f"the ramps would reach into a goal: valid is up to {mm(most)}", data.get(*location)
            )
    strip = (TABLE, "strips")
    wide, high = data.length(*strip, "width"), data.length(*strip, "height")
    if wide is None or high is None or width is None:
        return
    if 2 * wide >= width:
        yield Finding(
            (*strip, "width"), f"the strips would meet: valid is below {mm(width / 2)}", data.get(*strip, "width")
        )
        return
    axis, radius = data.length(TABLE, "rod", "axis_height"), data.length(TABLE, "rod", "foot_radius")
    foot = data.length(TABLE, "rod", "foot", "width")
    if axis is None or radius is None or foot is None:
        return
    for line in data.mapping(TABLE, "lines"):
        at = (TABLE, "lines", line)
        figures, pitch, stroke = data.get(*at, "figures"), data.length(*at, "pitch"), data.length(*at, "half_stroke")
        if not isinstance(figures, int) or pitch is None or stroke is None:
            continue
        over = (pitch * (figures - 1) + foot) / 2 + stroke - (width / 2 - wide)
        if over > 0 and high * min(over, wide) / wide >= axis - radius:
            what = f"the feet of {line} would touch the strips {mm(over)} in: lower or narrower ones are valid"
            yield Finding((*strip, "height"), what, data.get(*strip, "height"))
            return


def _shapes(data: PlainData) -> Iterator[Finding]:
    """The table's lengths describe a table that can be built."""
    for small, big, why in (
        (("rod", "inner_radius"), ("rod", "radius"), ""),
        (("rod", "foot_radius"), ("rod", "axis_height"), "the feet would reach the floor: "),
        (("rod", "figure_com_below_axis"), ("rod", "foot_radius"), ""),
        (("goal", "width"), ("field", "width"), ""),
        (("goal", "height"), ("walls", "height"), ""),
        (("ramps", "height"), ("walls", "height"), "the ramps would be higher than the wall: "),
        (("strips", "height"), ("walls", "height"), "the strips would be higher than the wall: "),
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
