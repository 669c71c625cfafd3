"""Residual loss: packets that are lost for reasons that geometry does not explain, independently of each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.protocol.deployment import LinkRule
from foosim.protocol.draws import Slot, chance_threshold
from foosim.vhub.packet import Flight

if TYPE_CHECKING:
    from foosim.vhub.stages import Memory

RANDOM_LOSS = "random_loss"


class Residual:
    """Drops a packet when its keyed draw says so: an integer comparison, the same on every machine."""

    def __init__(self, probability: float) -> None:
        self._threshold = chance_threshold(probability)

    @classmethod
    def for_rule(cls, rule: LinkRule | None) -> Residual | None:
        return cls(rule.loss) if rule is not None and rule.loss > 0.0 else None

    def at_sending(self, flight: Flight, memory: Memory) -> str:
        return RANDOM_LOSS if flight.words[Slot.LOSS] < self._threshold else ""

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        return ""
