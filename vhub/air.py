"""An air: a channel that radios share. Who is on it, who hears whom, and what spoils whose packets.

A transmission is registered when it is judged, with the times at which it is on air. It adds its power to the packets
that overlap with it at their receivers, those that were sent before it and are still on air too; each packet's sum is
of whole numbers, so no order matters. A station that sends hears nothing meanwhile. Stations that hear one another
take turns, so they overlap only where they do not.
Neighbours: `memory` (what is on air, in the hub's state), `stages.medium` registers, `stages.channel` judges.
"""

from __future__ import annotations

from typing import Final

from foosim.protocol.scene import Vector
from foosim.vhub.memory import AirState, Transmission
from foosim.vhub.packet import Flight
from foosim.vhub.propagation import Propagation
from foosim.vhub.radio.errors import LORA_FACTORS
from foosim.vhub.radio.noise import NEGLIGIBLE_CDB, units_of

DEAF: Final = 2**62
"""In units of 1e-21 W: the interference of a station with itself. That of others stays below: it is cut there, since
sums of cut numbers do not depend on their order either, and a state has 64 bits for them."""
NOTHING_CDBM: Final = -(10**6)


class Air:
    """One air in one world: its state, and the packets that are on it, each with how its radio's signals spread."""

    def __init__(self, state: AirState) -> None:
        self.state = state
        self._flights: list[tuple[Flight, Propagation]] = []

    def restore(self, flight: Flight, of: Propagation) -> None:
        """Take a packet in flight of a state that was written down."""
        if flight.air_end_ns > flight.sent_ns and not flight.is_settled:
            self._flights.append((flight, of))

    def advance(self, now_ns: int) -> None:
        """Forget what is over."""
        on_air = self.state.on_air
        if on_air and any(known.until_ns <= now_ns for known in on_air):
            on_air[:] = [known for known in on_air if known.until_ns > now_ns]
        flights = self._flights
        if flights and any(flight.air_end_ns <= now_ns for flight, _ in flights):
            self._flights = [entry for entry in flights if entry[0].air_end_ns > now_ns]

    def turn(self, source: str, ready_ns: int, of: Propagation) -> tuple[int, int]:
        """Return when a station gets its turn that is ready to send, and how many contend with it, itself included.

        It waits for all that it hears; who has something queued or on air when it is ready contends.
        """
        place = of.antenna(source)
        start_ns = ready_ns
        heard: set[str] = set()
        for known in self.state.on_air:
            if known.source == source or known.until_ns <= ready_ns:
                continue
            if known.source not in heard and not of.hears(
                known.position, place, known.source, source, known.power_cdbm
            ):
                continue
            heard.add(known.source)
            start_ns = max(start_ns, known.until_ns)
        return start_ns, 1 + len(heard)

    def register(self, known: Transmission) -> None:
        """Take a transmission: it spoils what is on air beside it."""
        self.state.on_air.append(known)
        for flight, of in self._flights:
            if not flight.cause:  # the inputs of a fate do not change behind it
                _spoil(flight, known, of)

    def listen(self, flight: Flight, of: Propagation) -> None:
        """Take a packet on air, which those who are on air beside it spoil."""
        for known in self.state.on_air:
            _spoil(flight, known, of)
        self._flights.append((flight, of))


def _power_cdbm(known: Transmission, at: str, place: Vector, of: Propagation) -> int:
    """Return with which power an endpoint hears a transmission."""
    path = of.path(known.position, place, known.source, at)
    return NOTHING_CDBM if path.cause else known.power_cdbm + of.gain_cdb - path.loss_cdb


def _spoil(flight: Flight, known: Transmission, of: Propagation) -> None:
    """Add a transmission to what disturbs a packet, where the two overlap."""
    if known.source == flight.source or known.end_ns <= flight.air_start_ns or known.start_ns >= flight.air_end_ns:
        return
    if known.source == flight.destination:
        flight.interference = DEAF
        return
    power_cdbm = _power_cdbm(known, flight.destination, of.antenna(flight.destination), of)
    if power_cdbm <= of.noise_cdbm - NEGLIGIBLE_CDB:
        return
    if flight.interference < DEAF:
        flight.interference = min(DEAF - 1, flight.interference + units_of(power_cdbm))
    if of.settings.medium == "lora":
        powers = list(flight.by_factor or (0,) * len(LORA_FACTORS))
        place = known.spreading_factor - LORA_FACTORS[0]
        powers[place] = min(DEAF - 1, powers[place] + units_of(power_cdbm))
        flight.by_factor = tuple(powers)
