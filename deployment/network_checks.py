"""Checks between the fields of a deployment's `network:`: matches of selectors, and settings that depend on each other.

Like `checks`, it reads plain data and skips malformed values.
"""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, Final

from foosim.common import names, units
from foosim.common.errors import BadValue
from foosim.common.finding import Finding, Location
from foosim.deployment.checks import View, has_body
from foosim.deployment.network.impairments import BURST_MAX, BURSTS, PARETO_MAX
from foosim.deployment.network.rules import ACTIONS, EVENTS_MAX, LINK_RULES_MAX, RADIOS_MAX, REST
from foosim.deployment.radio_checks import is_on_air, radio_findings

JITTER_RATIO_MAX: Final = 100
NO_ENDPOINT: Final = "a selector that matches no endpoint"
_LASTING: Final = ("partition", "clog")


def check_network(data: object) -> Iterator[Finding]:
    """All problems of the network's section, found lazily."""
    view = View(data)
    if not view.mapping("network") or not view.robots:
        return
    yield from _radios(view)
    yield from _carriers(view)
    yield from _phase(view)
    yield from _placeless(view)
    yield from _links(view)
    yield from _events(view)


def check_network_alone(data: object) -> Iterator[Finding]:
    """All problems of a network's section without its deployment: the matches of its selectors are not checked."""
    view = View(data)
    for check in (_carriers, _links, _events):
        yield from (finding for finding in check(view) if finding.what != NO_ENDPOINT)
    yield from _radios(view)


def _count(view: View, key: str, at_most: int) -> range:
    entries = view.get("network", key)
    return range(min(len(entries), at_most) if isinstance(entries, list) else 0)


def _matches(view: View, location: Location, beside: Sequence[str] = ()) -> Iterator[Finding]:
    """Every selector of a list matches an endpoint."""
    for index, glob in view.texts(*location):
        if glob not in beside and names.is_selector(glob) and not view.matched(glob):
            nearest = view.nearest(glob, [*view.endpoints, *beside])
            yield Finding((*location, index), NO_ENDPOINT, glob, nearest)


def _radios(view: View) -> Iterator[Finding]:
    for name in list(view.mapping("network", "radios"))[:RADIOS_MAX]:
        location: Location = ("network", "radios", name)
        yield from _impairments(view, location)
        yield from radio_findings(view, location)


def _carriers(view: View) -> Iterator[Finding]:
    radios = view.mapping("network", "radios")
    for glob in list(view.mapping("network", "robots"))[:LINK_RULES_MAX]:
        location: Location = ("network", "robots", glob)
        if names.is_selector(glob) and not view.matched(glob):
            nearest = view.nearest(glob, view.endpoints)
            yield Finding(location, NO_ENDPOINT, glob, nearest, at="key")
        for index, radio in view.texts(*location):
            if radio not in radios:
                yield Finding((*location, index), "unknown radio", radio, view.nearest(radio, radios))
    for glob in list(view.mapping("network", "places"))[:LINK_RULES_MAX]:
        if names.is_selector(glob) and not view.matched(glob):
            nearest = view.nearest(glob, view.endpoints)
            yield Finding(("network", "places", glob), NO_ENDPOINT, glob, nearest, at="key")


def _phase(view: View) -> Iterator[Finding]:
    """Packets of one tick are sent before those of the next."""
    try:
        phase_ns, tick_ns = units.parse_ns(view.get("network", "defaults", "phase")), view.tick_ns()
    except BadValue:
        return
    if tick_ns is not None and phase_ns > tick_ns:
        text = view.get("network", "defaults", "phase")
        yield Finding(("network", "defaults", "phase"), "more than the tick", text, repr(units.format_ns(tick_ns)))


def _placeless(view: View) -> Iterator[Finding]:
    """An endpoint with a radio has a body, is on board of one, or has a place."""
    carried = [glob for glob in view.mapping("network", "robots") if names.is_selector(glob)]
    glob_of: dict[str, str] = {}
    for glob in carried:
        for endpoint in view.matched(glob):
            glob_of.setdefault(endpoint, glob)
    radios = {
        glob: [radio for _, radio in view.texts("network", "robots", glob) if is_on_air(view, radio)]
        for glob in carried
    }
    placed = {endpoint for place in view.mapping("network", "places") for endpoint in view.matched(place)}
    for endpoint in view.endpoints:
        glob = glob_of.get(endpoint, "")
        on_air = radios.get(glob)
        if not on_air or endpoint in placed:
            continue
        section = next(one for one in ("players", "clients", "robots") if endpoint in view.mapping(one))
        robot = endpoint if section == "robots" else view.get(section, endpoint, "on")
        if isinstance(robot, str) and has_body(view, view.get("robots", robot, "model")):
            continue
        what = f"carries the radio {on_air[0]}, but is nowhere: write network.places.{endpoint}"
        yield Finding(
            ("network", "robots", glob),
            what + (" or its `on`" if section != "robots" else ""),
            endpoint,
            at="key",
        )


def _links(view: View) -> Iterator[Finding]:
    """Rules have names of their own and two ends, and go via radios that there are."""
    seen: dict[str, int] = {}
    radios = view.mapping("network", "radios")
    for number in _count(view, "links", LINK_RULES_MAX):
        location: Location = ("network", "links", number)
        rule = view.mapping(*location)
        name = rule.get("id")
        if isinstance(name, str) and seen.setdefault(name, number) != number:
            yield Finding((*location, "id"), f"a name that is also links[{seen[name]}]'s", name)
        if rule and "between" in rule:
            for side in ("from", "to"):
                if side in rule:
                    yield Finding((*location, side), "beside `between`, which is both directions", side, at="key")
        for side in ("from", "to") if rule and "between" not in rule else ():
            if side not in rule:
                yield Finding((*location, side), "missing key", side, at="missing")
        for side in ("from", "to", "between"):
            yield from _matches(view, (*location, side))
        via = rule.get("via")
        if isinstance(via, str) and via not in radios:
            yield Finding((*location, "via"), "unknown radio", via, view.nearest(via, radios))
        yield from _impairments(view, location)


def _impairments(view: View, location: Location) -> Iterator[Finding]:
    """Settings of one link or radio fit together."""
    written = [key for key in BURSTS if view.get(*location, key) is not None]
    for key in written[1:]:
        yield Finding((*location, key), f"beside {written[0]}: a link has one model of bursts", key, at="key")
    yield from _burst(view, (*location, "burst"))
    yield from _markov4(view, (*location, "markov4"))
    yield from _jitter(view, (*location, "jitter"))


def _burst(view: View, location: Location) -> Iterator[Finding]:
    burst = view.mapping(*location)
    if not burst:
        return
    lengths = [key for key in ("mean_bad", "mean_burst") if key in burst]
    if len(lengths) == 2:
        yield Finding(
            (*location, "mean_burst"), "beside mean_bad: a time, or lost packets in a row", "mean_burst", at="key"
        )
    elif not lengths:
        yield Finding((*location, "mean_bad"), "missing key (or mean_burst)", "mean_bad", at="missing")
    if "dwell" in burst and "mean_bad" not in burst:
        yield Finding((*location, "dwell"), "lengths of times need mean_bad", "dwell", at="key")
    loss, bad = _share(burst.get("loss")), _share(burst.get("bad_loss", "100 %"))
    if loss is not None and bad is not None and loss >= bad:
        yield Finding((*location, "loss"), "not below bad_loss, which is lost in bad times", burst.get("loss"))
    elif loss is not None and bad is not None and lengths == ["mean_burst"]:
        yield from _chain(location, loss, bad, burst["mean_burst"])
    if lengths == ["mean_bad"]:
        yield from _dwell(view, location)


def _chain(location: Location, loss: Fraction, bad: Fraction, mean: object) -> Iterator[Finding]:
    """There is a chain of two states with this loss and this mean number of losses in a row.

    With s = loss / bad_loss and r the chance to leave the bad state, p = r s / (1 - s) is a chance, too: that bounds r,
    and mean = 1 / (1 - (1 - r) bad_loss) lies between those of the greatest r and of none.
    """
    if not isinstance(mean, int | float) or not 1 <= mean <= BURST_MAX or loss <= 0:
        return
    share = loss / bad
    least = 1 / (1 - max(Fraction(0), 2 - 1 / share) * bad)
    if mean < least:
        what = f"so much loss comes in bursts of at least {float(least):.4g} packets"
        yield Finding((*location, "mean_burst"), what, mean)
    elif bad < 1 and mean >= 1 / (1 - bad):
        what = f"with this bad_loss bursts are shorter than {float(1 / (1 - bad)):.4g} packets"
        yield Finding((*location, "mean_burst"), what, mean)


def _dwell(view: View, location: Location) -> Iterator[Finding]:
    try:
        mean_ns = units.parse_ns(view.get(*location, "mean_bad"))
        max_ns = units.parse_ns(view.get(*location, "dwell", "max"))
    except BadValue:
        return
    if max_ns <= mean_ns:
        yield Finding((*location, "dwell", "max"), "not above mean_bad", view.get(*location, "dwell", "max"))


def _markov4(view: View, location: Location) -> Iterator[Finding]:
    """The probabilities of leaving a state add up to at most 1."""
    for one, other in (("p13", "p14"), ("p31", "p32")):
        first, second = (_share(view.get(*location, key)) for key in (one, other))
        if first is not None and second is not None and first + second > 1:
            yield Finding((*location, other), f"more than 100 % with {one}", view.get(*location, other))


def _share(text: object) -> Fraction | None:
    try:
        return units.parse(text, units.PROBABILITY)
    except BadValue:
        return None


def _jitter(view: View, location: Location) -> Iterator[Finding]:
    """The spread of a jitter fits its mean: else nearly all of it is 0, or nearly none of it is spread."""
    shape = view.get(*location, "shape")
    if shape == "mixture":
        shares = [
            _share(view.get(*location, "parts", n, "share")) for n in range(len(view.get(*location, "parts") or ()))
        ]
        if None not in shares and sum(share or 0 for share in shares) != 1:
            yield Finding((*location, "parts"), "shares that do not add up to 100 %", len(shares))
        return
    if shape == "pareto":
        yield from _pareto(view, location)
    if shape not in ("gamma", "lognormal"):
        return
    try:
        mean_ns, sd_ns = (units.parse_ns(view.get(*location, key)) for key in ("mean", "sd"))
    except BadValue:
        return
    if not mean_ns <= JITTER_RATIO_MAX * sd_ns <= JITTER_RATIO_MAX * 3 * mean_ns:
        what = f"not between 1/{JITTER_RATIO_MAX} of the mean and 3 times the mean"
        yield Finding((*location, "sd"), what, view.get(*location, "sd"))


def _pareto(view: View, location: Location) -> Iterator[Finding]:
    """The cut leaves room for the mean."""
    jitter = view.mapping(*location)
    try:
        mean_ns, max_ns = units.parse_ns(jitter.get("mean")), units.parse_ns(jitter.get("max", PARETO_MAX))
    except BadValue:
        return
    if max_ns < 2 * mean_ns:
        yield Finding((*location, "mean"), f"above half of max, {jitter.get('max', PARETO_MAX)}", jitter.get("mean"))


def _events(view: View) -> Iterator[Finding]:
    """Each event has one action, existing targets, and a duration."""
    rules = [rule.get("id") for rule in view.get("network", "links") or () if isinstance(rule, dict)]
    links = [name for name in rules if isinstance(name, str)]
    for number in _count(view, "events", EVENTS_MAX):
        location: Location = ("network", "events", number)
        event = view.mapping(*location)
        if event:
            yield from event_findings(view, location, event, links)


def event_findings(view: View, location: Location, event: Any, links: Sequence[str]) -> Iterator[Finding]:
    """The problems of one event, at its location."""
    actions = [key for key in ACTIONS if key in event]
    if not actions:
        yield Finding((*location, "heal"), f"missing key: one of {', '.join(ACTIONS)}", "heal", at="missing")
        return
    for key in actions[1:]:
        yield Finding((*location, key), f"beside {actions[0]}: an event does one thing", key, at="key")
    action = actions[0]
    if "for" in event and "until" in event:
        yield Finding((*location, "until"), "beside `for`: one of them says how long", "until", at="key")
    for key in ("for", "until") if action not in _LASTING else ():
        if key in event:
            yield Finding((*location, key), f"{action} happens at once", key, at="key")
    yield from _ends(view, location)
    if action == "partition":
        groups = view.get(*location, "partition")
        for index in range(len(groups) if isinstance(groups, list) else 0):
            yield from _matches(view, (*location, "partition", index), (REST,))
    for side in ("from", "to"):
        yield from _matches(view, (*location, "clog", side))
    link = view.get(*location, "set", "link")
    if isinstance(link, str) and link not in links:
        yield Finding((*location, "set", "link"), "unknown link rule", link, view.nearest(link, links))
    if view.mapping(*location, "set"):
        yield from _impairments(view, (*location, "set"))


def _ends(view: View, location: Location) -> Iterator[Finding]:
    try:
        at_ns, until_ns = (units.parse_ns(view.get(*location, key)) for key in ("at", "until"))
    except BadValue:
        return
    if until_ns <= at_ns:
        yield Finding((*location, "until"), "not after the event's time", view.get(*location, "until"))
