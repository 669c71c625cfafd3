"""Checks of a deployment's times: sensors have any rate up to that of the ticks, rates and offsets of who acts in
lockstep are whole ticks, offsets are below their periods.
"""

from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from fractions import Fraction
from itertools import chain
from math import ceil

from foosim.common import names, units
from foosim.common.errors import BadValue
from foosim.common.finding import Finding, Location
from foosim.common.spec_base import RATE_MIN
from foosim.common.units import format_ns, format_rate
from foosim.deployment.checks import Names
from foosim.deployment.schema import Deployment, Player
from foosim.world.forms.settings import SensorSettings

Said = dict[tuple[str, str], dict[str, list[str]]]
"""By what a player hears, as a text, and a selector: the channels that it subscribes to, each with their endpoints."""


def check_timing(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """All problems of a deployment's times, found lazily."""
    tick_ns, substeps = deployment.tick_ns, deployment.substeps
    if tick_ns % substeps:
        valid = sorted((n for n in range(1, 65) if tick_ns % n == 0), key=lambda n: (abs(n - substeps), n))
        nearest = " and ".join(str(n) for n in sorted(valid[:2]))
        yield Finding(("substeps",), f"does not divide the tick of {tick_ns} ns", nearest=nearest)
    yield from _acting(deployment)
    known: Said = {}
    for name, player in deployment.players.items():
        yield from _arrivals(deployment, ends, ("players", name), player, known)
    seen: set[int] = set()
    for robot, settings in deployment.robots.items():
        for channel, sensor in settings.sensors.items():
            if id(sensor) not in seen:  # robots that are like a template share its sensors
                seen.add(id(sensor))
                yield from _sensor(sensor, ("robots", robot, "sensors", channel), tick_ns)
    if "poses_hz" in deployment.capture.model_fields_set:
        yield from _turns(deployment.capture.poses_hz, 0, ("capture",), tick_ns, "poses")


def _acting(deployment: Deployment) -> Iterator[Finding]:
    """A lockstep client has a rate; a free-running one has no ticks of its own, and so no offset."""
    for section in ("players", "clients"):
        for name, about in getattr(deployment, section).items():
            if not about.lockstep:
                if "offset_ns" in about.model_fields_set:
                    what = "an offset of who is not in lockstep: a free-running client has no ticks of its own"
                    yield Finding((section, name, "offset"), what, at="key")
            elif about.rate_hz is None:
                yield Finding((section, name, "rate"), "missing key of a client in lockstep", at="missing")
            else:
                yield from _turns(about.rate_hz, about.offset_ns, (section, name), deployment.tick_ns)


def _sensor(sensor: SensorSettings, place: Location, tick_ns: int) -> Iterator[Finding]:
    """A sensor has at most a reading at each tick, and its offset is below its period."""
    fastest, period_ns = Fraction(units.NS_PER_S, tick_ns), units.NS_PER_S / sensor.rate_hz
    if sensor.rate_hz > fastest:
        what = f"above the rate of the ticks: valid are {RATE_MIN} to {format_rate(fastest)}"
        yield Finding((*place, "rate"), what, nearest=repr(format_rate(fastest)))
    elif sensor.offset_ns >= period_ns:
        period = format_ns(int(period_ns)) if period_ns.denominator == 1 else f"{1 / sensor.rate_hz} s"
        valid = f"valid are {format_ns(0)} to {format_ns(ceil(period_ns) - 1)}"
        yield Finding((*place, "offset"), f"not below the period of {period}: {valid}")


def _turns(rate_hz: Fraction, offset_ns: int, place: Location, tick_ns: int, key: str = "rate") -> Iterator[Finding]:
    """A period is whole ticks; so is an offset, which is below the period."""
    try:
        period_ns = units.period_ticks(rate_hz, tick_ns) * tick_ns
    except BadValue as bad:
        yield Finding((*place, key), bad.problem, nearest=bad.nearest)
        return
    if offset_ns >= period_ns:
        valid = f"{format_ns(0)} to {format_ns(period_ns - tick_ns)} in steps of {format_ns(tick_ns)}"
        yield Finding((*place, "offset"), f"not below the period of {format_ns(period_ns)}: valid are {valid}")
    elif offset_ns % tick_ns:
        below = offset_ns - offset_ns % tick_ns
        nearest = " and ".join(repr(format_ns(at)) for at in (below, below + tick_ns) if at < period_ns)
        yield Finding((*place, "offset"), f"not a whole number of ticks of {format_ns(tick_ns)}", nearest=nearest)


def _arrivals(deployment: Deployment, ends: Names, at: Location, player: Player, known: Said) -> Iterator[Finding]:
    """A client that acts at arrival is in lockstep, has no ticks of its own, and subscribes to its `arrivals`.

    `known` keeps what is found out about the selectors.
    """
    arrivals, hears = player.arrivals, player.hears
    if player.act != "arrival":
        if arrivals:
            what = "arrivals of a player that acts by its period: needs act: arrival"
            yield Finding((*at, "arrivals"), what, at="key")
        return
    if not player.lockstep:
        what = "needs lockstep: a free-running player acts by its own clock"
        yield Finding((*at, "act"), what, nearest="'period'")
    elif "offset_ns" in player.model_fields_set:
        what = "an offset of a player that acts at arrival, and so at no ticks of its own"
        yield Finding((*at, "offset"), what, at="key")
    if not arrivals:
        yield Finding((*at, "arrivals"), "missing key of a player that acts at arrival", at="missing")
    for glob, channels in arrivals.items():
        key = str(hears), glob
        said = known.get(key)
        if said is None:  # players that are like a template hear the same
            said = known[key] = _said(deployment, ends, hears, glob)
        heard = {name for robot, own in player.robots.items() if fnmatchcase(robot, glob) for name in own}
        heard |= {channel for channel, sources in said.items() if any(source != at[-1] for source in sources)}
        if not heard:
            others = (name for each in hears for name in ends.matched(each) if name != at[-1])
            nearest = ends.nearest(glob, chain(player.robots, others))
            what = "a selector that matches nothing it hears"
            yield Finding((*at, "arrivals", glob), what, nearest=nearest, at="key")
            continue
        for index, channel in enumerate(channels):
            if channel not in heard:
                what = f"no channel that it hears of {glob}: valid are {', '.join(sorted(heard))}"
                yield Finding((*at, "arrivals", glob, index), what)


def _said(deployment: Deployment, ends: Names, hears: Mapping[str, Sequence[str]], glob: str) -> dict[str, list[str]]:
    """The channels to which `hears` subscribes of endpoints that a selector matches, each with two of these."""
    said: dict[str, list[str]] = {}
    matched = {*ends.matched(glob)}
    for selector, channels in hears.items():
        for source in ends.matched(selector) if channels else ():
            if source not in matched:
                continue
            robot = deployment.robots.get(source)
            own = channels if robot is None else (*robot.sensors, names.CHANNEL_ECHO)
            for channel in channels:
                if channel in own and len(sources := said.setdefault(channel, [])) < 2 and source not in sources:
                    sources.append(source)
    return {channel: sources for channel, sources in said.items() if sources}
