"""The rule of a link in words: whose packets it is for, what it says, over which radio, what that amounts to.

Neighbours: `vhub.settings_text` (settings in words), `vhub.lint` (what they amount to).
"""

from __future__ import annotations

from collections.abc import Iterator

from foosim.protocol.deployment import Deployment
from foosim.protocol.network import LinkRule
from foosim.vhub.lint import Use, meaning_of
from foosim.vhub.lint_text import meaning_line
from foosim.vhub.profiles import NO_RADIO, ON_BOARD, Profile, Profiles
from foosim.vhub.settings_text import impairments_text, radio_text, rule_ends


def rule_text(deployment: Deployment, source: str, destination: str) -> str:
    """Return what the deployment, which has its files, says of the packets from one endpoint to another, in lines; the
    empty text where it has no such endpoint.

    What events of the network change meanwhile is not in it.
    """
    if not {source, destination} <= {*deployment.endpoints()}:
        return ""
    network, profiles = deployment.network, Profiles(deployment, deployment.network)
    lines: list[str] = []
    for rule in network.rules_for(source, destination):
        profile = profiles.of_rule(rule, source, destination)
        lines += _lines(deployment, rule, profile)
    return "\n".join(lines)


def _lines(deployment: Deployment, rule: LinkRule | None, profile: Profile) -> Iterator[str]:
    network = deployment.network
    if profile.rule == NO_RADIO:
        yield "no radio in common, or not that of their rule: nothing passes (no_route)"
        return
    if rule is not None:
        yield f"rule {rule.id}, {rule_ends(rule)}: {impairments_text(rule) or 'no settings of its own'}"
    elif profile.rule == ON_BOARD:
        yield "no rule: a link between a robot and what is on it is perfect"
    else:
        yield "no rule"
    if profile.radio:
        radio = network.radios[profile.radio]
        written = radio_text(radio)
        yield f"radio {profile.radio}: preset {radio.preset}{', ' if written else ''}{written}"
    elif profile.rule != ON_BOARD:
        yield f"defaults: preset {network.defaults.preset}"
    meaning = meaning_of(Use(profile.rule, profile.radio, profile.settings), deployment.asset_files)
    yield f"which is {meaning_line(meaning)}"
