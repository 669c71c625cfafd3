"""The rule of a link in words: its packets, its settings, its radio, its changes by events of the network at a
time, and the effective settings.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from pydantic import ValidationError

from foosim.common.errors import Refused
from foosim.deployment.network.link_settings import IDEAL, NO_RADIO, ON_BOARD, Profile, over
from foosim.deployment.network.rules import LinkRule, event_of
from foosim.deployment.network.settings_text import impairments_text, radio_text, rule_ends
from foosim.deployment.schema import Deployment
from foosim.vhub.links.summary import SharedSettings, summary_of
from foosim.vhub.links.summary_text import summary_line
from foosim.vhub.network.timeline import FOREVER_NS, Cut, Hold, Settings, Timeline

TEXTS_KEPT: Final = 256


class RuleTexts:
    """The rules of one deployment, which has its files, with the requests to its network."""

    def __init__(self, deployment: Deployment) -> None:
        self._deployment = deployment
        self._endpoints = deployment.endpoints()
        self._profiles = deployment.profiles()
        self._requested: tuple[tuple[int, str], ...] = ()
        self._timeline = self._timeline_of(())
        self._texts: dict[tuple[object, ...], str] = {}

    def text(
        self,
        source: str,
        destination: str,
        at_ns: int = 0,
        requested: Iterable[tuple[int, str]] = (),
        who: Mapping[int, str] | None = None,
    ) -> str:
        """Return the rule for the packets from one endpoint to another at a time, in lines; an empty text for an
        unknown endpoint.

        `requested` are the events of the network by then, (tick, event as JSON); `who` names the requester of a tick,
        where known.
        """
        if not {source, destination} <= {*self._endpoints}:
            return ""
        events = tuple((tick, event) for tick, event in requested)
        if events != self._requested:
            self._requested, self._timeline = events, self._timeline_of(events)
        cut = [*self._cuts(source, destination, at_ns)]
        lines: list[str] = []
        for rule in self._profiles.rules_for(source, destination):
            profile = self._profiles.of_rule(rule, source, destination)
            changes = self._timeline.changes_of(profile.rule)
            in_force = [change for change in changes if change.start_ns <= at_ns < change.end_ns]
            lines.append(self._rule(rule, profile, in_force, who or {}))
        lines += [f"{what}{self._when(event, who or {})}" for what, event in cut]
        return "\n".join(lines)

    def _timeline_of(self, requested: Iterable[tuple[int, str]]) -> Timeline:
        deployment = self._deployment
        network = deployment.network
        timeline = Timeline(network, deployment.seed if network.seed is None else network.seed, self._endpoints)
        for tick, event in requested:
            try:
                timeline.add(event_of(event, tick * deployment.tick_ns))
            except (ValidationError, ValueError, TypeError, Refused):
                continue  # a damaged row of a capture
        return timeline

    def _cuts(self, source: str, destination: str, at_ns: int) -> Iterator[tuple[str, Cut | Hold]]:
        for cut in self._timeline.cuts:
            if cut.start_ns <= at_ns < cut.end_ns and cut.parts(source, destination):
                yield "cut by a partition: nothing passes", cut
        for hold in self._timeline.holds:
            if hold.start_ns <= at_ns < hold.end_ns and source in hold.sources and destination in hold.destinations:
                yield "clogged: packets wait", hold

    def _when(self, event: Settings | Cut | Hold, who: Mapping[int, str]) -> str:
        """Return since when something is in force, by which requester, until when."""
        tick_ns = self._deployment.tick_ns
        tick = event.start_ns // tick_ns
        is_requested = any(requested == tick for requested, _ in self._requested)
        by = f"requested by {who[tick]}" if tick in who else "requested" if is_requested else "by the deployment"
        until = "" if event.end_ns >= FOREVER_NS else f" until {event.end_ns / 1e9:g} s"
        return f", since {event.start_ns / 1e9:g} s (tick {tick}), {by}{until}"

    def _rule(self, rule: LinkRule | None, profile: Profile, in_force: list[Settings], who: Mapping[int, str]) -> str:
        changes = [f"{impairments_text(change.changes)}{self._when(change, who)}" for change in in_force]
        key = None if rule is None else rule.id, profile.rule, profile.radio, tuple(changes)
        if key not in self._texts:
            if len(self._texts) >= TEXTS_KEPT:
                self._texts.clear()
            self._texts[key] = "\n".join(_lines(self._deployment, rule, profile, in_force, changes))
        return self._texts[key]


def _lines(
    deployment: Deployment, rule: LinkRule | None, profile: Profile, in_force: list[Settings], changes: list[str]
) -> Iterator[str]:
    network = deployment.network
    if profile.rule == NO_RADIO:
        yield "no radio in common, or not that of their rule: nothing passes (no_route)"
        return
    if rule is not None:
        yield f"rule {rule.id}, {rule_ends(rule)}: {impairments_text(rule) or 'no settings of its own'}"
    elif profile.rule == ON_BOARD:
        yield "no rule: a link between a robot and its own parts is perfect"
    elif profile.rule == IDEAL:
        yield "no rule names the console: its links are perfect"
    else:
        yield "no rule"
    if profile.radio:
        radio = network.radios[profile.radio]
        written = radio_text(radio)
        yield f"radio {profile.radio}: preset {radio.preset}{', ' if written else ''}{written}"
    elif profile.rule not in {ON_BOARD, IDEAL}:
        yield f"defaults: preset {network.defaults.preset}"
    settings = profile.settings
    for change, text in zip(in_force, changes, strict=True):
        settings = over(settings, change.changes)
        yield f"changed: {text}"
    summary = summary_of(SharedSettings(profile.rule, profile.radio, settings), deployment.asset_files)
    yield f"which is {summary_line(summary)}"
