"""Checks between the settings of a football table: lengths that fit each other, one rod for each line.

Lengths are compared exactly, as they are written.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import reduce
from itertools import pairwise
from math import hypot

from foosim.common.finding import Finding, Location, path_text
from foosim.common.names import nearest_quoted
from foosim.library.table.settings import TABLE, Strips, Table
from foosim.world.spec import WorldSpec


def table_findings(table: Table, spec: WorldSpec) -> Iterator[Finding]:
    """Yield the contradictions between the settings of a table, and of its robots."""
    yield from _robots(table, spec)
    yield from _lines(table)
    yield from _neighbours(table)
    yield from _corners(table)
    yield from _shapes(table)
    most = 2e9 / spec.tick_ns  # at twice the inverse of a tick an error changes its sign and stays, above it grows
    for axis in ("slide", "spin"):
        if getattr(table.drive, axis).gain >= most:
            what = f"a gain that cannot be stable: valid is below 2 / tick, {most:g} 1/s"
            yield Finding((TABLE, "drive", axis, "gain"), what)
    match = table.rules.match
    if match is not None and match.duration_ns is None and match.goals is None:
        what = "a match that nothing ends: it has a duration, a number of goals, or both; without match play has no end"
        yield Finding((TABLE, "rules", "match"), what)


def _robots(table: Table, spec: WorldSpec) -> Iterator[Finding]:
    """Lines exist and have one rod a team; other models may have such keys, too."""
    rods: dict[tuple[str, str], str] = {}
    for name, robot in spec.robots.items():
        if robot.component_type.name != "rod":
            continue
        team, line = robot.team, robot.line  # type: ignore[attr-defined]
        if line not in table.lines:
            nearest = nearest_quoted(line, table.lines)
            yield Finding(("robots", name, "line"), "not in table.lines", nearest=nearest)
        first = rods.setdefault((team, line), name)
        if first != name:
            yield Finding(("robots", name, "line"), f"{team}'s line is already the rod {first}")


def _lines(table: Table) -> Iterator[Finding]:
    """Figures stay off the side walls, rods span the field, at either end of the stroke."""
    width, foot, rod = _exact(table.field.width), _exact(table.rod.foot.width), _exact(table.rod.length)
    for name, line in table.lines.items():
        location = (TABLE, "lines", name, "half_stroke")
        stroke = _exact(line.half_stroke)
        free = (width - _exact(line.pitch) * (line.figures - 1) - foot) / 2
        if stroke > free:
            yield Finding(location, "figures would reach the side wall", nearest=_millimetres(free))
        if rod / 2 - stroke < width / 2:
            nearest = _millimetres((rod - width) / 2)
            yield Finding(location, "the rod would leave the field uncovered", nearest=nearest)


def _neighbours(table: Table) -> Iterator[Finding]:
    """Figures of neighbouring rods pass each other, also where one of them is level, and those of the last rods the end
    walls. Blue's rods are red's, mirrored."""
    rod, places = table.rod, list[tuple[Fraction, str, Location]]()
    for key, line in table.lines.items():
        x, by = _exact(line.x), (TABLE, "lines", key, "x")
        places += [(x, f"red's {key}", by), (-x, f"blue's {key}", by)]
    if rod.foot_radius >= rod.axis_height or not places:
        return
    reach, end = Fraction(hypot(rod.foot.length / 2, rod.foot_radius)), _exact(table.field.length)
    places.sort()
    reported: set[frozenset[Location]] = set()
    for (x, name, at), (there, other, beside) in pairwise(places):
        if there - x < 2 * reach and frozenset((at, beside)) not in reported:
            reported.add(frozenset((at, beside)))
            apart = f"{_mm(there - x)} apart, and their figures reach {float(reach * 1000):.1f} mm"
            what = f"{name} and {other} would overlap: they are {apart}"
            yield Finding(at, what, other=Finding(beside, what))
    if places[-1][0] + reach > end / 2:
        _, name, at = places[-1]
        nearer = f"valid is nearer to the middle than {float((end / 2 - reach) * 1000):.1f} mm"
        yield Finding(at, f"the figures of {name} would reach the end wall: {nearer}")


def _corners(table: Table) -> Iterator[Finding]:
    """Ramps leave the goals free, strips each other and the figures' feet."""
    length, width = _exact(table.field.length), _exact(table.field.width)
    most = min((width - _exact(table.goal.width)) / 2, length / 2)
    if _exact(table.ramps.leg) > most > 0:
        what = f"the ramps would reach into a goal: valid is up to {_mm(most)}"
        yield Finding((TABLE, "ramps", "leg"), what)
    if table.strips is not None:
        yield from _strips(table, table.strips, width)


def _strips(table: Table, strips: Strips, width: Fraction) -> Iterator[Finding]:
    wide = _exact(strips.width)
    if 2 * wide >= width:
        what = f"the strips would meet: valid is below {_mm(width / 2)}"
        yield Finding((TABLE, "strips", "width"), what)
        return
    clear = _exact(table.rod.axis_height) - _exact(table.rod.foot_radius)
    for name, line in table.lines.items():
        feet = _exact(line.pitch) * (line.figures - 1) + _exact(table.rod.foot.width)
        over = feet / 2 + _exact(line.half_stroke) - (width / 2 - wide)
        if over > 0 and _exact(strips.height) * min(over, wide) / wide >= clear:
            what = f"the feet of {name} would touch the strips {_mm(over)} in: lower or narrower ones are valid"
            yield Finding((TABLE, "strips", "height"), what)
            return


def _shapes(table: Table) -> Iterator[Finding]:
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
        if small[0] != "strips" or table.strips is not None:
            yield from _too_big(table, small, big, why)
    for side in ("depth", "width", "height"):
        yield from _too_big(table, ("ball", "radius"), ("goal", side), "the ball would not fit: ", 2)


def _too_big(table: Table, small: tuple[str, str], big: tuple[str, str], why: str, times: int = 1) -> Iterator[Finding]:
    """Yield a length of which `times` as much is not below another one; `why` that is wrong."""
    least, most = (_exact(reduce(getattr, path, table)) for path in (small, big))
    if times * least < most:
        return
    one, other = (TABLE, *small), (TABLE, *big)
    twice, half = ("twice that is ", "twice ") if times > 1 else ("", "")
    below = f"{why}{twice}not below {path_text(other)} ({_mm(most)}), valid is below {_mm(most / times)}"
    above = f"{why}not above {half}{path_text(one)} ({_mm(least)}), valid is above {_mm(least * times)}"
    yield Finding(one, below, other=Finding(other, above))


def _exact(length: object) -> Fraction:
    """Return a length (m) as it is written."""
    return Fraction(str(length))


def _mm(length: Fraction) -> str:
    return f"{float(length * 1000):g} mm"


def _millimetres(length: Fraction) -> str | None:
    return None if length <= 0 else f"'{_mm(length)}'"
