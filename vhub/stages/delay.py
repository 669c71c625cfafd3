"""Delay: constant, plus jitter from a quantile table and a keyed draw; fifo unless the link says otherwise.

Jitter is never negative: a shape with support from 0, so that the mean is what is configured. Neighbours: `jitter`
makes the table.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.protocol.deployment import LinkRule
from foosim.protocol.draws import Slot
from foosim.vhub.jitter import gamma_quantiles_ns, interpolate_ns
from foosim.vhub.packet import Flight

if TYPE_CHECKING:
    from foosim.vhub.stages import Memory


class Delay:
    """Sets the due time of a packet."""

    def __init__(self, rule: LinkRule) -> None:
        self._delay_ns = rule.delay_ns
        self._fifo = rule.order == "fifo"
        jitter = rule.jitter
        self._quantiles_ns = () if jitter is None else gamma_quantiles_ns(jitter.mean_ns, jitter.sd_ns)

    @classmethod
    def for_rule(cls, rule: LinkRule | None) -> Delay | None:
        """Return the stage, or None on a link without a rule: it is perfect, and fifo by itself."""
        return None if rule is None else cls(rule)

    def at_sending(self, flight: Flight, memory: Memory) -> str:
        due_ns = flight.sent_ns + self._delay_ns
        if self._quantiles_ns:
            due_ns += interpolate_ns(self._quantiles_ns, flight.words[Slot.JITTER])
        if self._fifo:
            due_ns = max(due_ns, memory.last_due_ns + 1)
            memory.last_due_ns = due_ns
        flight.due_ns = due_ns
        return ""

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        return ""
