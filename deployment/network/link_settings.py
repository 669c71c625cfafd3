"""Looks up the effective settings of a link: those of the rule that matches, over the radio of the packets' way, over
the defaults.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import Final

from foosim.deployment.network.impairments import BURSTS, Impairments, LinkSettings
from foosim.deployment.network.radios import Radio
from foosim.deployment.network.rules import LinkRule, Network

PERFECT: Final = "perfect"
ON_BOARD: Final = "on_board"
"""The rule of a link between a robot and an endpoint on it, where no rule matches: a perfect one."""
IDEAL: Final = "ideal"
"""The rule of a link to or from the console, where no rule names it: a perfect one, whatever selectors match it."""
NO_RADIO: Final = "no_radio"
"""The rule of a link between two endpoints without a common radio, or without the radio of their rule's `via`."""


@dataclass(frozen=True, slots=True)
class Profile:
    """The settings of a link, with the name of the rule that decided them and the radio."""

    rule: str
    radio: str
    settings: Radio
    is_own_queue: bool = False
    """Whether the link has a queue of its own, as a wire has whose rule has a rate; else the sender's radio has one."""


@lru_cache(maxsize=16)
def preset_radio(name: str) -> Radio:
    """Return a preset with nothing else written."""
    return Radio.model_validate({"preset": name})


class Profiles:
    """The profiles of one network's links. `carriers` are the robots that endpoints are on board of, `console` is the
    endpoint of the console, empty for none. `gateways` are clients of gateways: no rule applies between one and the
    robot that it is on board of."""

    def __init__(
        self, network: Network, carriers: Mapping[str, str], console: str, gateways: Collection[str] = ()
    ) -> None:
        self.network = network
        self._gateways = frozenset(gateways)
        self.console = console
        self._carriers = carriers
        self._by_channel = any(rule.channels is not None for rule in network.links)
        modelled = any(of.model is not None for of in (*network.radios.values(), *network.links))
        self.on_radio = modelled or any(radio.is_on_air for radio in (*network.radios.values(), self.base("")))
        """Whether the fate of packets may depend on where endpoints are: on air, or by a custom model."""

    def kind(self, channel: str) -> str:
        """Return what of a channel decides a link's profile: nothing, where no rule names channels."""
        return channel if self._by_channel else ""

    def body(self, endpoint: str) -> str:
        """Return the robot that an endpoint is or is on."""
        return self._carriers.get(endpoint, endpoint)

    def rule_for(self, source: str, destination: str, channel: str | None = None) -> LinkRule | None:
        """Return the first rule that matches the directed pair, or None."""
        rules = self._rules(source, destination)
        return next((rule for rule in rules if rule.matches(source, destination, channel)), None)

    def rules_for(self, source: str, destination: str) -> Iterator[LinkRule | None]:
        """Yield each rule that packets on some channel meet between the directed pair; None where they meet none."""
        for rule in self._rules(source, destination):
            if rule.matches(source, destination):
                yield rule
                if rule.channels is None:
                    return
        yield None

    def _rules(self, source: str, destination: str) -> Sequence[LinkRule]:
        """Return the rules that may apply to a pair; to the console's links only rules with its name apply."""
        if not self._gateways.isdisjoint((source, destination)) and self.body(source) == self.body(destination):
            return ()
        if self.console not in (source, destination):
            return self.network.links
        return [rule for rule in self.network.links if self.console in rule.selectors]

    def is_ideal(self, rule: LinkRule | None, source: str, destination: str) -> bool:
        """Whether a pair that meets a rule, or none, has an ideal link: one of the console, which no rule names."""
        return rule is None and self.console in (source, destination)

    def selects(self, glob: str, endpoint: str) -> bool:
        """Whether a selector of the network means an endpoint; the console is meant by its name alone."""
        return glob == endpoint if endpoint == self.console else fnmatchcase(endpoint, glob)

    def find(self, source: str, destination: str, channel: str) -> Profile:
        """Return the profile of packets from source to destination on a channel."""
        return self.of_rule(self.rule_for(source, destination, channel), source, destination)

    def of_rule(self, rule: LinkRule | None, source: str, destination: str) -> Profile:
        """Return the profile of a pair of which it is known which rule matches."""
        network = self.network
        if self.is_ideal(rule, source, destination):
            return Profile(IDEAL, "", preset_radio(PERFECT))
        way = self.way(rule, source, destination)
        if way is None:
            return Profile(NO_RADIO, "", preset_radio(PERFECT))
        if rule is None and self.body(source) == self.body(destination):
            return Profile(ON_BOARD, "", preset_radio(PERFECT))
        base = self.base(way)
        if rule is None:
            return Profile(way or network.defaults.preset, way, base)
        is_own_queue = not base.is_on_air and (way == "" or "rate_bps" in rule.model_fields_set)
        return Profile(rule.id, way, over(base, rule), is_own_queue)

    def way(self, rule: LinkRule | None, source: str, destination: str) -> str | None:
        """Return the radio by which packets that meet a rule go; empty for that of the defaults, None where there is
        none.

        A rule's `via` puts an endpoint without radios on that one; an endpoint with others needs one with the same
        air.
        """
        mine, theirs = self.radios_of(source), self.radios_of(destination)
        if rule is not None and rule.via is not None:
            air = self._air_of(rule.via)
            hears = all(not carried or air in map(self._air_of, carried) for carried in (mine, theirs))
            return rule.via if hears else None
        if self.body(source) == self.body(destination) or not mine or not theirs:
            return ""
        nothing = None if rule is None else ""
        return next((radio for radio in mine if radio in theirs), nothing)

    def radios_of(self, endpoint: str) -> list[str]:
        """Return the radios that an endpoint has: its own, or those of the robot that it is on."""
        for name in (endpoint, self._carriers.get(endpoint, "")):
            for glob, radios in self.network.robots.items() if name else ():
                if self.selects(glob, name):
                    return radios
        return []

    def _air_of(self, radio: str) -> str:
        """Return the channel of a radio: others with the same share it."""
        return self.network.radios[radio].air or radio

    def base(self, radio: str) -> Radio:
        """Return the settings of a radio alone; of the defaults for the empty name."""
        return self.network.radios[radio] if radio else preset_radio(self.network.defaults.preset)


def over(base: Radio, changes: LinkRule | Impairments) -> Radio:
    """Return a radio's settings with the rule's over them; a rule's model of bursts replaces the radio's."""
    written = {key: getattr(changes, key) for key in changes.model_fields_set if key in LinkSettings.model_fields}
    if any(key in written for key in BURSTS):
        written = dict.fromkeys(BURSTS) | written
    return base.model_copy(update=written)
