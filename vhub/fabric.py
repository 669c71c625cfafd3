"""All links of a run, and what they share: radios, airs, the world, the time line of events.

Everything that is remembered is a plain value (`memory`), so that a state can be written down and taken up again.
Neighbours: `state` (whose part it is), `links`, `profiles`, `events`, `world`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.protocol.deployment import Deployment
from foosim.protocol.draws import draw_key, draw_words
from foosim.protocol.frame import Frame
from foosim.protocol.impairments import Impairments, TableJitter
from foosim.protocol.network import Network, event_of
from foosim.protocol.radios import Radio
from foosim.protocol.traces import read_opportunities, read_table
from foosim.vhub.air import Air
from foosim.vhub.budget import Budget
from foosim.vhub.episodes import Times
from foosim.vhub.events import Timeline
from foosim.vhub.jitter import quantiles_ns
from foosim.vhub.link_models import LinkModel, make_model
from foosim.vhub.links import Link
from foosim.vhub.memory import AirState, LinkState, RadioState
from foosim.vhub.packet import Flight
from foosim.vhub.profiles import NO_RADIO, Profile, Profiles
from foosim.vhub.propagation import Propagation
from foosim.vhub.setup import LinkSetup
from foosim.vhub.world import World

LinkKey = tuple[str, str, str]
"""Source, destination, and the name of what decides the link's settings."""
RadioKey = tuple[str, str]
"""An endpoint and the name of a radio of its; or a link's own queue: its ends joined, and its rule."""

_OWN_QUEUE: Final = ">"


class Fabric:
    """The network of a run."""

    def __init__(self, deployment: Deployment, network: Network | None = None) -> None:
        """`network` stands in for the deployment's."""
        self.deployment = deployment
        self.network = deployment.network if network is None else network
        self.seed = deployment.seed if self.network.seed is None else self.network.seed
        self.timeline = Timeline(self.network, self.seed, deployment.endpoints())
        self.world = World(deployment, self.network)
        self.profiles = Profiles(deployment, self.network)
        self.states: dict[LinkKey, LinkState] = {}
        """What the links remember that packets were sent on."""
        self.radios: dict[RadioKey, RadioState] = {}
        self.airs: dict[str, Air] = {}
        self.asked: list[tuple[int, str]] = []
        """Events that were asked for while the run went on: the tick, and the event as JSON."""
        self.faults: list[str] = []
        """Why a link model of one's own has failed; nothing after it is what was asked for."""
        self._models: dict[str, LinkModel] = {}
        self._links: dict[tuple[str, str, str], Link] = {}
        """By source, destination and what of the channel decides."""
        self._by_rule: dict[LinkKey, Link] = {}
        """The same ones by the rule that matches: channels of one rule are one link."""
        self._phases: dict[str, int] = {}
        self._propagations: dict[str, Propagation] = {}
        for rule in (*self.network.links, *self.network.radios.values()):
            if rule.jitter is not None:  # the tables are made before the run starts: they would hold up a tick
                quantiles_ns(rule.jitter, self._table(rule))

    def turn_to(self, frame: Frame) -> None:
        """Take the newest committed frame. Links are made anew where bodies go out of service in it, or come back."""
        if self.world.turn_to(frame):
            self.timeline.version += 1

    def take(self, tick: int, at_ns: int, text: str) -> None:
        """Take an event that was asked for, as JSON; it happens at a tick."""
        self.asked.append((tick, text))
        self.timeline.add(event_of(text, at_ns))

    def phase_ns(self, source: str) -> int:
        """Return by how much later than its tick the packets of an endpoint come to its radio."""
        most_ns = self.network.defaults.phase_ns
        if not most_ns:
            return 0
        found = self._phases.get(source)
        if found is None:
            word = draw_words(draw_key(self.seed, "phase", self.world.body(source)), 0)[0]
            found = self._phases[source] = word * most_ns >> 64
        return found

    def link(self, source: str, destination: str, channel: str) -> Link:
        """Return the link of a packet."""
        kind = self.profiles.kind(channel)
        link = self._links.get((source, destination, kind))
        if link is None:
            rule = self.network.rule_for(source, destination, channel)
            key = source, destination, "" if rule is None else rule.id
            link = self._by_rule.get(key)
            if link is None:
                profile = self.profiles.of_rule(rule, source, destination)
                state = self.states.setdefault((source, destination, name_of(profile)), LinkState())
                link = self._by_rule[key] = Link(source, destination, profile, self, state)
            self._links[source, destination, kind] = link
        return link

    def restore(
        self,
        links: Sequence[tuple[str, str, str, LinkState]],
        radios: Sequence[tuple[str, str, RadioState]],
        airs: Sequence[tuple[str, AirState]],
        asked: Sequence[tuple[int, str]],
    ) -> None:
        """Take up what was written down of a network in which nothing has been sent yet."""
        self.states = {(source, destination, name): state for source, destination, name, state in links}
        self.radios = {(endpoint, radio): state for endpoint, radio, state in radios}
        self.airs = {name: Air(state, self.radios) for name, state in airs}
        for tick, text in asked:
            self.take(tick, tick * self.deployment.tick_ns, text)

    def restore_flight(self, flight: Flight) -> None:
        """Take up a packet in flight of such a state: it may be on air."""
        profile = self.profiles.find(flight.source, flight.destination, flight.channel)
        settings, name = profile.settings, profile.radio or self.network.defaults.preset
        if settings.is_on_air:
            self._air(name, settings).restore(flight, self._propagation(name, settings))
            self.link(flight.source, flight.destination, flight.channel).restore(flight)

    def setup(
        self,
        source: str,
        destination: str,
        profile: Profile,
        settings: Radio,
        key: bytes,
        memory: LinkState,
        times: Times,
    ) -> LinkSetup:
        """Return what the stages of a link are made from, for some time."""
        timeline = self.timeline
        radio = _sender(source, destination, profile)
        sender = self.radios.get(radio)
        if sender is None:
            sender = self.radios[radio] = RadioState()
        air, budget, own = None, None, None
        if settings.is_on_air:
            name = profile.radio or self.network.defaults.preset
            own = self.profiles.base(profile.radio)
            propagation = self._propagation(name, settings)
            air = self._air(name, settings)
            budget = Budget(propagation, source, destination, self.seed, settings.air or name)
        return LinkSetup(
            source,
            destination,
            settings,
            profile.radio,
            key,
            draw_key(self.seed, "sending", *radio),
            memory,
            times,
            sender,
            self.world,
            profile.rule != NO_RADIO,
            air,
            budget,
            tuple(timeline.cuts_of(source, destination)),
            tuple(timeline.holds_of(source, destination)),
            self.network.defaults.in_flight_on_partition == "drop",
            self._table(settings),
            self._opportunities(settings),
            self._model(settings),
            self.faults,
            own,
        )

    def queue_ns(self, key: LinkKey, now_ns: int) -> int:
        """Return how long what is sent on a link now waits before its turn comes."""
        source, destination, name = key
        rule, _, radio = name.partition("/")
        senders = (source + _OWN_QUEUE + destination, rule), (source, radio or rule), (source, "")
        found = next((self.radios[sender] for sender in senders if sender in self.radios), None)
        return 0 if found is None else max(0, found.free_ns - now_ns)

    def _propagation(self, name: str, settings: Radio) -> Propagation:
        found = self._propagations.get(name)
        if found is None:
            key = draw_key(self.seed, "shadowing", settings.air or name)
            found = self._propagations[name] = Propagation(settings, self.world, key)
        return found

    def _air(self, name: str, settings: Radio) -> Air:
        name = settings.air or name
        found = self.airs.get(name)
        if found is None:
            found = self.airs[name] = Air(AirState(), self.radios)
        return found

    def _model(self, settings: Radio) -> LinkModel | None:
        """Return the link model that settings name, one for equal parameters; raises ModelError."""
        if settings.model is None:
            return None
        key = settings.model.model_dump_json()
        if key not in self._models:
            self._models[key] = make_model(settings.model)
        return self._models[key]

    def _table(self, settings: Impairments) -> tuple[int, ...]:
        jitter = settings.jitter
        return read_table(self._text(jitter.file)) if isinstance(jitter, TableJitter) else ()

    def _opportunities(self, settings: Radio) -> tuple[int, ...]:
        return () if settings.trace is None else read_opportunities(self._text(settings.trace.file))

    def _text(self, path: str) -> str:
        return self.deployment.asset_files[path].decode("ascii", "replace")


def _sender(source: str, destination: str, profile: Profile) -> RadioKey:
    """Return whose queue a link's packets wait in."""
    return (source + _OWN_QUEUE + destination, profile.rule) if profile.is_own_queue else (source, profile.radio)


def name_of(profile: Profile) -> str:
    """Return a profile's name: its rule, and the radio where the rule does not say it."""
    return link_name(profile.rule, profile.radio)


def link_name(rule: str, radio: str) -> str:
    """Return the name of a rule over a radio, which is empty where there is none."""
    return rule if not radio or radio == rule else f"{rule}/{radio}"
