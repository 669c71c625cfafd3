"""Duty cycle: how much of the time a radio may send, by law; a bucket of airtime that fills up again.

It is for media on which a packet is sent once, for a time that is known before: LoRa, and a radio with a rate.
"""

from __future__ import annotations

from typing import Final

from foosim.vhub.memory import Sending
from foosim.vhub.packet import Flight
from foosim.vhub.radio.airtime import lora_airtime_ns, serialisation_ns
from foosim.vhub.setup import LinkSetup
from foosim.vhub.stages.stage import Stage

DUTY_CYCLE: Final = "duty_cycle"


class Duty(Stage):
    """Drops a packet for which its sender's bucket has too little; the medium takes out what is sent of the others."""

    def __init__(self, setup: LinkSetup) -> None:
        self._settings, self._shared, self._sender = setup.settings, setup.shared, setup.sender
        self._share = setup.settings.duty_cycle
        self._size_ns = int(self._share * setup.settings.duty_window_ns)
        self._broadcasts = setup.sends_once

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Duty | None:
        return cls(setup) if setup.is_radio and setup.settings.duty_cycle < 1.0 else None

    def at_sending(self, flight: Flight) -> str:
        sender = self._sender
        broadcast = self._broadcasts and flight.published
        if broadcast:
            shared = sender.sending(flight.sequence, flight.copy)
            if shared is not None:
                flight.decided_by = shared.decided_by
                return DUTY_CYCLE if shared.cause == DUTY_CYCLE else ""
        if sender.tokens_ns < 0:
            sender.tokens_ns = self._size_ns
        filled_ns = int((flight.sent_ns - sender.tokens_at_ns) * self._share)
        sender.tokens_ns = min(self._size_ns, sender.tokens_ns + filled_ns)
        sender.tokens_at_ns = flight.sent_ns
        airtime_ns = self.airtime_ns(len(flight.payload), flight.published)
        if airtime_ns > sender.tokens_ns:
            flight.decided_by = (sender.tokens_ns,)
            if broadcast:
                sender.last = Sending(flight.sequence, flight.copy, DUTY_CYCLE, decided_by=flight.decided_by)
            return DUTY_CYCLE
        return ""

    def airtime_ns(self, size: int, published: bool) -> int:
        """Return for how long a payload of so many bytes is on air."""
        settings = self._shared if self._broadcasts and published else self._settings
        if settings.medium == "lora":
            bandwidth_hz = int(settings.bandwidth_hz)
            return lora_airtime_ns(settings.spreading_factor, size, bandwidth_hz, settings.coding_rate)
        rate_bps = settings.rate_bps
        return 0 if rate_bps is None else serialisation_ns(size + settings.overhead_bytes, rate_bps)
