"""Checks of a deployment's times: sensors have any rate up to that of the ticks, rates and offsets of who acts in
lockstep are whole ticks, offsets are below their periods.

Like `checks`, it reads plain data and skips malformed values.
"""

from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from fractions import Fraction
from itertools import chain
from math import ceil
from typing import Any

from foosim.common import names, units
from foosim.common.errors import BadValue
from foosim.common.finding import Finding, Location
from foosim.common.spec_base import RATE_MIN
from foosim.common.units import format_ns, format_rate
from foosim.deployment.checks import View

Said = dict[tuple[int, str], dict[str, list[str]]]
"""By a player's `hears` (its id) and a selector: the channels that it subscribes to, with endpoints that have them."""


def check_timing(data: object) -> Iterator[Finding]:
    """All problems of a deployment's times, found lazily."""
    view = View(data)
    yield from _clients(view)
    known: Said = {}
    for player in view.players:
        yield from _arrivals(view, player, known)
    tick_ns = view.tick_ns()
    if tick_ns is None:
        return
    yield from _substeps(view, tick_ns)
    for place in _sensors(view):
        yield from _sensor(view, place, tick_ns)
    for place in _lockstep(view):
        yield from _rate(view, (*place, "rate"), tick_ns)
        yield from _offset(view, place, tick_ns)
    yield from _rate(view, ("capture", "poses"), tick_ns)


def _sensors(view: View) -> Iterator[Location]:
    seen: set[int] = set()
    for robot in view.robots:
        sensors = view.mapping("robots", robot, "sensors")
        if id(sensors) not in seen:  # robots that are like a template share its sensors
            seen.add(id(sensors))
            yield from (("robots", robot, "sensors", channel) for channel in sensors)


def _lockstep(view: View) -> Iterator[Location]:
    """Lockstep clients: their ticks follow from rate and offset."""
    for section, is_default in (("players", True), ("clients", False)):
        for name in view.mapping(section):
            if _in_lockstep(view, section, name, is_default=is_default):
                yield section, name


def _in_lockstep(view: View, section: str, name: str, *, is_default: bool) -> bool:
    lockstep = view.get(section, name, "lockstep")
    return lockstep is not False if is_default else lockstep is True


def _substeps(view: View, tick_ns: int) -> Iterator[Finding]:
    """The tick divides into its substeps."""
    substeps = view.get("substeps")
    if isinstance(substeps, int) and not isinstance(substeps, bool) and 1 <= substeps <= 64 and tick_ns % substeps:
        valid = sorted((n for n in range(1, 65) if tick_ns % n == 0), key=lambda n: (abs(n - substeps), n))
        what = f"does not divide the tick of {tick_ns} ns"
        yield Finding(("substeps",), what, substeps, " and ".join(str(n) for n in sorted(valid[:2])))


def _sensor(view: View, place: Location, tick_ns: int) -> Iterator[Finding]:
    """A sensor has at most a reading at each tick, and its offset is below its period."""
    text, offset = view.get(*place, "rate"), view.get(*place, "offset")
    try:
        rate = units.parse(text, units.RATE)
    except BadValue:
        return
    fastest = Fraction(units.NS_PER_S, tick_ns)
    if rate > fastest:
        valid = f"valid are {RATE_MIN} to {format_rate(fastest)}"
        yield Finding((*place, "rate"), f"above the rate of the ticks: {valid}", text, repr(format_rate(fastest)))
    if rate <= 0 or rate > fastest or offset is None:
        return
    try:
        offset_ns = units.parse_ns(offset)
    except BadValue:
        return
    period_ns = units.NS_PER_S / rate
    if offset_ns >= period_ns:
        period = format_ns(int(period_ns)) if period_ns.denominator == 1 else f"{1 / rate} s"
        valid = f"valid are {format_ns(0)} to {format_ns(ceil(period_ns) - 1)}"
        yield Finding((*place, "offset"), f"not below the period of {period}: {valid}", offset)


def _rate(view: View, place: Location, tick_ns: int) -> Iterator[Finding]:
    text = view.get(*place)
    try:
        rate = units.parse(text, units.RATE)
        if rate > 0:
            units.period_ticks(rate, tick_ns)
    except BadValue as bad:
        if bad.problem.startswith("not a whole"):
            yield Finding(place, bad.problem, text, bad.nearest)


def _offset(view: View, place: Location, tick_ns: int) -> Iterator[Finding]:
    """An offset is whole ticks and below the period, where that is one."""
    text = view.get(*place, "offset")
    if text is None:
        return
    location = (*place, "offset")
    try:
        offset_ns = units.parse_ns(text)
        period_ns = _period_ns(view.get(*place, "rate"), tick_ns)
    except BadValue:
        return
    valid = f"{format_ns(0)} to {format_ns(period_ns - tick_ns)} in steps of {format_ns(tick_ns)}"
    if offset_ns >= period_ns:
        yield Finding(location, f"not below the period of {format_ns(period_ns)}: valid are {valid}", text)
    elif offset_ns % tick_ns:
        below = offset_ns - offset_ns % tick_ns
        near = [at for at in (below, below + tick_ns) if at < period_ns]
        nearest = " and ".join(repr(format_ns(at)) for at in near)
        yield Finding(location, f"not a whole number of ticks of {format_ns(tick_ns)}", text, nearest)


def _period_ns(text: object, tick_ns: int) -> int:
    """The period of a rate that is one; raises BadValue."""
    rate_hz = units.parse(text, units.RATE)
    if rate_hz <= 0:
        raise BadValue("not a rate above 0 Hz", text)
    return units.period_ticks(rate_hz, tick_ns) * tick_ns


def _clients(view: View) -> Iterator[Finding]:
    """A lockstep client has a rate; a free-running one has no ticks of its own, and so no offset."""
    for name in view.clients:
        if _in_lockstep(view, "clients", name, is_default=False) and view.get("clients", name, "rate") is None:
            yield Finding(("clients", name, "rate"), "missing key of a client in lockstep", "rate", at="missing")
    for section, is_default in (("players", True), ("clients", False)):
        for name in view.mapping(section):
            if view.get(section, name, "offset") is None or _in_lockstep(view, section, name, is_default=is_default):
                continue
            what = "an offset of who is not in lockstep: a free-running client has no ticks of its own"
            yield Finding((section, name, "offset"), what, "offset", at="key")


def _arrivals(view: View, player: str, known: Said) -> Iterator[Finding]:
    """A client that acts at arrival is in lockstep, has no ticks of its own, and subscribes to its `arrivals`.

    `known` keeps what is found out about the selectors.
    """
    at: Location = ("players", player)
    arrivals = view.mapping(*at, "arrivals")
    if view.get(*at, "act") != "arrival":
        if arrivals and view.get(*at, "act") in (None, "period"):
            what = "arrivals of a player that acts by its period: needs act: arrival"
            yield Finding((*at, "arrivals"), what, "arrivals", at="key")
        return
    if not _in_lockstep(view, "players", player, is_default=True):
        what = "needs lockstep: a free-running player acts by its own clock"
        yield Finding((*at, "act"), what, "arrival", "'period'")
    elif view.get(*at, "offset") is not None:
        what = "an offset of a player that acts at arrival, and so at no ticks of its own"
        yield Finding((*at, "offset"), what, "offset", at="key")
    if not arrivals:
        yield Finding((*at, "arrivals"), "missing key of a player that acts at arrival", "arrivals", at="missing")
    robots, hears = view.mapping(*at, "robots"), view.mapping(*at, "hears")
    for glob in filter(names.is_selector, arrivals):
        said = known.get((id(hears), glob))
        if said is None:  # players that are like a template share what they hear
            said = known[id(hears), glob] = _said(view, hears, glob)
        heard = {name for robot in robots if fnmatchcase(robot, glob) for _, name in view.texts(*at, "robots", robot)}
        heard |= {channel for channel, sources in said.items() if any(source != player for source in sources)}
        if not heard:
            others = (name for each in hears for name in view.matched(each) if name != player)
            nearest = view.nearest(glob, chain(robots, others))
            yield Finding((*at, "arrivals", glob), "a selector that matches nothing it hears", glob, nearest, at="key")
            continue
        for index, channel in view.texts(*at, "arrivals", glob):
            if channel not in heard:
                what = f"no channel that it hears of {glob}: valid are {', '.join(sorted(heard))}"
                yield Finding((*at, "arrivals", glob, index), what, channel)


def _said(view: View, hears: Mapping[str, Any], glob: str) -> dict[str, list[str]]:
    """The channels to which `hears` subscribes of endpoints that a selector matches, each with two of these."""
    said: dict[str, list[str]] = {}
    matched = {*view.matched(glob)}
    for selector, channels in hears.items():
        texts = [name for name in (channels if isinstance(channels, list) else ()) if isinstance(name, str)]
        for source in view.matched(selector) if names.is_selector(selector) and texts else ():
            if source not in matched:
                continue
            own = (*view.mapping("robots", source, "sensors"), names.CHANNEL_ECHO) if source in view.robots else texts
            for channel in texts:
                if channel in own and len(sources := said.setdefault(channel, [])) < 2 and source not in sources:
                    sources.append(source)
    return {channel: sources for channel, sources in said.items() if sources}
