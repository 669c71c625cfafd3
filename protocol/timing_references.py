"""What one field of a deployment cannot know of times: rates and offsets are whole ticks, offsets below their periods.

Like references.py, whose findings it makes, it reads plain data and passes over what is malformed.
"""

from collections.abc import Iterator

from foosim.protocol import units
from foosim.protocol.errors import BadValue
from foosim.protocol.references import Finding, Location, View
from foosim.protocol.units import format_ns


def check_timing(data: object) -> Iterator[Finding]:
    """All problems of a deployment's times, found as they are asked for."""
    view = View(data)
    yield from _clients(view)
    tick_ns = view.tick_ns()
    if tick_ns is None:
        return
    yield from _substeps(view, tick_ns)
    for place in _sampled(view):
        yield from _rate(view, (*place, "rate"), tick_ns)
        yield from _offset(view, place, tick_ns)
    yield from _rate(view, ("capture", "poses"), tick_ns)


def _sampled(view: View) -> Iterator[Location]:
    """What happens at ticks that its rate and offset say: sensors, and who is in lockstep."""
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
    """A client in lockstep has a rate; who is not in lockstep has no ticks of its own, and so no offset."""
    for name in view.clients:
        if _in_lockstep(view, "clients", name, is_default=False) and view.get("clients", name, "rate") is None:
            yield Finding(("clients", name, "rate"), "missing key of a client in lockstep", "rate", at="missing")
    for section, is_default in (("players", True), ("clients", False)):
        for name in view.mapping(section):
            if view.get(section, name, "offset") is None or _in_lockstep(view, section, name, is_default=is_default):
                continue
            what = "an offset of who is not in lockstep: a free-running client has no ticks of its own"
            yield Finding((section, name, "offset"), what, "offset", at="key")
