"""All links of a run, and what they share: radios, airs, the world, the time line of events.

A link is a directed pair of endpoints with its pipeline of stages, what they remember, and its account. It exists from
the first packet on it; channels for which the deployment has another rule are links of their own. Its stages are made
anew where an event changes its settings; what they remember stays. Everything that is remembered is a plain value
(`memory`), so that a state can be written down and taken up again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from foosim.common.keyed_random import Slot, draw_key, draw_words
from foosim.deployment.network.link_settings import NO_RADIO, Profile, over
from foosim.deployment.network.radios import Radio
from foosim.deployment.network.rules import Network, event_of
from foosim.deployment.network.traces import read_opportunities
from foosim.deployment.schema import Deployment
from foosim.vhub.line_of_sight.placement import World
from foosim.vhub.network.air import Air
from foosim.vhub.network.custom_models import LinkModel, make_model
from foosim.vhub.network.draw_address import DrawKeys
from foosim.vhub.network.good_bad_periods import Times
from foosim.vhub.network.jitter import jitter_ns
from foosim.vhub.network.link_budget import Budget
from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.memory import AirState, LinkState, RadioState
from foosim.vhub.network.packet import Flight
from foosim.vhub.network.timeline import FOREVER_NS, Timeline
from foosim.vhub.radio.propagation import Propagation
from foosim.vhub.stages import STAGES
from foosim.vhub.stages.custom_model import CustomModel
from foosim.vhub.stages.delay import Delay
from foosim.vhub.stages.queue import Queue
from foosim.vhub.stages.stage import Stage
from foosim.world.frame import Frame

LinkKey = tuple[str, str, str]
"""Source, destination, and the name of what decides the link's settings."""
RadioKey = tuple[str, str]
"""An endpoint and the name of a radio of its; or a link's own queue: its ends joined, and its rule."""

_OWN_QUEUE: Final = ">"


class Settled:
    """The stages of a link for a time, by one version of the time line."""

    def __init__(self, version: int, since_ns: int, until_ns: int, setup: LinkSetup | None, phase_ns: int = 0) -> None:
        self.version, self.since_ns, self.until_ns, self.phase_ns = version, since_ns, until_ns, phase_ns
        self.stages = (
            [stage for _, make, _ in STAGES if (stage := make(setup)) is not None] if setup is not None else []
        )
        self.at_sending = [stage for stage in self.stages if type(stage).at_sending is not Stage.at_sending]
        self.at_arrival = [stage for stage in self.stages if type(stage).at_arrival is not Stage.at_arrival]
        self.slots = 0 if setup is None else slots_of(setup.settings)
        shares = any(isinstance(stage, Queue | CustomModel) for stage in self.stages)
        self.is_apart = setup is not None and not setup.settings.is_on_air and not shares


class Link:
    """One directed pair with its stages."""

    def __init__(self, source: str, destination: str, profile: Profile, fabric: Fabric, state: LinkState) -> None:
        self.source, self.destination = source, destination
        self.profile = profile
        self.state = state
        self._fabric, self._timeline = fabric, fabric.timeline
        via = (profile.radio,) if profile.radio else ()
        is_robot = source in fabric.deployment.robots
        self._draws = DrawKeys(fabric.seed, "link", source, destination, *via, by_channel=is_robot)
        self._key = b"" if is_robot else self._draws.key
        """Under which all its packets draw; empty where each channel has a key."""
        self._times = Times()
        self._now = self._other = Settled(-1, -1, -1, None)
        """The stages of now and of another time: a packet arrives by the settings of its time of sending."""

    @property
    def rule(self) -> str:
        return self.profile.rule

    def settings_at(self, time_ns: int) -> tuple[Radio, int, int]:
        """Return the link's settings at a time, and the start and end of their validity."""
        settings, since_ns, until_ns = self.profile.settings, -1, FOREVER_NS
        for change in self._timeline.changes_of(self.rule):
            if change.start_ns <= time_ns < change.end_ns:
                settings = over(settings, change.changes)
            for edge_ns in (change.start_ns, change.end_ns):
                if edge_ns <= time_ns:
                    since_ns = max(since_ns, edge_ns)
                else:
                    until_ns = min(until_ns, edge_ns)
        return settings, since_ns, until_ns

    def setup_at(self, time_ns: int) -> LinkSetup:
        """Return the context of the link's stages at a time."""
        return self._setup(self.settings_at(time_ns)[0])

    def _setup(self, settings: Radio) -> LinkSetup:
        fabric, timeline, profile, ends = self._fabric, self._timeline, self.profile, (self.source, self.destination)
        radio = _sender(*ends, profile)
        air, budget, own = None, None, None
        if settings.is_on_air:
            name = profile.radio or fabric.network.defaults.preset
            own = fabric.profiles.base(profile.radio)
            air = fabric.air(name, settings)
            budget = Budget(fabric.propagation(name, settings), *ends, fabric.seed, settings.air or name)
        return LinkSetup(
            *ends,
            settings,
            profile.radio,
            self._draws,
            DrawKeys(fabric.seed, "sending", *radio, by_channel=self._draws.by_channel),
            self.state,
            self._times,
            fabric.radios.setdefault(radio, RadioState()),
            fabric.world,
            profile.rule != NO_RADIO,
            air,
            budget,
            tuple(sorted((cut.start_ns, cut.end_ns) for cut in timeline.cuts if cut.parts(*ends))),
            tuple(timeline.holds_of(*ends)),
            fabric.network.defaults.in_flight_on_partition == "drop",
            jitter_ns(settings.jitter, fabric.deployment.asset_files),
            fabric.opportunities(settings),
            fabric.model(settings),
            fabric.faults,
            own,
        )

    def _settle(self, time_ns: int) -> Settled:
        """Select the stages of a time; they are made anew after a change of settings."""
        version, now = self._timeline.version, self._now
        if now.version == version and now.since_ns <= time_ns < now.until_ns:
            return now
        now, self._other = self._other, now
        if now.version != version or not now.since_ns <= time_ns < now.until_ns:
            settings, since_ns, until_ns = self.settings_at(time_ns)
            setup = self._setup(settings)
            phase_ns = self._fabric.phase_ns(self.source) * settings.is_on_air
            now = Settled(version, since_ns, until_ns, setup, phase_ns)
        self._now = now
        return now

    def is_apart(self, time_ns: int) -> bool:
        """Whether packets of a time share no radio, queue, air or custom model with other links."""
        return self._settle(time_ns).is_apart

    def restore(self, flight: Flight) -> None:
        """Add a packet in flight of a restored state: its turn may not have begun."""
        for stage in self._settle(flight.sent_ns).stages:
            if isinstance(stage, Delay):
                stage.plan(flight)

    def retime(self, flights: Iterable[Flight], now_ns: int) -> None:
        """After a change of clogs, set the due times of packets in flight, in the order of sending."""
        judged = [(flight, self._is_late(flight)) for flight in flights]
        for stage in self._settle(now_ns).stages:
            if isinstance(stage, Delay):
                stage.retime(judged, now_ns)

    def _is_late(self, flight: Flight) -> bool:
        """Whether later packets may overtake a packet, by the settings of its time of sending."""
        stages = self._settle(flight.sent_ns).stages
        return any(isinstance(stage, Delay) and stage.is_late(flight) for stage in stages)

    def send(self, flight: Flight) -> bool:
        """Judge a packet at sending: True when it is in flight with its due time, False when it is dropped."""
        sent_ns, is_offered, now = flight.sent_ns, flight.copy == 0, self._now
        if not now.since_ns <= sent_ns < now.until_ns or now.version != self._timeline.version:
            now = self._settle(sent_ns)
        if is_offered:
            self.state.offered += 1
        flight.rule, flight.radio = self.profile.rule, self.profile.radio
        flight.due_ns = sent_ns + flight.latency_ns
        flight.phase_ns = now.phase_ns
        if now.slots:
            flight.slots = now.slots
            flight.words = draw_words(self._key or self._draws.of(flight.channel), flight.draw, flight.copy)
        for stage in now.at_sending:
            cause = stage.at_sending(flight)
            if cause:
                self.drop(flight, cause)
                return False
        return True

    def drop(self, flight: Flight, cause: str) -> None:
        """Count a packet as dropped for a cause."""
        flight.cause = cause
        if flight.copy == 0:
            self.state.dropped += 1
            self.state.causes[cause] = self.state.causes.get(cause, 0) + 1

    def arrive(self, flight: Flight, hindered: str) -> bool:
        """Judge a packet at arrival, by the settings of its time of sending, whatever was sent on the link since.

        True when it is delivered, False when it is dropped. `hindered` is why its receiver does not take it; empty when
        it does.
        """
        state, is_offered, now = self.state, flight.copy == 0, self._now
        if not now.since_ns <= flight.sent_ns < now.until_ns or now.version != self._timeline.version:
            now = self._settle(flight.sent_ns)
        for stage in now.at_arrival:
            cause = stage.at_arrival(flight, hindered)
            if cause:
                self.drop(flight, cause)
                break
        else:
            state.delivered += is_offered
            state.delay_ns += (flight.due_ns - flight.sent_ns) * is_offered
        return not flight.cause


def slots_of(settings: Radio) -> int:
    """Return the draws that settings use: bit n for slot n."""
    bursts = settings.burst, settings.gilbert_elliott, settings.markov4, settings.outages
    used = {
        Slot.LOSS: settings.loss > 0.0 or any(model is not None for model in bursts),
        Slot.ERROR: settings.is_on_air,
        Slot.JITTER: settings.jitter is not None,
        Slot.DUPLICATE: settings.duplicate > 0.0,
        Slot.CORRUPT: settings.corrupt is not None,
        Slot.REORDER: settings.reorder is not None,
    }
    return sum(1 << slot for slot, is_used in used.items() if is_used)


class Fabric:
    """The network of a run."""

    def __init__(self, deployment: Deployment, network: Network | None = None) -> None:
        """`network` replaces that of the deployment."""
        self.deployment = deployment
        self.network = deployment.network if network is None else network
        self.seed = deployment.seed if self.network.seed is None else self.network.seed
        self.timeline = Timeline(self.network, self.seed, deployment.endpoints())
        self.world = World(deployment, self.network)
        self.profiles = deployment.profiles(self.network)
        self.states: dict[LinkKey, LinkState] = {}
        """The states of links that have had packets."""
        self.radios: dict[RadioKey, RadioState] = {}
        self.airs: dict[str, Air] = {}
        self.requested: list[tuple[int, str]] = []
        """Events that were requested during the run: the tick, and the event as JSON."""
        self.faults: list[str] = []
        """The failure of a custom link model, which ends the run."""
        self._models: dict[str, LinkModel] = {}
        self._links: dict[tuple[str, str, str], Link] = {}
        """By source, destination and what of the channel decides."""
        self._by_rule: dict[LinkKey, Link] = {}
        """The same ones by the rule that matches: channels of one rule are one link."""
        self._phases: dict[str, int] = {}
        self._propagations: dict[str, Propagation] = {}
        for rule in (*self.network.links, *self.network.radios.values()):
            jitter_ns(rule.jitter, deployment.asset_files)  # before the run starts: tables would delay a tick

    def turn_to(self, frame: Frame) -> None:
        """Set the newest committed frame. Links are made anew where bodies leave or enter service in it."""
        if self.world.turn_to(frame):
            self.timeline.version += 1

    def take(self, tick: int, at_ns: int, text: str) -> None:
        """Add a requested event, as JSON, at a tick."""
        self.requested.append((tick, text))
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
            rule = self.profiles.rule_for(source, destination, channel)
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
        requested: Sequence[tuple[int, str]],
    ) -> None:
        """Restore a snapshot, before any packet is sent."""
        self.states = {(source, destination, name): state for source, destination, name, state in links}
        self.radios = {(endpoint, radio): state for endpoint, radio, state in radios}
        self.airs = {name: Air(state, self.radios) for name, state in airs}
        for tick, text in requested:
            self.take(tick, tick * self.deployment.tick_ns, text)

    def restore_flight(self, flight: Flight) -> None:
        """Add a packet in flight of that snapshot: it may be on air."""
        profile = self.profiles.find(flight.source, flight.destination, flight.channel)
        settings, name = profile.settings, profile.radio or self.network.defaults.preset
        if settings.is_on_air:
            self.air(name, settings).restore(flight, self.propagation(name, settings))
            self.link(flight.source, flight.destination, flight.channel).restore(flight)

    def queue_ns(self, key: LinkKey, now_ns: int) -> int:
        """Return how long (ns) a packet sent on a link now waits before its turn comes."""
        source, destination, name = key
        rule, _, radio = name.partition("/")
        senders = (source + _OWN_QUEUE + destination, rule), (source, radio or rule), (source, "")
        found = next((self.radios[sender] for sender in senders if sender in self.radios), None)
        return 0 if found is None else max(0, found.free_ns - now_ns)

    def propagation(self, name: str, settings: Radio) -> Propagation:
        """Return what becomes of a radio's signals, by the radio's name."""
        found = self._propagations.get(name)
        if found is None:
            key = draw_key(self.seed, "shadowing", settings.air or name)
            found = self._propagations[name] = Propagation(settings, self.world, key)
        return found

    def air(self, name: str, settings: Radio) -> Air:
        """Return the air of a radio, by the radio's name."""
        name = settings.air or name
        found = self.airs.get(name)
        if found is None:
            found = self.airs[name] = Air(AirState(), self.radios)
        return found

    def model(self, settings: Radio) -> LinkModel | None:
        """Return the link model that settings name, one for equal parameters; raises ModelError."""
        if settings.model is None:
            return None
        key = settings.model.model_dump_json()
        if key not in self._models:
            self._models[key] = make_model(settings.model)
        return self._models[key]

    def opportunities(self, settings: Radio) -> tuple[int, ...]:
        """Return the times (ms) of the trace of capacity that settings name; none without one."""
        if settings.trace is None:
            return ()
        return read_opportunities(self.deployment.asset_files[settings.trace.file].decode("ascii", "replace"))


def _sender(source: str, destination: str, profile: Profile) -> RadioKey:
    """Return the queue of a link's packets."""
    return (source + _OWN_QUEUE + destination, profile.rule) if profile.is_own_queue else (source, profile.radio)


def name_of(profile: Profile) -> str:
    """Return a profile's name: its rule, and the radio if the rule does not imply it."""
    return link_name(profile.rule, profile.radio)


def link_name(rule: str, radio: str) -> str:
    """Return the name of a rule over a radio, which is empty where there is none."""
    return rule if not radio or radio == rule else f"{rule}/{radio}"
