"""Checks for settings that a radio does not support: its own, those of rules over it, and of events on these.

What rules ask of radios is checked when no reference of the network is wrong, for then it is known which radio the
packets of a pair go by.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import translate
from functools import cached_property
from itertools import chain, islice, permutations
from typing import Any, Final

from foosim.common import units
from foosim.common.finding import Finding, Location
from foosim.deployment.network.impairments import Impairments
from foosim.deployment.network.link_settings import Profiles
from foosim.deployment.network.presets import preset_settings
from foosim.deployment.network.radios import Radio, lora_longest
from foosim.deployment.network.rules import Event, LinkRule
from foosim.deployment.schema import Deployment
from foosim.world.forms import registry

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
Kind = tuple[tuple[int, ...], tuple[str, ...], bool]
"""What rules and radios know of an endpoint: the selectors that match it, by number, the radios that it has, and
whether it is the console."""
PAIRS_MAX: Final = 200_000
"""Pairs of endpoints that are looked at for settings without an effect: in a valid deployment that is no error."""
_LIMITING: Final = {"rate_bps": "rate", "trace": "trace", "overhead_bytes": "overhead", "payload_max": "mtu"}
"""Fields of a rule that not every medium heeds, and their keys."""


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


# --- a radio's own settings -------------------------------------------------------------------------------------------


def radio_findings(radio: Radio, written: Mapping[str, Any], location: Location) -> Iterator[Finding]:
    """Return the settings of a radio that it does not support; `written` is what is written of it, as plain data."""
    settings = {**preset_settings(radio.preset), **written}
    asked = [key for key in settings if settings[key] is not None and (key in written or key not in _OF_MEDIUM)]
    for key in asked:
        what = unheeded(key, radio.medium)
        if what is None and key == "fixed_rate" and key in written and radio.rates != "fixed":
            what = "has no effect without `rates: fixed`"
        if what is not None:
            yield Finding((*location, key), what, settings[key])
    known = BANDWIDTHS[radio.standard]
    if radio.medium == "wifi" and radio.bandwidth_hz not in [units.parse(text, units.FREQUENCY) for text in known]:
        what = f"not a bandwidth of {radio.standard} here, which has {' or '.join(known)}"
        yield Finding((*location, "bandwidth"), what, settings.get("bandwidth", "20 MHz"), repr(known[0]))
    what = _unknown_airtime(radio)
    if radio.duty_cycle < 1 and what is not None:
        yield Finding((*location, "duty_cycle"), what, settings["duty_cycle"])
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


# --- settings of rules and events on radios ---------------------------------------------------------------------------


def rule_findings(profiles: Profiles, ends: Sequence[str]) -> Iterator[Finding]:
    """Return which settings of rules, and of events for them, the radios do not heed by which packets go.

    `ends` are the endpoints, none where they are not known: then only a rule's `via` is known.
    """
    network, ways = profiles.network, _Ways(profiles, ends)
    for number, rule in enumerate(network.links):
        yield from ways.asked(rule, rule, ("network", "links", number))
    for number, event in enumerate(network.events):
        yield from ways.changed(event, ("network", "events", number))


def set_findings(profiles: Profiles, event: Event, location: Location, ends: Sequence[str]) -> Iterator[Finding]:
    """Return which settings of an event the radios do not heed by which the packets go of the rule that it changes."""
    return _Ways(profiles, ends).changed(event, location)


class _Ways:
    """By which radios the packets of rules go. Of the endpoints, one pair of each kind is looked at."""

    def __init__(self, profiles: Profiles, ends: Sequence[str]) -> None:
        self._profiles = profiles
        self._ends = ends

    def changed(self, event: Event, location: Location) -> Iterator[Finding]:
        """Yield which settings of an event the radios do not heed."""
        change = event.set
        rules = self._profiles.network.links
        rule = None if change is None else next((rule for rule in rules if rule.id == change.link), None)
        if change is not None and rule is not None:
            yield from self.asked(rule, change, (*location, "set"))

    def asked(self, rule: LinkRule, settings: Impairments, location: Location) -> Iterator[Finding]:
        """Yield which of the settings of a rule, or of an event for it, the radios do not heed."""
        asked = [field for field in _LIMITING if field in settings.model_fields_set and getattr(settings, field)]
        ways = list(dict.fromkeys(self._of(rule))) if asked else []
        for field in asked:
            key = _LIMITING[field]
            for way in ways:
                radio = self._profiles.base(way)
                what = unheeded(key, radio.medium)
                if key == "mtu" and radio.medium == "lora":
                    longest = lora_longest(radio.spreading_factor) or 0
                    too_long = (settings.payload_max or 0) > longest
                    what = _too_long(radio.spreading_factor, longest) if too_long else None
                if what is not None:
                    by = way or self._profiles.network.defaults.preset
                    yield Finding((*location, key), f"via {by}, {what}", key, at="key")
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
        """Directed pairs of endpoints, one for each two kinds; a pair on one body goes another way than one on two."""
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
    """Return what rules and radios know of each endpoint: the selectors that match it, and its radios."""
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
        has_body = robot is not None and registry.model_of(robot).has_body
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
