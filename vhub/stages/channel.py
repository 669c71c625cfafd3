"""The channel: whether a signal that was sent is strong enough at its receiver, and clear of the others'.

At sending it says what the medium has found out for a unicast, and judges the rest by the draw for errors; at arrival
it judges again what others spoiled that began later: broadcasts, and whatever is not sent again.
"""

from __future__ import annotations

from foosim.common.keyed_random import UNIT, Slot
from foosim.vhub.network.air import DEAF
from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.errors import lora_interferer, lora_received
from foosim.vhub.radio.noise import level_of
from foosim.vhub.radio.propagation import OUT_OF_RANGE
from foosim.vhub.stages.medium import COLLISION, SNR, error_curve
from foosim.vhub.stages.stage import Stage


class Channel(Stage):
    """Decides the signals of one link."""

    def __init__(self, setup: LinkSetup) -> None:
        assert setup.budget is not None
        self._budget, self._air = setup.budget, setup.air
        self._factor = setup.settings.spreading_factor if setup.settings.medium == "lora" else 0
        self._is_gateway = setup.settings.gateway
        self._curve = error_curve(setup.settings)

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Channel | None:
        return cls(setup) if setup.is_radio else None

    def at_sending(self, flight: Flight) -> str:
        if flight.outcome or flight.is_settled:
            return flight.outcome
        cause = self._judge(flight)
        if not cause and self._air is not None:
            self._air.listen(flight, self._budget.propagation)
            cause = self._judge(flight) if flight.interference else ""
        return cause

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        if self._air is not None:
            self._air.settle(flight.due_ns)
        return self._judge(flight) if flight.interference and not flight.is_settled else ""

    def _judge(self, flight: Flight) -> str:
        """Return why the signal is lost, given the transmissions so far; empty when it is received."""
        if flight.interference >= DEAF:
            return COLLISION
        if self._factor:
            return self._judge_lora(flight)
        if self._curve is None or not flight.words:
            return ""
        clear = flight.error_threshold = self._curve(flight, flight.snr_cdb)
        word = flight.words[Slot.ERROR]
        if word < clear:
            return SNR
        if flight.interference:
            flight.error_threshold = self._curve(flight, self._budget.ratio_cdb(flight))
        return COLLISION if word < flight.error_threshold else ""

    def _judge_lora(self, flight: Flight) -> str:
        """LoRa captures: a signal survives others that are together weaker by their spreading factor's isolation."""
        factor = self._factor
        power_dbm = flight.received_cdbm / 100.0
        if not lora_received(factor, power_dbm, self._is_gateway):
            flight.error_threshold = UNIT
            return OUT_OF_RANGE
        if not flight.by_factor:
            return ""
        others = [level_of(power) if power else None for power in flight.by_factor]
        return COLLISION if lora_interferer(factor, power_dbm, others) else ""
