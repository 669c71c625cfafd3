"""An air: a channel that radios share. Who is on it, who hears whom, and what spoils whose packets.

A transmission is registered when it is judged, with the times at which it is on air. It adds its power to the packets
that overlap with it at their receivers, those that were sent before it and are still on air too; each packet's sum is
of whole numbers, so no order matters. A station that sends hears nothing meanwhile. Stations that hear one another
take turns, so they overlap only where they do not.
Neighbours: `memory` (what is on air, in the hub's state), `stages.medium` registers, `stages.channel` judges.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from foosim.vhub.memory import AirState, Transmission
from foosim.vhub.packet import Flight
from foosim.vhub.propagation import Propagation
from foosim.vhub.radio.errors import LORA_FACTORS
from foosim.vhub.radio.noise import NEGLIGIBLE_CDB, units_of

DEAF: Final = 2**62
"""In units of 1e-21 W: the interference of a station with itself. That of others stays below: it is cut there, since
sums of cut numbers do not depend on their order either, and a state has 64 bits for them."""
NOTHING_CDBM: Final = -(10**6)


class _Heard:
    """A transmission as its receivers have it: packets that are on air together, and who is on air beside them."""

    __slots__ = ("beside", "end_ns", "flights", "of", "source", "start_ns")

    def __init__(self, flight: Flight, of: Propagation, on_air: Iterable[Transmission]) -> None:
        self.source, self.of = flight.source, of
        self.start_ns, self.end_ns = flight.air_start_ns, flight.air_end_ns
        self.flights: list[Flight] = []
        self.beside = [known for known in on_air if self.overlaps(known)]

    def has(self, flight: Flight, of: Propagation) -> bool:
        """Whether a packet belongs to it."""
        times_ns = self.start_ns, self.end_ns
        return self.of is of and self.source == flight.source and times_ns == (flight.air_start_ns, flight.air_end_ns)

    def overlaps(self, known: Transmission) -> bool:
        """Whether another's is on air beside it; one without a duration never is."""
        if known.start_ns == known.end_ns or known.source == self.source:
            return False
        return known.start_ns < self.end_ns and known.end_ns > self.start_ns


class Air:
    """One air in one world: its state, and the packets that are on it, each with how its radio's signals spread."""

    def __init__(self, state: AirState) -> None:
        self.state = state
        self._heard: list[_Heard] = []
        self._advanced_ns = -1

    def restore(self, flight: Flight, of: Propagation) -> None:
        """Take a packet in flight of a state that was written down."""
        if flight.air_end_ns > flight.sent_ns and not flight.is_settled:
            self._group(flight, of).flights.append(flight)

    def advance(self, now_ns: int) -> None:
        """Forget what is over."""
        if now_ns == self._advanced_ns:
            return
        self._advanced_ns = now_ns
        self.state.on_air[:] = [known for known in self.state.on_air if known.until_ns > now_ns]
        self._heard = [heard for heard in self._heard if heard.end_ns > now_ns]

    def turn(self, source: str, ready_ns: int, of: Propagation) -> tuple[int, int]:
        """Return when a station gets its turn that is ready to send, and how many contend with it, itself included.

        It waits for all that it hears; who has something queued or on air when it is ready contends.
        """
        place = of.place(source)
        start_ns = ready_ns
        heard: set[str] = set()
        for known in self.state.on_air:
            until_ns, other = known.until_ns, known.source
            if until_ns <= ready_ns or other == source:
                continue
            if other not in heard:
                if not of.hears(of.place_at(other, known.position), place, known.power_cdbm):
                    continue
                heard.add(other)
            start_ns = max(start_ns, until_ns)
        return start_ns, 1 + len(heard)

    def register(self, known: Transmission) -> None:
        """Take a transmission: it spoils what is on air beside it. One without a duration is over at once."""
        if known.until_ns > self._advanced_ns:
            self.state.on_air.append(known)
        for heard in self._heard:
            if heard.overlaps(known):
                heard.beside.append(known)
                for flight in heard.flights:
                    if not flight.cause:  # the inputs of a fate do not change behind it
                        _spoil(flight, known, heard.of)

    def listen(self, flight: Flight, of: Propagation) -> None:
        """Take a packet on air, which those who are on air beside it spoil."""
        heard = self._group(flight, of)
        for known in heard.beside:
            _spoil(flight, known, of)
        heard.flights.append(flight)

    def _group(self, flight: Flight, of: Propagation) -> _Heard:
        """Return the transmission that a packet belongs to: the newest one, where others have heard that."""
        if not self._heard or not self._heard[-1].has(flight, of):
            self._heard.append(_Heard(flight, of, self.state.on_air))
        return self._heard[-1]


def _power_cdbm(known: Transmission, at: str, of: Propagation) -> int:
    """Return with which power an endpoint hears a transmission."""
    path = of.path(of.place_at(known.source, known.position), of.place(at))
    return NOTHING_CDBM if path.cause else known.power_cdbm + of.gain_cdb - path.loss_cdb


def _spoil(flight: Flight, known: Transmission, of: Propagation) -> None:
    """Add a transmission that is on air beside a packet to what disturbs it."""
    if known.source == flight.destination:
        flight.interference = DEAF
        return
    power_cdbm = _power_cdbm(known, flight.destination, of)
    if power_cdbm <= of.noise_cdbm - NEGLIGIBLE_CDB:
        return
    if flight.interference < DEAF:
        flight.interference = min(DEAF - 1, flight.interference + units_of(power_cdbm))
    if of.settings.medium == "lora":
        powers = list(flight.by_factor or (0,) * len(LORA_FACTORS))
        place = known.spreading_factor - LORA_FACTORS[0]
        powers[place] = min(DEAF - 1, powers[place] + units_of(power_cdbm))
        flight.by_factor = tuple(powers)
