"""Links: a directed pair of endpoints, its pipeline of stages, what they remember, and its account.

A link exists from the first packet on it. Its rule is the first of the deployment that matches the pair; without one
it is perfect. Neighbours: `stages` (the table that is walked), `state` (all links of a run).
"""

from __future__ import annotations

from dataclasses import dataclass

from foosim.protocol.deployment import Network
from foosim.protocol.draws import draw_key, draw_words
from foosim.vhub.packet import Flight
from foosim.vhub.stages import STAGES, Stage


@dataclass(slots=True)
class LinkState:
    """What a link's stages remember, and its account: plain values, part of the hub's state."""

    last_due_ns: int = -1
    offered: int = 0
    delivered: int = 0
    dropped: int = 0
    delay_ns: int = 0
    """Sum of (due - sent) of what was delivered, for people."""


class Link:
    """One directed pair with its stages."""

    def __init__(self, source: str, destination: str, network: Network, seed: int, state: LinkState) -> None:
        rule = network.rule_for(source, destination)
        self.state = state
        self.rule = rule.id if rule is not None else "perfect"
        self._key = draw_key(seed, "link", source, destination)
        self._draws = rule is not None and (rule.loss > 0.0 or rule.jitter is not None)
        stages: list[Stage] = [stage for make in STAGES if (stage := make(rule)) is not None]
        self._stages = stages

    def send(self, flight: Flight) -> bool:
        """Judge a packet at sending: True when it is on its way with its due time, False when it is dropped."""
        state = self.state
        state.offered += 1
        flight.rule = self.rule
        if self._draws:
            flight.words = draw_words(self._key, flight.sequence, flight.copy)
        for stage in self._stages:
            cause = stage.at_sending(flight, state)
            if cause:
                flight.cause = cause
                state.dropped += 1
                return False
        return True

    def arrive(self, flight: Flight, hindered: str) -> bool:
        """Judge a packet at arrival: True when it is delivered, False when it is dropped.

        `hindered` is why its receiver does not take it; empty when it does.
        """
        for stage in self._stages:
            cause = stage.at_arrival(flight, hindered)
            if cause:
                flight.cause = cause
                self.state.dropped += 1
                return False
        self.state.delivered += 1
        self.state.delay_ns += flight.due_ns - flight.sent_ns
        return True
