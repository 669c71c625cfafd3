"""Checks of a deployment's `network:`: matches of selectors, settings that depend on each other or that a radio does
not support, and events, also ones requested during a run.

What rules set of radios is checked when no reference of the network is wrong, for then it is known which radio the
packets of a pair go by. validate.py has the table of all checks.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import translate
from fractions import Fraction
from functools import cached_property
from itertools import chain, islice, permutations
from typing import Final

from pydantic import ValidationError

from foosim.common import limits, units
from foosim.common.errors import Refused, describe
from foosim.common.finding import Finding, Location, with_written
from foosim.common.json_text import encode_json
from foosim.common.names import nearest_quoted
from foosim.deployment.network.impairments import (
    BURSTS,
    Burst,
    GammaJitter,
    Impairments,
    Jitter,
    LognormalJitter,
    MixtureJitter,
    ParetoJitter,
    Trace,
)
from foosim.deployment.network.link_settings import Profiles
from foosim.deployment.network.presets import preset_settings
from foosim.deployment.network.radios import Radio, lora_longest
from foosim.deployment.network.rules import ACTIONS, REST, Event, LinkRule, Network
from foosim.deployment.network.traces import file_settings
from foosim.deployment.schema import Deployment
from foosim.deployment.schema_errors import schema_findings
from foosim.deployment.text.selection import Population

JITTER_RATIO_MAX: Final = 100
NEAREST_MAX: Final = 128
"""How often a nearest name is looked for: among thousands of names that takes 20 ms, and not all problems are shown."""
BANDWIDTHS: Final = {"802.11a/g": ("20 MHz", "10 MHz"), "802.11n": ("20 MHz",)}
"""Of Wi-Fi: those whose rates are known here; 10 MHz is 802.11p."""
_RATES: Final = {
    "wifi": "a radio's bit rate is its own: write `rates: fixed` and `fixed_rate` there",
    "ieee802154": "a radio's bit rate is 250 kbit/s",
    "lora": "a radio's bit rate is that of its `spreading_factor`",
    "lte": "a radio's bit rate is that of its signal and `bandwidth`",
}
"""Media with bit rates of their own, and the settings that decide them."""
_OWN_HEADERS: Final = ("wifi", "ieee802154", "lora")
_OF_MEDIUM: Final = {
    "rates": "wifi",
    "fixed_rate": "wifi",
    "standard": "wifi",
    "access": "wifi",
    "spreading_factor": "lora",
    "coding_rate": "lora",
    "gateway": "lora",
}
"""Keys that one medium alone reads."""
PAIRS_MAX: Final = 200_000
"""Pairs of endpoints that are searched for settings without effect; further pairs are accepted."""
_LIMITING: Final = {"rate_bps": "rate", "trace": "trace", "overhead_bytes": "overhead", "payload_max": "mtu"}
"""Fields of a rule that some media ignore, and their keys."""
SHOWN_MAX: Final = 20
_UNDER: Final[Location] = ("network", "events", 0)
Kind = tuple[tuple[int, ...], tuple[str, ...], bool]
"""The properties of an endpoint for rules and radios: the selectors that match it, by number, its radios, and
whether it is the console."""


class Names(Population):
    """The names of a deployment's endpoints, and the comparisons with them, which are bounded."""

    def __init__(self, endpoints: Sequence[str]) -> None:
        super().__init__(endpoints)
        self._nearest = 0

    def matched(self, glob: str) -> Sequence[str]:
        """The endpoints that a selector without ranges matches. Raises TooManyComparisons."""
        return [] if ".." in glob else [name for name, _ in self.chosen(glob)]

    def nearest(self, value: str, choices: Iterable[str]) -> str | None:
        """The valid name most similar to a wrong one, in quotes."""
        self._nearest += 1
        return nearest_quoted(value, choices) if self._nearest <= NEAREST_MAX else None


# --- the section by itself -------------------------------------------------------------------------------------------


def check_network(network: Network, ends: Names) -> Iterator[Finding]:
    """All problems of a network's section, found lazily; without endpoints the matches of selectors are not checked."""
    for name, radio in network.radios.items():
        location: Location = ("network", "radios", name)
        yield from _impairments(radio, radio.written, location)
        yield from radio_findings(radio, location)
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


def _unmatched(
    ends: Names, glob: str, location: Location, beside: Sequence[str] = (), *, is_key: bool = False
) -> Iterator[Finding]:
    """A selector matches an endpoint, or is one of those beside."""
    if ends.names and glob not in beside and not ends.matched(glob):
        nearest = ends.nearest(glob, [*ends.names, *beside])
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
        what = f"this loss needs bursts of at least {float(least):.4g} packets"
        yield Finding((*location, "mean_burst"), what)
    elif bad < 1 and mean >= 1 / (1 - bad):
        what = f"with this bad_loss bursts are shorter than {float(1 / (1 - bad)):.4g} packets"
        yield Finding((*location, "mean_burst"), what)


def _exact(share: float) -> Fraction:
    """Return the text of a number, in tenths."""
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
        yield Finding((*location, "until"), "beside `for`: only one of them is valid", at="key")
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


# --- settings that a radio does not support ---------------------------------------------------------------------------


def unheeded(key: str, medium: str) -> str | None:
    """Return why a key has no effect on a medium; None where it has."""
    if key in _OF_MEDIUM and medium != _OF_MEDIUM[key]:
        return f"has no effect on {medium}, it is of {_OF_MEDIUM[key]}"
    if key in ("rate", "trace") and medium in _RATES:
        return f"has no effect over {medium}: {_RATES[medium]}"
    if key == "trace" and medium == "radio":
        return "has no effect over radio: write `rate`"
    if key == "overhead" and medium in _OWN_HEADERS:
        return f"has no effect over {medium}, whose headers count already"
    return None


def radio_findings(radio: Radio, location: Location) -> Iterator[Finding]:
    """Return the settings of a radio that it does not support."""
    written = radio.written
    settings = {**preset_settings(radio.preset), **written}
    for key in [key for key in settings if settings[key] is not None and (key in written or key not in _OF_MEDIUM)]:
        problem = unheeded(key, radio.medium)
        if problem is None and key == "fixed_rate" and key in written and radio.rates != "fixed":
            problem = "has no effect without `rates: fixed`"
        if problem is not None:
            yield Finding((*location, key), problem, settings[key])
    known = BANDWIDTHS[radio.standard]
    if radio.medium == "wifi" and radio.bandwidth_hz not in [units.parse(text, units.FREQUENCY) for text in known]:
        problem = f"not a bandwidth of {radio.standard} here, which has {' or '.join(known)}"
        yield Finding((*location, "bandwidth"), problem, settings.get("bandwidth", "20 MHz"), repr(known[0]))
    problem = _unknown_airtime(radio)
    if radio.duty_cycle < 1 and problem is not None:
        yield Finding((*location, "duty_cycle"), problem, settings["duty_cycle"])
    longest = lora_longest(radio.spreading_factor) if radio.medium == "lora" else None
    if longest is not None and "mtu" in written and (radio.payload_max or 0) > longest:
        yield Finding((*location, "mtu"), _too_long(radio.spreading_factor, longest))


def _too_long(factor: int, longest: int) -> str:
    return f"more than the {longest} B of LoRaWAN at spreading factor {factor}"


def _unknown_airtime(radio: Radio) -> str | None:
    """Return why a radio has no duty cycle, which counts airtime that is known before it is used; None if it may."""
    if radio.medium == "lora" or (radio.medium == "radio" and radio.rate_bps is not None):
        return None
    if radio.medium == "radio":
        return "has no effect without `rate`: packets take no time"
    if not radio.is_on_air:
        return f"has no effect on {radio.medium}, it is of lora, and of radio with a rate"
    return f"not to be had on {radio.medium}, whose airtime is not known before it is used; lora has it, and radio"


def rule_findings(profiles: Profiles, ends: Sequence[str]) -> Iterator[Finding]:
    """Return the settings of rules, and of events for them, that the radios of their packets ignore.

    `ends` are the endpoints, none where they are not known: then only a rule's `via` is known.
    """
    network, ways = profiles.network, _Ways(profiles, ends)
    for number, rule in enumerate(network.links):
        yield from ways.unheeded(rule, rule, ("network", "links", number))
    for number, event in enumerate(network.events):
        yield from ways.changed(event, ("network", "events", number))


class _Ways:
    """The radios of the packets of rules. Of the endpoints, one pair of each kind is read."""

    def __init__(self, profiles: Profiles, ends: Sequence[str]) -> None:
        self._profiles = profiles
        self._ends = ends

    def changed(self, event: Event, location: Location) -> Iterator[Finding]:
        """Yield the settings of an event that the radios ignore."""
        change = event.set
        rules = self._profiles.network.links
        rule = None if change is None else next((rule for rule in rules if rule.id == change.link), None)
        if change is not None and rule is not None:
            yield from self.unheeded(rule, change, (*location, "set"))

    def unheeded(self, rule: LinkRule, settings: Impairments, location: Location) -> Iterator[Finding]:
        """Yield the settings of a rule, or of an event for it, that the radios ignore."""
        limits = [field for field in _LIMITING if field in settings.model_fields_set and getattr(settings, field)]
        ways = list(dict.fromkeys(self._of(rule))) if limits else []
        for field in limits:
            key = _LIMITING[field]
            for way in ways:
                radio = self._profiles.base(way)
                problem = unheeded(key, radio.medium)
                if key == "mtu" and radio.medium == "lora":
                    longest = lora_longest(radio.spreading_factor) or 0
                    too_long = (settings.payload_max or 0) > longest
                    problem = _too_long(radio.spreading_factor, longest) if too_long else None
                if problem is not None:
                    by = way or self._profiles.network.defaults.preset
                    yield Finding((*location, key), f"via {by}, {problem}", key, at="key")
                    break

    def _of(self, rule: LinkRule) -> Iterator[str]:
        """Yield by which radios packets go that meet a rule; the empty name is that of the defaults.

        If there are only wires, which all support the same settings, only a rule's `via` counts.
        """
        profiles = self._profiles
        if rule.via is not None:
            yield rule.via
            return
        if not any(profiles.base(way).is_on_air for way in ("", *profiles.network.radios)):
            return
        for source, destination in self._pairs:
            if any(met is rule for met in profiles.rules_for(source, destination)):
                way = profiles.way(rule, source, destination)
                if way is not None:
                    yield way

    @cached_property
    def _pairs(self) -> list[tuple[str, str]]:
        """Directed pairs of endpoints, one for each two kinds; a pair on one body has another link than one on two."""
        kinds = _kinds(self._profiles, self._ends)
        apart = permutations(_representatives(self._profiles, kinds), 2)
        on_body: dict[str, list[str]] = {}
        for end in self._ends:
            on_body.setdefault(self._profiles.body(end), []).append(end)
        together = {
            (kinds[one], kinds[other]): (one, other)
            for members in on_body.values()
            for one, other in islice(permutations(members, 2), PAIRS_MAX)
        }
        return list(islice(chain(together.values(), apart), PAIRS_MAX))


def _kinds(profiles: Profiles, ends: Sequence[str]) -> dict[str, Kind]:
    """Return the properties of each endpoint for rules and radios: the selectors that match it, and its radios."""
    rules = profiles.network.links
    globs = sorted({glob for rule in rules for glob in rule.selectors})
    matches = [re.compile(translate(glob)).match for glob in globs]
    found: dict[str, Kind] = {}
    for end in ends:
        matched = tuple(number for number, match in enumerate(matches) if match(end))
        found[end] = matched, tuple(profiles.radios_of(end)), end == profiles.console
    return found


def _representatives(profiles: Profiles, kinds: Mapping[str, Kind]) -> list[str]:
    """Return one endpoint of each kind, and one on another body where there is one, in their order."""
    bodies: dict[Kind, list[str]] = {}
    found = []
    for end, kind in kinds.items():
        known = bodies.setdefault(kind, [])
        if len(known) < 2 and profiles.body(end) not in known:
            known.append(profiles.body(end))
            found.append(end)
    return found


def place_findings(deployment: Deployment) -> Iterator[Finding]:
    """Return the endpoints without a body or a place that use a radio: their own, that of a rule or of the defaults."""
    network, ends = deployment.network, deployment.endpoints()
    profiles = deployment.profiles()
    on_air = {way for way in ("", *network.radios) if profiles.base(way).is_on_air}
    others: list[str] = []
    for end in ends if on_air else ():
        robot = deployment.robots.get(profiles.body(end))
        has_body = robot is not None and robot.component_type.has_body
        if has_body or network.place_of(end) is not None:
            continue
        where = f"is nowhere: write network.places.{end}{'' if end in deployment.robots else ' or its `on`'}"
        glob = next((glob for glob in network.robots if profiles.selects(glob, end)), "")
        own = next((radio for radio in network.robots.get(glob, ()) if radio in on_air), None)
        if own is not None:
            yield Finding(("network", "robots", glob), f"carries the radio {own}, but {where}", end, at="key")
            continue
        others = others or _representatives(profiles, _kinds(profiles, ends))
        pairs = [pair for other in others if other != end for pair in ((end, other), (other, end))]
        rules = ((rule, pair) for pair in pairs for rule in profiles.rules_for(*pair))
        met = ((rule, profiles.way(rule, *pair)) for rule, pair in rules if not profiles.is_ideal(rule, *pair))
        found = next(((rule, way) for rule, way in met if way in on_air), None)
        if found is not None:
            rule, way = found
            number = network.links.index(rule) if rule is not None else 0
            location: Location = ("network", "links", number, "via") if way and rule is not None else (
                "network", "defaults", "preset"
            )  # fmt: skip
            what = f"goes by radio to or from {end}, which {where}"
            yield Finding(location, what, way or network.defaults.preset)


# --- events that are requested during a run ---------------------------------------------------------------------------


class BadEvent(Refused):
    """An event with problems, one a line: `path: what, value, nearest name`."""

    exit_code = 2


def event_text(deployment: Deployment, data: object, at_ns: int) -> str:
    """Return an event as JSON, without spaces; `at_ns` is the simulated time at which it would happen.

    Raises BadEvent with all its problems, including references to the deployment.
    """
    if not isinstance(data, dict):
        raise BadEvent(describe("not an event, which is a mapping", data))
    findings = [with_written(finding, data) for finding in islice(_requested(deployment, data, at_ns), SHOWN_MAX)]
    if findings:
        raise BadEvent("\n".join(dict.fromkeys(finding.text for finding in findings)))
    text = encode_json(data).decode()
    if len(text.encode()) > limits.EVENT_BYTES_MAX:
        raise BadEvent(f"an event of {len(text.encode())} bytes, at most {limits.EVENT_BYTES_MAX} are allowed")
    return text


def _requested(deployment: Deployment, data: dict[str, object], at_ns: int) -> list[Finding]:
    if "at" in data:
        return [Finding(("at",), "a requested event happens at the next tick and has no time", "at", at="key")]
    links = [rule.id for rule in deployment.network.links]
    try:
        event = Event.model_validate({**data, "at": f"{at_ns} ns"})
    except ValidationError as error:
        of_schema = schema_findings(error, _UNDER)
        return [replace(finding, location=finding.location[len(_UNDER) :]) for finding in of_schema]
    found = list(event_findings(Names(deployment.endpoints()), (), event, links))
    found += _Ways(deployment.profiles(), deployment.endpoints()).changed(event, ())
    found += _files(deployment, event)
    if event.until_ns is not None and event.until_ns <= at_ns:
        what = f"not after the present simulated time, {units.format_ns(at_ns)}"
        found.append(Finding(("until",), what))
    return found


def _files(deployment: Deployment, event: Event) -> Iterator[Finding]:
    """A request cannot bring files: it may name those of the network, for the same use."""
    known = {(type(setting), setting.file) for _, setting in file_settings(deployment.network)}
    for _, setting in file_settings(Network(events=[event])):
        if (type(setting), setting.file) not in known or setting.digest is not None:
            key = "trace" if isinstance(setting, Trace) else "jitter"
            what = "not one of the files of its kind that this deployment's network names, or with a digest"
            yield Finding(("set", key, "file"), what, setting.file)
