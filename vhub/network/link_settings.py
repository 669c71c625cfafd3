"""Which settings are a link's: the rule that matches, over the radio that it goes via, over the defaults."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from foosim.deployment.network.impairments import BURSTS, Impairments, LinkSettings
from foosim.deployment.network.radios import Radio
from foosim.deployment.network.rules import LinkRule, Network
from foosim.deployment.schema import Deployment

PERFECT: Final = "perfect"
ON_BOARD: Final = "on_board"
"""The rule of a link between a robot and what is on it, where no rule matches: a perfect one."""
NO_RADIO: Final = "no_radio"
"""The rule of a link between two that have radios: none of them the same, or not the one that their rule goes via."""


@dataclass(frozen=True, slots=True)
class Profile:
    """What holds on a link: the name of what decided it, the radio that it goes via, and every setting."""

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
    """The profiles of one deployment's links."""

    def __init__(self, deployment: Deployment, network: Network) -> None:
        self._network = network
        self._carriers = deployment.carriers()
        self._by_channel = any(rule.channels is not None for rule in network.links)
        modelled = any(of.model is not None for of in (*network.radios.values(), *network.links))
        self.on_radio = modelled or any(radio.is_on_air for radio in (*network.radios.values(), self.base("")))
        """Whether the fate of packets may depend on where endpoints are: on air, or by a model of one's own."""

    def kind(self, channel: str) -> str:
        """Return what of a channel decides a link's profile: nothing, where no rule names channels."""
        return channel if self._by_channel else ""

    def body(self, endpoint: str) -> str:
        """Return the robot that an endpoint is or is on."""
        return self._carriers.get(endpoint, endpoint)

    def find(self, source: str, destination: str, channel: str) -> Profile:
        """Return the profile of packets from source to destination on a channel."""
        return self.of_rule(self._network.rule_for(source, destination, channel), source, destination)

    def of_rule(self, rule: LinkRule | None, source: str, destination: str) -> Profile:
        """Return the profile of a pair of which it is known which rule matches."""
        network = self._network
        way = network.way(rule, source, destination, self._carriers)
        if way is None:
            return Profile(NO_RADIO, "", preset_radio(PERFECT))
        if rule is None and self.body(source) == self.body(destination):
            return Profile(ON_BOARD, "", preset_radio(PERFECT))
        base = self.base(way)
        if rule is None:
            return Profile(way or network.defaults.preset, way, base)
        is_own_queue = not base.is_on_air and (way == "" or "rate_bps" in rule.model_fields_set)
        return Profile(rule.id, way, over(base, rule), is_own_queue)

    def base(self, radio: str) -> Radio:
        """Return the settings of a radio alone; of the defaults for the empty name."""
        return self._network.radios[radio] if radio else preset_radio(self._network.defaults.preset)


def over(base: Radio, changes: LinkRule | Impairments) -> Radio:
    """Return a radio's settings with those that a rule writes; a model of bursts replaces another one."""
    written = {key: getattr(changes, key) for key in changes.model_fields_set if key in LinkSettings.model_fields}
    if any(key in written for key in BURSTS):
        written = dict.fromkeys(BURSTS) | written
    return base.model_copy(update=written)
