"""Delay: queue, access, airtime and propagation, the constant delay, a model's, jitter, clogs; then the link's order.

Jitter is never negative: a shape with support from 0, so that the mean is what is configured. Links are fifo by
default. A request that begins or heals a clog moves the due times of packets in flight, as if it had been known when
they were sent. The latency of a sensor is added last, and delays no other packet.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from foosim.common.keyed_random import Slot, chance_threshold
from foosim.vhub.network.jitter import interpolate_ns
from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.packet import Flight
from foosim.vhub.stages.explanation import Explanation, Seen, exact
from foosim.vhub.stages.stage import Stage

_JITTER: Final = int(Slot.JITTER)


class Delay(Stage):
    """Sets the due time of a packet."""

    def __init__(self, setup: LinkSetup) -> None:
        settings = setup.settings
        self._memory = setup.memory
        self._delay_ns = settings.delay_ns
        self._fifo = settings.order == "fifo"
        self._quantiles_ns = setup.jitter_ns
        self._holds = setup.holds
        self._bad_ns = 0 if settings.burst is None else settings.burst.bad_extra_delay_ns
        reorder = settings.reorder
        self._reordered = 0 if reorder is None else chance_threshold(reorder.probability)
        self._extra_ns = 0 if reorder is None else reorder.extra_ns
        self._air = setup.air if settings.medium == "wifi" else None
        self._budget = setup.budget

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Delay | None:
        """Return the stage, or None where no delay applies or has applied: such a link is in order anyway."""
        settings = setup.settings
        timed = settings.medium != "none" or settings.rate_bps is not None or settings.trace is not None
        late = settings.jitter is not None or settings.reorder is not None or settings.burst is not None
        if timed or late or settings.delay_ns or setup.holds or setup.model is not None:
            return cls(setup)
        return InOrder(setup) if settings.order == "fifo" and setup.memory.last_due_ns >= 0 else None

    def at_sending(self, flight: Flight) -> str:
        spent_ns = flight.phase_ns + flight.queue_ns + flight.access_ns + flight.airtime_ns + flight.propagation_ns
        due_ns = flight.sent_ns + spent_ns + self._delay_ns + flight.model_ns
        if self._quantiles_ns:
            flight.jitter_ns = jitter_ns = interpolate_ns(self._quantiles_ns, flight.words[_JITTER])
            due_ns += jitter_ns
        if flight.is_bad:
            due_ns += self._bad_ns
        is_late = self._extra_ns > 0 and self.is_late(flight)
        if is_late:
            due_ns += self._extra_ns
        held_ns = self._held_ns(due_ns) if self._holds else due_ns
        if self._fifo and not is_late:
            memory = self._memory
            if held_ns <= memory.last_due_ns:
                held_ns = memory.last_due_ns + 1
            memory.last_due_ns = held_ns
        flight.due_ns = held_ns + flight.latency_ns
        if self._holds:
            flight.held_ns = held_ns - due_ns
        if self._air is not None:
            self.plan(flight)
        return ""

    def explain(self, seen: Seen, note: Explanation) -> None:
        row = seen.row
        parts = {
            "phase": row.phase_ns,
            "queue": row.queue_ns,
            "access": row.access_ns,
            "airtime": row.airtime_ns,
            "way": row.propagation_ns,
            "constant": self._delay_ns,
            "link model": row.model_ns,
            "jitter": row.jitter_ns,
            "bad time": self._bad_ns if row.is_bad else 0,
            "reordered": self._extra_ns if self.is_late(seen.flight) else 0,
            "clog": row.held_ns,
            "the sensor's latency": seen.flight.latency_ns,
        }
        parts["order, after the one before it"] = max(0, row.due_ns - row.sent_ns - sum(parts.values()))
        note.facts = {what: ns for what, ns in parts.items() if ns}
        text = " + ".join(f"{what} {exact(ns)}" for what, ns in note.facts.items()) or "no delay"
        note.add("{} = due {due_ns}", text, due_ns=row.due_ns)

    def plan(self, flight: Flight) -> None:
        """Delay a packet whose turn on the air is deferred."""
        if self._air is not None and self._budget is not None:
            self._air.plan(flight, self._budget.propagation, self.put_off)

    def put_off(self, flight: Flight, by_ns: int, last_ns: dict[int, int]) -> None:
        """Delay a packet; `last_ns` are the due times of the deferred ones before it, by link.

        It is called in the order of sending, also for later packets without deferral.
        """
        free_ns = flight.due_ns - flight.latency_ns - flight.held_ns + by_ns
        due_ns = self._held_ns(free_ns) if self._holds else free_ns
        if self._fifo and not (self._extra_ns and self.is_late(flight)):
            memory = self._memory
            link = id(memory)
            before_ns = last_ns.get(link, -1)
            if due_ns <= before_ns:
                due_ns = before_ns + 1
            last_ns[link] = due_ns
            memory.last_due_ns = max(memory.last_due_ns, due_ns)
        flight.put_off_ns += due_ns + flight.latency_ns - flight.due_ns
        flight.due_ns = due_ns + flight.latency_ns
        if self._holds:
            flight.held_ns = due_ns - free_ns

    def retime(self, flights: Iterable[tuple[Flight, bool]], now_ns: int) -> None:
        """Set the due times of packets in flight, in the order of sending, by the present clogs.

        Each comes with whether later packets may overtake it. Packets that are due and wait for their receiver stay.
        """
        last_ns = -1
        for flight, is_late in flights:
            due_ns = flight.due_ns - flight.latency_ns  # the network's part of it
            if due_ns < now_ns:
                continue
            free_ns = due_ns - flight.held_ns
            due_ns = self._held_ns(free_ns)
            if not is_late:
                last_ns = due_ns = max(due_ns, last_ns + 1) if self._fifo else due_ns
            flight.held_ns = due_ns - free_ns
            flight.due_ns = due_ns + flight.latency_ns
        if self._fifo:
            self._memory.last_due_ns = max(last_ns, min(self._memory.last_due_ns, now_ns))

    def is_late(self, flight: Flight) -> bool:
        """Whether later packets may overtake a packet that was sent with these settings."""
        return self._extra_ns > 0 and flight.words[Slot.REORDER] < self._reordered

    def _held_ns(self, due_ns: int) -> int:
        """Return the due time under clogs of a packet that would be due now."""
        for start_ns, end_ns in self._holds:
            if start_ns <= due_ns < end_ns:
                due_ns = end_ns
        return due_ns


class InOrder(Delay):
    """The stage of a link without delays that had some: packets arrive after earlier ones, otherwise at once."""

    def at_sending(self, flight: Flight) -> str:
        memory, due_ns = self._memory, flight.sent_ns
        if due_ns <= memory.last_due_ns:
            due_ns = memory.last_due_ns = memory.last_due_ns + 1
        flight.due_ns = due_ns + flight.latency_ns
        return ""
