"""Checks of a deployment's times: rates and offsets are whole ticks, offsets are below their periods.

Like `checks`, it reads plain data and skips malformed values.
"""

from collections.abc import Iterator
from fnmatch import fnmatchcase

from foosim.common import names, units
from foosim.common.errors import BadValue
from foosim.common.finding import Finding, Location
from foosim.common.names import nearest_name
from foosim.common.units import format_ns
from foosim.deployment.checks import View, quoted


def check_timing(data: object) -> Iterator[Finding]:
    """All problems of a deployment's times, found lazily."""
    view = View(data)
    yield from _clients(view)
    for player in view.players:
        yield from _arrivals(view, player)
    tick_ns = view.tick_ns()
    if tick_ns is None:
        return
    yield from _substeps(view, tick_ns)
    for place in _sampled(view):
        yield from _rate(view, (*place, "rate"), tick_ns)
        yield from _offset(view, place, tick_ns)
    yield from _rate(view, ("capture", "poses"), tick_ns)


def _sampled(view: View) -> Iterator[Location]:
    """Sensors and lockstep clients: their ticks follow from rate and offset."""
    for robot in view.robots:
        for channel in view.mapping("robots", robot, "sensors"):
            yield "robots", robot, "sensors", channel
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


def _arrivals(view: View, player: str) -> Iterator[Finding]:
    """A client that acts at arrival is in lockstep, has no ticks of its own, and subscribes to its `arrivals`."""
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
    heard = _heard(view, player)
    for glob in arrivals:
        matched = {source for source in heard if names.is_selector(glob) and fnmatchcase(source, glob)}
        if names.is_selector(glob) and not matched:
            nearest = quoted(nearest_name(glob, heard))
            yield Finding((*at, "arrivals", glob), "a selector that matches nothing it hears", glob, nearest, at="key")
            continue
        channels = sorted({channel for source in matched for channel in heard[source]})
        for index, channel in view.texts(*at, "arrivals", glob):
            if matched and channel not in channels:
                what = f"no channel that it hears of {glob}: valid are {', '.join(channels)}"
                yield Finding((*at, "arrivals", glob, index), what, channel)


def _heard(view: View, player: str) -> dict[str, set[str]]:
    """The channels that a player subscribes to, by endpoint."""
    heard: dict[str, set[str]] = {}
    for robot in view.mapping("players", player, "robots"):
        heard.setdefault(robot, set()).update(name for _, name in view.texts("players", player, "robots", robot))
    endpoints = [*view.robots, *view.players, *view.clients]
    for glob in view.mapping("players", player, "hears"):
        for endpoint in endpoints:
            if names.is_selector(glob) and endpoint != player and fnmatchcase(endpoint, glob):
                said = {name for _, name in view.texts("players", player, "hears", glob)}
                if endpoint in view.robots:
                    said &= {*view.mapping("robots", endpoint, "sensors"), names.CHANNEL_ECHO}
                heard.setdefault(endpoint, set()).update(said)
    return {endpoint: channels for endpoint, channels in heard.items() if channels}
