"""Checks between the fields of a deployment's `network:`: matches of selectors, settings that depend on each other."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, Final

from foosim.common import units
from foosim.common.finding import Finding, Location
from foosim.deployment.checks import Names
from foosim.deployment.network.impairments import (
    BURSTS,
    Burst,
    GammaJitter,
    Impairments,
    Jitter,
    LognormalJitter,
    MixtureJitter,
    ParetoJitter,
)
from foosim.deployment.network.rules import ACTIONS, REST, Event, Network
from foosim.deployment.radio_checks import radio_findings

JITTER_RATIO_MAX: Final = 100


def check_network(network: Network, ends: Names, radios: Mapping[str, Any]) -> Iterator[Finding]:
    """All problems of a network's section, found lazily; without endpoints the matches of selectors are not checked.

    `radios` is what is written of its radios, as plain data.
    """
    for name, radio in network.radios.items():
        location: Location = ("network", "radios", name)
        yield from _impairments(radio, radios[name], location)
        yield from radio_findings(radio, radios[name], location)
    for section in ("robots", "places"):
        for glob in getattr(network, section):
            yield from _unmatched(ends, glob, ("network", section, glob), is_key=True)
    for glob, carried in network.robots.items():
        for index, name in enumerate(carried):
            if name not in network.radios:
                nearest = ends.nearest(name, network.radios)
                yield Finding(("network", "robots", glob, index), "unknown radio", nearest=nearest)
    yield from _links(network, ends)
    links = [rule.id for rule in network.links]
    for number, event in enumerate(network.events):
        at: Location = ("network", "events", number)
        yield from event_findings(ends, at, event, links)
        if event.until_ns is not None and event.until_ns <= event.at_ns:
            yield Finding((*at, "until"), "not after the event's time")


def check_phase(network: Network, tick_ns: int) -> Iterator[Finding]:
    """Packets of one tick are sent before those of the next."""
    if network.defaults.phase_ns > tick_ns:
        nearest = repr(units.format_ns(tick_ns))
        yield Finding(("network", "defaults", "phase"), "more than the tick", nearest=nearest)


def _unmatched(
    ends: Names, glob: str, location: Location, beside: Sequence[str] = (), *, is_key: bool = False
) -> Iterator[Finding]:
    """A selector matches an endpoint, or is one of those beside."""
    if ends.endpoints and glob not in beside and not ends.matched(glob):
        nearest = ends.nearest(glob, [*ends.endpoints, *beside])
        what = "a selector that matches no endpoint"
        yield Finding(location, what, nearest=nearest, at="key" if is_key else "value")


def _matches(ends: Names, globs: Sequence[str], location: Location, beside: Sequence[str] = ()) -> Iterator[Finding]:
    """Every selector of a list matches an endpoint."""
    for index, glob in enumerate(globs):
        yield from _unmatched(ends, glob, (*location, index), beside)


def _links(network: Network, ends: Names) -> Iterator[Finding]:
    """Rules have names of their own and two ends, and go via radios that there are."""
    seen: dict[str, int] = {}
    for number, rule in enumerate(network.links):
        location: Location = ("network", "links", number)
        if seen.setdefault(rule.id, number) != number:
            yield Finding((*location, "id"), f"a name that is also links[{seen[rule.id]}]'s")
        for side, globs in (("from", rule.from_), ("to", rule.to)):
            if globs is not None and rule.between is not None:
                yield Finding((*location, side), "beside `between`, which is both directions", at="key")
            if globs is None and rule.between is None:
                yield Finding((*location, side), "missing key", at="missing")
            yield from _matches(ends, globs or (), (*location, side))
        yield from _matches(ends, rule.between or (), (*location, "between"))
        if rule.via is not None and rule.via not in network.radios:
            yield Finding((*location, "via"), "unknown radio", nearest=ends.nearest(rule.via, network.radios))
        yield from _impairments(rule, rule.model_fields_set, location)


def _impairments(settings: Impairments, keys: Collection[str], location: Location) -> Iterator[Finding]:
    """Settings of one link or radio, of which some keys are written, fit together."""
    written = [key for key in BURSTS if key in keys and getattr(settings, key) is not None]
    for key in written[1:]:
        yield Finding((*location, key), f"beside {written[0]}: a link has one model of bursts", at="key")
    if settings.burst is not None:
        yield from _burst(settings.burst, (*location, "burst"))
    if settings.markov4 is not None:
        for one, other in (("p13", "p14"), ("p31", "p32")):  # the probabilities of leaving a state
            if _exact(getattr(settings.markov4, one)) + _exact(getattr(settings.markov4, other)) > 1:
                yield Finding((*location, "markov4", other), f"more than 100 % with {one}")
    if settings.jitter is not None:
        yield from _jitter(settings.jitter, (*location, "jitter"))


def _burst(burst: Burst, location: Location) -> Iterator[Finding]:
    mean_ns, mean = burst.mean_bad_ns, burst.mean_burst
    if mean_ns is not None and mean is not None:
        what = "beside mean_bad: a time, or lost packets in a row"
        yield Finding((*location, "mean_burst"), what, at="key")
    elif mean_ns is None and mean is None:
        yield Finding((*location, "mean_bad"), "missing key (or mean_burst)", at="missing")
    if burst.dwell is not None and mean_ns is None:
        yield Finding((*location, "dwell"), "lengths of times need mean_bad", at="key")
    if burst.loss >= burst.bad_loss:
        yield Finding((*location, "loss"), "not below bad_loss, which is lost in bad times")
    elif mean is not None and mean_ns is None:
        yield from _chain(location, _exact(burst.loss), _exact(burst.bad_loss), mean)
    if burst.dwell is not None and mean is None and mean_ns is not None and burst.dwell.max_ns <= mean_ns:
        yield Finding((*location, "dwell", "max"), "not above mean_bad")


def _chain(location: Location, loss: Fraction, bad: Fraction, mean: float) -> Iterator[Finding]:
    """There is a chain of two states with this loss and this mean number of losses in a row.

    With s = loss / bad_loss and r the chance to leave the bad state, p = r s / (1 - s) is a chance, too: that bounds r,
    and mean = 1 / (1 - (1 - r) bad_loss) lies between those of the greatest r and of none.
    """
    share = loss / bad
    least = 1 / (1 - max(Fraction(0), 2 - 1 / share) * bad)
    if mean < least:
        what = f"so much loss comes in bursts of at least {float(least):.4g} packets"
        yield Finding((*location, "mean_burst"), what)
    elif bad < 1 and mean >= 1 / (1 - bad):
        what = f"with this bad_loss bursts are shorter than {float(1 / (1 - bad)):.4g} packets"
        yield Finding((*location, "mean_burst"), what)


def _exact(share: float) -> Fraction:
    """Return a number as it is written, in tenths."""
    return Fraction(str(share))


def _jitter(jitter: Jitter, location: Location) -> Iterator[Finding]:
    """The spread of a jitter fits its mean: else nearly all of it is 0, or nearly none of it is spread."""
    if isinstance(jitter, MixtureJitter):
        if sum(_exact(part.share) for part in jitter.parts) != 1:
            yield Finding((*location, "parts"), "shares that do not add up to 100 %", len(jitter.parts))
    elif isinstance(jitter, ParetoJitter):
        if jitter.max_ns < 2 * jitter.mean_ns:  # the cut leaves room for the mean
            yield Finding((*location, "mean"), f"above half of max, {units.format_ns(jitter.max_ns)}")
    elif isinstance(jitter, GammaJitter | LognormalJitter):
        ratio, mean_ns = JITTER_RATIO_MAX, jitter.mean_ns
        if not mean_ns <= ratio * jitter.sd_ns <= ratio * 3 * mean_ns:
            yield Finding((*location, "sd"), f"not between 1/{ratio} of the mean and 3 times the mean")


def event_findings(ends: Names, location: Location, event: Event, links: Sequence[str]) -> Iterator[Finding]:
    """The problems of one event, at its location: it has one action, existing targets, and a duration."""
    actions = [key for key in ACTIONS if getattr(event, key) is not None]
    if not actions:
        yield Finding((*location, "heal"), f"missing key: one of {', '.join(ACTIONS)}", at="missing")
        return
    for key in actions[1:]:
        yield Finding((*location, key), f"beside {actions[0]}: an event does one thing", at="key")
    lasting = [key for key, value in (("for", event.lasts), ("until", event.until_ns)) if value is not None]
    if len(lasting) > 1:
        yield Finding((*location, "until"), "beside `for`: one of them says how long", at="key")
    for key in lasting if actions[0] not in ("partition", "clog") else ():
        yield Finding((*location, key), f"{actions[0]} happens at once", at="key")
    for index, group in enumerate(event.partition or ()):
        yield from _matches(ends, group, (*location, "partition", index), (REST,))
    if event.clog is not None:
        yield from _matches(ends, event.clog.from_, (*location, "clog", "from"))
        yield from _matches(ends, event.clog.to, (*location, "clog", "to"))
    if event.set is not None:
        link = event.set.link
        if link not in links:
            yield Finding((*location, "set", "link"), "unknown link rule", nearest=ends.nearest(link, links))
        yield from _impairments(event.set, event.set.model_fields_set, (*location, "set"))
