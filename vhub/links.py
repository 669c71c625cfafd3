"""Links: a directed pair of endpoints, its pipeline of stages, what they remember, and its account.

A link exists from the first packet on it; channels for which the deployment has another rule are links of their own.
Its stages are made anew where an event changes its settings; what they remember stays. Neighbours: `stages` (the table
that is walked), `fabric` (all links of a run, and what they share), `profiles` (whose settings).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from foosim.protocol.draws import Slot, draw_key, draw_words
from foosim.protocol.radios import Radio
from foosim.vhub.episodes import Times
from foosim.vhub.events import FOREVER_NS
from foosim.vhub.memory import LinkState
from foosim.vhub.packet import Flight
from foosim.vhub.profiles import Profile, over
from foosim.vhub.setup import LinkSetup
from foosim.vhub.stages import STAGES
from foosim.vhub.stages.capacity import leave
from foosim.vhub.stages.delay import Delay
from foosim.vhub.stages.own import Own
from foosim.vhub.stages.queue import Queue
from foosim.vhub.stages.stage import Stage, at_arrival, at_sending

if TYPE_CHECKING:
    from foosim.vhub.fabric import Fabric

Settled = tuple[int, int, int, list[Stage], list[Stage], list[Stage], int, int, bool]
"""By version of the time line, from when, until when: stages, at sending, at arrival, draws, phase, being apart."""


class Link:
    """One directed pair with its stages."""

    def __init__(self, source: str, destination: str, profile: Profile, fabric: Fabric, state: LinkState) -> None:
        self.source, self.destination = source, destination
        self.profile = profile
        self.state = state
        self._fabric, self._timeline = fabric, fabric.timeline
        via = (profile.radio,) if profile.radio else ()
        self._key = draw_key(fabric.seed, "link", source, destination, *via)
        self._version = -1
        self._since_ns = self._until_ns = -1
        self._stages: list[Stage] = []
        self._at_sending: list[Stage] = []
        self._at_arrival: list[Stage] = []
        self._is_apart = False
        self._slots = self._phase_ns = 0
        self._times = Times()
        self._other: Settled | None = None
        """What holds in another time: packets arrive by the settings of when they were sent."""

    @property
    def rule(self) -> str:
        return self.profile.rule

    def settings_at(self, time_ns: int) -> tuple[Radio, int, int]:
        """Return the link's settings at a time, and from when and until when they hold."""
        settings, since_ns, until_ns = self.profile.settings, -1, FOREVER_NS
        for change in self._timeline.changes_of(self.rule, self.source, self.destination):
            if change.start_ns <= time_ns < change.end_ns:
                settings = over(settings, change.changes)
            for edge_ns in (change.start_ns, change.end_ns):
                if edge_ns <= time_ns:
                    since_ns = max(since_ns, edge_ns)
                else:
                    until_ns = min(until_ns, edge_ns)
        return settings, since_ns, until_ns

    def setup_at(self, time_ns: int) -> LinkSetup:
        """Return what the link's stages are made from at a time."""
        return self._setup(self.settings_at(time_ns)[0])

    def _setup(self, settings: Radio) -> LinkSetup:
        source, destination, profile = self.source, self.destination, self.profile
        return self._fabric.setup(source, destination, profile, settings, self._key, self.state, self._times)

    def _settle(self, time_ns: int) -> None:
        """Have the stages of a time: made anew where settings have changed, or what is known of them."""
        version, other = self._timeline.version, self._other
        if self._version == version and self._since_ns <= time_ns < self._until_ns:
            return
        self._other = self._settled()
        if other is not None and other[0] == version and other[1] <= time_ns < other[2]:
            self._version, self._since_ns, self._until_ns, self._stages, self._at_sending, self._at_arrival = other[:6]
            self._slots, self._phase_ns, self._is_apart = other[6:]
            return
        settings, self._since_ns, self._until_ns = self.settings_at(time_ns)
        self._version = version
        setup = self._setup(settings)
        self._stages = [stage for make in STAGES if (stage := make(setup)) is not None]
        self._at_sending, self._at_arrival = at_sending(self._stages), at_arrival(self._stages)
        self._slots = slots_of(settings, is_radio=setup.is_radio)
        self._phase_ns = self._fabric.phase_ns(self.source) if setup.is_radio else 0
        self._is_apart = not (setup.is_radio or any(isinstance(stage, Queue | Own) for stage in self._stages))

    def _settled(self) -> Settled:
        times = self._version, self._since_ns, self._until_ns
        stages = self._stages, self._at_sending, self._at_arrival
        return *times, *stages, self._slots, self._phase_ns, self._is_apart

    def is_apart(self, time_ns: int) -> bool:
        """Whether what is sent at a time shares no radio, queue or air with other links, and no model of one's own."""
        self._settle(time_ns)
        return self._is_apart

    def restore(self, flight: Flight) -> None:
        """Take up a packet on its way of a state that was written down: its turn may not have begun."""
        self._settle(flight.sent_ns)
        for stage in self._stages:
            if isinstance(stage, Delay):
                stage.plan(flight)

    def retime(self, flights: Iterable[Flight], now_ns: int) -> None:
        """Clogs have changed: give packets on their way, in the order of sending, new due times."""
        judged = [(flight, self._is_late(flight)) for flight in flights]
        self._settle(now_ns)
        for stage in self._stages:
            if isinstance(stage, Delay):
                stage.retime(judged, now_ns)

    def _is_late(self, flight: Flight) -> bool:
        """Whether those behind a packet overtake it, by the settings of when it was sent."""
        self._settle(flight.sent_ns)
        return any(isinstance(stage, Delay) and stage.is_late(flight) for stage in self._stages)

    def send(self, flight: Flight) -> bool:
        """Judge a packet at sending: True when it is on its way with its due time, False when it is dropped."""
        sent_ns, is_offered = flight.sent_ns, flight.copy == 0
        if not self._since_ns <= sent_ns < self._until_ns or self._version != self._timeline.version:
            self._settle(sent_ns)
        if is_offered:
            self.state.offered += 1
        flight.rule, flight.radio = self.profile.rule, self.profile.radio
        flight.due_ns = sent_ns
        flight.phase_ns = self._phase_ns
        if self._slots:
            flight.slots = self._slots
            flight.words = draw_words(self._key, flight.sequence, flight.copy)
        for stage in self._at_sending:
            cause = stage.at_sending(flight)
            if cause:
                self._drop(flight, cause)
                return False
        return True

    def _drop(self, flight: Flight, cause: str) -> None:
        flight.cause = cause
        if flight.copy == 0:
            self.state.dropped += 1
            self.state.causes[cause] = self.state.causes.get(cause, 0) + 1

    def turn_away(self, flight: Flight, cause: str) -> None:
        """Drop a packet that would be on its way: there is no room for it."""
        self._drop(flight, cause)
        if self.state.under_way:
            leave(self.state, flight)

    def arrive(self, flight: Flight, hindered: str) -> bool:
        """Judge a packet at arrival, by the settings of when it was sent: whatever was sent on the link meanwhile.

        True when it is delivered, False when it is dropped. `hindered` is why its receiver does not take it; empty when
        it does.
        """
        if not self._since_ns <= flight.sent_ns < self._until_ns or self._version != self._timeline.version:
            self._settle(flight.sent_ns)
        state, is_offered = self.state, flight.copy == 0
        for stage in self._at_arrival:
            cause = stage.at_arrival(flight, hindered)
            if cause:
                self._drop(flight, cause)
                break
        else:
            state.delivered += is_offered
            state.delay_ns += (flight.due_ns - flight.sent_ns) * is_offered
        if state.under_way:
            leave(state, flight)
        return not flight.cause


def slots_of(settings: Radio, *, is_radio: bool) -> int:
    """Return which draws settings use: bit n for slot n."""
    bursts = settings.burst, settings.gilbert_elliott, settings.markov4, settings.outages
    used = {
        Slot.LOSS: settings.loss > 0.0 or any(model is not None for model in bursts),
        Slot.ERROR: is_radio,
        Slot.JITTER: settings.jitter is not None,
        Slot.DUPLICATE: settings.duplicate > 0.0,
        Slot.CORRUPT: settings.corrupt is not None,
        Slot.REORDER: settings.reorder is not None,
    }
    return sum(1 << slot for slot, is_used in used.items() if is_used)
